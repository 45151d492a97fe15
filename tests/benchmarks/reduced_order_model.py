"""Accuracy and cost of the reduced-order model of the bulge test.

    python tests/benchmarks/reduced_order_model.py [--cases 90] [--seed 3] [--write]

Tests of six laws drawn over the paper's bounds, 12 h with 288 frames, by the reduced-order model and by finite elements
of the same mesh, each in the steps of its own. The error is the largest difference of the displacement of the top over
all frames and nodes, in % of the largest that the finite elements reach: median, 90 % and largest of the cases. Where a
test ruptures, its frames before the first of both ruptures count; beside stands the difference of the times at which
the middle has risen by 2.4 mm.
"""

import time
from dataclasses import dataclass

import numpy as np
from bulge_cases import FILLET, TIMES, TRUE, Case, drawn_cases
from core_speed import CASES as SPEED_CASES
from core_speed import Case as SpeedCase
from core_speed import least
from measured import Page, arguments
from public_calls import predict

import creepkit as ck
from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.fem.reduced_order_model import ReducedBasis, ReducedOrderModel
from creepkit.fem.simulation import Simulation, simulate
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import CreepLaw, Param, State, parameters, principal_stress, states, stress
from creepkit.records import History, Status
from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.finite_element_tests import FiniteElementTest, solver_settings

SHORTEST, LEAST = 60.0, 0.02
DEFLECTION = 2.4
"""mm."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A case in finite elements, and their CPU time, s."""

    case: Case
    setup: FiniteElementTest
    kernel: CompiledLaw
    theta: Floats
    run: Simulation
    cpu: float

    @property
    def complete(self) -> bool:
        """Whether the test lasts until its end."""
        return self.run.status == Status.COMPLETE


def references(specimen: Bulge, thicknesses: tuple[float, ...], count: int, seed: int) -> list[Reference]:
    """Drawn cases by finite elements, the thicknesses in turn."""
    result: list[Reference] = []
    for case in drawn_cases(seed):
        own = specimen.replace(apex_thickness=thicknesses[len(result) % len(thicknesses)]) if thicknesses else specimen
        setup = FiniteElementTest.of(own, case.history(TIMES), {})
        kernel = kernels.lower(case.model, "compiled")
        theta = case.model.to_internal(case.model.values(case.values))[0]
        settings = solver_settings(own)
        cpu, run = timed(
            lambda k=kernel, x=theta, s=setup, o=settings: simulate(k, x, s.model, s.load_history, settings=o)
        )
        if run.end_time >= SHORTEST and run.displacements[:, setup.model.top, 1].max() >= LEAST:
            result.append(Reference(case, setup, kernel, theta, run, cpu))
        if len(result) == count:
            return result
    return result


