"""Working noise: the noise model under which values are estimated, from the settings; robust weights of whole tests."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.noise_model import (
    ASSUMED_RATE_SD,
    MINIMUM_TESTS,
    NEGLIGIBLE_DRIFT,
    NoiseModel,
    OutputNoise,
    Residuals,
    cholesky_factors,
    initial_sd,
    initial_working_noise,
    predicted_random_effects,
    whiten,
)
from creepkit.inverse.observation_vector import LOGARITHMIC_OUTPUTS, RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.output_transforms import LinearTransform
from creepkit.inverse.settings import PAPER_WEIGHTS, IdentificationSettings
from creepkit.inverse.variance_components import (
    LinearisedProblem,
    estimate_variance_components,
    restricted_log_likelihood,
)

STUDENT_FREEDOM = 4.0
"""Degrees of freedom of Student's t for whole tests; the usual choice where tails are unknown (Lange et al. 1989)."""


SMALLEST_NOISE = 1e-2
"""Least noise of a likelihood, over the floor of the output's transform: simulated histories have none of their own."""


DRIFT_CONFIDENCE = 0.95
"""Residuals are autocorrelated where the likelihood gains more by it than by chance in so many cases; each output that
drifts has two components more, drift and correlation length."""


INITIAL_RUPTURE_SD = 0.3
"""Scatter of ln of rupture times to begin from: one of each test, which has no noise, and cannot drift."""


SMALLEST_WEIGHT = 1e-6
"""Relative weight of an output that the weights do not name."""


