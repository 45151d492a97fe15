"""One test in finite elements: set-up from its history, simulation, observation, sensitivities; predictions of many."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple, Self, TypeVar

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats, usable_cores
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.mesh import GeometryDerivative
from creepkit.fem.simulation import LoadHistory, Simulation, sensitivity_directions, simulate
from creepkit.fem.solvable_model import SensitivityDirections, SolvableModel
from creepkit.fem.solver import SolverSettings
from creepkit.integration.time_discretisation import SDIRK2_TEXT
from creepkit.records import (
    PROGRAM_NUISANCES,
    History,
    HistoryPrediction,
    NuisanceValues,
    Output,
    Prediction,
    Program,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
    dimension_named,
    kind_and_start,
    outputs_of_tests,
    with_program_nuisances,
)
from creepkit.specimens.finite_element_settings import FiniteElementSettings

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw


STEPS = {"temperature step": 1.0, "temperature drift": 1.0, "load step": 1e-3, "modulus": 1e-3, "temperature": 1.0}
"""K and relative, of central differences of the load history by kind; it is linear in all but for the modulus in K."""


class CandidateResponse(NamedTuple):
    """One candidate in one test.

    values : (times, outputs). law : (times, outputs, parameters) derivatives to the internal parameters, or None.
    nuisances : {key: (times, outputs)} those to the nuisances.
    """

    simulation: Simulation
    values: Floats
    law: Floats | None
    nuisances: Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class FiniteElementTest(ABC):
    """One test with its nuisances, ready to be simulated by any law; a kind of it says what its specimen observes.

    piece : the specimen with the lengths of this test. loads, lengths, views : nuisances that change the load history,
    that move nodes, and that only change what is observed. directions : what is differentiated to; None for nothing.
    """

    piece: Any
    history: History
    load_history: LoadHistory
    loads: tuple[str, ...] = ()
    lengths: tuple[str, ...] = ()
    views: tuple[str, ...] = ()
    directions: SensitivityDirections | None = None

    # ---- of each kind ---------------------------------------------------------------------------------------------

    @classmethod
    @abstractmethod
    def model_of(cls, piece: Any, load: str) -> FiniteElementModel:
        """The finite elements of a test piece under a load, by its name."""

    @property
    @abstractmethod
    def outputs(self) -> tuple[Output, ...]:
        """What is observed."""

    @abstractmethod
    def observed(self, simulation: Simulation) -> Floats:
        """Outputs in each accepted step, (steps, outputs)."""

    @abstractmethod
    def differentiated(self, simulation: Simulation) -> tuple[Floats, Floats]:
        """As `observed`, and derivatives (steps, outputs, columns) of what the core differentiates the steps to."""

    @abstractmethod
    def length_derivative(self, key: str, simulation: Simulation) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length at the same displacements."""

    @abstractmethod
    def movement(self, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
        """How points, nodes (nodes, 2), mm, and dead forces (nodes, 2), N/rad, move with a length."""

    @classmethod
    def motion_of(cls, piece: Any, load: str) -> float | None:
        """mm of motion for a unit of the load; None where the load acts as a pressure or a force."""
        return None

    def observed_at_times(self, simulation: Simulation) -> Floats:
        """Outputs at the times of the history, (times, outputs)."""
        return simulation.at(self.observed(simulation), self.history.times)

    def stated_history(self) -> History:
        """The history with all that was taken for granted: the lengths of the test piece."""
        lengths = {each.name: each.default for each in self.piece.dimensions if each.of_piece}
        return self.history.replace(geometry={**lengths, **self.history.geometry})

    # ---- of every kind --------------------------------------------------------------------------------------------

    @classmethod
    def of(cls, specimen: Any, history: History, nuisances: Mapping[str, float], sensitivities: bool = False) -> Self:
        """Set one test up; nuisances : {key: value}. sensitivities : for a simulation with its derivatives."""
        piece, tested = specimen.of_test(history, nuisances)
        known = {key: dimension_named(specimen, key) for key in nuisances}
        loads = tuple(key for key, length in known.items() if length is None)
        lengths = tuple(key for key, length in known.items() if length is not None and length.of_piece)
        views = tuple(key for key in known if key not in (*loads, *lengths))
        motion = cls.motion_of(piece, history.loading.quantity)
        load_history = _load_history_of(piece, with_program_nuisances(tested, nuisances), motion)
        test = cls(piece, history, load_history, loads, lengths, views)
        if not sensitivities:
            return test

        def segments(key: str, step: float) -> Floats:
            return cls.of(specimen, history, {**nuisances, key: nuisances[key] + step}).load_history.segments

        steps = {key: STEPS[kind_and_start(key)[0]] for key in loads}
        along = [(segments(key, step) - segments(key, -step)) / (2.0 * step) for key, step in steps.items()]
        moves = [test.movement(key) for key in lengths]
        directions = sensitivity_directions(
            test.model,
            load_history,
            np.array(along).reshape(-1, *load_history.segments.shape),
            [(gradient, velocity) for gradient, velocity, _ in moves],
            np.array([force for *_, force in moves]) if moves else None,
        )
        return replace(test, directions=directions)

    @property
    def model(self) -> FiniteElementModel:
        """The finite elements."""
        return self.model_of(self.piece, self.history.loading.quantity)

    def simulate(
        self,
        kernel: CompiledLaw,
        theta: Floats,
        settings: SolverSettings,
        model: SolvableModel | None = None,
        keep_points: bool = False,
    ) -> Simulation:
        """Simulate the test; theta : (parameters,) internal values. model : in the place of the finite elements."""
        return simulate(
            kernel, theta, model or self.model, self.load_history, settings=settings, keep_points=keep_points,
            directions=self.directions,
        )  # fmt: skip

    def respond(
        self, kernel: CompiledLaw, theta: Floats, settings: SolverSettings, model: SolvableModel | None = None
    ) -> CandidateResponse:
        """Simulate and observe the test, with derivatives where it has directions; theta : (parameters,)."""
        simulation = self.simulate(kernel, theta, settings, model)
        if self.directions is None:
            return CandidateResponse(simulation, self.observed_at_times(simulation), None, {})
        outputs, columns = self.differentiated(simulation)
        names = (*self.loads, *self.lengths, *self.views)
        at = simulation.at(columns, self.history.times)
        nuisances = {name: at[..., theta.size + k] for k, name in enumerate(names)}
        return CandidateResponse(
            simulation, simulation.at(outputs, self.history.times), at[..., : theta.size], nuisances
        )

    def columns(self, simulation: Simulation, by_observed: Floats, change: Floats) -> Floats:
        """Derivatives (steps, outputs, columns): to the law's parameters, to loads, lengths and views.

        by_observed : (steps, outputs, observed) derivatives of the outputs to what is observed of the body.
        change : (steps, observed, parameters + loads + lengths) its derivatives, mm or N.
        """
        columns = by_observed @ change
        for k, name in enumerate(reversed(self.lengths), 1):
            columns[:, :, -k] += self.length_derivative(name, simulation)
        views = [self.length_derivative(name, simulation)[..., None] for name in self.views]
        return np.concatenate([columns, *views], axis=2)


def _load_history_of(piece: FiniteElementSettings, tested: History, motion: float | None) -> LoadHistory:
    """What the body goes through in a test; SolveError for one that cannot be made.

    tested : with its nuisances. motion : mm for a unit of the load; None where it is a pressure or a force.
    """
    where, quantity = tested.origin, tested.loading.quantity
    if tested.times[-1] <= 0.0:
        raise SolveError(f"{where}: the last time is 0 s, where the load only begins; ask for a time after it")
    if tested.elastic is None:
        raise SolveError(f"{where}: specimen '{piece.name}' needs elastic data; set elastic=Elastic(E=...), E in MPa")
    load = tested.loading.program()
    if {each.name: each.quantity for each in piece.loads}[quantity] == "pressure" and load.values.min() < 0.0:
        raise SolveError(f"{where}: the pressure falls to {load.values.min():g} MPa; it must not be negative")
    if not load.values.any():
        raise SolveError(f"{where}: the {quantity} is zero throughout; a test needs a load")
    temperature, elastic = tested.temperature_program(), tested.elastic
    moduli = {float(T): float(elastic.at(float(T)).E) for T in np.unique(temperature.values)}
    values = np.array([moduli[float(T)] for T in temperature.values])
    if not (values > 0).all():
        raise SolveError(f"{where}: the modulus is {values.min():g} MPa; it must be above zero")
    modulus, poisson = Program(temperature.times, values), float(elastic.at(float(temperature.values[0])).nu)
    end = float(tested.times[-1])
    if motion is None:
        return LoadHistory(load, temperature, modulus, end, poisson)
    moved = Program(load.times, motion * load.values)
    return LoadHistory(Program.constant(0.0), temperature, modulus, end, poisson, moved)


class Reduction(NamedTuple):
    """How a reduced-order model simulates: the model of a test that is set up, and the settings of the solver."""

    model_of: Callable[[Any], SolvableModel]
    settings: SolverSettings


def predict_tests(
    kind: type[FiniteElementTest],
    specimen: FiniteElementSettings,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    sensitivities: bool,
    reduction: Reduction | None = None,
) -> Prediction:
    """Predict every candidate in every test; see records.Predictor.

    theta : (candidates, parameters) internal values. nuisances : {key: (candidates or 1, tests)}. reduction : to a
    model that is simulated in the place of the finite elements.
    """
    known = (*specimen.nuisances, *PROGRAM_NUISANCES)
    check_nuisances([kind_and_start(key)[0] for key in nuisances], known, f"specimen '{specimen.name}'")
    kernel = kernels.lower(law, "compiled")
    theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
    tasks = list(product(range(len(theta)), range(len(histories))))
    settings = solver_settings(specimen, exact=sensitivities) if reduction is None else reduction.settings
    shared = all(np.ptp(value, axis=0).max() == 0.0 for value in nuisances.values())

    def prepared(c: int, k: int) -> tuple[FiniteElementTest, SolvableModel]:
        values = {key: float(value[c, k]) for key, value in nuisances.items()}
        test = kind.of(specimen, histories[k], values, sensitivities)
        return test, test.model if reduction is None else reduction.model_of(test.piece)

    # before threads begin: a reduced-order model may have to be trained
    tests = [prepared(0, k) for k in range(len(histories))] if tasks else []

    def run(task: tuple[int, int]) -> CandidateResponse:
        c, k = task
        test, model = tests[k] if shared or c == 0 else prepared(c, k)
        return test.respond(kernel, theta[c], settings, model)

    rows = in_threads(run, tasks, specimen.threads)
    observed = outputs_of_tests(specimen, histories)
    parts = [
        _history_prediction(rows[k :: len(histories)], test.outputs, observed) for k, (test, _) in enumerate(tests)
    ]
    return assemble_prediction(parts, histories, observed, len(theta))


def _history_prediction(
    responses: Sequence[CandidateResponse], outputs: Sequence[str], observed: Sequence[str]
) -> HistoryPrediction:
    """The responses of all candidates in one test; NaN for outputs of other tests, which are observed too."""
    columns = [observed.index(name) for name in outputs]

    def in_columns(arrays: Sequence[Floats]) -> Floats:
        """(candidates, times, observed, ...) from one array (times, outputs, ...) of each candidate."""
        own = np.array(arrays)
        out = np.full((*own.shape[:2], len(observed), *own.shape[3:]), np.nan)
        out[:, :, columns] = own
        return out

    jacobians = [r.law for r in responses if r.law is not None]
    return HistoryPrediction(
        values=in_columns([r.values for r in responses]),
        status=np.array([int(r.simulation.status) for r in responses], dtype=np.int64),
        end_times=np.array([r.simulation.end_time for r in responses]),
        jacobian=in_columns(jacobians) if jacobians else None,
        nuisance_jacobian={key: in_columns([r.nuisances[key] for r in responses]) for key in responses[0].nuisances},
    )


def solver_settings(specimen: FiniteElementSettings, *, exact: bool = False) -> SolverSettings:
    """The solver's settings; exact : equilibrium so tight that derivatives err by 1e-5 to 1e-3 of their largest."""
    return SolverSettings(
        tolerance=specimen.tolerance,
        newton=1e-6 if exact else 1e-2 * specimen.tolerance,
        first=specimen.first_step,
        deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
        max_steps=int(specimen.max_steps),
        least=specimen.resolution,
    )


def finite_element_text(specimen: FiniteElementSettings, model: FiniteElementModel) -> str:
    """Elements, kinematics, material, integration in time and its end, in sentences for a paper."""
    return (
        f"Finite elements of a body of revolution: {len(model.elements)} quadrilaterals of eight nodes with 2 x 2 "
        f"integration points, {len(model.nodes)} nodes. Strains are finite (logarithmic, Hencky elasticity), and creep "
        "flows along the elastic deviator at the rate that the law gives for the von Mises stress. Time is integrated "
        f"by {SDIRK2_TEXT}, in steps whose estimated error of displacements is at most {specimen.tolerance:g} of their "
        f"largest plus {specimen.resolution:g} mm. A test ends at a creep strain of {specimen.strain_limit:g} in a "
        f"point or an observed displacement of {specimen.deflection_limit:g} mm."
    )


Task = TypeVar("Task")
Row = TypeVar("Row")


def in_threads(run: Callable[[Task], Row], tasks: Sequence[Task], threads: int | None) -> list[Row]:
    """The results of tasks in their order; threads : that run them, None for one on each core."""
    workers = min(threads or usable_cores(), len(tasks))
    if workers <= 1:
        return [run(task) for task in tasks]
    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(run, tasks))
    finally:
        pool.shutdown(cancel_futures=True)  # an interrupt waits for the simulations that run, not for the others
