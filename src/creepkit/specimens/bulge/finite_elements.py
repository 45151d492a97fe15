"""The finite element model of a bulge test: set-up from a history, prediction, and sensitivities of its outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.errors import SolveError, nearest
from creepkit.fem.mesh import GeometryDerivative, geometry_derivative
from creepkit.fem.simulation import Simulation, sensitivity_directions, simulate
from creepkit.fem.solvable_model import SensitivityDirections, SolvableModel
from creepkit.fem.solver import SolverSettings
from creepkit.records import (
    PROGRAM_NUISANCES,
    History,
    HistoryPrediction,
    NuisanceValues,
    Output,
    Prediction,
    Program,
    Status,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
    kind_and_start,
    outputs_of_tests,
)
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.setup import BulgeSetup, set_up_test
from creepkit.specimens.finite_element_tests import PROGRAM_STEPS, in_threads, step_time_derivative

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge.observation import Observation
    from creepkit.specimens.bulge.settings import BulgeSettings


MODULUS_TEMPERATURE_STEP = 1.0
"""K, of the central difference of the modulus to the temperature."""


@dataclass(frozen=True, eq=False)
class BulgeSensitivities:
    """Derivatives of the outputs.

    law : (times, outputs, parameters) to the internal parameters. nuisances : {name: (times, outputs)} to everything
    else.
    """

    law: Floats
    nuisances: Mapping[str, Floats]


def sensitivity_directions_of(
    setup: BulgeSetup, history: History, names: Sequence[str], programs: Mapping[str, Floats] | None = None
) -> SensitivityDirections:
    """What a test is differentiated to beside the law's parameters.

    names : "modulus" (relative), "temperature" (K), "thickness" (mm) and any length of the dimple, "window" (mm), and
        the numbers of the loading, such as P1, P2 and Tj. programs : {name: (segments, 10)} derivatives of the
        segments of the load history, of further names.
    """
    loads, lengths = _loads_and_lengths(names)
    known = programs or {}
    segments = np.array([known[n] if n in known else _direction(setup, history, n) for n in loads]).reshape(
        -1, *setup.load_history.segments.shape
    )
    velocities = [_velocity(setup.geometry, _dimension_name(name), setup) for name in lengths]
    return sensitivity_directions(setup.model, setup.load_history, segments, velocities)


def _loads_and_lengths(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of what changes the load history, and of what moves the nodes."""
    loads = [n for n in names if n != "window" and not _is_dimension(n)]
    return loads, [n for n in names if _is_dimension(n)]


def output_sensitivities(
    setup: BulgeSetup,
    theta: Floats,
    history: History,
    simulation: Simulation,
    profiles: Floats,
    names: Sequence[str],
    directions: SensitivityDirections,
) -> tuple[Floats, BulgeSensitivities]:
    """Outputs (times, outputs) and their derivatives, from a simulation that was differentiated to `directions`.

    theta : (parameters,) internal values. profiles : (times, nodes) mm, displacements of the top. names : those that
        the directions were made of.
    """
    change = simulation.sensitivities
    assert change is not None
    loads, lengths = _loads_and_lengths(names)
    outputs, output_derivatives = setup.observation.observe_with_derivatives(setup.radii, profiles)
    output_columns = output_derivatives @ change.surface
    velocities = directions.velocities.reshape(len(lengths), len(setup.model.nodes), 2)
    for k, radial_velocity in enumerate(velocities[:, setup.model.top, 0]):
        output_columns[:, :, theta.size + len(loads) + k] += setup.observation.node_derivatives(
            setup.radii, profiles, radial_velocity
        )
    _lend_to_rest(output_columns, setup.observation)
    along = simulation.at(output_columns, history.times)
    nuisances = {}
    for k, name in enumerate(loads):
        nuisances[name] = along[..., theta.size + k] + step_time_derivative(
            simulation, change, directions.segments, k, outputs, history.times
        )
    for k, name in enumerate(lengths):
        nuisances[name] = along[..., theta.size + len(loads) + k]
    if "window" in names:
        window_columns = setup.observation.window_derivatives(setup.radii, profiles)
        _lend_to_rest(window_columns, setup.observation)
        nuisances["window"] = simulation.at(window_columns, history.times)
    return simulation.at(outputs, history.times), BulgeSensitivities(along[..., : theta.size], nuisances)


def _lend_to_rest(columns: Floats, observation: Observation) -> None:
    """Width and shape at rest are those of the first step, and so are their derivatives, (steps, outputs, ...)."""
    if observation.form != "rings":
        columns[0, 1:] = columns[1, 1:] if len(columns) > 1 else 0.0


def _is_dimension(name: str) -> bool:
    return name == "thickness" or name in DimpleGeometry.lengths


def _dimension_name(name: str) -> str:
    return "apex_thickness" if name == "thickness" else name