class WorkingNoiseEstimator:
    """How the working noise follows from the settings: by likelihood, or by the weights of outputs."""

    def __init__(
        self,
        settings: IdentificationSettings,
        observations: ObservationVector,
        errors: Mapping[str, float] | None = None,
    ) -> None:
        """errors : {output: standard deviation of what the predictor itself is wrong by}, in the output's unit."""
        self.settings, self.observations, self.predictor_errors = settings, observations, errors or {}
        self.by_likelihood = settings.weights == "likelihood"
        self.relative_sd: Mapping[str, float] | None = None
        if settings.weights == "equal":
            self.relative_sd = _relative_standard_deviations(dict.fromkeys(observations.outputs, 1.0), observations)
        elif settings.weights == "paper":
            self.relative_sd = _relative_standard_deviations(PAPER_WEIGHTS, observations)
        elif not isinstance(settings.weights, str):
            self.relative_sd = _relative_standard_deviations(settings.weights, observations)

    def initial(self) -> NoiseModel:
        """The working noise before anything was fitted."""
        start = initial_working_noise(self.observations, self.settings.nuisances)
        return (
            start
            if self.relative_sd is None
            else self._in_ratio_of_weights(start, 0.3 / min(self.relative_sd.values()))
        )

    def estimate(
        self, residuals: Residuals, previous: NoiseModel, linearised: LinearisedProblem | None = None
    ) -> NoiseModel:
        """The working noise, given residuals; for a likelihood also the problem made linear."""
        nuisances = self.settings.nuisances
        if self.by_likelihood:
            assert linearised is not None
            return self._by_restricted_likelihood(linearised, previous)
        if self.relative_sd is None:
            return estimate_variance_components(residuals, previous, nuisances)
        offsets = predicted_random_effects(residuals, previous)[0]
        remaining = residuals.values + residuals.offset_sensitivity * np.take_along_axis(
            offsets, residuals.output_index, axis=1
        )
        relative_sd = self.observations.per_observation([self.relative_sd[name] for name in self.observations.outputs])
        whitened = (remaining / relative_sd)[residuals.present] ** 2 * _weight_per_observation(residuals)[
            residuals.present
        ]
        scaled = self._in_ratio_of_weights(previous, float(np.sqrt(np.mean(whitened))))
        return estimate_variance_components(residuals, scaled, nuisances, fixed=("misfit",))

    def starting_noise(self, tests: int) -> NoiseModel:
        """Where the iteration begins: the guess, or for a likelihood all sources of scatter at a tenth."""
        if not self.by_likelihood:
            return self.initial()
        nuisances, by_output = self.settings.nuisances, {}
        for name, scale, noise in zip(
            self.observations.outputs, self.observations.transforms, self.observations.noise, strict=True
        ):
            offset = initial_sd(nuisances, "offset", scale.floor, name)
            misfit = INITIAL_RUPTURE_SD if name == RUPTURE_OUTPUT else 0.03 if name in LOGARITHMIC_OUTPUTS else 0.0
            drift = 0.0 if name == RUPTURE_OUTPUT else 0.1
            by_output[name] = OutputNoise(max(float(noise), SMALLEST_NOISE * scale.floor), misfit, offset, drift)
        rate_nuisances = [n for n in nuisances if n.kind == "rate" and (n.sd is not None or tests >= MINIMUM_TESTS)]
        return NoiseModel(by_output, initial_sd(rate_nuisances, "rate", ASSUMED_RATE_SD))

    def _by_restricted_likelihood(self, linearised: LinearisedProblem, previous: NoiseModel) -> NoiseModel:
        """The noise model of largest restricted likelihood; with drift only where that is significantly more likely.

        A drift is a variance at the edge of what it may be: estimated always, it is above zero half of the time where
        there is none, and widens every interval.
        """
        nuisances, residuals = self.settings.nuisances, linearised.residuals
        without_drift = estimate_variance_components(
            residuals, self._with_initial_drift(previous, 0.0), nuisances, fixed=(), linearised=linearised
        )
        with_drift = estimate_variance_components(
            residuals, self._with_initial_drift(previous, 0.01), nuisances, fixed=(), linearised=linearised
        )
        gain = 2.0 * (
            restricted_log_likelihood(linearised, with_drift) - restricted_log_likelihood(linearised, without_drift)
        )
        drifting_outputs = sum(sizes.drift > NEGLIGIBLE_DRIFT for sizes in with_drift.outputs.values())
        return self._with_predictor_error(
            with_drift
            if drifting_outputs and gain > chi2.ppf(DRIFT_CONFIDENCE, 2 * drifting_outputs)
            else without_drift
        )

    def _with_predictor_error(self, noise_model: NoiseModel) -> NoiseModel:
        """The same with the errors of the predictor as drift: they follow the curve, and do not average out."""
        for name, error in self._transformed_predictor_errors().items():
            noise_model = noise_model.with_output(name, drift=float(np.hypot(noise_model[name].drift, error)))
        return noise_model

    def unestimated_drift_components(self, noise_model: NoiseModel) -> set[tuple[str, str]]:
        """Those (output, component) that were not estimated: drifts that are the predictor's error and no more."""
        outputs = [
            n
            for n, error in self._transformed_predictor_errors().items()
            if noise_model[n].drift <= float(np.hypot(error, NEGLIGIBLE_DRIFT))
        ]
        return {(name, source) for name in outputs for source in ("drift", "correlation_length")}

    def _transformed_predictor_errors(self) -> dict[str, float]:
        """{output: standard deviation} of what the predictor is wrong by, on the output's scale."""
        scales = zip(self.observations.outputs, self.observations.transforms, strict=True)
        linearised = {name: scale.scale for name, scale in scales if isinstance(scale, LinearTransform)}
        return {
            n: self.predictor_errors[n] / size
            for n, size in linearised.items()
            if self.predictor_errors.get(n, 0.0) > 0
        }

    def _with_initial_drift(self, noise_model: NoiseModel, drift: float) -> NoiseModel:
        """The same with a drift to begin from, or none, and the noise that was measured."""
        for name, noise, scale in zip(
            self.observations.outputs, self.observations.noise, self.observations.transforms, strict=True
        ):
            initial_drift = max(noise_model[name].drift, drift) if drift > 0 and name != RUPTURE_OUTPUT else 0.0
            initial_noise = max(float(noise), SMALLEST_NOISE * scale.floor)
            noise_model = noise_model.with_output(
                name, noise=initial_noise, drift=initial_drift, correlation_length=1.0
            )
        return noise_model

    def _in_ratio_of_weights(self, noise_model: NoiseModel, scale: float) -> NoiseModel:
        """Misfits in the ratio that the weights ask for, without noise of their own."""
        assert self.relative_sd is not None
        for name, relative in self.relative_sd.items():
            noise_model = noise_model.with_output(name, noise=0.0, misfit=max(scale, 1e-6) * relative)
        return noise_model

    def with_measured_noise(self, working: NoiseModel) -> NoiseModel:
        """The noise model from which the whole covariance is estimated: with the noise that was measured."""
        initial = initial_working_noise(self.observations, self.settings.nuisances)
        for name, sizes in initial.outputs.items():
            working = working.with_output(name, noise=sizes.noise)
            if self.relative_sd is not None:
                working = working.with_output(name, misfit=sizes.misfit)
        return working


