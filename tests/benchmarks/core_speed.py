"""Cost of a simulation in the compiled core, and of its steps.

    python tests/benchmarks/core_speed.py [--repeats 30] [--write] [--libraries before.so,now.so [--counts]]

The dimple under 8 MPa, then 10 MPa from 4 h on, observed at 289 times of 12 h, by six laws of the paper; least CPU time
of the repeats, on one thread. "Prediction" is what a fit asks for; "derivatives" adds those to all parameters,
thickness, modulus and temperature.
"""

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
from core_instructions import PARTS, counted, write_problem
from measured import Page, arguments

import creepkit as ck
from creepkit import kernels
from creepkit.fem.simulation import simulate
from creepkit.records import History, PressureJump
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.finite_element_tests import EQUILIBRIUM_SHARE, FiniteElementTest, solver_settings

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
        self.setup = FiniteElementTest.of(self.specimen, self.history, {})

    def simulate(self, **settings: float):
        """The finite element simulation alone."""
        chosen = solver_settings(self.specimen)._replace(**settings)
        return simulate(self.law, self.theta, self.setup.model, self.setup.load_history, settings=chosen)

    def predict(self, jacobian: bool = False):
        """What a fit asks for."""
        nuisances = NUISANCES if jacobian else {}
        test = FiniteElementTest.of(self.specimen, self.history, nuisances, jacobian)
        return test.response(test.simulate(self.law, self.theta, solver_settings(self.specimen)))


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
    """Cost of the six laws."""
    page.heading("Six laws")
    page.table("of the laws", "simulation, ms", "prediction, ms", "with derivatives, ms")
    cases = [Case(name) for name in CASES]
    costs = [
        [least(call, repeats) for call in (case.simulate, case.predict, partial(case.predict, True))] for case in cases
    ]
    for name, cost in (("least", np.min), ("mean", np.mean), ("largest", np.max)):
        page.row(name, *(f"{value:.2f}" for value in cost(costs, axis=0)))


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
    for tolerance, growth_ in ((1e-2, 2.0), (2e-2, 3.0), (4e-2, 3.0)):
        errors, costs = [], []
        for name in CASES:
            case = Case(name)
            settings = dict(tolerance=tolerance, newton=EQUILIBRIUM_SHARE * tolerance, growth=growth_)
            made = case.simulate(**settings)
            apex = made.at(made.displacements[:, case.setup.model.top[0], 1], TIMES)
            errors.append(100 * np.nanmax(np.abs(apex - exact[name])) / np.nanmax(exact[name]))
            costs.append(least(lambda case=case, settings=settings: case.simulate(**settings), max(3, repeats // 3)))
        page.row(
            f"{tolerance:g}", f"{growth_:g}", f"{np.mean(costs):.2f}", f"{np.median(errors):.3f}", f"{max(errors):.3f}"
        )


def answer_rounds() -> None:
    """For each line of input, mean CPU ms of simulations, predictions, derivatives and reduced-order models."""
    calls = []
    for case in map(Case, CASES):
        predictor = case.specimen.reduced_order_model()
        reduced = predictor.reduced_model_of(case.setup.piece)
        simulation = partial(
            simulate, case.law, case.theta, reduced, case.setup.load_history, settings=predictor.settings
        )
        calls.append((case.simulate, case.predict, partial(case.predict, True), simulation))
    for _ in sys.stdin:
        print(*np.mean([[least(call, 1) for call in own] for own in calls], axis=0), flush=True)


def libraries(page: Page, paths: list[str], repeats: int, counts: bool) -> None:
    """Libraries of the core in turns, with vectors of 4 and 8 numbers; instructions of their parts, with 4 and 2."""
    page.table("library, vector", "simulation, ms", "prediction", "with derivatives", "reduced-order model")
    best = {(path, lanes): np.full(4, np.inf) for lanes in (4, 8) for path in paths}
    command = [sys.executable, "-c", "import core_speed; core_speed.answer_rounds()"]
    workers = {}
    for path, lanes in best:
        environment = {**os.environ, "CREEPKIT_CORE": path, "CREEPKIT_LANES": str(lanes)}
        workers[path, lanes] = subprocess.Popen(
            command,
            cwd=Path(__file__).parent,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
    for _ in range(repeats):
        for key, worker in workers.items():
            print(file=worker.stdin, flush=True)
            best[key] = np.minimum(best[key], np.array(worker.stdout.readline().split(), dtype=float))
    for worker in workers.values():
        worker.communicate()
    for (path, lanes), times in best.items():
        page.row(f"{Path(path).parent.name}, {lanes}", *(f"{t:.2f}" for t in times))
    if not counts:
        return
    page.table("thousand instructions: library, numbers in a vector", *PARTS.values())
    case = Case("norton")
    with tempfile.TemporaryDirectory() as folder:
        write_problem(case.setup.model, case.simulate().displacements[1].copy(), Path(folder))
        for lanes in (4, 2):
            for path in paths:
                found = counted(path, Path(folder), lanes)
                page.row(f"{Path(path).parent.name}, {lanes}", *(f"{found[name]:.0f}" for name in PARTS.values()))


def main() -> None:
    """Print the tables, and write the page if asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--libraries", default="", help="compare these alone, in folders that name them")
    parser.add_argument("--counts", action="store_true", help="count their instructions too, by valgrind")
    options = parser.parse_args()
    page = Page("core_speed", __doc__)
    if options.libraries:
        libraries(page, options.libraries.split(","), options.repeats, options.counts)
        return
    laws(page, options.repeats)
    tolerances(page, options.repeats)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
