"""One test of an axisymmetric specimen: set-up from its history, simulation, observation, sensitivities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.mesh import GeometryDerivative, Mesh, geometry_derivative
from creepkit.fem.section import Section
from creepkit.fem.simulation import LoadHistory, Simulation, sensitivity_directions, simulate
from creepkit.fem.solvable_model import SensitivityDirections
from creepkit.fem.solver import SolverSettings
from creepkit.records import (
    PROGRAM_NUISANCES,
    Dimension,
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Program,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
    dimension_named,
    kind_and_start,
    with_program_nuisances,
)
from creepkit.specimens.axisymmetric.displacements import Displacements
from creepkit.specimens.finite_element_tests import PROGRAM_STEPS, in_threads, modulus_program, step_time_derivative

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw
    from creepkit.specimens.axisymmetric.settings import AxisymmetricSettings


LENGTH_STEP = 1e-4
"""Relative step of central differences of meshes and of outputs to a length; nodes are nearly linear in lengths."""

DISPLACEMENT_STEP = 1e-4
"""Relative step, of the largest of it, of central differences of outputs to an observed displacement."""

_STEPS = {**PROGRAM_STEPS, "modulus": 1e-3, "temperature": 1.0}
"""Steps of central differences of the load history, by kind; it is linear in all but for the modulus in K."""


@dataclass(frozen=True, eq=False)
class PreparedSection:
    """A section ready to be simulated; order : the displacements that are observed, 2 node + component."""

    section: Section
    model: FiniteElementModel
    order: tuple[int, ...]

    @classmethod
    def of(cls, piece: AxisymmetricSettings, load: str) -> PreparedSection:
        """Make the section of a test piece; SolveError, beginning with the specimen's name, where it cannot be."""
        try:
            section = piece.section(load)
            notes = Displacements(section)
            with np.errstate(all="ignore"):
                _checked_outputs(piece, piece.observe(notes))
            order = tuple(sorted(set(notes.asked)))
            return cls(section, section.model(np.array(order, dtype=np.int64)), order)
        except SolveError as error:
            raise SolveError(f"specimen '{piece.name}' under {load}: {error}") from error

    def quantities(self, simulation: Simulation) -> Floats:
        """What is observed in each accepted step, (steps, observed): displacements, mm, then the force, N."""
        flat = simulation.displacements.reshape(len(simulation.times), -1)
        columns = [flat[:, list(self.order)]]
        if self.section.controlled is not None:
            columns.append(2.0 * np.pi * simulation.reactions[:, None])
        return np.concatenate(columns, axis=1)


@lru_cache(maxsize=256)
def _kept_section(piece: AxisymmetricSettings, load: str) -> PreparedSection:
    return PreparedSection.of(piece, load)


def prepared_section(piece: AxisymmetricSettings, load: str) -> PreparedSection:
    """The section of a test piece, kept, for a fit needs it a thousand times; made anew for one without a hash."""
    try:
        hash(piece)
    except TypeError:
        return PreparedSection.of(piece, load)
    return _kept_section(piece, load)


def _checked_outputs(piece: AxisymmetricSettings, found: Mapping[str, object]) -> None:
    for name in piece.outputs:
        if name not in found:
            raise SolveError(f"observe() gave no '{name}'; it gives {', '.join(piece.outputs)}")


def observe(piece: AxisymmetricSettings, body: PreparedSection, quantities: Floats) -> Floats:
    """Outputs (steps, outputs) in their units, from what is observed, quantities (steps, observed), mm and N."""
    found = piece.observe(Displacements(body.section, quantities, body.order))
    rows = [np.broadcast_to(np.asarray(found[name], dtype=float), len(quantities)) for name in piece.outputs]
    return np.stack(rows, axis=1)


def observation_derivatives(piece: AxisymmetricSettings, body: PreparedSection, quantities: Floats) -> Floats:
    """Derivatives (steps, outputs, observed) of the outputs to what is observed; quantities : (steps, observed)."""
    slopes = []
    for k in range(quantities.shape[1]):
        move = np.zeros(quantities.shape[1])
        move[k] = DISPLACEMENT_STEP * max(float(np.abs(quantities[:, k]).max()), piece.resolution)
        up, down = (observe(piece, body, quantities + sign * move) for sign in (1.0, -1.0))
        slopes.append((up - down) / (2.0 * move[k]))
    return np.stack(slopes, axis=-1) if slopes else np.zeros((len(quantities), len(piece.outputs), 0))


