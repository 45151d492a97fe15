"""What uniaxial tests and relaxation share: prediction at a material point, nuisance parameters, elastic strain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import Bools, Floats, Ints
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

    creep_strain : (times,) logarithmic. states : {name: (times,)} internal variables of the law.
    """

    creep_strain: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
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

    def end_reason(self, history: History, reason: str, output: Floats, end: float) -> str:
        """Why a test ended at `end`, s, from what the integration says; output : (times,) up to there, then NaN.

        The integration says nothing, "", where it went on, and the output is not shown.
        """
        return reason

    # ---- of every bar ---------------------------------------------------------------------------------------------

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> BarRun:
        """Run one test: what its history would show at its times, how it ended, and the states of the law."""
        theta = law.to_internal(law.values(values))
        result = self._integrate(law, theta, self._tests([plan]), False, keep_states=True)
        prediction = self._observed_prediction([plan], result)
        rows, status = prediction.values[0, 0, :, 0], Status(int(prediction.status[0, 0]))
        end, hidden = float(prediction.end_times[0, 0]), (prediction.end_times != result.end_times).any()
        reason = "" if hidden else integration.REASONS[int(result.terminations[0, 0])]
        if status is not Status.COMPLETE:
            reason = self.end_reason(plan, reason, rows, end)
        run = run_from_outputs(BarRun, plan, self.outputs, rows[:, None], status, end, reason)
        reached = np.isin(plan.times, run.times)
        assert result.states is not None
        states = {symbol.name: result.states[0, reached, k] for k, symbol in enumerate(law.states)}
        return replace(run, creep_strain=result.of(0)[0, reached], states=states)

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
            values, status, ends = self.observed_output(history, creep), result.status[:, k], result.end_times[:, k]
            hidden = np.isnan(values) & np.isfinite(creep)
            if hidden.any():
                values, status, ends = _ended_where_hidden(hidden, values, status, ends, history.times)
            parts.append(HistoryPrediction(values[..., None], status, ends, jacobian))
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


def _ended_where_hidden(
    hidden: Bools, values: Floats, status: Ints, ends: Floats, times: Floats
) -> tuple[Floats, Ints, Floats]:
    """Values, status and ends where rows have ended at the last frame before one that no instrument shows.

    hidden, values : (candidates, times).
    """
    rows, first = np.asarray(hidden.any(axis=1)), hidden.argmax(axis=1)
    from_there_on = rows[:, None] & (np.arange(times.size) >= first[:, None])
    before = np.where(first > 0, times[first - 1], 0.0)
    return (
        np.where(from_there_on, np.nan, values),
        np.where(rows, int(Status.NOT_CONVERGED), status),
        np.where(rows, np.minimum(before, ends), ends),
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
