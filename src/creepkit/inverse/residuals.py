"""The residual function: predicted minus observed values of all tests with their Jacobian; orthogonal residuals for tests followed to rupture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.composite_predictor import (
    predict,
    predict_to_rupture,
    predict_with_sensitivities,
)
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.noise_model import Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import LinearTransform, ObservationVector
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor, TimesToStrain

_SMALL_DISTANCE = 1e-7
"""Below this distance the ratio of a to b is the slope of the curve."""


@dataclass(frozen=True, eq=False)
class OrthogonalDistance:
    """values : (...,) r; by_strain, by_time : (...,) its derivatives to a and to b."""

    values: Floats
    strain_derivative: Floats
    time_derivative: Floats


def orthogonal_distance(strain_residual: Floats, time_residual: Floats, curve_slope: Floats) -> OrthogonalDistance:
    """The distance of points whose errors are a (`strain`) and b (`time`).

    Either may be infinite, and not both. slope : (...,) of the predicted curve, d(compared strain)/d(ln time), infinite
    at rupture.
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
    """Residuals of candidates x tests x entries, and how they change with strain and with time.

    values : residuals. by_strain, by_time : derivatives to the compared strain at the frame's time, and to -ln of the
        time at which the measured strain is arrived at, or the specimen breaks.
    heard : which entries say anything: that a test was stopped says nothing of a candidate that lasts longer.
    """

    values: Floats
    strain_derivative: Floats
    time_derivative: Floats
    informative: Bools


def orthogonal_residuals(
    observations: ObservationVector, vertical: Floats, alive: Bools, prediction: Prediction
) -> OrthogonalResiduals:
    """Residuals, given those in strain alone (`vertical`), and which frames the prediction lives to see."""
    unit, zeros = np.ones_like(vertical), np.zeros_like(vertical)
    if prediction.times_to_strain is None:
        return OrthogonalResiduals(vertical, unit, zeros, np.broadcast_to(observations.present, vertical.shape))
    life, frames = (
        prediction.times_to_strain,
        observations.followed_to_rupture[:, None] & observations.present & ~observations.rupture_mask,
    )
    log_time_ratio = observations.log_times - _log_times(observations.select_frames(life.times))
    not_converged = ~alive & np.isneginf(log_time_ratio)  # it neither lives nor broke: the solver gave up
    curve_slope = observations.derivative(np.where(frames, observations.values, 1.0)) * observations.select_frames(
        life.log_time_derivatives
    )
    orthogonal = orthogonal_distance(
        np.where(alive | not_converged, vertical, np.inf), np.where(not_converged, -np.inf, log_time_ratio), curve_slope
    )
    values = np.where(frames, orthogonal.values, vertical)
    by_strain, by_time = (
        np.where(frames, orthogonal.strain_derivative, unit),
        np.where(frames, orthogonal.time_derivative, zeros),
    )
    return _with_rupture_times(
        observations, life, OrthogonalResiduals(values, by_strain, by_time, np.broadcast_to(unit > 0, unit.shape))
    )


def _with_rupture_times(
    observations: ObservationVector, life: TimesToStrain, frame_residuals: OrthogonalResiduals
) -> OrthogonalResiduals:
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


BURST_SLOPE = 3.0
"""Growth of the compared quantity per unit of ln(t / t_burst) after a burst; strains above it are not data."""


CACHED_EVALUATIONS = 4
"""Candidates whose residuals are kept: a search ends at one that it has seen, and the next begins there."""