def timed(function, repeats: int = 3):
    """Least CPU time, s, of some calls, and the last result."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        result = function()
        best = min(best, time.process_time() - start)
    return best, result


def errors_of(reference: Reference, basis: ReducedBasis) -> tuple[float, float, float]:
    """Error in %, difference of the end in %, and CPU time in s."""
    model = ReducedOrderModel(reference.setup.model, basis)
    history, settings = reference.setup.load_history, BulgeReducedOrderModel(reference.setup.piece).settings
    cpu, run = timed(lambda: simulate(reference.kernel, reference.theta, model, history, settings=settings))
    top = reference.setup.model.top
    exact, found = (each.at(each.displacements[:, top, 1], TIMES) for each in (reference.run, run))
    both = np.isfinite(exact[:, 0]) & np.isfinite(found[:, 0])
    largest = reference.run.displacements[:, top, 1].max()
    error = np.abs(found - exact)[both].max(initial=0.0) / largest
    exact_time, found_time = (time_of_deflection(each, top[0]) for each in (reference.run, run))
    return 100 * float(error), 100 * abs(found_time / exact_time - 1.0), cpu


def time_of_deflection(run: Simulation, node: int) -> float:
    """When the node has risen by DEFLECTION, s, between the steps; NaN if never."""
    rise = np.maximum.accumulate(run.displacements[:, node, 1])
    return float(np.interp(DEFLECTION, rise, run.times)) if rise[-1] >= DEFLECTION else float("nan")


def row(page: Page, label: str, cases: list[Reference], basis: ReducedBasis, *more: str) -> None:
    """A row of the tables of accuracy."""
    errors = np.array([errors_of(each, basis) for each in cases])
    complete = np.array([each.complete for each in cases])
    cells = [three(errors[:, 0]), three(errors[complete, 0]), three(errors[~complete, 1])]
    times = [f"{1e3 * errors[mask, 2].mean():.2f}" if mask.any() else "-" for mask in (complete, ~complete)]
    page.row(label, *more, *cells, *times)


def three(values: Floats) -> str:
    """Median, 90 % and largest."""
    if not values.size:
        return "-"
    return ", ".join(f"{v:.2f}" for v in np.nanpercentile(values, [50, 90, 100]))


HEADS = (
    "all: median, 90 %, largest error, %", "complete tests, %", "time to 2.4 mm, %", "CPU ms, complete", "ruptured",
)  # fmt: skip


def default_table(page: Page, cases: list[Reference], count: int, seed: int) -> None:
    """The model that `reduced_order_model()` returns, law by law and on another specimen."""
    page.heading("The model as it is used")
    page.paragraph(
        "Modes and points by default, from the basis that serves a range of thicknesses. The last rows are a plate "
        "with a fillet, clamped at its rim, and a mesh of the dimple with 1.5 times as many elements each way."
    )
    basis = default_basis(TRUE, cases[0])
    page.paragraph(f"{len(basis.modes)} modes, {basis.points.size} points.")
    page.table("tests", *HEADS)
    row(page, "all", cases, basis)
    for law in dict.fromkeys(each.case.law for each in cases):
        row(page, law, [each for each in cases if each.case.law == law], basis)
    for label, specimen in (("plate with a fillet", FILLET), ("finer mesh", TRUE.replace(refinement=1.5))):
        others = references(specimen, (), max(count // 3, 6), seed)
        own = default_basis(specimen, others[0])
        page_label = f"{label}: {own.points.size} of {others[0].setup.model.weights.size} points, finite elements "
        row(page, page_label + f"{1e3 * np.mean([e.cpu for e in others]):.1f} ms", others, own)


def costs_table(page: Page) -> None:
    """Where the time of the six laws of core_speed.py goes."""
    page.heading("Where the time goes")
    page.paragraph(
        "Means of the six laws of [core_speed](core_speed.md). Passes are equilibrium iterations, with a new tangent "
        "and without; a prediction adds Python, the Gaussian fits and the interpolation in time to the simulation."
    )
    page.table("model", "steps", "passes with tangent", "without", "simulation, CPU ms", "prediction, CPU ms")
    rows: dict[str, list[list[float]]] = {}
    for each in map(SpeedCase, SPEED_CASES):
        reduced = each.specimen.reduced_order_model()
        for label, predictor in (
            ("finite elements", None),
            ("reduced", reduced),
            ("in searches", reduced.for_search()),
        ):
            settings = solver_settings(each.specimen) if predictor is None else predictor.settings
            model = each.setup.model if predictor is None else predictor.reduced_model_of(each.setup.piece)

            def run(each=each, settings=settings, model=model):
                return each.setup.simulate(each.law, each.theta, settings, model)

            def predicted(setup=each.setup, run=run):
                return setup.response(run())

            found = [*run().iterations[[0, 2, 3]], least(run, 10), least(predicted, 10)]
            rows.setdefault(label, []).append(found)
    for label, found in rows.items():
        steps, stiff, light, *times = np.mean(found, axis=0)
        page.row(label, f"{steps:.0f}", f"{stiff:.0f}", f"{light:.0f}", *(f"{time:.2f}" for time in times))


def default_basis(specimen: Bulge, reference: Reference) -> ReducedBasis:
    """The basis that a test of a specimen uses."""
    return BulgeReducedOrderModel(specimen).reduced_model_of(reference.setup.piece).basis


SEARCHED = {
    "norton": {"A": 2e-12, "n": 3.0},
    "strain-hardening": {"A": 1e-14, "n": 3.5, "m": -0.4},
    "combined": {
        "A_1": 1e-9, "n_1": 3, "B": 60, "A_2": 1e-14, "n_2": 4, "m_1": -0.3, "A_3": 3e-12, "n_3": 3, "m_2": -0.4,
    },
}  # fmt: skip


def plan(thickness: float) -> History:
    """A test of two pressures."""
    return History(
        name="planned", times=np.arange(289) * 150.0 + 5.0, outputs={}, loading=ck.PressureJump(8.0, 10.0, 14400.0),
        temperature=1000.0, specimen="bulge", elastic=ck.Elastic(150e3), geometry={"apex_thickness": thickness},
    )  # fmt: skip


def sensitivities_table(page: Page) -> None:
    """Jacobians of the amplitude against those of the finite elements, and a law with an internal variable."""
    page.heading("Sensitivities, and laws with internal variables")
    page.paragraph(
        "Largest difference to the finite elements over the frames in % of the largest value: of the amplitude, of its "
        "derivatives to the law's parameters (the worst of them) and to thickness and modulus. Steps of a tenth of the "
        "usual tolerance in both. That the derivatives are those of the reduced-order model itself, to 1e-6, is a test "
        "(tests/unit/fem/test_reduced_order_model.py)."
    )
    page.table("law", "thickness, mm", "amplitude", "parameters", "thickness", "modulus")
    fine = TRUE.replace(tolerance=1e-3)
    laws = [(ck.law(name), values) for name, values in SEARCHED.items()]
    for law, values in (*laws, (*tension_damage(),)):
        for thickness in (0.5, 0.53):
            given = {"thickness": np.full((1, 1), thickness), "modulus": np.zeros((1, 1))}
            exact, found = (
                predict(p, law, law.values(values), [plan(thickness)], nuisances=given, sensitivities=True)
                for p in (fine, fine.reduced_order_model())
            )
            parameters_of = [worst(exact.jacobian[0, 0, :, 0, p], found.jacobian[0, 0, :, 0, p])
                             for p in range(exact.jacobian.shape[-1])]  # fmt: skip
            others = [worst(exact.nuisance_jacobian[key][0, 0, :, 0], found.nuisance_jacobian[key][0, 0, :, 0])
                      for key in given]  # fmt: skip
            amplitude = worst(exact.values[0, 0, :, 0], found.values[0, 0, :, 0])
            cells = (amplitude, max(parameters_of), *others)
            page.row(law.name, thickness, *(f"{cell:.2f}" for cell in cells))


def worst(exact: Floats, found: Floats) -> float:
    """Largest difference in % of the largest value."""
    return 100.0 * float(np.nanmax(np.abs(found - exact)) / np.nanmax(np.abs(exact)))


def tension_damage() -> tuple[CreepLaw, dict[str, float]]:
    """Creep with a damage that grows with the largest principal stress."""
    A, n, B, k = parameters("A n B k")
    (omega,) = states("omega")
    rate = dict(unit="1/s", bounds=(1e-40, 1.0), scale="log", off=0.0)
    law = CreepLaw(
        name="damage",
        title="Damage by the largest principal stress",
        terms={"creep": A * (stress / (1 - omega)) ** n},
        params={A: Param("rate", **rate), n: Param("exponent", bounds=(1, 8)), B: Param("damage rate", **rate),
                k: Param("damage exponent", bounds=(1, 8))},
        states={omega: State(0, B * principal_stress**k / (1 - omega) ** k, limit=0.99)},
        references=("L. M. Kachanov (1958)",),
    )  # fmt: skip
    return law, {"A": 1e-13, "n": 3.5, "B": 1e-11, "k": 2.5}


def main() -> None:
    """Measure and print, or write the page."""
    parser = arguments(__doc__)
    parser.add_argument("--cases", type=int, default=90)
    parser.add_argument("--seed", type=int, default=3)
    options = parser.parse_args()
    page = Page("reduced_order_model", __doc__)
    cases = references(TRUE, (), options.cases, options.seed)
    default_table(page, cases, options.cases, options.seed)
    costs_table(page)
    sensitivities_table(page)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
