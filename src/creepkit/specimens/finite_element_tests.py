"""One test in finite elements: set-up from its history, simulation, observation, sensitivities; predictions of many."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel, SensitivityDirections
from creepkit.fem.simulation import LoadHistory, Simulation, sensitivity_directions, simulate
from creepkit.fem.solver import SolvableModel, SolverSettings
from creepkit.integration.time_discretisation import SDIRK2_TEXT
from creepkit.language.elastic import STATE_MODULUS
from creepkit.records import (
    History,
    Loading,
    NuisanceValues,
    Prediction,
    Program,
    changed_fields,
    dimension_named,
    kind_and_start,
    outputs_of_tests,
)
from creepkit.specimens.separate_tests import TestResponse, predict_separately
from creepkit.specimens.test_piece import kept

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw, Elastic


STEPS = {"temperature step": 1.0, "temperature drift": 1.0, "load step": 1e-3, "modulus": 1e-3, "temperature": 1.0}
"""K and relative, of differences of the load history by kind; they are central where the modulus varies with K."""


@dataclass(frozen=True, eq=False)
class FiniteElementTest:
    """One test with its nuisances, ready to be simulated by any law.

    piece : the FiniteElementSpecimen with the lengths of this test. loads, lengths, views : nuisances that change the
    load history, that move nodes, and that only change what is observed. directions : what is
    differentiated to; None for nothing.
    """

    piece: Any
    history: History
    load_history: LoadHistory
    loads: tuple[str, ...] = ()
    lengths: tuple[str, ...] = ()
    views: tuple[str, ...] = ()
    directions: SensitivityDirections | None = None

    @classmethod
    def of(
        cls, specimen: Any, history: History, nuisances: Mapping[str, float], sensitivities: bool = False
    ) -> FiniteElementTest:
        """Set one test up; nuisances : {key: value}. sensitivities : for a simulation with its derivatives."""
        return _prepared(specimen, history, tuple(nuisances.items()), sensitivities)

    @property
    def load(self) -> str:
        """The name of what is imposed."""
        return self.history.loading.quantity

    @property
    def model(self) -> FiniteElementModel:
        """The finite elements."""
        model: FiniteElementModel = self.piece.finite_elements(self.load)
        return model

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

    def observed_at_times(self, simulation: Simulation) -> Floats:
        """Outputs at the times of the history, (times, outputs)."""
        return np.asarray(self.piece.observed_at_times(self.load, simulation, self.history.times))

    def differentiated(self, simulation: Simulation) -> tuple[Floats, Floats]:
        """Outputs (steps, outputs), and derivatives (steps, outputs, columns).

        Columns are those of the law's parameters, of loads, lengths and views.
        """
        assert simulation.sensitivities is not None
        piece, load = self.piece, self.load
        outputs, by_observed = piece.observe_with_derivatives(load, simulation)
        columns = by_observed @ piece.observed_change(load, simulation)
        for k, name in enumerate(reversed(self.lengths), 1):
            columns[:, :, -k] += piece.length_derivative(load, name, simulation)
        views = [piece.length_derivative(load, name, simulation)[..., None] for name in self.views]
        return outputs, piece.derivatives_from_rest(np.concatenate([columns, *views], axis=2))

    def response(self, simulation: Simulation) -> TestResponse:
        """What is observed of a simulation of the test, with derivatives where it has directions."""
        status, end, names = simulation.status, simulation.end_time, tuple(self.piece.outputs)
        if self.directions is None:
            return TestResponse(self.observed_at_times(simulation), status, end, outputs=names)
        outputs, columns = self.differentiated(simulation)
        at, keys = simulation.at(columns, self.history.times), (*self.loads, *self.lengths, *self.views)
        count = at.shape[2] - len(keys)
        nuisances = {key: at[..., count + k] for k, key in enumerate(keys)}
        values = simulation.at(outputs, self.history.times)
        return TestResponse(values, status, end, "", at[..., :count], nuisances, names)


@kept
def _prepared(
    specimen: Any, history: History, nuisances: tuple[tuple[str, float], ...], sensitivities: bool
) -> FiniteElementTest:
    """As FiniteElementTest.of; nuisances : (key, value)."""
    piece, tested = specimen.of_test(history, dict(nuisances))
    known = {key: dimension_named(specimen, key) for key, _ in nuisances}
    loads = tuple(key for key, length in known.items() if length is None)
    lengths = tuple(key for key, length in known.items() if length is not None and length.of_piece)
    views = tuple(key for key in known if key not in (*loads, *lengths))
    load_history = _load_history_of(piece, history, tested.loading, tested.temperature, tested.elastic)
    test = FiniteElementTest(piece, history, load_history, loads, lengths, views)
    if not sensitivities:
        return test

    def segments(key: str, step: float) -> Floats:
        values = dict(nuisances)
        changed = changed_fields(history, {**values, key: values[key] + step})
        fields = (changed.get(name, getattr(history, name)) for name in ("loading", "temperature", "elastic"))
        return _load_history_of(piece, history, *fields).segments

    linear = isinstance(getattr(history.elastic, "E", None), Real)
    along = []
    for key in loads:
        step = STEPS[kind_and_start(key)[0]]
        before, width = (load_history.segments, step) if linear else (segments(key, -step), 2.0 * step)
        along.append((segments(key, step) - before) / width)
    moves = [piece.movement(test.load, key) for key in lengths]
    directions = sensitivity_directions(
        test.model,
        load_history,
        np.array(along).reshape(-1, *load_history.segments.shape),
        [(gradient, velocity) for gradient, velocity, _ in moves],
        np.array([force for *_, force in moves]) if moves else None,
    )
    return replace(test, directions=directions)


def _load_history_of(
    piece: Any, history: History, loading: Loading, temperature: float | Program, elastic: Elastic | None
) -> LoadHistory:
    """What the body goes through in a test as its nuisances say; SolveError for one that cannot be made."""
    where, quantity, end = history.origin, loading.quantity, float(history.times[-1])
    if end <= 0.0:
        raise SolveError(f"{where}: the last time is 0 s, where the load only begins; ask for a time after it")
    if elastic is None:
        raise SolveError(f"{where}: specimen '{piece.name}' needs elastic data; {STATE_MODULUS}")
    load = loading.program()
    if {each.name: each.quantity for each in piece.loads}[quantity] == "pressure" and load.values.min() < 0.0:
        raise SolveError(f"{where}: the pressure falls to {load.values.min():g} MPa; it must not be negative")
    if not load.values.any():
        raise SolveError(f"{where}: the {quantity} is zero throughout; a test needs a load")
    kelvin = temperature if isinstance(temperature, Program) else Program.constant(temperature)
    moduli = {float(T): float(elastic.at(float(T)).E) for T in np.unique(kelvin.values)}
    values = np.array([moduli[float(T)] for T in kelvin.values])
    if not (values > 0).all():
        raise SolveError(f"{where}: the modulus is {values.min():g} MPa; it must be above zero")
    modulus, poisson = Program(kelvin.times, values), float(elastic.at(float(kelvin.values[0])).nu)
    motion = piece.motion(quantity)
    if motion is None:
        return LoadHistory(load, kelvin, modulus, end, poisson)
    moved = Program(load.times, motion * load.values)
    return LoadHistory(Program.constant(0.0), kelvin, modulus, end, poisson, moved)


class Reduction(NamedTuple):
    """How a reduced-order model simulates: the model of a test piece, and the settings of the solver.

    model_of : of a test piece, and of that which its history states, to which the one is near.
    """

    model_of: Callable[[Any, Any], SolvableModel]
    settings: SolverSettings


def predict_tests(
    specimen: Any,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    sensitivities: bool,
    reduction: Reduction | None = None,
) -> Prediction:
    """Predict every candidate in every test.

    theta : (candidates, parameters) internal values. nuisances : {key: (candidates, tests)}. reduction : to a model
    that is simulated in the place of the finite elements.
    """
    kernel = kernels.lower(law, "compiled")
    settings = solver_settings(specimen) if reduction is None else reduction.settings

    def prepared(k: int, of_test: Mapping[str, float]) -> tuple[FiniteElementTest, SolvableModel]:
        test = FiniteElementTest.of(specimen, histories[k], of_test, sensitivities)
        if reduction is None:
            return test, test.model
        return test, reduction.model_of(test.piece, FiniteElementTest.of(specimen, histories[k], {}).piece)

    for k in range(len(histories)) if len(theta) else ():  # before threads begin: a model may have to be trained
        prepared(k, {key: float(values[0, k]) for key, values in nuisances.items()})

    def respond(row: Floats, k: int, of_test: Mapping[str, float]) -> TestResponse:
        test, model = prepared(k, of_test)
        return test.response(test.simulate(kernel, row, settings, model))

    outputs = outputs_of_tests(specimen, histories)
    return predict_separately(respond, theta, histories, nuisances, outputs, specimen.threads)


EQUILIBRIUM_SHARE = 7e-3
"""Of the tolerance of steps, that of equilibrium: values and derivatives then err by some 1e-4 of their largest."""


def solver_settings(specimen: Any) -> SolverSettings:
    """The solver's settings, the same with derivatives as without: a test has one prediction."""
    return SolverSettings(
        tolerance=specimen.tolerance,
        newton=EQUILIBRIUM_SHARE * specimen.tolerance,
        first=specimen.first_step,
        deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
        max_steps=int(specimen.max_steps),
        least=specimen.resolution,
    )


def finite_element_text(specimen: Any, model: FiniteElementModel) -> str:
    """Elements, kinematics, material, integration in time and its end, in sentences for a paper."""
    return (
        f"Finite elements of a body of revolution: {len(model.elements)} quadrilaterals of eight nodes with 2 x 2 "
        f"integration points, {len(model.nodes)} nodes. Strains are finite (logarithmic, Hencky elasticity), and creep "
        "flows along the elastic deviator at the rate that the law gives for the von Mises stress. Time is integrated "
        f"by {SDIRK2_TEXT}, in steps whose estimated error of displacements is at most {specimen.tolerance:g} of their "
        f"largest plus {specimen.resolution:g} mm. A test ends at a creep strain of {specimen.strain_limit:g} in a "
        f"point or an observed displacement of {specimen.deflection_limit:g} mm."
    )
