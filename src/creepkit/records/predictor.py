"""Predictor: anything that predicts histories from a law and its internal values, and what it has by default.

A kind of it writes `predict_batch`. Checks, nuisance parameters of programs and rates, which become other histories and
a law with rate factors, and central differences in the place of derivatives that it does not give are here, for all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from creepkit.errors import SolveError
from creepkit.records.conditions import of_parameters, with_values_of_tests
from creepkit.records.nuisance_programs import with_changed_history
from creepkit.records.plugin_calls import call_of_plugin
from creepkit.records.prediction import (
    PROGRAM_NUISANCES,
    RATE_NUISANCES,
    NuisanceValues,
    Prediction,
    Status,
    TimesToStrain,
    is_length_nuisance,
    kind_and_start,
)
from creepkit.records.prediction_assembly import broadcast_candidates, concatenated_candidates, concatenated_tests
from creepkit.records.specimen_lookup import outputs_of_tests

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.language.law import CreepLaw
    from creepkit.records.history import History
    from creepkit.records.specimen_record import Dimension, Load

RELATIVE_STEP = 1e-4
"""Of internal parameters (ln of a coefficient, an exponent), relative to the larger of their size and one."""


NUISANCE_STEPS = {
    **{"modulus": 1e-3, "temperature": 0.1},
    **{"temperature step": 1.0, "temperature drift": 1.0, "rate step": 0.02, "rate drift": 0.02, "load step": 5e-3},
}
"""relative, K, K, K, ln, ln, relative: of central differences, well above the error of a solver's steps."""


LENGTH_STEP = 2e-3
"""The same for lengths, relative."""