def load_history_of(specimen: AxisymmetricSettings, history: History, nuisances: Mapping[str, float]) -> LoadHistory:
    """What the body goes through in a test with its nuisances; SolveError for a test that cannot be made."""
    piece, tested = specimen.of_test(history, nuisances)
    tested, where = with_program_nuisances(tested, nuisances), history.origin
    if tested.times[-1] <= 0.0:
        raise SolveError(f"{where}: the last time is 0 s, where the load only begins; ask for a time after it")
    if tested.elastic is None:
        raise SolveError(f"{where}: specimen '{piece.name}' needs elastic data; set elastic=Elastic(E=...), E in MPa")
    load = tested.loading.program()
    kind = {each.name: each.quantity for each in piece.loads}[tested.loading.quantity]
    if kind == "pressure" and load.values.min() < 0.0:
        raise SolveError(f"{where}: the pressure falls to {load.values.min():g} MPa; it must not be negative")
    if not load.values.any():
        raise SolveError(f"{where}: the {tested.loading.quantity} is zero throughout; a test needs a load")
    temperature = tested.temperature_program()
    modulus = modulus_program(tested.elastic, temperature, 1.0, where)
    poisson = float(tested.elastic.at(float(temperature.values[0])).nu)
    still, end = Program.constant(0.0), float(tested.times[-1])
    section = prepared_section(piece, tested.loading.quantity).section
    if section.controlled is not None:
        motion = Program(load.times, section.motion * load.values)
        return LoadHistory(still, temperature, modulus, end, poisson, motion)
    return LoadHistory(load, temperature, modulus, end, poisson)


@dataclass(frozen=True, eq=False)
class OneResponse:
    """One candidate in one test.

    values : (times, outputs). law : (times, outputs, parameters) derivatives to the internal parameters, or None.
    nuisances : {key: (times, outputs)} those to the nuisances.
    """

    simulation: Simulation
    values: Floats
    law: Floats | None
    nuisances: Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class AxisymmetricTest:
    """One test with its nuisances, ready to be simulated by any law.

    piece : with the lengths of this test. loads, lengths : the nuisances that change the load history, and those that
    move nodes. directions : what is differentiated to; None for nothing.
    """

    piece: AxisymmetricSettings
    history: History
    body: PreparedSection
    load_history: LoadHistory
    loads: tuple[str, ...]
    lengths: tuple[str, ...]
    directions: SensitivityDirections | None

    @classmethod
    def of(
        cls, specimen: AxisymmetricSettings, history: History, nuisances: Mapping[str, float], sensitivities: bool
    ) -> AxisymmetricTest:
        """Set one test up; nuisances : {key: value}. sensitivities : for a simulation with its derivatives."""
        piece, _ = specimen.of_test(history, nuisances)
        body = prepared_section(piece, history.loading.quantity)
        load_history = load_history_of(specimen, history, nuisances)
        lengths = tuple(key for key in nuisances if dimension_named(specimen, key) is not None)
        loads = tuple(key for key in nuisances if key not in lengths)
        test = cls(piece, history, body, load_history, loads, lengths, None)
        if not sensitivities:
            return test
        segments = [_segment_direction(specimen, history, nuisances, key) for key in loads]
        moves = [_movement(piece, history.loading.quantity, key) for key in lengths]
        directions = sensitivity_directions(
            body.model,
            load_history,
            np.array(segments).reshape(-1, *load_history.segments.shape),
            [(gradient, velocity) for gradient, velocity, _ in moves],
            np.array([force for *_, force in moves]) if moves else None,
        )
        return replace(test, directions=directions)

    def simulate(
        self, kernel: CompiledLaw, theta: Floats, settings: SolverSettings, keep_points: bool = False
    ) -> Simulation:
        """Simulate the test; theta : (parameters,) internal values."""
        return simulate(
            kernel, theta, self.body.model, self.load_history, settings=settings, keep_points=keep_points,
            directions=self.directions,
        )  # fmt: skip

    def outputs(self, simulation: Simulation) -> Floats:
        """Outputs (times, outputs) at the times of the history."""
        return simulation.at(observe(self.piece, self.body, self.body.quantities(simulation)), self.history.times)

    def respond(self, kernel: CompiledLaw, theta: Floats, settings: SolverSettings) -> OneResponse:
        """Simulate and observe the test, with derivatives where it has directions; theta : (parameters,)."""
        simulation = self.simulate(kernel, theta, settings)
        change, times = simulation.sensitivities, self.history.times
        if change is None or self.directions is None:
            return OneResponse(simulation, self.outputs(simulation), None, {})
        quantities = self.body.quantities(simulation)
        surface = np.array(change.surface)
        if self.body.section.controlled is not None:
            surface[:, -1] *= 2.0 * np.pi
        outputs = observe(self.piece, self.body, quantities)
        columns = observation_derivatives(self.piece, self.body, quantities) @ surface
        first = theta.size + len(self.loads)
        for k, name in enumerate(self.lengths):
            columns[:, :, first + k] += self._length_derivative(name, quantities)
        along = simulation.at(columns, times)
        nuisances = {name: along[..., first + k] for k, name in enumerate(self.lengths)}
        for k, name in enumerate(self.loads):
            moved = step_time_derivative(simulation, change, self.directions.segments, k, outputs, times)
            nuisances[name] = along[..., theta.size + k] + moved
        return OneResponse(simulation, simulation.at(outputs, times), along[..., : theta.size], nuisances)

    def _length_derivative(self, name: str, quantities: Floats) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length at fixed displacements."""
        longer, shorter, step = _neighbours(self.piece, name)
        up, down = (observe(piece, self.body, quantities) for piece in (longer, shorter))
        return (up - down) / (2.0 * step)


def _neighbours(piece: AxisymmetricSettings, key: str) -> tuple[AxisymmetricSettings, AxisymmetricSettings, float]:
    """The test piece with a length a little larger and a little smaller, within its bounds, and the step, mm."""
    known = dimension_named(piece, key)
    assert isinstance(known, Dimension)
    value, (low, high) = float(getattr(piece, known.name)), known.bounds
    step = LENGTH_STEP * value
    middle = min(max(value, low + step), high - step)
    longer, shorter = (piece.replace(**{known.name: middle + s}) for s in (step, -step))
    return longer, shorter, step


@lru_cache(maxsize=256)
def _movement_of(piece: AxisymmetricSettings, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
    section = prepared_section(piece, load).section
    longer, shorter, step = _neighbours(piece, key)
    up, down = longer.section(load), shorter.section(load)
    if not (up.has_topology_of(section) and down.has_topology_of(section)):
        raise SolveError(
            f"specimen '{piece.name}': another '{key}' makes another mesh, not the same one with its nodes moved; let "
            "numbers of elements, and what is held, not depend on lengths"
        )
    velocity = (up.nodes - down.nodes) / (2.0 * step)
    force = (up.forces - down.forces) / (2.0 * step)
    mesh = Mesh(section.nodes, section.elements, section.held, section.pressed, np.zeros(0, dtype=np.int64))
    return geometry_derivative(mesh, velocity), velocity, force


def _movement(piece: AxisymmetricSettings, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
    """How nodes (nodes, 2), mm, and dead forces (nodes, 2), N/rad, move with a length, by central differences."""
    try:
        hash(piece)
    except TypeError:
        return _movement_of.__wrapped__(piece, load, key)
    return _movement_of(piece, load, key)


def _segment_direction(
    specimen: AxisymmetricSettings, history: History, nuisances: Mapping[str, float], key: str
) -> Floats:
    """Derivative (segments, 10) of the load history's segments to a nuisance of it, by central differences."""
    step = _STEPS[kind_and_start(key)[0]]
    up, down = (
        load_history_of(specimen, history, {**nuisances, key: nuisances[key] + s}).segments for s in (step, -step)
    )
    return np.asarray((up - down) / (2.0 * step))


