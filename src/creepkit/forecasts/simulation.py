"""The curves of one test for draws of the law, of the test's own rate and of its dimensions, and times along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import (
    outside_class,
    predict,
    predict_with_sensitivities,
    predictor_for,
    predicts_rupture,
    reduced_order_model_of,
    refined_of,
    search_predictor_of,
)
from creepkit.inverse.identification import Identification
from creepkit.inverse.rate_nuisances import law_with_rate_factors
from creepkit.inverse.single_values import EXTRAPOLATION_FACTOR
from creepkit.records import History, Prediction, Predictor, Status

FOLLOWED_TIMES, ADDED_TIMES = 300, 20
"""Geometrically spaced times at which a test is followed to its rupture, or to its last time, beside its own."""


FIRST_OF_FOLLOWED, FIRST_OF_ADDED = 1e-8, 1e-4
"""The first of them, over the last time of the test."""


@dataclass(frozen=True, eq=False)
class TestCurves:
    """Outputs of one test for draws.

    outputs : names. times : (times,) s. values : (draws, times, outputs) in the output's unit; NaN after a rupture.
    end_times : (draws,) s; infinite where the test lasts to its last time.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    outputs: tuple[str, ...]
    times: Floats
    values: Floats
    end_times: Floats

    def of(self, output: str) -> Floats:
        """(draws, times) of one output."""
        return np.asarray(self.values[..., self.outputs.index(output)])


def central_curves(
    fit: Identification, predictor: Predictor, history: History, dimensions: Mapping[str, float], log_factor: float
) -> tuple[TestCurves, dict[str, float]]:
    """The curve at the identified values, by the most exact predictor there is, and what is left of its error.

    dimensions : {kind: value}. log_factor : ln of a factor on its rate. Returns one draw, and {output: standard
    deviation} of the numerical error, in the output's unit: a tenth of what the refined predictor changes, and what
    predictors state of themselves.
    """
    theta = fit.coordinates.theta(fit.u)[None]
    nuisances = {kind: np.array([[value]]) for kind, value in dimensions.items()}
    coarse = curves(fit, predictor, history, theta, np.array([log_factor]), nuisances)
    refined = refined_of(predictor_for(predictor, history))
    stated = dict(getattr(predictor_for(predictor, history), "error", {}))
    if refined is None:
        return coarse, stated
    exact = curves(fit, refined, history, theta, np.array([log_factor]), nuisances)
    change = exact.values[0] - coarse.values[0]
    remaining = {
        name: REMAINING_DEFECT * float(np.sqrt(np.nanmean(change[:, k] ** 2)))
        for k, name in enumerate(exact.outputs)
        if np.isfinite(change[:, k]).any()
    }
    return exact, remaining


REMAINING_DEFECT = 0.1
"""Standard deviation of what is left of a corrected error, over its size (see inverse.defect_correction)."""


def drawing_predictor(fit: Identification, predictor: Predictor, history: History, kinds: Sequence[str]) -> Predictor:
    """A cheaper predictor for draws, which are then corrected at the identified values; itself where there is none."""
    own = predictor_for(predictor, history)
    cheaper = reduced_order_model_of(own)
    known = cheaper is not None and not outside_class(cheaper, fit.law)
    if cheaper is None or not known or not {*kinds} <= {*getattr(cheaper, "nuisances", ())}:
        return search_predictor_of(own)
    return search_predictor_of(cheaper)


def curves(
    fit: Identification,
    predictor: Predictor,
    history: History,
    theta: Floats,
    log_factor: Floats,
    nuisances: Mapping[str, Floats],
) -> TestCurves:
    """The curves of draws.

    theta : (draws, parameters) internal values. log_factor : (draws,) ln of a factor on every rate. nuisances : {kind:
    (draws, 1)}.
    """
    law, coefficients = fit.law, _coefficients_of_rates(fit)
    if coefficients:
        moved = theta.copy()
        moved[:, coefficients] += log_factor[:, None]
    else:
        law = law_with_rate_factors(law, ("rate",))
        moved = np.concatenate([theta, log_factor[:, None]], axis=1)
    return _curves_of(predict(predictor, law, moved, [history], nuisances=nuisances), history)


def _coefficients_of_rates(fit: Identification) -> list[int]:
    """Positions of the coefficients of all rates of the law; none where one of them has no coefficient of its own."""
    return list(fit.coordinates.coefficients) if fit.coordinates.every_rate_has_coefficient else []