class Predictor:
    """Anything that predicts histories from a law and its internal values: specimen, surrogate or closed form.

    outputs : names of what is predicted, first the one that grows with creep. optional_outputs : all others that a test
        may have, where it decides what is observed of it. loads, dimensions : what is imposed, and lengths.
    nuisances : kinds of explicit nuisances that it follows, beside those of programs and rates, which all follow.
    conditions : {load, "modulus", "temperature", "end_time" or length: (lowest, highest)}, the default ranges of data
        sets, in their units.
    error : {output: standard deviation of its numerical error}, in the output's unit.
    follows_to_rupture : whether predict_to_rupture() goes beyond the last time of a history.
    takes_values_of_tests : whether predict_batch() takes theta (candidates, tests, parameters), where tests differ in
        the values of the law; without, it is called for each test by itself there.
    is_trained : whether train() prepares it before it predicts. is_surrogate : whether it is a trained network.
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    outputs: ClassVar[tuple[str, ...]] = ()
    optional_outputs: ClassVar[tuple[str, ...]] = ()
    loads: ClassVar[tuple[Load, ...]] = ()
    dimensions: ClassVar[tuple[Dimension, ...]] = ()
    nuisances: ClassVar[tuple[str, ...]] = ()
    error: ClassVar[Mapping[str, float]] = {}
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = {}
    follows_to_rupture: ClassVar[bool] = False
    takes_values_of_tests: ClassVar[bool] = False
    is_trained: ClassVar[bool] = False
    is_surrogate: ClassVar[bool] = False

    @property
    def label(self) -> str:
        """Its name, or that of its class."""
        return self.name or type(self).__name__

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict each history's outputs at its times.

        theta : (candidates, parameters) internal values. nuisances : {key: (candidates, tests)} of `own_nuisances`.
        sensitivities : whether derivatives are wanted; what of them is left out is had by differences.
        """
        raise SolveError(f"{type(self).__name__} has no predict_batch(); write one that returns a ck.Prediction")

    # ---- what a kind of it may say of itself ---------------------------------------------------------------------

    @property
    def own_nuisances(self) -> tuple[str, ...]:
        """Kinds of nuisances whose values predict_batch() is given; other histories stand for those it is not."""
        return self.nuisances

    @cached_property
    def specimen(self) -> Any:
        """The specimen that it stands for; it is its own."""
        return self

    def outputs_of_test(self, history: History) -> tuple[str, ...]:
        """The outputs of one test; SolveError where it has outputs that its operator does not give."""
        return self.outputs

    def reference_stress(self, history: History) -> Any:
        """The von Mises stress that stands for a test, MPa, (levels,) or a number; None where nothing says so."""
        return None if self.specimen is self else self.specimen.reference_stress(history)

    def simulated_stress(self, law: CreepLaw, values: Mapping[str, float], history: History) -> Any:
        """The stress that stands for a test while it creeps, MPa, (levels,): all that it goes through, by simulation.

        By default what reference_stress() makes of the outputs, those simulated of a test that has none.
        """
        if self.specimen is not self:
            return self.specimen.simulated_stress(law, values, history)
        simulated = None if history.outputs else self.run(law, values, history)
        return self.reference_stress(history if simulated is None else simulated)

    def reference_strain(self, history: History) -> Any:
        """The largest creep strain that a test reached, as its outputs show; None where it does not say."""
        return None if self.specimen is self else self.specimen.reference_strain(history)

    def growth_per_strain(self, history: History) -> Any:
        """Increase of the leading output for a creep strain of one, in its unit; None where it does not say."""
        return None if self.specimen is self else self.specimen.growth_per_strain(history)

    def model_text(self, histories: Sequence[History]) -> str:
        """How it predicts these tests, in sentences for a paper; "" where it does not say."""
        return ""

    def reduced_order_model(self) -> Predictor | None:
        """A cheap model of the same outputs and nuisances, which may be some per cent off; None where it has none."""
        return None

    def refined(self) -> Predictor | None:
        """A more exact predictor of the same outputs and nuisances: on a finer mesh, or the specimen of a surrogate."""
        return None

    def for_search(self) -> Predictor:
        """The same predictor at the tolerances that a global search for minima needs."""
        return self

    def single_threaded(self) -> Predictor:
        """The same predictor, which starts no threads."""
        return self

    def outside_class(self, law: CreepLaw) -> str:
        """Why it does not know the class of a law, in a sentence; "" where it does, or knows every law."""
        return ""

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> Any:
        """Run one test and keep more than its outputs; None where there is no more."""
        return None

    def train(self) -> str:
        """Train it, where that was not done before, and keep it; what it is, in a few words."""
        return ""

    def states(self, method: str) -> bool:
        """Whether its class writes a method that says nothing by default."""
        return getattr(type(self), method) is not getattr(Predictor, method)

    # ---- of several predictors as one -----------------------------------------------------------------------------

    @property
    def parts(self) -> Mapping[str, Predictor]:
        """{name of the specimen: predictor of its tests}, of one that is made of several; {} of any other."""
        return {}

    def for_history(self, history: History) -> Predictor:
        """The predictor of one history."""
        return self

    def for_law(self, law: CreepLaw) -> Predictor:
        """The predictor itself, or its specimen where the law is outside the class of laws that it knows."""
        return self.specimen if self.outside_class(law) else self

    # ---- predictions -------------------------------------------------------------------------------------------------

    def follows(self, key: str) -> bool:
        """Whether it knows an explicit nuisance."""
        kind = kind_and_start(key)[0]
        return kind in (*self.nuisances, *PROGRAM_NUISANCES, *RATE_NUISANCES)

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict each history's outputs at its times.

        theta : (candidates, parameters) internal values in the order of law.names, see CreepLaw.to_internal: the
            natural logarithm where the scale is log, -inf for a coefficient that is off; (candidates, tests,
            parameters) where tests have values of their own.
        nuisances : {key: (candidates or 1, tests)} of what differs from test to test, measured as Nuisance says. A
            kind that the predictor does not know is a SolveError.
        sensitivities : whether the prediction has its derivatives with respect to theta, in `jacobian`, and to the
            kinds of nuisances given, in `nuisance_jacobian`.
        """
        for key in nuisances or {}:
            if not self.follows(key):
                known = ", ".join(self.nuisances) or "none"
                raise SolveError(
                    f"{self.label} does not know the nuisance '{kind_and_start(key)[0]}'; it knows {known}"
                )
        given, count = dict(nuisances or {}), theta.shape[-1]
        law, theta = with_values_of_tests(law, theta, histories)
        prediction = self._predict(law, theta, histories, given, sensitivities)
        if sensitivities:
            prediction = self._with_differences(prediction, law, theta, histories, given)
        return of_parameters(prediction, count) if theta.shape[-1] > count else prediction

    def predict_to_rupture(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], *, sensitivities: bool = False
    ) -> Prediction:
        """Predict as predict() does, with `times_to_strain`: when measured strains are reached, and when it ruptures.

        theta : (candidates[, tests], parameters) internal values. Where specimens are not followed to rupture, no
        strain is reached, and they never break.
        """
        law, extended = with_values_of_tests(law, theta, histories)
        prediction = self._predict_to_rupture(law, extended, histories, sensitivities)
        return prediction if extended is theta else of_parameters(prediction, theta.shape[-1])

    def _predict_to_rupture(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], sensitivities: bool
    ) -> Prediction:
        """predict_to_rupture() of a law without conditions; a kind of it that follows ruptures writes this one."""
        prediction = self.predict(law, theta, histories, sensitivities=sensitivities)
        shape, count = prediction.values.shape[:3], theta.shape[-1]
        never = TimesToStrain(
            np.full(shape, np.nan),
            np.full(shape, np.inf),
            np.full(shape[:2], np.nan),
            np.array([h.times[-1] for h in histories]),
            np.full((*shape, count), np.nan),
            np.full((*shape[:2], count), np.nan),
        )
        return replace(prediction, times_to_strain=never)

    def _predict(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """By predict_batch(), with other histories and another law in the place of nuisances that it is not given."""
        own = {key: v for key, v in nuisances.items() if kind_and_start(key)[0] in self.own_nuisances}
        others = {key: v for key, v in nuisances.items() if key not in own}
        if max((len(v) for v in others.values()), default=1) > 1:
            theta, every = broadcast_candidates(theta, nuisances, len(histories))
            joint = np.stack([every[key] for key in others], axis=-1).reshape(len(theta), -1)
            ends = [0, *(np.flatnonzero((np.diff(joint, axis=0) != 0.0).any(axis=1)) + 1), len(theta)]
            batches = []  # consecutive candidates with the same programs
            for first, end in pairwise(ends):
                of_batch = {key: v[first : first + 1 if key in others else end] for key, v in every.items()}
                batches.append(self._predict(law, theta[first:end], histories, of_batch, sensitivities))
            return concatenated_candidates(batches)
        if not others:
            return self._checked_batch(law, theta, histories, own, sensitivities)
        of_tests = [{key: float(v[0, k]) for key, v in others.items()} for k in range(len(histories))]
        changed = [with_changed_history(h, values) for h, values in zip(histories, of_tests, strict=True)]
        keys = tuple(key for key in others if kind_and_start(key)[0] in RATE_NUISANCES)
        if not keys:
            return self._checked_batch(law, theta, changed, own, sensitivities)
        from creepkit.records.rate_nuisances import law_with_rate_factors, rate_parameters

        law, count = law_with_rate_factors(law, keys), theta.shape[-1]
        factors, scales = rate_parameters(keys, np.array([[v[key] for key in keys] for v in of_tests]), changed)
        if theta.ndim == 2 and (factors == factors[0]).all():
            factors = factors[0]
        elif theta.ndim == 2:
            theta = np.repeat(theta[:, None], len(histories), axis=1)
        extended = np.concatenate([theta, np.broadcast_to(factors, (*theta.shape[:-1], len(keys)))], axis=-1)
        prediction = self._checked_batch(law, extended, changed, own, sensitivities)
        if prediction.jacobian is None:
            return prediction
        by_parameter, by_rate = np.split(prediction.jacobian, [count], axis=-1)
        slopes = {key: by_rate[..., k] * scales[:, k, None, None] for k, key in enumerate(keys)}
        merged = {**prediction.nuisance_jacobian, **slopes}
        return replace(prediction, jacobian=by_parameter, nuisance_jacobian=merged)

    def _checked_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
        if theta.ndim == 3 and not self.takes_values_of_tests:
            of_tests = [{key: values[:, [k]] for key, values in nuisances.items()} for k in range(len(histories))]
            single = [
                ([k], self._checked_batch(law, theta[:, k], [history], of_tests[k], sensitivities))
                for k, history in enumerate(histories)
            ]
            return concatenated_tests(single, histories)
        prediction = call_of_plugin(
            lambda: self.predict_batch(law, theta, histories, nuisances, sensitivities),
            self,
            f"predictor '{self.label}': predict_batch()",
            SolveError,
        )
        return checked_prediction(prediction, self, histories, len(theta), theta.shape[-1])

    def _with_differences(
        self, prediction: Prediction, law: CreepLaw, theta: Floats, histories: Sequence[History], given: NuisanceValues
    ) -> Prediction:
        """The prediction with the derivatives that it lacks, by central differences of all candidates at once."""
        kinds = [key for key in given if key not in prediction.nuisance_jacobian]
        numeric = prediction.jacobian is None
        if not (numeric or kinds):
            return prediction
        theta, nuisances = broadcast_candidates(theta, given, len(histories))
        on = np.isfinite(theta)  # a coefficient that is off stays off, and has a derivative of zero
        sizes = np.moveaxis(np.abs(np.where(on, theta, 0.0)), -1, 0)
        steps = RELATIVE_STEP * np.maximum(sizes, 1.0) if numeric else sizes[:0]
        own_steps = [_nuisance_step(key, nuisances[key]) for key in kinds]
        count, size = len(steps) + len(kinds), len(theta)
        moved = np.zeros(
            (count, *theta.shape)
        )  # one step in each parameter, then in each nuisance of all tests at once
        for p, step in enumerate(steps):
            moved[p, ..., p] = step
        shifted = {key: np.tile(values, (2, count, 1, 1)) for key, values in nuisances.items()}
        for k, (key, step) in enumerate(zip(kinds, own_steps, strict=True), len(steps)):
            shifted[key][0, k] += step
            shifted[key][1, k] -= step
        ends = np.stack([theta + moved, theta - moved]).reshape(-1, *theta.shape[1:])
        flat = {key: values.reshape(2 * count * size, -1) for key, values in shifted.items()}
        values = self._predict(law, ends, histories, flat, False).values
        with np.errstate(invalid="ignore"):  # of values that are not finite, whose derivatives are NaN
            up, down = values.reshape(2, count, size, *values.shape[1:])
            differences = up - down
        slopes = {key: differences[len(steps) + k] / (2 * own_steps[k]) for k, key in enumerate(kinds)}
        jacobian = prediction.jacobian
        if numeric:
            widths = 2 * steps.reshape(*steps.shape, *(1,) * (differences.ndim - steps.ndim))
            jacobian = np.moveaxis(differences[: len(steps)] / widths, 0, -1)
        return replace(prediction, jacobian=jacobian, nuisance_jacobian={**prediction.nuisance_jacobian, **slopes})


def _nuisance_step(key: str, values: Floats) -> float:
    """The step of central differences in a nuisance; values : (candidates, tests), of a length in mm."""
    kind = kind_and_start(key)[0]
    return LENGTH_STEP * float(np.max(np.abs(values))) if is_length_nuisance(kind) else NUISANCE_STEPS[kind]


_REAL, _WHOLE, _NUMERIC = "f", "iu", "fiu"
"""Kinds of numbers, as numpy names them."""


_IN_WORDS = {_REAL: "real floating point numbers", _WHOLE: "whole numbers", _NUMERIC: "real numbers"}


def checked_prediction(
    prediction: Any, predictor: Predictor, histories: Sequence[History], candidates: int, parameters: int
) -> Prediction:
    """The prediction itself; SolveError, naming the predictor, unless it is one of so many candidates and parameters.

    candidates : rows of theta, or of the nuisances where these are more.
    """
    who = f"predictor '{predictor.label}'"
    if not isinstance(prediction, Prediction):
        raise SolveError(
            f"{who} returned a {type(prediction).__name__} from predict_batch(); it must return a Prediction"
        )
    names = outputs_of_tests(predictor, histories) or tuple(prediction.outputs)
    if tuple(prediction.outputs) != names:
        found = ", ".join(map(str, prediction.outputs)) or "none"
        raise SolveError(
            f"{who} predicted the outputs {found}; it must predict those that it names, {', '.join(names)}"
        )
    tests = (candidates, len(histories))
    frames = (*tests, max((h.times.size for h in histories), default=0), len(names))
    _check_array(who, "values", prediction.values, frames, _REAL)
    _check_array(who, "lengths", prediction.lengths, tests[1:], _WHOLE)
    _check_array(who, "status", prediction.status, tests, _WHOLE)
    _check_array(who, "end_times", prediction.end_times, tests, _NUMERIC)
    if prediction.jacobian is not None:
        _check_array(who, "jacobian", prediction.jacobian, (*frames, parameters), _REAL)
    for key, derivative in prediction.nuisance_jacobian.items():
        _check_array(who, f"nuisance_jacobian['{key}']", derivative, frames, _REAL)
    if prediction.status.size and not 0 <= prediction.status.min() <= prediction.status.max() < len(Status):
        unknown = next(int(code) for code in prediction.status.flat if not 0 <= code < len(Status))
        known = ", ".join(f"{int(status)} ({status.text})" for status in Status)
        raise SolveError(f"{who} returned the status {unknown}; known are {known}")
    lengths = [h.times.size for h in histories]
    if prediction.lengths.tolist() != lengths:
        raise SolveError(
            f"{who} returned the lengths {prediction.lengths.tolist()}; they must be the numbers of times of the "
            f"histories, {lengths}"
        )
    return prediction


def _check_array(who: str, name: str, array: object, shape: tuple[int, ...], kinds: str) -> None:
    if not isinstance(array, np.ndarray):
        raise SolveError(f"{who} returned a {type(array).__name__} as {name}; it must be an array of shape {shape}")
    if array.shape != shape:
        raise SolveError(f"{who} returned {name} of shape {array.shape}; it must be {shape} for what was asked")
    if array.dtype.kind not in kinds:
        raise SolveError(f"{who} returned {name} of type {array.dtype}; it must hold {_IN_WORDS[kinds]}")
