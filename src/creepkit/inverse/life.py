"""Tests compared over their whole life: their distance from the predicted curve, and when they break."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.distance import orthogonal_distance
from creepkit.inverse.entries import ObservationVector
from creepkit.inverse.together import CompositePredictor, predict, predictor_for
from creepkit.language import CreepLaw
from creepkit.records import History, TimesToStrain, Prediction, Predictor, SupportsRupturePrediction


@dataclass(frozen=True, eq=False)
class OrthogonalResiduals:
    """Residuals of candidates x tests x entries, and how they change with strain and with time.

    values : residuals. by_strain, by_time : derivatives to the compared strain at the frame's time, and to -ln of the
        time at which the measured strain is arrived at, or the specimen breaks.
    heard : which entries say anything: that a test was stopped says nothing of a candidate that lasts longer.
    """

    values: Floats
    strain_derivative: Floats
    time_derivative: Floats
    informative: Bools


def orthogonal_residuals(observations: ObservationVector, vertical: Floats, alive: Bools, prediction: Prediction) -> OrthogonalResiduals:
    """Residuals, given those in strain alone (`vertical`), and which frames the prediction lives to see."""
    unit, zeros = np.ones_like(vertical), np.zeros_like(vertical)
    if prediction.times_to_strain is None:
        return OrthogonalResiduals(vertical, unit, zeros, np.broadcast_to(observations.present, vertical.shape))
    life, frames = prediction.times_to_strain, observations.followed_to_rupture[:, None] & observations.present & ~observations.rupture_mask
    log_time_ratio = observations.log_times - _log_times(observations.select_frames(life.times))
    not_converged = ~alive & np.isneginf(log_time_ratio)  # it neither lives nor broke: the solver gave up
    curve_slope = observations.derivative(np.where(frames, observations.values, 1.0)) * observations.select_frames(life.log_time_derivatives)
    orthogonal = orthogonal_distance(np.where(alive | not_converged, vertical, np.inf), np.where(not_converged, -np.inf, log_time_ratio), curve_slope)
    values = np.where(frames, orthogonal.values, vertical)
    by_strain, by_time = np.where(frames, orthogonal.strain_derivative, unit), np.where(frames, orthogonal.time_derivative, zeros)
    return _with_rupture_times(observations, life, OrthogonalResiduals(values, by_strain, by_time, np.broadcast_to(unit > 0, unit.shape)))


def _with_rupture_times(observations: ObservationVector, life: TimesToStrain, frame_residuals: OrthogonalResiduals) -> OrthogonalResiduals:
    """The same with ln of measured over predicted rupture time; a stopped test counts where it outlasted that."""
    ruptured = np.isfinite(life.rupture_times)
    log_end_times = np.log(np.where(ruptured, life.rupture_times, life.horizon))
    log_time_ratio = np.where(observations.rupture_mask, observations.log_times - log_end_times[..., None], 0.0)
    uninformative = observations.rupture_mask & observations.censored[:, None] & (log_time_ratio <= 0.0)
    values = np.where(observations.rupture_mask, np.where(uninformative, 0.0, log_time_ratio), frame_residuals.values)
    rupture_derivative = np.where(ruptured[..., None] & ~uninformative, 1.0, 0.0)
    return OrthogonalResiduals(
        values,
        np.where(observations.rupture_mask, 0.0, frame_residuals.strain_derivative),
        np.where(observations.rupture_mask, rupture_derivative, frame_residuals.time_derivative),
        observations.present & ~uninformative,
    )


def time_jacobian(observations: ObservationVector, life: TimesToStrain) -> Floats:
    """Derivatives of -ln(time) of arrivals and ruptures to internal parameters.

    (candidates, tests, entries, parameters); zero where neither comes.
    """
    assert life.time_jacobian is not None
    assert life.rupture_jacobian is not None
    arrivals = observations.select_frames(life.time_jacobian)
    jacobian = -np.where(observations.rupture_mask[..., None], life.rupture_jacobian[:, :, None], arrivals)
    return np.where(np.isfinite(jacobian), jacobian, 0.0)


def offset_time_derivative(observations: ObservationVector, life: TimesToStrain) -> Floats:
    """Derivative of -ln(time of arrival) to an offset that is added to a prediction, (candidates, tests, entries)."""
    curve_slope = observations.select_frames(life.log_time_derivatives)
    positive_slope = np.where(np.isfinite(curve_slope) & (curve_slope > 0), curve_slope, np.inf)
    return np.where(observations.rupture_mask, 0.0, 1.0 / positive_slope)


def _log_times(times: Floats) -> Floats:
    """ln of times; of what never comes infinity."""
    with np.errstate(divide="ignore"):
        return np.where(np.isnan(times), np.inf, np.log(np.where(np.isnan(times), 1.0, times)))


def predict_to_rupture(
    using: Predictor, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], *,
    jacobian: bool = False,
) -> Prediction:  # fmt: skip
    """Predict with `life`; tests whose predictor follows none to rupture arrive nowhere and never break."""
    groups = using.groups(histories) if isinstance(using, CompositePredictor) else [(using, list(range(len(histories))))]
    group_predictions = []
    for predictor, tests in groups:
        group_histories = [histories[k] for k in tests]
        if isinstance(predictor, SupportsRupturePrediction):
            group_predictions.append((tests, predictor.predict_to_rupture(law, values, group_histories, jacobian=jacobian)))
        else:
            prediction = predict(predictor, law, values, group_histories, jacobian=jacobian)
            group_predictions.append((tests, replace(prediction, times_to_strain=_without_rupture(prediction, len(law.names)))))
    return group_predictions[0][1] if len(group_predictions) == 1 else CompositePredictor.concatenate(group_predictions, histories)


def _without_rupture(prediction: Prediction, parameters: int) -> TimesToStrain:
    """The life of what never ends."""
    shape = prediction.values.shape[:3]
    no_arrivals, no_ruptures = np.full(shape, np.nan), np.full(shape[:2], np.nan)
    jacobians = np.full((*shape, parameters), np.nan), np.full((*shape[:2], parameters), np.nan)
    return TimesToStrain(no_arrivals, np.full(shape, np.inf), no_ruptures, np.array([t[-1] for t in prediction.times]), *jacobians)


def check_explicit_nuisances(kinds: Sequence[str], observations: ObservationVector, histories: Sequence[History], predictor: Predictor) -> None:
    """Explicit nuisances have no place yet where tests are followed to rupture."""
    if not kinds or not observations.followed_to_rupture.any():
        return
    history = histories[int(np.argmax(observations.followed_to_rupture))]
    name = getattr(predictor_for(predictor, history), "name", "predictor")
    raise FitError(
        f"nuisance '{kinds[0]}' cannot be fitted beside tests that are followed to their end ('{history.name}', "
        f"{name}); leave it out, or forget how they ended: history.replace(rupture_time=None, unruptured=False)"
    )
