"""What uniaxial tests and relaxation share: prediction at a material point, nuisance parameters, elastic strain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import SolveError
from creepkit.integration.time_discretisation import SDIRK4_TEXT
from creepkit.records import (
    History,
    HistoryPrediction,
    Load,
    NuisanceValues,
    Output,
    Prediction,
    Status,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
)
from creepkit.specimens.run import Run, run_from_outputs
from creepkit.specimens.settings_checks import check_number, check_whole_number
from creepkit.specimens.test_piece import BASIC_NUISANCES, warmer_and_stiffer

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest
    from creepkit.language import CreepLaw


SEARCH_TOLERANCE = 1e-3
"""Tolerance of the integration in a global search; creep of bars scatters by a thousand times as much."""


NUISANCES = BASIC_NUISANCES


@dataclass(frozen=True, eq=False, kw_only=True)
class BarRun(Run):
    """A simulated bar, at the times of the run.

    creep_strain : (times,) logarithmic. states : {name: (times,)} internal variables of the law.
    """

    creep_strain: Floats = field(default_factory=lambda: np.zeros(0), repr=False)
    states: Mapping[str, Floats] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Bar:
    """A bar; a kind of it says what its point goes through, what its instrument shows, and how that moves with creep.

    tolerance : relative local error of a step of the integration; the output is then within about ten times of it.
    strain_limit : logarithmic creep strain at which the bar has ruptured.
    max_steps : cap on the steps of one history, beside 20 for each further straight piece of its programs.
    """

    tolerance: float = 1e-5
    strain_limit: float = 1.0
    max_steps: int = 2000

    name: ClassVar[str]
    title: ClassVar[str]
    outputs: ClassVar[tuple[Output, ...]]
    loads: ClassVar[tuple[Load, ...]]
    nuisances: ClassVar[tuple[str, ...]] = NUISANCES
    """Kinds of explicit nuisances that predict() understands."""

    def __post_init__(self) -> None:
        check_number(self.name, "tolerance", self.tolerance, "1e-13 to 1e-2")
        check_number(self.name, "strain_limit", self.strain_limit, "above 0, up to 10")
        check_whole_number(self.name, "max_steps", self.max_steps, "10 to 10 000 000")
        if not 1e-13 <= self.tolerance <= 1e-2:
            raise SolveError(f"{self.name} specimen: tolerance is {self.tolerance:g}; allowed are 1e-13 to 1e-2")
        if not 0 < self.strain_limit <= 10:
            raise SolveError(
                f"{self.name} specimen: strain_limit is {self.strain_limit:g}; allowed is above 0, up to 10"
            )
        if not 10 <= self.max_steps <= 10_000_000:
            raise SolveError(f"{self.name} specimen: max_steps is {self.max_steps}; allowed are 10 to 10 000 000")

    def replace(self, **changes: float) -> Self:
        """The same specimen with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def for_search(self) -> Self:
        """The bar at the tolerance of a global search, at which strains err by some 1e-4 of themselves."""
        return self.replace(tolerance=max(self.tolerance, SEARCH_TOLERANCE))

    def model_text(self, histories: Sequence[History]) -> str:
        """How the bar is simulated, in sentences for a paper."""
        return (
            f"A bar is one material point, whose creep rate is integrated in time by {SDIRK4_TEXT}; the step is chosen "
            f"so that its local error is at most {self.tolerance:g} of the strain. {self.imposed_text} A bar is taken "
            f"to rupture at a logarithmic creep strain of {self.strain_limit:g}, or where an internal variable reaches "
            "its limit or the creep rate diverges."
        )

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

    def modulus_derivative(
        self, result: Prediction, histories: Sequence[History], modulus_changes: Floats
    ) -> Floats | None:
        """Derivative of the values, (candidates, tests, times, 1), to the relative change of the modulus.

        modulus_changes : (tests,) the changes themselves. None leaves the derivative to differences.
        """
        return None

    def end_reason(self, history: History, reason: str, output: Floats, end: float) -> str:
        """Why a test ended at `end`, s, from what the integration says; output : (times,) up to there, then NaN.

        The integration says nothing, "", where it went on, and the output is not shown.
        """
        return reason

    # ---- of every bar ---------------------------------------------------------------------------------------------

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict the output of each history at its times; see records.Predictor.

        theta : (candidates, parameters) internal values.
        nuisances : "temperature" (K above what the history says) and "modulus" (relative change).
        """
        predict_plain = partial(self._predict, law)
        return predict_with_nuisances(
            predict_plain,
            theta,
            histories,
            nuisances,
            sensitivities,
            modulus_derivative=self.modulus_derivative,
            specimen=self.name,
        )

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

    def _predict(self, law: CreepLaw, theta: Floats, histories: Sequence[History], sensitivities: bool) -> Prediction:
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
        settings = integration.IntegrationSettings(
            rtol=self.tolerance, strain_limit=self.strain_limit, max_steps=int(self.max_steps)
        )
        return integration.integrate(
            kernel, theta, tests, settings=settings, jacobian=sensitivities, keep_states=keep_states
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


DIFFERENCE_STEPS = {"temperature": 0.1, "modulus": 1e-3}
"""Of central differences: K, and relative."""


PlainPredict = Callable[[Floats, Sequence[History], bool], Prediction]
"""Predict histories for theta (candidates, parameters), with sensitivities or without."""


ModulusDerivative = Callable[[Prediction, Sequence[History], Floats], Floats | None]
"""Derivative of the values to the relative change of the modulus; None where it is not known exactly."""


def predict_with_nuisances(
    predict_plain: PlainPredict,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues | None,
    sensitivities: bool,
    *,
    modulus_derivative: ModulusDerivative | None = None,
    specimen: str = "uniaxial",
) -> Prediction:
    """Predict with nuisances, if there are any, a candidate at a time where they differ from candidate to candidate.

    theta : (candidates, parameters) internal values.
    Derivatives are central differences, of 0.1 K and of a thousandth of the modulus to each side, but for that to the
    modulus where `modulus_derivative` gives it.
    """
    if not nuisances:
        return predict_plain(theta, histories, sensitivities)
    check_nuisances(nuisances, NUISANCES, f"a {specimen} specimen")
    if max(len(v) for v in nuisances.values()) == 1:
        shared_nuisances = {kind: v[0] for kind, v in nuisances.items()}
        return _predict_one(predict_plain, theta, histories, shared_nuisances, sensitivities, modulus_derivative)
    parts = []
    theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
    for row in range(len(theta)):
        candidate_nuisances = {kind: v[row] for kind, v in nuisances.items()}
        parts.append(
            _predict_one(
                predict_plain, theta[row : row + 1], histories, candidate_nuisances, sensitivities, modulus_derivative
            )
        )
    return _concatenated(parts)


def _predict_one(
    predict_plain: PlainPredict,
    theta: Floats,
    histories: Sequence[History],
    nuisances: Mapping[str, Floats],
    sensitivities: bool,
    modulus_derivative: ModulusDerivative | None,
) -> Prediction:
    result = predict_plain(theta, _perturbed_histories(histories, nuisances), sensitivities)
    if not sensitivities:
        return result
    slopes = {}
    for kind in nuisances:
        exact = modulus_derivative if kind == "modulus" else None
        slope = None if exact is None else exact(result, _perturbed_histories(histories, nuisances), nuisances[kind])
        if slope is not None:
            slopes[kind] = slope
            continue
        ends = (
            _perturbed_histories(histories, {**nuisances, kind: nuisances[kind] + s})
            for s in (DIFFERENCE_STEPS[kind], -DIFFERENCE_STEPS[kind])
        )
        up, down = (predict_plain(theta, moved, False).values for moved in ends)
        slopes[kind] = (up - down) / (2 * DIFFERENCE_STEPS[kind])
    return replace(result, nuisance_jacobian=slopes)


def _perturbed_histories(histories: Sequence[History], nuisances: Mapping[str, Floats]) -> list[History]:
    """Histories that are so many K warmer, with moduli larger by these shares."""
    zeros = np.zeros(len(histories))
    temperature_changes, modulus_changes = nuisances.get("temperature", zeros), nuisances.get("modulus", zeros)
    changes = zip(histories, temperature_changes, modulus_changes, strict=True)
    return [warmer_and_stiffer(history, float(T), float(share)) for history, T, share in changes]


def _concatenated(parts: Sequence[Prediction]) -> Prediction:
    def joined(arrays: Sequence[Floats]) -> Floats:
        return np.concatenate(arrays)

    jacobians = [p.jacobian for p in parts if p.jacobian is not None]
    return replace(
        parts[0],
        values=joined([p.values for p in parts]),
        status=np.concatenate([p.status for p in parts]),
        end_times=joined([p.end_times for p in parts]),
        jacobian=joined(jacobians) if jacobians else None,
        nuisance_jacobian={
            kind: joined([p.nuisance_jacobian[kind] for p in parts]) for kind in parts[0].nuisance_jacobian
        },
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


def isothermal_elasticity(history: History, specimen: str) -> tuple[float, float]:
    """E, MPa, and nu of a test whose strain is prescribed: they must be the same at all its temperatures."""
    where = history.origin
    if history.elastic is None:
        raise SolveError(
            f"{where}: a {specimen} specimen under prescribed strain needs elastic data; set elastic=Elastic(E=150e3), "
            "in MPa"
        )
    result = [history.elastic.at(float(T)) for T in np.unique(history.temperature_program().values)]
    moduli = [float(one.E) for one in result]
    if max(moduli) - min(moduli) > 1e-12 * max(moduli):
        raise SolveError(
            f"{where}: the modulus changes from {moduli[0]:g} to {moduli[-1]:g} MPa with the temperature of the test; "
            f"a {specimen} specimen takes one modulus a test, such as elastic.at(T)"
        )
    return moduli[0], float(result[0].nu)
