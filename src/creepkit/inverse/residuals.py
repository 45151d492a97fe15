"""Residuals: transformed predictions less transformed observations of all tests, with their derivatives.

After a predicted rupture the transformed output grows on with ln of time over rupture time, so that residuals are
finite and their derivatives lead back to values at which the specimen lasts.

Of tests that were followed to rupture, or whose rate rises, residuals are orthogonal: near rupture strain grows without
limit within almost no time, and an error in strain has no meaning. What counts is the distance of a measured point from
the predicted curve, in strain and in the logarithm of time, in units of both errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_model import Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, ObservationVector
from creepkit.inverse.output_transforms import LinearTransform
from creepkit.records import Prediction, TimesToStrain

SLOPE_AFTER_RUPTURE = 3.0
"""Growth of the transformed output per unit of ln(t / t_rupture) after a predicted rupture."""


SMALLEST_INCREASE = 0.01
"""Of a transformed output since the first frame: smaller increases say nothing about the creep rate."""


SMALLEST_DISTANCE = 1e-7
"""Below this distance the ratio of the errors is the slope of the curve."""


@dataclass(frozen=True, eq=False)
class OrthogonalDistance:
    """The orthogonal distance of points from a curve, in units of their errors.

    values : (...,) -, the distance r, with its sign.
    strain_derivative, time_derivative : (...,) -, its derivatives to the error in strain and to that in ln time.
    """

    values: Floats
    strain_derivative: Floats
    time_derivative: Floats


def orthogonal_distance(strain_residual: Floats, time_residual: Floats, curve_slope: Floats) -> OrthogonalDistance:
    """The distance of points from a curve, given their errors, of which one may be infinite but not both.

    strain_residual, time_residual : (...,) -, errors in transformed strain and in ln time.
    curve_slope : (...,) -, d(transformed strain) / d(ln time) of the predicted curve, infinite at rupture.
    """
    a, b = np.abs(strain_residual), np.abs(time_residual)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        ratio = np.where(np.maximum(np.minimum(a, b), 0.0) > SMALLEST_DISTANCE, a / b, np.maximum(curve_slope, 0.0))
        ratio = np.where(np.isinf(b), 0.0, np.where(np.isinf(a), np.inf, ratio))
        strain_weight, time_weight = 1.0 / np.hypot(1.0, ratio), 1.0 / np.hypot(1.0, 1.0 / ratio)
    sign = np.where(np.isinf(a), np.sign(time_residual), np.sign(strain_residual))
    by_strain, by_time = (np.where(np.isinf(e), 0.0, e) * w for e, w in ((a, strain_weight), (b, time_weight)))
    magnitude = np.where(strain_weight >= time_weight, by_strain, by_time)
    return OrthogonalDistance(
        np.sqrt(2.0) * sign * magnitude, np.sqrt(2.0) * strain_weight**3, np.sqrt(2.0) * time_weight**3
    )


def residuals_at_measured_values(observations: ObservationVector) -> Residuals:
    """Residuals of zero with the derivatives at the measured values: a covariance exists before any prediction."""
    derivatives = np.where(observations.present, observations.derivative(observations.values), 0.0)
    strains = observations.direction * np.maximum(observations.direction * observations.values, 0.0)
    zero, rates = np.zeros_like(derivatives), derivatives * strains
    return _masked_residuals(observations, zero, derivatives, np.zeros((*zero.shape, 0)), rates)


def candidate_residuals(
    observations: ObservationVector, prediction: Prediction, correction: Floats | None = None
) -> tuple[Floats, Floats | None]:
    """Residuals of all candidates, zero where there are no data; with derivatives to internal parameters.

    correction : (tests, observations) in the output's unit, what is added to predictions. Returns residuals
    (candidates, tests, observations), and derivatives (candidates, tests, observations, parameters) for tests that are
    not followed to rupture, None of a prediction without them.
    """
    predicted = _predicted_values(observations, prediction, correction)
    values = np.where(observations.present, _distance(observations, predicted, prediction).values, 0.0)
    if prediction.jacobian is None:
        return values, None
    jacobian = observations.select_outputs(prediction.jacobian, prediction)
    return values, _transformed_jacobian(observations, predicted, jacobian)


def residuals_of_prediction(
    observations: ObservationVector,
    prediction: Prediction,
    nuisance_parameters: NuisanceParameters,
    coefficients: tuple[Sequence[int] | None, Sequence[int]],
    correction: Floats | None = None,
) -> Residuals:
    """Residuals of one candidate, with derivatives to internal parameters and nuisance parameters.

    coefficients : positions of the rate coefficients of all terms and internal variables, whose sum is the effect of a
        factor on all rates; None where one has none of its own, and the derivative to ln t takes its place. Then of
        those of damage; without any, the end of curves moves as in life_sensitivity().
    correction : (tests, observations) in the output's unit, what is added to the prediction.
    """
    assert prediction.jacobian is not None
    predicted = _predicted_values(observations, prediction, correction)
    distance, reached = _distance(observations, predicted, prediction), np.isfinite(predicted[0])
    jacobian = observations.select_outputs(prediction.jacobian, prediction)[0]
    if nuisance_parameters.size:
        by_kind = {
            kind: observations.select_outputs(s, prediction)[0] for kind, s in prediction.nuisance_jacobian.items()
        }
        jacobian = np.concatenate([jacobian, nuisance_parameters.jacobian(by_kind)], axis=-1)
    by_strain, by_time = distance.strain_derivative[0], distance.time_derivative[0]
    jacobian = by_strain[..., None] * _transformed_jacobian(observations, predicted[0], jacobian)
    offsets = by_strain * np.where(reached, observations.derivative(np.where(reached, predicted[0], 1.0)), 0.0)
    if prediction.times_to_strain is not None:
        time_jacobian, time_offsets = _time_derivatives(observations, prediction.times_to_strain)
        jacobian += by_time[..., None] * time_jacobian
        offsets += by_time * time_offsets
    of_rates, of_damage = coefficients
    if of_rates is None:
        log_rate_sensitivity = by_strain * _time_derivative(observations, predicted[0]) + by_time
    else:
        log_rate_sensitivity = np.asarray(jacobian[..., list(of_rates)].sum(axis=-1))
    found = _masked_residuals(observations, distance.values[0], offsets, jacobian, log_rate_sensitivity)
    if not observations.followed_to_rupture.any():
        return found
    if of_damage:
        return replace(found, log_life_sensitivity=found.jacobian[..., list(of_damage)].sum(axis=-1))
    lives = np.where(observations.rupture_mask, 1.0, life_sensitivity(found))
    followed = observations.followed_to_rupture[:, None] & observations.present
    return replace(found, log_life_sensitivity=np.where(followed, lives, 0.0))


def life_sensitivity(residuals: Residuals) -> Floats:
    """(tests, observations) -, derivative of the residuals of frames to -ln of the rupture life, where no damage grows.

    Specimens of one alloy that creep alike still break at different times, and the last part of their curves moves with
    the life. Along a curve whose creep ends in a damage that grows at a rate of its own, such as

        e = A t_r lambda [1 - (1 - t / t_r)^(1 / lambda)]

    a life shorter by a factor exp(b) moves the time at which a strain is reached by (1 - 1/s) b in ln t, with
    s = d ln e / d ln t: not at all in steady creep, where s = 1, and by all of b at rupture, where s is infinite. A
    rate that scatters moves the whole curve by one amount in ln t, and the orthogonal residual of the frame by
    L = sqrt(2) s / sqrt(1 + s^2); with that, a life moves it by L - sqrt(2 - L^2).
    """
    shift = np.clip(residuals.log_rate_sensitivity, 0.0, np.sqrt(2.0))
    return np.asarray(np.maximum(shift - np.sqrt(np.maximum(2.0 - shift**2, 0.0)), 0.0))


def median_log_rate_excess(observations: ObservationVector, residuals: Floats) -> Floats:
    """(candidates,) -, ln of predicted over measured creep rates: the median over the leading outputs.

    residuals : (candidates, tests, observations) -. With a logarithmic transform they are that logarithm themselves;
    with a linear one it is taken of the increase since the first frame, and grows after a rupture.
    """
    predicted = residuals + observations.transformed_values
    log_ratios = np.where(observations.leading_output, residuals * observations.direction, np.nan)
    for position, transform in enumerate(observations.transforms):
        mask = observations.leading_output & (observations.output_index == position) & observations.present
        if not isinstance(transform, LinearTransform) or not mask.any():
            continue
        first_index = mask.argmax(axis=1)[:, None]
        predicted_growth = predicted - np.take_along_axis(
            predicted, np.broadcast_to(first_index, (*predicted.shape[:2], 1)), axis=2
        )
        measured_growth = observations.transformed_values - np.take_along_axis(
            observations.transformed_values, first_index, axis=1
        )
        after_rupture = np.maximum(predicted - transform.ceiling, 0.0)
        # The stress of a relaxation test decreases both in the prediction and in the measurement.
        signed_growth = np.maximum(predicted_growth * np.sign(measured_growth), 1e-12)
        ratio = np.log(signed_growth / np.maximum(np.abs(measured_growth), SMALLEST_INCREASE)) + after_rupture
        log_ratios = np.where(mask, np.where(np.abs(measured_growth) > SMALLEST_INCREASE, ratio, np.nan), log_ratios)
    return np.array(
        [np.nanmedian(each) if np.isfinite(each).any() else 0.0 for each in log_ratios[:, observations.present]]
    )


def median_log_rupture_excess(observations: ObservationVector, residuals: Floats) -> Floats:
    """(candidates,) -, ln of measured over predicted rupture times: the median; 0 where no test ruptured.

    residuals : (candidates, tests, observations) -.
    """
    ruptured = observations.rupture_mask & ~observations.stopped_ends
    return np.median(residuals[:, ruptured], axis=1) if ruptured.any() else np.zeros(len(residuals))


def _predicted_values(observations: ObservationVector, prediction: Prediction, correction: Floats | None) -> Floats:
    """(candidates, tests, observations) predicted outputs; rupture times are compared separately."""
    predicted = observations.select_outputs(prediction.values, prediction)
    if correction is not None:
        predicted = predicted + correction
    return np.where(observations.rupture_mask, observations.values, predicted)


def _distance(observations: ObservationVector, predicted: Floats, prediction: Prediction) -> OrthogonalDistance:
    """Of the observations from the curves of candidates, predicted : (candidates, tests, observations).

    Of tests that are not followed to rupture it is the residual in the transformed output alone; of an end ln of
    measured over predicted time.
    """
    reached, times = np.isfinite(predicted), prediction.times_to_strain
    vertical = _extended_after_rupture(observations, predicted, prediction.end_times) - observations.transformed_values
    if times is None:
        return OrthogonalDistance(vertical, np.ones_like(vertical), np.zeros_like(vertical))
    frames, ends = observations.followed_frames, observations.rupture_mask
    strain_times = observations.select_frames(times.times)
    never = np.isnan(strain_times)
    with np.errstate(divide="ignore"):
        log_time_ratio = observations.log_times - np.where(never, np.inf, np.log(np.where(never, 1.0, strain_times)))
    not_converged = ~reached & np.isneginf(log_time_ratio)  # neither reached nor ruptured: no convergence
    curve_slope = observations.derivative(np.where(frames, observations.values, 1.0)) * observations.select_frames(
        times.log_time_derivatives
    )
    orthogonal = orthogonal_distance(
        np.where(reached | not_converged, vertical, np.inf),
        np.where(not_converged, -np.inf, log_time_ratio),
        curve_slope,
    )
    ruptured = np.isfinite(times.rupture_times)
    log_end_times = np.log(np.where(ruptured, times.rupture_times, times.horizon))
    late = observations.log_times - log_end_times[..., None]
    at_end = np.where(ruptured[..., None], 1.0, 0.0)
    return OrthogonalDistance(
        np.where(ends, late, np.where(frames, orthogonal.values, vertical)),
        np.where(ends, 0.0, np.where(frames, orthogonal.strain_derivative, 1.0)),
        np.where(ends, at_end, np.where(frames, orthogonal.time_derivative, 0.0)),
    )


def _extended_after_rupture(observations: ObservationVector, predicted: Floats, end_times: Floats) -> Floats:
    """(candidates, tests, observations) transformed prediction, continued after a rupture."""
    reached = np.isfinite(predicted)
    transformed = observations.forward(np.where(reached, predicted, 0.0))
    unreached = observations.present & ~reached
    if unreached.any():
        ceilings = observations.per_observation([transform.ceiling for transform in observations.transforms])
        log_delay = np.log(np.maximum(observations.times / np.maximum(end_times[..., None], 1e-12), 1.0))
        transformed = np.where(unreached, ceilings + SLOPE_AFTER_RUPTURE * log_delay, transformed)
    return transformed


def _transformed_jacobian(observations: ObservationVector, predicted: Floats, jacobian: Floats) -> Floats:
    """Derivatives (..., tests, observations, unknowns) of transformed outputs from those of outputs.

    At frames after a rupture they are those of the last frame of the output that the prediction reaches.
    """
    reached, output = np.isfinite(predicted), observations.output_index
    with np.errstate(invalid="ignore"):
        jacobian = observations.derivative(np.where(reached, predicted, 1.0))[..., None] * jacobian
    reached = reached & observations.present
    if not reached.all():
        frames = np.broadcast_to(np.arange(reached.shape[-1]), reached.shape)
        index = np.array(frames)
        for position in np.unique(output):
            mask = reached & (output == position)
            last = np.maximum.accumulate(np.where(mask, frames, -1), axis=-1)
            first = np.where(mask.any(axis=-1), mask.argmax(axis=-1), 0)[..., None]
            index = np.where(output == position, np.where(last >= 0, last, first), index)
        jacobian = np.take_along_axis(jacobian, index[..., None], axis=-2)
    return np.where(np.isfinite(jacobian), jacobian, 0.0)


def _time_derivatives(observations: ObservationVector, times: TimesToStrain) -> tuple[Floats, Floats]:
    """Derivatives of -ln of the times to strain and to rupture, of the first candidate; zero where neither is reached.

    To internal parameters (tests, observations, parameters) and to an added offset (tests, observations), 1 / unit.
    """
    assert times.time_jacobian is not None
    assert times.rupture_jacobian is not None
    ends = observations.rupture_mask
    jacobian = -np.where(
        ends[..., None], times.rupture_jacobian[:, :, None], observations.select_frames(times.time_jacobian)
    )
    slope = observations.select_frames(times.log_time_derivatives)
    slope = np.where(np.isfinite(slope) & (slope > 0), slope, np.inf)
    return np.where(np.isfinite(jacobian), jacobian, 0.0)[0], np.where(ends, 0.0, 1.0 / slope)[0]


def _time_derivative(observations: ObservationVector, predicted: Floats) -> Floats:
    """(tests, observations) derivative of the transformed output to ln t.

    For a law without explicit time at constant stress it is that to ln of a factor on all rates: the strain depends on
    factor x time alone.
    """
    transformed = observations.forward(np.where(np.isfinite(predicted), predicted, observations.values))
    sensitivity = np.zeros_like(transformed)
    for k, position, row in observations.series:
        if observations.outputs[position] == MINIMUM_RATE_OUTPUT:
            sensitivity[k, row] = 1.0
        elif row.size > 1:
            sensitivity[k, row] = np.gradient(transformed[k, row], observations.log_times[k, row])
    return sensitivity


def _masked_residuals(
    observations: ObservationVector, values: Floats, derivatives: Floats, jacobian: Floats, log_rate_sensitivity: Floats
) -> Residuals:
    residuals = Residuals(
        values=values,
        offset_sensitivity=derivatives,
        present=observations.present,
        correlation_coordinate=observations.correlation_coordinate,
        jacobian=jacobian,
        log_rate_sensitivity=log_rate_sensitivity,
        output_index=observations.output_index,
        relative_noise=observations.relative_noise,
        discrepancy_unit=observations.discrepancy_unit,
        shared_noise=observations.shared_noise,
    )
    return residuals.where(observations.present)
