"""Cost of a simulation in the compiled core, and where it goes.

    python tests/benchmarks/core_speed.py [--repeats 30] [--write]

The dimple under 8 MPa, then 10 MPa from 4 h on, observed at 289 times of 12 h, by six laws of the paper; least CPU time
of the repeats, on one thread, in one process. "Prediction" is what a fit asks for: set-up, simulation, Gaussian fits,
interpolation in time. "Derivatives" adds those to all parameters of the law, the thickness, the modulus and the
temperature. The parts of a simulation are timed by repeating each at the state of a dimple that begins to creep.
"""

import ctypes
import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from measured import Page, arguments

import creepkit as ck
from creepkit import kernels
from creepkit.core import address, function, library
from creepkit.fem import solver
from creepkit.fem.simulation import simulate
from creepkit.records import History, PressureJump
from creepkit.specimens.bulge.finite_elements import PreparedTest, set_up_test, solver_settings
from creepkit.specimens.bulge.specimen import Bulge

TIMES = np.maximum(np.arange(289) * 150.0, 1.0)
CASES = {
    "norton": dict(A=1e-14, n=4.0),
    "strain-hardening": dict(A=2e-15, n=4.0, m=-0.4),
    "time-hardening": dict(A=3e-12, n=3.6, m=-0.4),
    "hyperbolic-sine": dict(A=1e-7, n=3.0, B=60.0),
    "drifting-exponent": dict(A=1e-14, n_0=3.6, n_inf=4.0, C=0.3, tau_d=1e4, tau_r=3e3, m=0.0),
    "combined": dict(A_1=1e-9, n_1=3, B=60, A_2=1e-14, n_2=4, m_1=-0.3, A_3=3e-12, n_3=3, m_2=-0.4),
}
NUISANCES = {"thickness": 0.5, "modulus": 0.0, "temperature": 0.0}
PARTS = ("assembly with tangent", "assembly without", "factorisation", "solution", "forces of the error estimate")
COPY = 5


class Case:
    """One law in one test, set up."""

    def __init__(self, name: str, **settings: float) -> None:
        self.specimen = Bulge(threads=1).replace(**settings)
        law = ck.law(name)
        self.law, self.theta = kernels.lower(law, "compiled"), law.to_internal(law.values(CASES[name]))[0]
        self.history = History(
            name=name, times=TIMES, outputs={}, loading=PressureJump(8.0, 10.0, 14400.0), temperature=1000.0,
            specimen="bulge", elastic=ck.Elastic(150e3),
        )  # fmt: skip
        self.setup = set_up_test(self.specimen, self.history, {})

    def simulate(self, **settings: float):
        """The finite element simulation alone."""
        chosen = solver_settings(self.specimen)._replace(**settings)
        return simulate(self.law, self.theta, self.setup.model, self.setup.load_history, settings=chosen)

    def predict(self, jacobian: bool = False):
        """What a fit asks for."""
        nuisances = NUISANCES if jacobian else {}
        test = PreparedTest.of(self.specimen, self.history, nuisances, jacobian)
        return test.simulate_and_observe(self.law, self.theta, solver_settings(self.specimen, exact=jacobian))


def least(call, repeats: int) -> float:
    """Least CPU time of some calls, ms; the first does not count."""
    call()
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return 1e3 * best


def laws(page: Page, repeats: int) -> None:
    """Predictions, law by law."""
    page.heading("Six laws")
    heads = "simulation, ms", "prediction, ms", "with derivatives, ms", "ratio", "columns", "steps"
    page.table("law", *heads, "passes with, without a new tangent")
    rows = []
    for name in CASES:
        case = Case(name)
        made = case.simulate()
        march, whole, exact = (
            least(call, repeats) for call in (case.simulate, case.predict, lambda case=case: case.predict(True))
        )
        rows.append((march, whole, exact))
        accepted, rejected, full, light = made.iterations
        columns = case.theta.size + len(NUISANCES)
        page.row(
            name, f"{march:.2f}", f"{whole:.2f}", f"{exact:.2f}", f"{exact / whole:.2f}", columns,
            f"{accepted} + {rejected}", f"{full}, {light}",
        )  # fmt: skip
    march, whole, exact = np.mean(rows, axis=0)
    page.row("mean", f"{march:.2f}", f"{whole:.2f}", f"{exact:.2f}", f"{exact / whole:.2f}", "", "", "")


def law_calls(case: Case, repeats: int = 20000) -> float:
    """CPU time of one call of the law with eight points, us."""
    x = np.tile(np.array([[100.0], [0.01], [3600.0], [1000.0], [100.0], [33.0]]), (1, 8))
    out = np.zeros((7, 8))
    entry = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, *3 * [ctypes.c_void_p])(case.law.update.address)
    arguments_ = (8, *(a.ctypes.data for a in (x, case.theta, out)))
    empty = ctypes.CFUNCTYPE(ctypes.c_int64)(("creepkit_core_version", library()))
    calls = {
        "law": lambda: [entry(*arguments_) for _ in range(repeats)],
        "none": lambda: [empty() for _ in range(repeats)],
    }
    return max(0.0, 1e3 * (least(calls["law"], 3) - least(calls["none"], 3)) / repeats)