def solver_settings(specimen: AxisymmetricSettings, *, exact: bool = False) -> SolverSettings:
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


def predict_axisymmetric(
    specimen: AxisymmetricSettings,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    sensitivities: bool,
) -> Prediction:
    """Predict every candidate in every test; see records.Predictor.

    theta : (candidates, parameters) internal values. nuisances : {key: (candidates or 1, tests)}.
    """
    known = (*specimen.nuisances, *PROGRAM_NUISANCES)
    check_nuisances([kind_and_start(key)[0] for key in nuisances], known, f"specimen '{specimen.name}'")
    kernel = kernels.lower(law, "compiled")
    theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
    tasks = list(product(range(len(theta)), range(len(histories))))
    settings = solver_settings(specimen, exact=sensitivities)
    shared = all(np.ptp(value, axis=0).max() == 0.0 for value in nuisances.values())

    def prepared(c: int, k: int) -> AxisymmetricTest:
        values = {key: float(value[c, k]) for key, value in nuisances.items()}
        return AxisymmetricTest.of(specimen, histories[k], values, sensitivities)

    tests = [prepared(0, k) for k in range(len(histories))] if tasks else []

    def run(task: tuple[int, int]) -> OneResponse:
        c, k = task
        test = tests[k] if shared or c == 0 else prepared(c, k)
        return test.respond(kernel, theta[c], settings)

    rows = in_threads(run, tasks, specimen.threads)
    parts = [_history_prediction(rows[k :: len(histories)]) for k in range(len(histories))]
    return assemble_prediction(parts, histories, specimen.outputs, len(theta))


def _history_prediction(responses: Sequence[OneResponse]) -> HistoryPrediction:
    """The responses of all candidates in one test."""
    jacobians = [r.law for r in responses if r.law is not None]
    return HistoryPrediction(
        values=np.array([r.values for r in responses]),
        status=np.array([int(r.simulation.status) for r in responses], dtype=np.int64),
        end_times=np.array([r.simulation.end_time for r in responses]),
        jacobian=np.array(jacobians) if jacobians else None,
        nuisance_jacobian={key: np.array([r.nuisances[key] for r in responses]) for key in responses[0].nuisances},
    )