def with_rupture_weight(working: NoiseModel, observations: ObservationVector) -> NoiseModel:
    """The working noise with which values are found: the one rupture time of a test weighs as much as its whole curve.

    Frames that follow one another say the same thing many times; a rupture time says it once.
    """
    if RUPTURE_OUTPUT not in working.outputs:
        return working
    frames = int((observations.present & ~observations.rupture_mask)[observations.followed_to_rupture].sum()) / int(
        observations.followed_to_rupture.sum()
    )
    return working.with_output(RUPTURE_OUTPUT, misfit=working[RUPTURE_OUTPUT].misfit / float(np.sqrt(frames)))


def _relative_standard_deviations(weights: Mapping[str, float], observations: ObservationVector) -> dict[str, float]:
    """{output: standard deviation} of independent residuals; squares add up to weight x relative squared error."""
    unknown = [name for name in weights if name not in observations.outputs]
    if unknown:
        raise FitError(f"weights name '{unknown[0]}', which is not among the outputs {', '.join(observations.outputs)}")
    transformed, standard_deviations = observations.forward(observations.values), {}
    largest = max(weights.values())
    for position, name in enumerate(observations.outputs):
        values = transformed[observations.present & (observations.output_index == position)]
        sum_of_squares = float(((values - values.mean()) ** 2).sum()) if values.size else 0.0
        standard_deviations[name] = float(
            np.sqrt(sum_of_squares / max(weights.get(name, 0.0), SMALLEST_WEIGHT * largest))
        )
    return standard_deviations


def _weight_per_observation(residuals: Residuals) -> Floats:
    return np.broadcast_to(residuals.test_weights[:, None], residuals.values.shape)


def robust_test_weights(residuals: Residuals, working: NoiseModel) -> Floats:
    """(tests,) weights (nu + 1) / (nu + m / s): m the mean squared white residual of a test, s its median over tests.

    Each output is taken on its own, and the worst one counts, if it is worse than the median: amplitudes far from
    those of the twins are not hidden among good widths. Iterated with the fit this is the likelihood of tests that
    scatter as Student's t does: one like the others weighs one, one of ten times their error a twentieth.
    """
    unweighted = residuals.with_test_weights(np.ones(len(residuals.values)))
    whitened = whiten(cholesky_factors(unweighted, working), unweighted.values)
    largest_ratio = np.zeros(len(whitened))
    for position in range(len(working.outputs)):
        mask = unweighted.present & (unweighted.output_index == position)
        observed_tests = mask.any(axis=1)
        mean_squares = (np.where(mask, whitened, 0.0) ** 2).sum(axis=1) / np.maximum(mask.sum(axis=1), 1)
        median_mean_square = max(float(np.median(mean_squares[observed_tests])), 1e-300)
        largest_ratio = np.maximum(largest_ratio, mean_squares / median_mean_square)
    return np.asarray((STUDENT_FREEDOM + 1) / (STUDENT_FREEDOM + np.maximum(largest_ratio, 1.0)))