@dataclass(frozen=True, eq=False)
class TestSensitivities:
    """Derivatives of the outputs of a test at the identified values, in the output's unit.

    outputs : names. coordinates : (times, outputs, parameters) to u. rate : (times, outputs) to ln of a factor on its
    rate. dimensions : {kind: (times, outputs)}.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    outputs: tuple[str, ...]
    coordinates: Floats
    rate: Floats
    dimensions: Mapping[str, Floats]


def sensitivities_at_values(
    fit: Identification, predictor: Predictor, history: History, dimensions: Mapping[str, float]
) -> TestSensitivities:
    """The derivatives of one test; dimensions : {kind: value}."""
    law, coefficients, theta = fit.law, _coefficients_of_rates(fit), fit.coordinates.theta(fit.u)
    if not coefficients:
        law, theta = law_with_rate_factors(law, ("rate",)), np.append(theta, 0.0)
    nuisances = {kind: np.array([[value]]) for kind, value in dimensions.items()}
    prediction = predict_with_sensitivities(predictor, law, theta, [history], nuisances)
    assert prediction.jacobian is not None
    jacobian = np.nan_to_num(prediction.jacobian[0, 0, : history.times.size])
    size = fit.u.size
    rate = jacobian[..., coefficients].sum(axis=-1) if coefficients else jacobian[..., -1]
    slopes = {
        kind: np.nan_to_num(values.reshape(-1, *values.shape[-2:])[0, : history.times.size])
        for kind, values in prediction.nuisance_jacobian.items()
    }
    to_u = jacobian[..., :size] @ fit.coordinates.jacobian(fit.u)
    return TestSensitivities(prediction.outputs, to_u, rate, slopes)


def _curves_of(prediction: Prediction, history: History) -> TestCurves:
    ended = prediction.status[:, 0] == Status.RUPTURED
    end_times = np.where(ended, prediction.end_times[:, 0], np.inf)
    values = np.array(prediction.values[:, 0, : history.times.size])
    failed = prediction.status[:, 0] == Status.NOT_CONVERGED
    finished = prediction.status[:, 0] == Status.COMPLETE
    if finished.any() and not np.isfinite(values[finished]).any():
        raise FitError(f"test '{history.name}': the predictor says that the test is complete, but gives no numbers")
    values[failed] = np.nan
    end_times[failed] = np.nan
    return TestCurves(prediction.outputs, history.times, values, end_times)


def drawn_theta(fit: Identification, u: Floats) -> Floats:
    """(draws, parameters) internal values of drawn coordinates u (draws, parameters), within the law's bounds."""
    low, high = fit.law.internal_bounds
    return np.clip(fit.coordinates.theta(u), low, high)


def corrected(drawn: TestCurves, at_values: TestCurves, exact: TestCurves) -> TestCurves:
    """Draws through a cheaper predictor, moved by its difference from the exact one at the identified values."""
    difference = exact.values[0] - at_values.values[0]
    ratio = exact.end_times[0] / at_values.end_times[0] if np.isfinite(exact.end_times[0]) else 1.0
    ratio = ratio if np.isfinite(ratio) else 1.0
    return replace(
        drawn,
        values=drawn.values + np.where(np.isfinite(difference), difference, 0.0),
        end_times=drawn.end_times * ratio,
    )


def followed_history(history: History, predictor: Predictor, kinds: Sequence[str] = ()) -> History:
    """The history at its own times and at times up to its rupture, far beyond where the specimen is followed to it.

    kinds : of nuisance parameters that are drawn. A drift is one over the test: with it nothing is followed beyond.
    """
    last = max(float(history.times[-1]), history.rupture_time or 0.0)
    far = predicts_rupture(predictor, history) and not any("drift" in kind for kind in kinds)
    horizon, count = (EXTRAPOLATION_FACTOR * last, FOLLOWED_TIMES) if far else (last, ADDED_TIMES)
    times = np.geomspace((FIRST_OF_FOLLOWED if far else FIRST_OF_ADDED) * last, horizon, count)
    return history.replace(times=np.union1d(times, history.times), outputs={}, standard_deviation={})


def at_times(followed: TestCurves, times: Floats) -> TestCurves:
    """The curves at some of their times; times : (times,) s."""
    return replace(followed, times=times, values=followed.values[:, np.searchsorted(followed.times, times)])


def crossing_times(drawn: TestCurves, output: str, targets: Floats, *, rising: bool | None = None) -> Floats:
    """(draws,) s, when an output first reaches targets (draws,): from below where it is `rising`, else from above.

    rising : by default whether the first value of a draw lies below its target. The rupture where that comes first;
    infinite where neither comes, NaN where the prediction failed.
    """
    values, times = drawn.of(output), drawn.times
    result = np.where(np.isnan(drawn.end_times), np.nan, drawn.end_times)
    for k in range(len(values)):
        result[k] = min(first_crossing(times, values[k], float(targets[k]), rising), result[k])
    return np.asarray(result)


def first_crossing(times: Floats, values: Floats, target: float, rising: bool | None = None) -> float:
    """s, when values first reach a target from the side on which they begin; infinite where they do not.

    rising : whether that is from below; a rising output that begins beyond its target has reached it at once.
    times : (times,) s. values : (times,) in the unit of the target.
    """
    counted = np.isfinite(values) & (times > 0)
    times, values = times[counted], values[counted]
    if not values.size:
        return float("inf")
    sign = 1.0 if (values[0] <= target if rising is None else rising) else -1.0
    reached = np.flatnonzero(sign * (values - target) >= 0.0)
    if not reached.size:
        return float("inf")
    j = int(reached[0])
    if j == 0:  # before the first time an output is taken to be in proportion to time
        return float(times[0] * max(target, 0.0) / values[0]) if sign > 0 and values[0] > 0 else float(times[0])
    below, above = values[j - 1], values[j]
    positive = min(below, above, target) > 0
    share = np.log(target / below) / np.log(above / below) if positive else (target - below) / (above - below)
    return float(times[j - 1] * (times[j] / times[j - 1]) ** share)
