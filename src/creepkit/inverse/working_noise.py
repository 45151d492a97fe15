"""Working noise: the noise model under which values are estimated, from the settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from creepkit.inverse.noise_model import (
    ASSUMED_RATE_SD,
    MINIMUM_TESTS,
    NoiseModel,
    OutputNoise,
    Residuals,
    autocorrelated_components,
    known_sd,
    without_confounded_misfit,
)
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, SINGLE_VALUES, SMALLEST_NOISE, ObservationVector
from creepkit.inverse.output_transforms import LinearTransform, OutputTransform
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.variance_components import (
    LARGEST_RATE_SCATTER,
    LONGEST_DRIFT,
    LinearisedProblem,
    estimate_variance_components,
    log_noise_prior,
    restricted_log_likelihood,
)
from creepkit.records import is_logarithmic

AUTOCORRELATION_CONFIDENCE = 0.95
"""Residuals are autocorrelated where the likelihood gains more by it than by chance in so many cases; each output that
drifts, and the discrepancy, has two components more, a size and a correlation length."""


INITIAL_AUTOCORRELATION = 0.1
"""Of the leading output, transformed, before anything was fitted."""


INITIAL_DRIFT, INITIAL_DRIFT_LENGTH = 0.01, 0.2
"""Of the transformed output, and in correlation time, where the estimate of a drift begins."""


ALMOST = 0.99
"""Of the longest correlation of a drift, from which on it is at its bound."""


NEGLIGIBLE_SHARE = 0.5
"""Of white noise, up to which a drift is small beside it and its correlation length means nothing."""


INITIAL_DISCREPANCY = 1.0
"""In noises, where the estimate of a discrepancy begins."""


INITIAL_MISFIT = 0.3
"""Of transformed outputs, before anything was fitted."""


INITIAL_SINGLE_VALUE_SD = 0.3
"""Scatter of ln of rupture times and of minimum rates to begin from: one of each test, which cannot drift."""


INITIAL_LIFE_SD = LARGEST_RATE_SCATTER
"""Scatter of ln of the rate of damage between tests to begin from, where curves show it: what they share of their
beginning is then that of rates."""


UNRELATED_RATES = 0.95 * LARGEST_RATE_SCATTER
"""Scatter of ln rate, near the largest that is looked for, from which on the rates of tests say nothing of a law."""


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

    def initial(self) -> NoiseModel:
        """The working noise before anything was fitted: a misfit of 0.3, offsets of the floor of the transform."""
        return NoiseModel(self._outputs(1e-3, lambda _: INITIAL_MISFIT))

    def estimate(self, linearised: LinearisedProblem, previous: NoiseModel) -> NoiseModel:
        """The working noise, given the problem made linear."""
        if self.by_likelihood:
            return self._by_restricted_likelihood(linearised, previous)
        return estimate_variance_components(linearised.residuals, previous, self.settings.nuisances)

    def weighting(self, working_noise: NoiseModel) -> NoiseModel:
        """The noise under which values are found."""
        return working_noise if self.by_likelihood else with_single_value_weight(working_noise, self.observations)

    def starting_noise(self, tests: int) -> NoiseModel:
        """Where the iteration begins: the guess, or for a likelihood all sources of scatter at a tenth."""
        return self._likely_start(tests) if self.by_likelihood else self.initial()

    def final(self, linearised: LinearisedProblem, working_noise: NoiseModel, parameters: int) -> NoiseModel:
        """The noise model of largest restricted likelihood at the end: the working noise itself where values are.

        parameters : of the law, the first unknowns.
        """
        if self.by_likelihood:
            return working_noise
        start = self._likely_start(len(linearised.residuals.values))
        found = self._by_restricted_likelihood(linearised, start)
        if found.rate < UNRELATED_RATES:
            return found
        # rates that share nothing set values free to follow the bend of curves: the noise is that about these values
        held = np.arange(linearised.free.size) < parameters
        return self._by_restricted_likelihood(replace(linearised, free=linearised.free & ~held), start)

    def _likely_start(self, tests: int) -> NoiseModel:
        def misfit(name: str) -> float:
            return INITIAL_SINGLE_VALUE_SD if name in SINGLE_VALUES else 0.03 if is_logarithmic(name) else 0.0

        units = self.observations.discrepancy_unit[self.observations.present & self.observations.leading_output]
        units = units[units > 0]
        discrepancy = INITIAL_AUTOCORRELATION / float(np.median(units)) if units.size else 0.0
        outputs = self._outputs(SMALLEST_NOISE, misfit)
        return without_confounded_misfit(NoiseModel(outputs, self._likely_rate(tests), discrepancy))

    def _outputs(self, least: float, misfit: Callable[[str], float]) -> dict[str, OutputNoise]:
        """The noise of each output, at least a share of the floor of its transform, a misfit, and offsets of tests."""
        known = zip(self.observations.outputs, self.observations.transforms, self.observations.noise, strict=True)
        return {
            name: OutputNoise(max(float(noise), least * transform.floor), misfit(name), self._offset(name, transform))
            for name, transform, noise in known
        }

    def _offset(self, output: str, transform: OutputTransform) -> float:
        """Where an estimate of the offsets of tests begins."""
        known = known_sd(self.settings.nuisances, "offset", output)
        return transform.floor if known is None else known

    def _likely_rate(self, tests: int) -> float:
        """Where an estimate of the scatter of rates between so many tests begins."""
        known = known_sd(self.settings.nuisances, "rate")
        return ASSUMED_RATE_SD * (tests >= MINIMUM_TESTS) if known is None else known

    def _by_restricted_likelihood(self, linearised: LinearisedProblem, previous: NoiseModel) -> NoiseModel:
        """The noise model of largest restricted likelihood; autocorrelated where that is significantly more likely.

        A drift is a variance at the edge of what it may be: estimated always, it is above zero half of the time where
        there is none, and widens every interval. Of the parts that are autocorrelated those stay that the others cannot
        replace: a discrepancy of all outputs rather than drifts of each. A drift whose correlation is as long as may be
        is no noise of an instrument: the discrepancy stays in its place.
        """
        residuals, tests = linearised.residuals, len(linearised.residuals.values)
        lives = residuals.log_life_sensitivity
        # which ends, of no offset, do not tell from their own
        curves_show_lives = lives is not None and bool((lives * residuals.offset_sensitivity).any())

        def estimated(*, drift: bool, discrepancy: bool) -> tuple[NoiseModel, float]:
            start = self._initial_components(previous, tests, drift=drift, discrepancy=discrepancy)
            life = max(previous.life, INITIAL_LIFE_SD) if curves_show_lives and tests >= MINIMUM_TESTS else 0.0
            start = replace(start, life=life)
            noise_model = estimate_variance_components(
                linearised.residuals,
                start,
                self.settings.nuisances,
                fixed=(),
                linearised=linearised,
                longest_drift=LONGEST_DRIFT,
            )
            return noise_model, restricted_log_likelihood(linearised, noise_model) + log_noise_prior(noise_model)

        def suffices(simpler: tuple[NoiseModel, float], richer: tuple[NoiseModel, float]) -> bool:
            further = autocorrelated_components(richer[0]) - autocorrelated_components(simpler[0])
            return bool(2.0 * (richer[1] - simpler[1]) < chi2.ppf(AUTOCORRELATION_CONFIDENCE, max(further, 1)))

        white, full = estimated(drift=False, discrepancy=False), estimated(drift=True, discrepancy=True)
        if suffices(white, full):
            return self._with_predictor_error(white[0])
        discrepant = estimated(drift=False, discrepancy=True)
        if suffices(discrepant, full):
            return self._with_predictor_error(discrepant[0])
        drifting = estimated(drift=True, discrepancy=False)
        best = drifting if suffices(drifting, full) else full
        is_slow = _drifts_at_longest(best[0], linearised.residuals)
        return self._with_predictor_error((discrepant if is_slow else best)[0])

    def _with_predictor_error(self, noise_model: NoiseModel) -> NoiseModel:
        """The same with the errors of the predictor as drift: they follow the curve, and do not average out."""
        for name, error in self._transformed_predictor_errors().items():
            components = noise_model[name]
            length = components.correlation_length if components.drift > error else 1.0
            drift = float(np.hypot(components.drift, error))
            noise_model = noise_model.with_output(name, drift=drift, correlation_length=length)
        return noise_model

    def _transformed_predictor_errors(self) -> dict[str, float]:
        """{output: standard deviation} of what the predictor is wrong by, on the output's scale."""
        scales = zip(self.observations.outputs, self.observations.transforms, strict=True)
        linearised = {name: scale.scale for name, scale in scales if isinstance(scale, LinearTransform)}
        return {
            n: self.predictor_errors[n] / size
            for n, size in linearised.items()
            if self.predictor_errors.get(n, 0.0) > 0
        }

    def _initial_components(self, noise_model: NoiseModel, tests: int, *, drift: bool, discrepancy: bool) -> NoiseModel:
        """Where an estimate begins: with the noise that was measured, and the autocorrelated parts asked for.

        No component begins smaller than in a first estimate: the likelihood hardly depends on one that has vanished, as
        far from the optimum, and it would never come back.
        """
        observations = self.observations
        for name, noise, stated, scale in zip(
            observations.outputs, observations.noise, observations.stated, observations.transforms, strict=True
        ):
            initial_noise = max(float(noise), SMALLEST_NOISE * scale.floor)
            initial_drift = max(noise_model[name].drift, INITIAL_DRIFT) if drift and name not in SINGLE_VALUES else 0.0
            noise_model = noise_model.with_output(
                name,
                noise=initial_noise,
                offset=max(noise_model[name].offset, self._offset(name, scale)),
                drift=initial_drift,
                correlation_length=INITIAL_DRIFT_LENGTH,
                stated=initial_noise if stated else 0.0,
            )
        size, rate = max(noise_model.discrepancy, INITIAL_DISCREPANCY), max(noise_model.rate, self._likely_rate(tests))
        return replace(noise_model, rate=rate, discrepancy=size if discrepancy else 0.0, discrepancy_length=1.0)