def parts(page: Page, repeats: int) -> None:
    """Where the time of one simulation goes."""
    page.heading("Parts of a simulation")
    page.table("law", *(f"{part}, us" for part in PARTS), "sum over the passes, ms", "simulation, ms")
    for name in ("norton", "combined"):
        case = Case(name)
        made = case.simulate()
        model = case.setup.model
        stage = solver.StageConditions(100.0, np.log(100.0), 200.0, 1000.0, 125e3, 57.7e3, 8.0)
        history = np.zeros((4 * model.compiled.elements, 4))
        history[:, 3] = 1e-4
        displacement = np.ascontiguousarray(made.displacements[1].ravel())
        entries = solver._Law(
            case.law.update.address, case.law.sensitivity.address, address(case.theta), case.theta.size, 0
        )

        def time_of(part: int, count: int = 200) -> float:
            def call() -> None:
                flag = function("creepkit_repeat_part")(
                    ctypes.byref(model.compiled.structure), ctypes.byref(entries), ctypes.byref(solver._Stage(*stage)),  # noqa: B023
                    address(history), address(displacement), ctypes.c_int64(part), ctypes.c_int64(count),  # noqa: B023
                )  # fmt: skip
                assert flag == 0

            return 1e3 * least(call, max(3, repeats // 3)) / count

        costs = [time_of(k) for k in range(len(PARTS))]
        costs[2] -= time_of(COPY)
        accepted, rejected, full, light = made.iterations
        counts = (full, light, full, full + light + accepted + rejected, accepted + rejected)
        total = 1e-3 * sum(c * n for c, n in zip(costs, counts, strict=True))
        page.row(name, *(f"{c:.1f}" for c in costs), f"{total:.2f}", f"{least(case.simulate, repeats):.2f}")
    calls = ", ".join(f"{name} {law_calls(Case(name)):.2f} us" for name in ("norton", "hyperbolic-sine", "combined"))
    page.paragraph(
        f"A call of a law with eight points, of which an assembly makes 25 for each of its iterations: {calls}."
    )


def growth(page: Page, repeats: int) -> None:
    """How the cost grows."""
    page.heading("Growth of the cost")
    page.table("what", "value", "CPU ms", "over the first")
    sizes = {"elements": [], "tolerance of a step": []}
    for refinement in (1.0, 2.0, 3.0, 4.0):
        case = Case("strain-hardening", refinement=refinement)
        sizes["elements"].append((len(case.setup.model.elements), least(case.simulate, max(3, repeats // 3))))
    for tolerance in (2e-2, 1e-2, 2.5e-3, 6e-4):
        case = Case("strain-hardening", tolerance=tolerance)
        steps = int(case.simulate().iterations[0])
        sizes["tolerance of a step"].append((f"{tolerance:g}: {steps} steps", least(case.simulate, repeats)))
    for what, rows in sizes.items():
        for value, cost in rows:
            page.row(what, value, f"{cost:.2f}", f"{cost / rows[0][1]:.1f}")
    case, cores, first = Case("combined"), len(os.sched_getaffinity(0)), 0.0
    for threads in sorted({1, cores}):
        with ThreadPoolExecutor(threads) as pool:
            start = time.perf_counter()
            list(pool.map(lambda _: case.predict(), range(40)))
            wall = 1e3 * (time.perf_counter() - start) / 40
        first = first or wall
        page.row("threads: wall time a prediction, of 40", threads, f"{wall:.2f}", f"{wall / first:.2f}")


def tolerances(page: Page, repeats: int) -> None:
    """Accuracy against cost."""
    page.heading("Steps")
    page.paragraph(
        "Error of the apex, in % of its largest, against a run with a tolerance of 1e-5 on the same mesh: what the "
        "steps add to the error of the mesh."
    )
    page.table("tolerance", "growth of the time since a load", "mean CPU ms", "median error, %", "largest error, %")
    exact = {}
    for name in CASES:
        case = Case(name)
        made = case.simulate(tolerance=1e-5, newton=1e-9, max_steps=100_000)
        exact[name] = made.at(made.displacements[:, case.setup.model.top[0], 1], TIMES)
    for tolerance, growth_ in ((1e-2, 2.0), (1e-2, 3.0), (2e-2, 2.0), (2e-2, 3.0), (4e-2, 3.0)):
        errors, costs = [], []
        for name in CASES:
            case = Case(name)
            settings = dict(tolerance=tolerance, newton=1e-2 * tolerance, growth=growth_)
            made = case.simulate(**settings)
            apex = made.at(made.displacements[:, case.setup.model.top[0], 1], TIMES)
            errors.append(100 * np.nanmax(np.abs(apex - exact[name])) / np.nanmax(exact[name]))
            costs.append(least(lambda case=case, settings=settings: case.simulate(**settings), max(3, repeats // 3)))
        page.row(
            f"{tolerance:g}", f"{growth_:g}", f"{np.mean(costs):.2f}", f"{np.median(errors):.3f}", f"{max(errors):.3f}"
        )


def main() -> None:
    """Print the tables, and write the page if asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=30)
    options = parser.parse_args()
    page = Page("core_speed", __doc__)
    page.paragraph(f"Vectors of {library().creepkit_core_lanes()} numbers.")
    laws(page, options.repeats)
    parts(page, options.repeats)
    growth(page, options.repeats)
    tolerances(page, options.repeats)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
