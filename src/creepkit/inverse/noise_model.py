"""Noise model: residuals, standard deviations of the sources of scatter, and the covariance of one test.

Beside white noise and offsets there are two autocorrelated parts. The drift of an output is slow noise of its
instrument, with a short correlation length. The model discrepancy is what the law cannot follow: one standard deviation
and one, longer, correlation length for all outputs, in units in which their noises are alike, so that no law can call
the misfit of one output noise and fit the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.records import Nuisance


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of the observation vector (see inverse.observation_vector), with what their covariance depends on.

    values : (tests, observations) -, transformed prediction less transformed observation.
    offset_sensitivity : (tests, observations) 1 / unit, effect of one unit of offset.
    present : (tests, observations) which are data; the others are zero.
    correlation_coordinate : (tests, observations) -, in which drifts decay: ln t or a share of the duration.
    jacobian : (tests, observations, unknowns) derivatives to x = (u, e), or None.
    log_rate_sensitivity : (tests, observations) -, derivative to ln of a factor on the creep rate of the test.
    output_index : (tests, observations) position of the output; relative_noise : (tests, observations) -, noise over
        the typical noise of that output.
    test_weights : (tests,) -; the covariance of a test is divided by it.
    random_effect_sensitivities : (tests, observations, effects) -, effect of one standard deviation of further random
        effects, or None.
    discrepancy_unit : (tests, observations) -, what a model discrepancy of one is in the transformed output: the stated
        or estimated noise of the frame; 1 % where the transform is logarithmic; 0 where there can be none.
    """

    values: Floats
    offset_sensitivity: Floats
    present: Bools
    correlation_coordinate: Floats
    jacobian: Floats | None
    log_rate_sensitivity: Floats
    output_index: Ints
    relative_noise: Floats
    test_weights: Floats
    random_effect_sensitivities: Floats | None = None
    discrepancy_unit: Floats | None = None

    def with_test_weights(self, test_weights: Floats) -> Residuals:
        """The same with other weights of tests."""
        return replace(self, test_weights=test_weights)


MINIMUM_TESTS = 3
"""Below this many tests the scatter between them cannot be estimated."""


ASSUMED_RATE_SD = 0.3
"""Scatter of ln rate between tests that is assumed then, unless a likelihood is asked for."""