def _direction(setup: BulgeSetup, history: History, name: str) -> Floats:
    """Derivative of the segments of the load history, (segments, 10): a central difference, exact if linear."""
    load_history = setup.load_history
    if name == "modulus":
        # measured against the modulus that the history states
        given_value = history.elastic.at(float(load_history.temperature.values[0])).E if history.elastic else 1.0
        share = Program(
            load_history.modulus.times,
            load_history.modulus.values * (float(given_value) / load_history.modulus.values[0]),
        )
        return np.asarray(replace(load_history, modulus=share).segments * _COLUMNS["modulus"])
    if name == "temperature":
        return _by_temperature(setup, history)
    loading = history.loading
    if not isinstance(getattr(loading, name, None), Real):
        known = ("modulus", "temperature", "thickness", "window", *getattr(loading, "__dataclass_fields__", ()))
        raise SolveError(f"history '{history.name}': no derivative to '{name}' is known; {nearest(name, known)}")
    value = float(getattr(loading, name))
    step = 1e-4 * max(abs(value), 1e-3)
    up, down = (
        replace(load_history, pressure=replace(loading, **{name: value + s}).program()).segments  # type: ignore[type-var]
        for s in (step, -step)
    )
    return np.asarray((up - down) / (2.0 * step))


def program_directions(specimen: BulgeSettings, history: History, nuisances: Mapping[str, float]) -> dict[str, Floats]:
    """{key: (segments, 10)} derivatives of the load history's segments to nuisances of programs: central differences.

    nuisances : {key: value} of all explicit nuisances of the test. Programs are linear in these, but for the modulus.
    """

    def segments(key: str, step: float) -> Floats:
        return set_up_test(specimen, history, {**nuisances, key: nuisances[key] + step}).load_history.segments

    steps = {key: PROGRAM_STEPS.get(kind_and_start(key)[0], 0.0) for key in nuisances}
    return {key: (segments(key, s) - segments(key, -s)) / (2.0 * s) for key, s in steps.items() if s}


_COLUMNS = {
    "modulus": np.array([0, 0, 0, 0, 0, 0, 1, 1, 0, 0.0]),
    "temperature": np.array([0, 0, 0, 0, 1, 1, 0, 0, 0, 0.0]),
}


def _by_temperature(setup: BulgeSetup, history: History) -> Floats:
    """One kelvin more in every temperature, and the modulus that goes with it."""
    load_history = setup.load_history
    direction: Floats = np.zeros_like(load_history.segments) + _COLUMNS["temperature"]
    if history.elastic is None:
        return np.asarray(direction)
    temperature = load_history.temperature.values
    given_modulus = [float(history.elastic.at(float(T)).E) for T in temperature]
    factor = load_history.modulus.values / np.array(given_modulus)
    up, down = (
        np.array([float(history.elastic.at(float(T) + s).E) for T in temperature])
        for s in (MODULUS_TEMPERATURE_STEP, -MODULUS_TEMPERATURE_STEP)
    )
    slope = Program(load_history.modulus.times, factor * (up - down) / (2.0 * MODULUS_TEMPERATURE_STEP))
    modulus_changes: Floats = replace(load_history, modulus=slope).segments * _COLUMNS["modulus"]
    return np.asarray(direction + modulus_changes)


@lru_cache(maxsize=256)
def _velocity_of(geometry: DimpleGeometry, refinement: float, name: str) -> tuple[GeometryDerivative, Floats]:
    velocity = geometry.mesh_velocity(name, refinement)
    return geometry_derivative(geometry.mesh(refinement), velocity), velocity


def _velocity(geometry: DimpleGeometry, name: str, setup: BulgeSetup) -> tuple[GeometryDerivative, Floats]:
    if setup.refinement is None:
        raise SolveError(f"a mesh from files does not say how it follows {name}; use the structured mesh instead")
    return _velocity_of(geometry, setup.refinement, name)


@dataclass(frozen=True, eq=False)
class BulgeResponse:
    """One candidate in one test.

    outputs : names of what is observed. values : (times, outputs) in their units. status, end_time : how it ended, and
    when, s. sensitivities : derivatives of the outputs, if asked for.
    """

    outputs: tuple[Output, ...]
    values: Floats
    status: Status
    end_time: float
    sensitivities: BulgeSensitivities | None