def _drifts_at_longest(noise_model: NoiseModel, residuals: Residuals) -> bool:
    """Whether a drift that is not small beside white noise has the longest correlation that it may have."""
    for position, components in enumerate(noise_model.outputs.values()):
        mask = residuals.present & (residuals.output_index == position)
        noise = components.noise * float(np.median(residuals.offset_sensitivity[mask])) if mask.any() else np.inf
        if components.drift > NEGLIGIBLE_SHARE * noise and components.correlation_length > ALMOST * LONGEST_DRIFT:
            return True
    return False


def with_single_value_weight(working: NoiseModel, observations: ObservationVector) -> NoiseModel:
    """The working noise with which values are found: a rupture time or minimum rate weighs as much as a whole curve.

    Frames that follow one another say the same thing many times; a rupture time says it once.
    """
    frames = (observations.present & ~observations.single_value_mask).sum(axis=1)
    for name in (name for name in SINGLE_VALUES if name in working.outputs):
        curves = frames[observations.followed_to_rupture & (frames > 0)] if name == RUPTURE_OUTPUT else frames[:0]
        curves = curves if curves.size else frames[frames > 0]
        if curves.size:
            working = working.with_output(name, misfit=working[name].misfit / float(np.sqrt(np.mean(curves))))
    return working