@dataclass(frozen=True)
class OutputNoise:
    """Standard deviations of one output.

    noise : of one frame, and offset : of a test, in the output's unit. misfit : independent error of a frame, and
    drift : autocorrelated noise of the instrument, in the transformed output. correlation_length : of the drift, in
    correlation time. stated : the noise that the histories state, its lower bound, in the output's unit; 0 where they
    state none.
    """

    noise: float
    misfit: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    correlation_length: float = 1.0
    stated: float = 0.0


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviations of the sources of scatter, such as noise_model["strain"].offset and noise_model.rate.

    outputs : of each output, in the order of the observations; rate : of ln rate between tests.
    discrepancy : of the model discrepancy, in noises (see Residuals.discrepancy_unit), and discrepancy_length : its
        correlation length, in correlation time.
    """

    outputs: Mapping[str, OutputNoise]
    rate: float = 0.0
    discrepancy: float = 0.0
    discrepancy_length: float = 1.0

    def __getitem__(self, output: str) -> OutputNoise:
        return self.outputs[output]

    def per_observation(self, output_index: Ints, component: str) -> Floats:
        """(tests, observations) one component at each observation; output_index : (tests, observations)."""
        return np.asarray(np.array([getattr(s, component) for s in self.outputs.values()])[output_index])

    def with_output(self, output: str, **components: float) -> NoiseModel:
        """The same with other components of one output."""
        return replace(self, outputs={**self.outputs, output: replace(self.outputs[output], **components)})


def initial_working_noise(observations: ObservationVector, nuisances: Sequence[Nuisance]) -> NoiseModel:
    """Working noise before anything was fitted: a misfit of 0.3, offsets of the floor of the transform."""
    by_output = {}
    for name, transform, noise in zip(observations.outputs, observations.transforms, observations.noise, strict=True):
        offset = initial_sd(nuisances, "offset", transform.floor, name)
        by_output[name] = OutputNoise(noise=max(float(noise), 1e-3 * transform.floor), misfit=0.3, offset=offset)
    return NoiseModel(by_output)


def initial_noise_model(working: NoiseModel, nuisances: Sequence[Nuisance]) -> NoiseModel:
    """The noise model from which its estimate begins; the one rupture time of a test cannot drift."""
    outputs = {
        name: s
        if name == RUPTURE_OUTPUT
        else replace(s, misfit=0.3 * s.misfit, drift=0.5 * s.misfit, correlation_length=1.0)
        for name, s in working.outputs.items()
    }
    return NoiseModel(outputs, initial_sd(nuisances, "rate", ASSUMED_RATE_SD))


def initial_sd(nuisances: Sequence[Nuisance], kind: str, default: float, output: str = "") -> float:
    """Initial standard deviation of a nuisance: its prior, by default `default`; 0 where there is no such nuisance."""
    standard_deviations = [
        default if n.sd is None else n.sd for n in nuisances if n.kind == kind and n.output in ("", output)
    ]
    return standard_deviations[0] if standard_deviations else 0.0


def components_fixed_by_priors(nuisances: Sequence[Nuisance], outputs: Sequence[str]) -> set[tuple[str, str]]:
    """Those (output, component) that a nuisance states; the rate belongs to the output ""."""
    fixed: set[tuple[str, str]] = {("", "rate") for n in nuisances if n.kind == "rate" and n.sd is not None}
    for output in outputs:
        offset_nuisances = [n for n in nuisances if n.kind == "offset" and n.output in ("", output)]
        if offset_nuisances and offset_nuisances[0].sd is not None:
            fixed.add((output, "offset"))
    return fixed


_JITTER = 1e-10


def covariance(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """(tests, observations, observations) -; absent observations have unit variance and no correlation."""
    s, d, present, output = (
        residuals.offset_sensitivity,
        residuals.log_rate_sensitivity,
        residuals.present,
        residuals.output_index,
    )
    drift, offset = noise_model.per_observation(output, "drift"), noise_model.per_observation(output, "offset") * s
    c = (drift**2)[:, :, None] * np.exp(
        -correlation_lags(residuals) / noise_model.per_observation(output, "correlation_length")[:, :, None]
    )
    if noise_model.discrepancy > 0:
        assert residuals.discrepancy_unit is not None
        unit = noise_model.discrepancy * residuals.discrepancy_unit
        c += unit[:, :, None] * unit[:, None, :] * np.exp(-correlation_lags(residuals) / noise_model.discrepancy_length)
    c += offset[:, :, None] * offset[:, None, :]
    c = np.where(same_output(residuals), c, 0.0) if len(noise_model.outputs) > 1 else c
    c += noise_model.rate**2 * d[:, :, None] * d[:, None, :]
    if residuals.random_effect_sensitivities is not None:
        c += residuals.random_effect_sensitivities @ np.swapaxes(residuals.random_effect_sensitivities, 1, 2)
    k = np.arange(s.shape[1])
    noise = noise_model.per_observation(output, "noise") * residuals.relative_noise
    c[:, k, k] = (
        c[:, k, k] * (1 + 1e-9) + (noise * s) ** 2 + noise_model.per_observation(output, "misfit") ** 2 + _JITTER
    )
    present_pairs = present[:, :, None] & present[:, None, :]
    c = np.where(present_pairs, c / residuals.test_weights[:, None, None], 0.0)
    c[:, k, k] = np.where(present, c[:, k, k], 1.0)
    return np.asarray(c)


def correlation_lags(residuals: Residuals) -> Floats:
    """(tests, observations, observations) differences of correlation time."""
    t = residuals.correlation_coordinate
    return np.abs(t[:, :, None] - t[:, None, :])


def same_output(residuals: Residuals) -> Bools:
    """(tests, observations, observations) whether two observations are of one output."""
    return np.asarray(residuals.output_index[:, :, None] == residuals.output_index[:, None, :])


def cholesky_factors(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """Lower Cholesky factors L of the covariance, (tests, observations, observations); L^-1 r is white."""
    return np.asarray(np.linalg.cholesky(covariance(residuals, noise_model)))


def whiten(covariance_factor: Floats, values: Floats) -> Floats:
    """L^-1 v, whose covariance is the identity where that of v is L L'.

    covariance_factor : (tests, observations, observations) Cholesky factors L.
    values : (tests, observations[, columns]) residuals, derivatives, or both. Returns (tests, observations[, columns]).
    """
    if values.ndim == 2:
        return np.asarray(np.linalg.solve(covariance_factor, values[..., None])[..., 0])
    return np.asarray(np.linalg.solve(covariance_factor, values))


def log_likelihood(residuals: Residuals, noise_model: NoiseModel) -> float:
    """Gaussian log-likelihood of the residuals under a noise model."""
    covariance_factor = cholesky_factors(residuals, noise_model)
    whitened = whiten(covariance_factor, residuals.values)
    k = np.arange(covariance_factor.shape[1])
    log_det = 2.0 * np.log(covariance_factor[:, k, k]).sum()
    count = int(residuals.present.sum())
    return float(-0.5 * ((whitened**2).sum() + log_det + count * np.log(2 * np.pi)))


def predicted_random_effects(residuals: Residuals, noise_model: NoiseModel) -> tuple[Floats, Floats]:
    """Best linear prediction of each test's offsets, (tests, outputs) in their units, and ln rate factor, (tests,)."""
    unweighted = residuals.with_test_weights(np.ones(len(residuals.values)))
    weighted = np.linalg.solve(covariance(unweighted, noise_model), -residuals.values[..., None])[..., 0]
    weighted_sensitivity = residuals.offset_sensitivity * weighted
    offsets = [
        s.offset**2 * np.where(residuals.output_index == k, weighted_sensitivity, 0.0).sum(axis=1)
        for k, s in enumerate(noise_model.outputs.values())
    ]
    return np.stack(offsets, axis=1), noise_model.rate**2 * (residuals.log_rate_sensitivity * weighted).sum(axis=1)


def effective_sample_size(residuals: Residuals, noise_model: NoiseModel) -> float:
    """Number of independent observations that carry the same information on a common mean as all frames together."""
    without_offset = noise_model
    for output in noise_model.outputs:
        without_offset = without_offset.with_output(output, offset=0.0)
    c = covariance(residuals, without_offset)
    k = np.arange(c.shape[1])
    sd = np.sqrt(c[:, k, k])
    correlation = c / (sd[:, :, None] * sd[:, None, :])
    ones = residuals.present.astype(float)
    weights = np.linalg.solve(correlation, ones[..., None])[..., 0]
    return float(np.clip((ones * weights).sum(), len(ones), ones.sum()))


NEGLIGIBLE_DRIFT = 1e-3
"""A drift below this, in transformed outputs, is none."""


NEGLIGIBLE_DISCREPANCY = 0.02
"""A model discrepancy below this, in noises, is none."""


def autocorrelated_components(noise_model: NoiseModel) -> int:
    """How many components the autocorrelated parts of a noise model have: a size and a length each."""
    drifting = sum(components.drift > NEGLIGIBLE_DRIFT for components in noise_model.outputs.values())
    return 2 * (drifting + int(noise_model.discrepancy > NEGLIGIBLE_DISCREPANCY))
