"""Residuals: transformed predictions less transformed observations of all tests, with their derivatives.

After a predicted rupture the transformed output grows on with ln of time over rupture time, so that residuals are
finite and their derivatives lead back to values at which the specimen lasts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.noise_model import Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, ObservationVector
from creepkit.inverse.orthogonal_residual import (
    OrthogonalResiduals,
    offset_time_derivative,
    orthogonal_residuals,
    time_jacobian,
)
from creepkit.inverse.output_transforms import LinearTransform
from creepkit.records import Prediction

SLOPE_AFTER_RUPTURE = 3.0
"""Growth of the transformed output per unit of ln(t / t_rupture) after a predicted rupture."""


SMALLEST_INCREASE = 0.01
"""Of a transformed output since the first frame: smaller increases say nothing about the creep rate."""


def residuals_at_measured_values(observations: ObservationVector) -> Residuals:
    """Residuals of zero with the derivatives at the measured values: a covariance exists before any prediction."""
    observed = observations.values
    derivatives = np.where(observations.present, observations.derivative(observed), 0.0)
    return _masked_residuals(
        observations,
        np.zeros_like(derivatives),
        derivatives,
        None,
        derivatives * np.maximum(observed, 0.0),
        observations.present,
    )


def candidate_residuals(
    observations: ObservationVector, prediction: Prediction, correction: Floats | None = None
) -> Floats:
    """(candidates, tests, observations) - residuals of all candidates; zero where there are no data.

    correction : (tests, observations) in the output's unit, what is added to predictions.
    """
    predicted = _predicted_values(observations, prediction, correction)
    values = _orthogonal_residuals(observations, predicted, prediction).values
    return np.where(observations.present, values, 0.0)


def candidate_residuals_and_jacobian(
    observations: ObservationVector, prediction: Prediction, correction: Floats | None = None
) -> tuple[Floats, Floats]:
    """Residuals of all candidates, with derivatives to internal parameters, for tests that are not followed to rupture.

    correction : (tests, observations) in the output's unit. Returns residuals (candidates, tests, observations) and
    derivatives (candidates, tests, observations, parameters).
    """
    assert prediction.jacobian is not None
    predicted = _predicted_values(observations, prediction, correction)
    reached = np.isfinite(predicted)
    derivatives = observations.derivative(np.where(reached, predicted, 1.0))
    with np.errstate(invalid="ignore"):
        jacobian = derivatives[..., None] * observations.select_outputs(prediction.jacobian, prediction)
    jacobian = np.where(np.isfinite(jacobian), jacobian, np.nan)
    filled = np.stack(
        [
            _jacobian_after_rupture(one, reached_rows, observations.output_index)
            for one, reached_rows in zip(jacobian, reached & observations.present, strict=True)
        ]
    )
    values = np.where(observations.present, _orthogonal_residuals(observations, predicted, prediction).values, 0.0)
    return values, filled


def residuals_of_prediction(
    observations: ObservationVector,
    prediction: Prediction,
    nuisance_parameters: NuisanceParameters,
    coefficients: Sequence[int] | None,
    correction: Floats | None = None,
) -> Residuals:
    """Residuals of one candidate, with derivatives to internal parameters and nuisance parameters.

    coefficients : positions of the rate coefficients of all terms and internal variables, whose sum is the effect of a
        factor on all rates; None where one has none of its own, and the derivative to ln t takes its place.
    correction : (tests, observations) in the output's unit, what is added to the prediction.
    """
    assert prediction.jacobian is not None
    predicted = _predicted_values(observations, prediction, correction)
    orthogonal, reached = _orthogonal_residuals(observations, predicted, prediction), np.isfinite(predicted[0])
    derivatives = observations.derivative(np.where(reached, predicted[0], 1.0))
    jacobian = _transformed_jacobian(observations, prediction, nuisance_parameters, derivatives, reached)
    jacobian = orthogonal.strain_derivative[0, ..., None] * jacobian
    derivatives = orthogonal.strain_derivative[0] * np.where(reached, derivatives, 0.0)
    times = prediction.times_to_strain
    if times is not None:
        jacobian += orthogonal.time_derivative[0, ..., None] * time_jacobian(observations, times)[0]
        derivatives += orthogonal.time_derivative[0] * offset_time_derivative(observations, times)[0]
    if coefficients is None:
        log_rate_sensitivity = _time_derivative(observations, predicted[0], orthogonal)
    else:
        log_rate_sensitivity = np.asarray(jacobian[..., list(coefficients)].sum(axis=-1))
    return _masked_residuals(
        observations,
        orthogonal.values[0],
        derivatives,
        jacobian,
        log_rate_sensitivity,
        observations.present & orthogonal.informative[0],
    )


def median_log_rate_excess(observations: ObservationVector, residuals: Floats) -> Floats:
    """(candidates,) -, ln of predicted over measured creep rates: the median over the leading outputs.

    residuals : (candidates, tests, observations) -. With a logarithmic transform they are that logarithm themselves;
    with a linear one it is taken of the increase since the first frame, and grows after a rupture.
    """
    predicted = residuals + observations.transformed_values
    log_ratios = np.where(observations.leading_output, residuals, np.nan)
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
    ruptured = observations.rupture_mask & ~observations.censored[:, None]
    return np.median(residuals[:, ruptured], axis=1) if ruptured.any() else np.zeros(len(residuals))


def _predicted_values(observations: ObservationVector, prediction: Prediction, correction: Floats | None) -> Floats:
    """(candidates, tests, observations) predicted outputs; rupture times are compared separately."""
    predicted = observations.select_outputs(prediction.values, prediction)
    if correction is not None:
        predicted = predicted + correction
    return np.where(observations.rupture_mask, observations.values, predicted)


def _orthogonal_residuals(
    observations: ObservationVector, predicted: Floats, prediction: Prediction
) -> OrthogonalResiduals:
    vertical = _extended_after_rupture(observations, predicted, prediction.end_times) - observations.transformed_values
    return orthogonal_residuals(observations, vertical, np.isfinite(predicted), prediction)


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


def _transformed_jacobian(
    observations: ObservationVector,
    prediction: Prediction,
    nuisance_parameters: NuisanceParameters,
    derivatives: Floats,
    reached: Bools,
) -> Floats:
    """(tests, observations, unknowns) derivatives of transformed outputs to internal and nuisance parameters."""
    assert prediction.jacobian is not None
    jacobian = observations.select_outputs(prediction.jacobian, prediction)[0]
    if nuisance_parameters.size:
        by_kind = {
            kind: observations.select_outputs(s, prediction)[0] for kind, s in prediction.nuisance_jacobian.items()
        }
        jacobian = np.concatenate([jacobian, nuisance_parameters.jacobian(by_kind)], axis=-1)
    with np.errstate(invalid="ignore"):
        jacobian = derivatives[..., None] * jacobian
    jacobian = np.where(np.isfinite(jacobian), jacobian, np.nan)
    return _jacobian_after_rupture(jacobian, reached & observations.present, observations.output_index)


def _time_derivative(observations: ObservationVector, predicted: Floats, orthogonal: OrthogonalResiduals) -> Floats:
    """(tests, observations) derivative of the residual to ln t.

    For a law without explicit time at constant stress it is that to ln of a factor on all rates: the strain depends on
    factor x time alone.
    """
    reached = np.isfinite(predicted)
    transformed = observations.forward(np.where(reached, predicted, observations.values))
    sensitivity = np.zeros_like(transformed)
    for k, present in enumerate(observations.present):
        for position in np.unique(observations.output_index[k, present]):
            row = present & (observations.output_index[k] == position)
            if observations.outputs[position] == MINIMUM_RATE_OUTPUT:
                sensitivity[k, row] = 1.0
            elif row.sum() > 1:
                sensitivity[k, row] = np.gradient(transformed[k, row], observations.log_times[k, row])
    return np.asarray(orthogonal.strain_derivative[0] * sensitivity + orthogonal.time_derivative[0])


def _masked_residuals(
    observations: ObservationVector,
    values: Floats,
    derivatives: Floats,
    jacobian: Floats | None,
    log_rate_sensitivity: Floats,
    mask: Bools,
) -> Residuals:
    return Residuals(
        values=np.where(mask, values, 0.0),
        offset_sensitivity=np.where(mask, derivatives, 0.0),
        present=mask,
        correlation_coordinate=observations.correlation_coordinate,
        jacobian=None if jacobian is None else np.where(mask[..., None], jacobian, 0.0),
        log_rate_sensitivity=np.where(mask, log_rate_sensitivity, 0.0),
        output_index=observations.output_index,
        relative_noise=observations.relative_noise,
        discrepancy_unit=np.where(mask, observations.discrepancy_unit, 0.0),
        shared_noise=observations.shared_noise,
        test_weights=np.ones(len(mask)),
    )


def _jacobian_after_rupture(jacobian: Floats, reached: Bools, output: Ints) -> Floats:
    """Derivatives at frames after a rupture: those of the last frame of the output that the prediction reaches."""
    if reached.all():
        return np.where(np.isfinite(jacobian), jacobian, 0.0)
    frames = np.broadcast_to(np.arange(reached.shape[1]), reached.shape)
    index = np.array(frames)
    for position in np.unique(output):
        mask = reached & (output == position)
        last_alive = np.maximum.accumulate(np.where(mask, frames, -1), axis=1)
        first_alive = np.where(mask.any(axis=1), mask.argmax(axis=1), 0)
        index = np.where(output == position, np.where(last_alive >= 0, last_alive, first_alive[:, None]), index)
    filled = np.take_along_axis(jacobian, index[..., None], axis=1)
    return np.where(np.isfinite(filled), filled, 0.0)
