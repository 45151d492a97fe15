"""Orthogonal residuals of tests that were followed to rupture: distances in strain and in the logarithm of time.

Near rupture strain grows without limit within almost no time, and an error in strain has no meaning: what counts is the
distance of a measured point from the predicted curve, in units of both errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.records import Prediction, TimesToStrain

_SMALL_DISTANCE = 1e-7
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
        ratio = np.where(np.maximum(np.minimum(a, b), 0.0) > _SMALL_DISTANCE, a / b, np.maximum(curve_slope, 0.0))
        ratio = np.where(np.isinf(b), 0.0, np.where(np.isinf(a), np.inf, ratio))
        strain_weight, time_weight = 1.0 / np.hypot(1.0, ratio), 1.0 / np.hypot(1.0, 1.0 / ratio)
    sign = np.where(np.isinf(a), np.sign(time_residual), np.sign(strain_residual))
    magnitude = np.where(
        strain_weight >= time_weight,
        np.where(np.isinf(a), 0.0, a) * strain_weight,
        np.where(np.isinf(b), 0.0, b) * time_weight,
    )
    return OrthogonalDistance(
        np.sqrt(2.0) * sign * magnitude, np.sqrt(2.0) * strain_weight**3, np.sqrt(2.0) * time_weight**3
    )


@dataclass(frozen=True, eq=False)
class OrthogonalResiduals:
    """Residuals of candidates, and their derivatives to strain and to time.

    values : (candidates, tests, observations) -, the residuals.
    strain_derivative : (candidates, tests, observations) -, to the transformed strain at the time of the frame.
    time_derivative : (candidates, tests, observations) -, to -ln of the time to the measured strain, or to rupture.
    informative : (candidates, tests, observations), false for tests that were stopped before a candidate ruptures.
    """

    values: Floats
    strain_derivative: Floats
    time_derivative: Floats
    informative: Bools


def orthogonal_residuals(
    observations: ObservationVector, vertical: Floats, reached: Bools, prediction: Prediction
) -> OrthogonalResiduals:
    """Orthogonal residuals from those in strain alone.

    vertical : (candidates, tests, observations) -, transformed prediction less transformed observation.
    reached : (candidates, tests, observations), whether the prediction reaches the time of the frame.
    """
    unit, zeros = np.ones_like(vertical), np.zeros_like(vertical)
    if prediction.times_to_strain is None:
        return OrthogonalResiduals(vertical, unit, zeros, np.broadcast_to(observations.present, vertical.shape))
    strain_times, frames = (
        prediction.times_to_strain,
        observations.followed_to_rupture[:, None] & observations.present & ~observations.single_value_mask,
    )
    log_time_ratio = observations.log_times - _log_times(observations.select_frames(strain_times.times))
    not_converged = ~reached & np.isneginf(log_time_ratio)  # neither reached nor ruptured: no convergence
    curve_slope = observations.derivative(np.where(frames, observations.values, 1.0)) * observations.select_frames(
        strain_times.log_time_derivatives
    )
    orthogonal = orthogonal_distance(
        np.where(reached | not_converged, vertical, np.inf),
        np.where(not_converged, -np.inf, log_time_ratio),
        curve_slope,
    )
    values = np.where(frames, orthogonal.values, vertical)
    by_strain, by_time = (
        np.where(frames, orthogonal.strain_derivative, unit),
        np.where(frames, orthogonal.time_derivative, zeros),
    )
    return _with_rupture_times(
        observations,
        strain_times,
        OrthogonalResiduals(values, by_strain, by_time, np.broadcast_to(unit > 0, unit.shape)),
    )


def _with_rupture_times(
    observations: ObservationVector, strain_times: TimesToStrain, frame_residuals: OrthogonalResiduals
) -> OrthogonalResiduals:
    """With ln of measured over predicted rupture time; a stopped test counts where it lasted longer than that."""
    ruptured = np.isfinite(strain_times.rupture_times)
    log_end_times = np.log(np.where(ruptured, strain_times.rupture_times, strain_times.horizon))
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


def time_jacobian(observations: ObservationVector, strain_times: TimesToStrain) -> Floats:
    """(candidates, tests, observations, parameters) -, derivatives of -ln of the times to strain and to rupture.

    They are to internal parameters, and zero where neither is reached.
    """
    assert strain_times.time_jacobian is not None
    assert strain_times.rupture_jacobian is not None
    strain_time_jacobian = observations.select_frames(strain_times.time_jacobian)
    jacobian = -np.where(
        observations.rupture_mask[..., None], strain_times.rupture_jacobian[:, :, None], strain_time_jacobian
    )
    return np.where(np.isfinite(jacobian), jacobian, 0.0)


def offset_time_derivative(observations: ObservationVector, strain_times: TimesToStrain) -> Floats:
    """(candidates, tests, observations) 1 / unit, derivative of -ln(time to strain) to an added offset."""
    curve_slope = observations.select_frames(strain_times.log_time_derivatives)
    positive_slope = np.where(np.isfinite(curve_slope) & (curve_slope > 0), curve_slope, np.inf)
    return np.where(observations.rupture_mask, 0.0, 1.0 / positive_slope)


def _log_times(times: Floats) -> Floats:
    """ln of times; infinity for a time that is never reached."""
    with np.errstate(divide="ignore"):
        return np.where(np.isnan(times), np.inf, np.log(np.where(np.isnan(times), 1.0, times)))
