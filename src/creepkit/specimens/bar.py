"""What uniaxial tests and relaxation share: prediction at a material point, nuisance parameters, elastic strain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import Floats
from creepkit.integration.time_discretisation import SDIRK4_TEXT
from creepkit.records import History, HistoryPrediction, NuisanceValues, Prediction, Status, assemble_prediction
from creepkit.specimens.point_specimen import PointSpecimen
from creepkit.specimens.run import Run, run_from_outputs

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest
    from creepkit.language import CreepLaw


SEARCH_TOLERANCE = 1e-3
"""Tolerance of the integration in a global search; creep of bars scatters by a thousand times as much."""


@dataclass(frozen=True, eq=False, kw_only=True)
class BarRun(Run):
    """A simulated bar, at the times of the run.

    creep_strain : (times,) logarithmic, along the axis, below zero where the bar is shortened. equivalent_strain :
    (times,) what the law sees, which grows in compression as in tension. states : {name: (times,)} internal variables.
    """

    creep_strain: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    equivalent_strain: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    states: Mapping[str, Floats] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Bar(PointSpecimen):
    """A bar; a kind of it says what its point goes through, what its instrument shows, and how it moves with creep."""

    def for_search(self) -> Self:
        """The bar at the tolerance of a global search, at which strains err by some 1e-4 of themselves."""
        return self.replace(tolerance=max(self.tolerance, SEARCH_TOLERANCE))

    def model_text(self, histories: Sequence[History]) -> str:
        """How the bar is simulated, in sentences for a paper."""
        return (
            f"A bar is one material point. Its creep rate is integrated by {SDIRK4_TEXT}. The step is chosen "
            f"so that its local error is at most {self.tolerance:g} of the strain. {self.imposed_text} A bar ruptures "
            f"at a logarithmic creep strain of {self.strain_limit:g}, or where an internal variable reaches its limit "
            "or the creep rate diverges."
        )

    takes_values_of_tests: ClassVar[bool] = True

    imposed_text: ClassVar[str] = ""
    """What the point of such a bar goes through, in a sentence for a paper."""

    # ---- of each kind of bar --------------------------------------------------------------------------------------

    def point_test(self, history: History) -> PointTest:
        """What the material point of a history goes through."""
        raise NotImplementedError

    def observed_output(self, history: History, creep: Floats) -> Floats:
        """The output, (candidates, times); creep : (candidates, times) logarithmic creep strain."""
        raise NotImplementedError

    def output_derivative(self, history: History, creep: Floats) -> Floats:
        """Derivative of the output to the creep strain; both, as creep (candidates, times)."""
        raise NotImplementedError

    # ---- of every bar ---------------------------------------------------------------------------------------------

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> BarRun:
        """Run one test: what its history would show at its times, how it ended, and the states of the law."""
        theta = law.to_internal(law.values(values))
        result = self._integrate(law, theta, self._tests([plan]), False, keep_states=True)
        prediction = self._observed_prediction([plan], result)
        rows, status = prediction.values[0, 0, :, 0], Status(int(prediction.status[0, 0]))
        end, reason = float(prediction.end_times[0, 0]), integration.REASONS[int(result.terminations[0, 0])]
        run = run_from_outputs(BarRun, plan, self.outputs, rows[:, None], status, end, reason)
        reached = np.isin(plan.times, run.times)
        assert result.states is not None
        assert result.path is not None
        states = {symbol.name: result.states[0, reached, k] for k, symbol in enumerate(law.states)}
        own = {"creep_strain": result.of(0)[0, reached], "equivalent_strain": result.path[0, reached]}
        return replace(run, **own, states=states)

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict histories; theta : (candidates, parameters) internal values."""
        result = self._integrate(law, theta, self._tests(histories), sensitivities)
        return self._observed_prediction(histories, result)

    def _tests(self, histories: Sequence[History]) -> list[PointTest]:
        return [self.point_test(history) for history in histories]

    def _observed_prediction(self, histories: Sequence[History], result: Integration) -> Prediction:
        """What the instruments of the histories show of an integration."""
        parts = []
        for k, history in enumerate(histories):
            creep, frames = result.of(k), slice(result.starts[k], result.starts[k + 1])
            jacobian = None
            if result.jacobian is not None:
                derivative = self.output_derivative(history, creep)[..., None]
                jacobian = (result.jacobian[:, frames] * derivative)[:, :, None]
            values = self.observed_output(history, creep)[..., None]
            parts.append(HistoryPrediction(values, result.status[:, k], result.end_times[:, k], jacobian))
        return assemble_prediction(parts, histories, self.outputs, len(result.strain))

    def _integrate(
        self,
        law: CreepLaw,
        theta: Floats,
        tests: Sequence[PointTest],
        sensitivities: bool,
        *,
        keep_states: bool = False,
    ) -> Integration:
        kernel = kernels.lower(law, "compiled")
        return integration.integrate(
            kernel, theta, tests, settings=self.integration_settings(), jacobian=sensitivities, keep_states=keep_states
        )


def observed_strain(history: History, creep: Floats) -> Floats:
    """The strain that a history's instrument shows, (candidates, times).

    creep : (candidates, times) logarithmic creep strain.
    """
    strain = np.expm1(creep) if history.strain_measure == "engineering" else creep
    return strain + elastic_strain(history) if history.includes_elastic else strain


def elastic_strain(history: History) -> Floats:
    """Nominal stress over the modulus at each time, (times,)."""
    if history.elastic is None:
        return np.zeros(history.times.size)
    temperatures, which = np.unique(history.temperature_program().at(history.times), return_inverse=True)
    moduli = np.array([float(history.elastic.at(float(T)).E) for T in temperatures])
    return np.asarray(history.loading.program().at(history.times) / moduli[which])