class ResidualFunction:
    """Residuals of a law's candidates against histories."""

    def __init__(
        self, law: CreepLaw, histories: Sequence[History], predictor: Predictor, coordinates: Coordinates,
        observations: ObservationVector, nuisance_parameters: NuisanceParameters,
    ) -> None:  # fmt: skip
        self.law, self.histories, self.predictor = law, list(histories), predictor
        self.coordinates, self.observations, self.nuisance_parameters = coordinates, observations, nuisance_parameters
        self.observed = observations.forward(observations.values)
        self.evaluations = 0
        self._cache: dict[bytes, Residuals] = {}

    def with_predictor(self, predictor: Predictor, law: CreepLaw, coordinates: Coordinates) -> ResidualFunction:
        """The same entries asked of another predictor or law, unknowns of tests held at their means."""
        return ResidualFunction(
            law,
            self.histories,
            predictor,
            coordinates,
            self.observations,
            replace(self.nuisance_parameters, fixed=True),
        )

    def at_measured_values(self) -> Residuals:
        """Slopes as the measured values have them, so that a covariance exists before anything was predicted."""
        observed = self.observations.values
        derivatives = np.where(self.observations.present, self.observations.derivative(observed), 0.0)
        return self._masked_residuals(
            np.zeros_like(derivatives), derivatives, None, derivatives * np.maximum(observed, 0.0)
        )

    def batch_residuals(self, u: Floats, e: Floats | None = None) -> Floats:
        """Residuals without derivatives: (candidates, parameters) to entries; unknowns of tests at e or their means."""
        theta = self.coordinates.theta(u)
        if self.observations.followed_to_rupture.any():
            prediction = predict_to_rupture(self.predictor, self.law, theta, self.histories)
        else:
            nuisances = replace(self.nuisance_parameters, fixed=e is None).predictor_values(
                np.zeros(0) if e is None else e
            )
            prediction = predict(self.predictor, self.law, theta, self.histories, nuisances=nuisances)
        self.evaluations += len(u)
        return np.where(
            self.observations.present,
            self._residual_derivatives(self._predicted_outputs(prediction), prediction).values,
            0.0,
        )

    def median_log_rate_excess(self, residuals: Floats) -> Floats:
        """(candidates,) by how much rates are too high, in ln: the median over what grows with creep.

        On a logarithmic scale the residual itself; on a linear one ln of predicted over measured growth, and more
        after a burst.
        """
        observations, predicted = self.observations, residuals + self.observed
        log_ratios = np.where(observations.leading_output, residuals, np.nan)
        for position, transform in enumerate(observations.transforms):
            mask = observations.leading_output & (observations.output_index == position) & observations.present
            if not isinstance(transform, LinearTransform) or not mask.any():
                continue
            first_index = mask.argmax(axis=1)[:, None]
            predicted_growth = predicted - np.take_along_axis(
                predicted, np.broadcast_to(first_index, (*predicted.shape[:2], 1)), axis=2
            )
            measured_growth = self.observed - np.take_along_axis(self.observed, first_index, axis=1)
            burst = np.maximum(predicted - transform.ceiling, 0.0)
            signed_growth = np.maximum(
                predicted_growth * np.sign(measured_growth), 1e-12
            )  # a stress that relaxes falls in both
            ratio = np.log(signed_growth / np.maximum(np.abs(measured_growth), 0.01)) + burst
            log_ratios = np.where(mask, np.where(np.abs(measured_growth) > 0.01, ratio, np.nan), log_ratios)
        return np.array(
            [np.nanmedian(each) if np.isfinite(each).any() else 0.0 for each in log_ratios[:, observations.present]]
        )

    def median_log_rupture_excess(self, residuals: Floats) -> Floats:
        """(candidates,) by how much ruptures come too early, in ln: the median; 0 where no test ruptured."""
        ruptured = self.observations.rupture_mask & ~self.observations.censored[:, None]
        return np.median(residuals[:, ruptured], axis=1) if ruptured.any() else np.zeros(len(residuals))

    def evaluate(self, x: Floats) -> Residuals:
        """Residuals of one candidate x = (u, e) with exact derivatives; the last few are remembered."""
        key = x.tobytes()
        if key not in self._cache:
            self._cache = dict([*self._cache.items()][1 - CACHED_EVALUATIONS :])
            self._cache[key] = self._evaluated(x)
        return self._cache[key]

    def batch_jacobian(self, u: Floats) -> tuple[Floats, Floats]:
        """Residuals (candidates, tests, entries) of u (candidates, parameters), and their derivatives to u.

        The unknowns of tests stay at their means; one prediction, where the predictor differentiates itself.
        """
        theta, nuisances = (
            self.coordinates.theta(u),
            replace(self.nuisance_parameters, fixed=True).predictor_values(np.zeros(0)),
        )
        prediction = predict(self.predictor, self.law, theta, self.histories, nuisances=nuisances, sensitivities=True)
        if prediction.jacobian is None or self.observations.followed_to_rupture.any():
            single = self.with_predictor(self.predictor, self.law, self.coordinates)
            evaluated = [single.evaluate(one) for one in u]
            self.evaluations += single.evaluations
            return np.stack([r.values for r in evaluated]), np.stack([_require_jacobian(r.jacobian) for r in evaluated])
        self.evaluations += len(u)
        observations, predicted = self.observations, self._predicted_outputs(prediction)
        alive = np.isfinite(predicted)
        derivatives = observations.derivative(np.where(alive, predicted, 1.0))
        with np.errstate(invalid="ignore"):
            jacobian = derivatives[..., None] * observations.select_outputs(prediction.jacobian, prediction)
        jacobian = np.where(np.isfinite(jacobian), jacobian, np.nan)
        alive_observations = alive & observations.present
        filled = np.stack(
            [
                _jacobian_of_lost_frames(one, alive_rows, observations.output_index)
                for one, alive_rows in zip(jacobian, alive_observations, strict=True)
            ]
        )
        jacobian_u = np.einsum("ctep,cpq->cteq", filled, self.coordinates.jacobian(u))
        values = np.where(observations.present, self._residual_derivatives(predicted, prediction).values, 0.0)
        return values, np.where(observations.present[..., None], jacobian_u, 0.0)

    def _evaluated(self, x: Floats) -> Residuals:
        parameters, observations = len(self.law.params), self.observations
        u, e = x[:parameters], x[parameters:]
        theta = self.coordinates.theta(u)
        if observations.followed_to_rupture.any():
            prediction = predict_to_rupture(self.predictor, self.law, theta[None], self.histories, sensitivities=True)
        else:
            prediction = predict_with_sensitivities(
                self.predictor, self.law, theta, self.histories, self.nuisance_parameters.predictor_values(e)
            )
        self.evaluations += 1
        assert prediction.jacobian is not None
        predicted = self._predicted_outputs(prediction)
        orthogonal, alive = self._residual_derivatives(predicted, prediction), np.isfinite(predicted[0])
        derivatives = observations.derivative(np.where(alive, predicted[0], 1.0))
        internal_jacobian = orthogonal.strain_derivative[0, ..., None] * self._internal_jacobian(
            prediction, derivatives, alive
        )
        derivatives = orthogonal.strain_derivative[0] * np.where(alive, derivatives, 0.0)
        if prediction.times_to_strain is not None:
            internal_jacobian += (
                orthogonal.time_derivative[0, ..., None] * time_jacobian(observations, prediction.times_to_strain)[0]
            )
            derivatives += (
                orthogonal.time_derivative[0] * offset_time_derivative(observations, prediction.times_to_strain)[0]
            )
        log_rate_sensitivity = self._log_rate_sensitivity(internal_jacobian[..., :parameters], predicted[0], orthogonal)
        jacobian = np.concatenate(
            [internal_jacobian[..., :parameters] @ self.coordinates.jacobian(u), internal_jacobian[..., parameters:]],
            axis=-1,
        )
        return self._masked_residuals(
            orthogonal.values[0], derivatives, jacobian, log_rate_sensitivity, orthogonal.informative[0]
        )

    def _predicted_outputs(self, prediction: Prediction) -> Floats:
        """What is predicted at the entries, (candidates, tests, entries); rupture times are compared on their own."""
        return np.where(
            self.observations.rupture_mask,
            self.observations.values,
            self.observations.select_outputs(prediction.values, prediction),
        )

    def _residual_derivatives(self, predicted: Floats, prediction: Prediction) -> OrthogonalResiduals:
        vertical = self._extended_after_burst(predicted, prediction.end_times) - self.observed
        return orthogonal_residuals(self.observations, vertical, np.isfinite(predicted), prediction)

    def _internal_jacobian(self, prediction: Prediction, derivatives: Floats, alive: Bools) -> Floats:
        """Derivatives of what is compared to internal parameters and unknowns of tests."""
        assert prediction.jacobian is not None
        jacobian = self.observations.select_outputs(prediction.jacobian, prediction)[0]
        if self.nuisance_parameters.size:
            by_kind = {
                kind: self.observations.select_outputs(s, prediction)[0]
                for kind, s in prediction.nuisance_jacobian.items()
            }
            jacobian = np.concatenate([jacobian, self.nuisance_parameters.jacobian(by_kind)], axis=-1)
        with np.errstate(invalid="ignore"):
            jacobian = derivatives[..., None] * jacobian
        jacobian = np.where(np.isfinite(jacobian), jacobian, np.nan)
        return _jacobian_of_lost_frames(jacobian, alive & self.observations.present, self.observations.output_index)

    def _masked_residuals(
        self,
        values: Floats,
        derivatives: Floats,
        jacobian: Floats | None,
        log_rate_sensitivity: Floats,
        informative: Bools | None = None,
    ) -> Residuals:
        observations = self.observations
        mask = observations.present if informative is None else observations.present & informative
        return Residuals(
            np.where(mask, values, 0.0), np.where(mask, derivatives, 0.0), mask, observations.correlation_time,
            None if jacobian is None else np.where(mask[..., None], jacobian, 0.0), np.where(mask, log_rate_sensitivity, 0.0),
            observations.output_index, observations.relative_noise, np.ones(len(mask)),
        )  # fmt: skip

    def _log_rate_sensitivity(self, jacobian: Floats, predicted: Floats, orthogonal: OrthogonalResiduals) -> Floats:
        """Derivative of the compared quantity to ln of a factor on all rates of a test, (tests, entries).

        The sum over the coefficients of terms and of internal variables; where one has none of its own, the slope in
        ln t, which is the same for a law without explicit time at constant stress (strain depends on factor x time
        alone).
        """
        coordinates = self.coordinates
        if len(coordinates.coefficients) == len(self.law.terms) + len(self.law.states):
            return np.asarray(jacobian[..., list(coordinates.coefficients)].sum(axis=-1))
        alive = np.isfinite(predicted)
        transformed, observations = (
            self.observations.forward(np.where(alive, predicted, self.observations.values)),
            self.observations,
        )
        sensitivity = np.zeros_like(transformed)
        for k, present in enumerate(observations.present):
            for position in np.unique(observations.output_index[k, present]):
                row = present & (observations.output_index[k] == position)
                if row.sum() > 1:
                    sensitivity[k, row] = np.gradient(transformed[k, row], observations.log_times[k, row])
        return np.asarray(orthogonal.strain_derivative[0] * sensitivity + orthogonal.time_derivative[0])

    def _extended_after_burst(self, predicted: Floats, end_times: Floats) -> Floats:
        """g of the prediction, carried on after a burst; (candidates, tests, entries)."""
        alive = np.isfinite(predicted)
        transformed = self.observations.forward(np.where(alive, predicted, 0.0))
        lost = self.observations.present & ~alive
        if lost.any():
            ceilings = self.observations.per_observation([scale.ceiling for scale in self.observations.transforms])
            log_delay = np.log(np.maximum(self.observations.times / np.maximum(end_times[..., None], 1e-12), 1.0))
            transformed = np.where(lost, ceilings + BURST_SLOPE * log_delay, transformed)
        return transformed


def _require_jacobian(jacobian: Floats | None) -> Floats:
    assert jacobian is not None
    return jacobian


def _jacobian_of_lost_frames(jacobian: Floats, alive: Bools, output: Ints) -> Floats:
    """Derivatives of lost frames: those of the output's last frame alive in the test, a direction back to life."""
    if alive.all():
        return jacobian
    frames = np.broadcast_to(np.arange(alive.shape[1]), alive.shape)
    index = np.array(frames)
    for position in np.unique(output):
        mask = alive & (output == position)
        last_alive = np.maximum.accumulate(np.where(mask, frames, -1), axis=1)
        first_alive = np.where(mask.any(axis=1), mask.argmax(axis=1), 0)
        index = np.where(output == position, np.where(last_alive >= 0, last_alive, first_alive[:, None]), index)
    filled = np.take_along_axis(jacobian, index[..., None], axis=1)
    return np.where(np.isfinite(filled), filled, 0.0)