def predict_bulge(
    specimen: BulgeSettings,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    sensitivities: bool,
    model_of: Callable[[BulgeSetup], SolvableModel] | None = None,
    settings: SolverSettings | None = None,
) -> Prediction:
    """Predict every candidate in every test; see records.Predictor.

    theta : (candidates, parameters) internal values. nuisances : {kind: (candidates or 1, tests)}. model_of : the model
    of a test that is simulated in the place of its finite elements, such as a reduced-order model. settings : of the
    solver, by default those of the specimen.
    """
    known = (*specimen.nuisances, *PROGRAM_NUISANCES)
    check_nuisances([kind_and_start(key)[0] for key in nuisances], known, "a bulge specimen")
    kernel = kernels.lower(law, "compiled")
    theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
    tasks = list(product(range(len(theta)), range(len(histories))))
    settings = settings or solver_settings(specimen, exact=sensitivities)
    shared = all(np.ptp(value, axis=0).max() == 0.0 for value in nuisances.values())

    def prepared(c: int, k: int) -> PreparedTest:
        values = {kind: float(value[c, k]) for kind, value in nuisances.items()}
        return PreparedTest.of(specimen, histories[k], values, sensitivities, model_of)

    # before threads begin: a reduced-order model may have to be trained
    tests = [prepared(0, k) for k in range(len(histories))] if tasks else []

    def run(task: tuple[int, int]) -> BulgeResponse:
        c, k = task
        test = tests[k] if shared or c == 0 else prepared(c, k)
        return test.simulate_and_observe(kernel, theta[c], settings)

    rows = in_threads(run, tasks, specimen.threads)
    observed = outputs_of_tests(specimen, histories)
    parts = [_history_prediction(rows[k :: len(histories)], observed) for k in range(len(histories))]
    return assemble_prediction(parts, histories, observed, len(theta))


@dataclass(frozen=True, eq=False)
class PreparedTest:
    """One test with its nuisances, ready to be simulated by any law.

    model : what is simulated. names, directions : the nuisances, and what is differentiated to; None for nothing.
    """

    setup: BulgeSetup
    history: History
    model: SolvableModel
    names: tuple[str, ...]
    directions: SensitivityDirections | None

    @classmethod
    def of(
        cls,
        specimen: BulgeSettings,
        history: History,
        nuisances: Mapping[str, float],
        jacobian: bool,
        model_of: Callable[[BulgeSetup], SolvableModel] | None = None,
    ) -> PreparedTest:
        """Set one test up; jacobian : for a simulation with its sensitivities."""
        setup = set_up_test(specimen, history, nuisances)
        model = setup.model if model_of is None else model_of(setup)
        names, directions = tuple(nuisances), None
        if jacobian:
            programs = program_directions(specimen, history, nuisances)
            directions = sensitivity_directions_of(setup, history, names, programs)
        return cls(setup, history, model, names, directions)

    def simulate_and_observe(self, kernel: CompiledLaw, theta: Floats, settings: SolverSettings) -> BulgeResponse:
        """Simulate the test and observe it at the times of its history; theta : (parameters,) internal values."""
        setup, times = self.setup, self.history.times
        simulation = simulate(
            kernel, theta, self.model, setup.load_history, settings=settings, directions=self.directions
        )
        profiles = simulation.displacements[:, setup.model.top, 1]
        sensitivities = None
        if self.directions is not None:
            outputs, sensitivities = output_sensitivities(
                setup, theta, self.history, simulation, profiles, self.names, self.directions
            )
        else:
            outputs = setup.observation.observe_at_times(setup.radii, profiles, simulation.timeline, times)
        names = setup.observation.outputs
        return BulgeResponse(names, outputs, simulation.status, simulation.end_time, sensitivities)


def solver_settings(specimen: BulgeSettings, *, exact: bool = False) -> SolverSettings:
    """The solver's settings; exact : equilibrium so tight that derivatives err by 1e-5 to 1e-3 of their largest."""
    return SolverSettings(
        tolerance=specimen.tolerance,
        newton=1e-6 if exact else 1e-2 * specimen.tolerance,
        deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
        max_steps=int(specimen.max_steps),
    )


def _history_prediction(responses: Sequence[BulgeResponse], outputs: Sequence[str]) -> HistoryPrediction:
    """The responses of all candidates in one test; NaN for outputs of other tests."""
    sensitivities = [r.sensitivities for r in responses if r.sensitivities is not None]
    columns = [outputs.index(name) for name in responses[0].outputs]

    def in_columns(arrays: Sequence[Floats]) -> Floats:
        """(candidates, times, outputs, ...) from one array (times, own outputs, ...) of each candidate."""
        own = np.array(arrays)
        if own.shape[2] == len(outputs):
            return own
        out = np.full((*own.shape[:2], len(outputs), *own.shape[3:]), np.nan)
        out[:, :, columns] = own
        return out

    return HistoryPrediction(
        values=in_columns([r.values for r in responses]),
        status=np.array([int(r.status) for r in responses], dtype=np.int64),
        end_times=np.array([r.end_time for r in responses]),
        jacobian=in_columns([s.law for s in sensitivities]) if sensitivities else None,
        nuisance_jacobian={
            kind: in_columns([s.nuisances[kind] for s in sensitivities])
            for kind in (sensitivities[0].nuisances if sensitivities else ())
        },
    )
