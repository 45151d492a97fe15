"""Noise model: residuals, standard deviations of the sources of scatter, and the covariance of one test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.records import Nuisance


@dataclass(frozen=True, eq=False)
class Residuals:
    """Predicted minus measured, for each test the entries of its outputs end to end (see inverse.entries).

    values, slopes : (tests, entries) residual, and dg/dy at the prediction (what one unit of offset changes).
    present : (tests, entries) which entries are data; the others are zero.
    clock : (tests, entries) that in which what the law cannot follow wanders (see Entries.clock).
    jacobian : (tests, entries, unknowns) with respect to x = (u, e), or None.
    rate_effect : (tests, entries) derivative with respect to ln of a factor on this test's creep rate.
    output : (tests, entries) position of the entry's output; loudness : its noise over that of its output.
    trust : (tests,) weight of each test; the covariance of a test is divided by it.
    known : (tests, entries, nuisances) what one standard deviation of further random effects does, or None.
    """

    values: Floats
    transform_derivatives: Floats
    present: Bools
    correlation_time: Floats
    jacobian: Floats | None
    log_rate_sensitivity: Floats
    output_index: Ints
    relative_noise: Floats
    test_weights: Floats
    random_effect_sensitivities: Floats | None = None

    def with_test_weights(self, test_weights: Floats) -> Residuals:
        """The same with other weights of tests."""
        return replace(self, test_weights=test_weights)


MINIMUM_TESTS = 3
"""Below this many tests the scatter between them cannot be seen."""


ASSUMED_RATE_SD = 0.3
"""Scatter of ln rate between tests that is assumed then, unless a likelihood is asked for."""


@dataclass(frozen=True)
class OutputNoise:
    """Standard deviations of one output.

    noise, offset : in the output's unit; misfit, drift : on its scale (ln strain; for a linear scale the spread of
    what was measured is one); reach : on the clock of the output (see Entries.clock).
    """

    noise: float
    misfit: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    correlation_length: float = 1.0


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviations of the sources of scatter: scatter["strain"].offset, scatter.rate.

    outputs : of each output, in the order of the entries; rate : of ln rate between tests.
    """

    outputs: Mapping[str, OutputNoise]
    rate: float = 0.0

    def __getitem__(self, output: str) -> OutputNoise:
        return self.outputs[output]

    def per_observation(self, output_index: Ints, component: str) -> Floats:
        """One size at each entry, (tests, entries), from the positions of the entries' outputs."""
        return np.asarray(np.array([getattr(s, component) for s in self.outputs.values()])[output_index])

    def with_output(self, output: str, **components: float) -> NoiseModel:
        """The same with other sizes of one output."""
        return replace(self, outputs={**self.outputs, output: replace(self.outputs[output], **components)})


def initial_working_noise(observations: ObservationVector, nuisances: Sequence[Nuisance]) -> NoiseModel:
    """Working scatter assumed before anything was fitted: frames wrong by a third, offsets of the scale's floor."""
    by_output = {}
    for name, transform, noise in zip(observations.outputs, observations.transforms, observations.noise, strict=True):
        offset = initial_sd(nuisances, "offset", transform.floor, name)
        by_output[name] = OutputNoise(noise=max(float(noise), 1e-3 * transform.floor), misfit=0.3, offset=offset)
    return NoiseModel(by_output)


def initial_noise_model(working: NoiseModel, nuisances: Sequence[Nuisance]) -> NoiseModel:
    """Where the estimate of the whole scatter begins; a test's one rupture cannot drift."""
    outputs = {
        name: s
        if name == RUPTURE_OUTPUT
        else replace(s, misfit=0.3 * s.misfit, drift=0.5 * s.misfit, correlation_length=1.0)
        for name, s in working.outputs.items()
    }
    return NoiseModel(outputs, initial_sd(nuisances, "rate", ASSUMED_RATE_SD))


def initial_sd(nuisances: Sequence[Nuisance], kind: str, default: float, output: str = "") -> float:
    """Zero unless the nuisance is there for this output; its prior if it has one."""
    standard_deviations = [
        default if n.sd is None else n.sd for n in nuisances if n.kind == kind and n.output in ("", output)
    ]
    return standard_deviations[0] if standard_deviations else 0.0


def fixed_components(nuisances: Sequence[Nuisance], outputs: Sequence[str]) -> set[tuple[str, str]]:
    """Those (output, source) whose size a nuisance states; the rate belongs to the output ""."""
    fixed: set[tuple[str, str]] = {("", "rate") for n in nuisances if n.kind == "rate" and n.sd is not None}
    for output in outputs:
        offset_nuisances = [n for n in nuisances if n.kind == "offset" and n.output in ("", output)]
        if offset_nuisances and offset_nuisances[0].sd is not None:
            fixed.add((output, "offset"))
    return fixed


_JITTER = 1e-10


def covariance(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """(tests, entries, entries); absent entries have unit variance and no company."""
    s, d, present, output = (
        residuals.transform_derivatives,
        residuals.log_rate_sensitivity,
        residuals.present,
        residuals.output_index,
    )
    drift, offset = noise_model.per_observation(output, "drift"), noise_model.per_observation(output, "offset") * s
    c = (drift**2)[:, :, None] * np.exp(
        -time_lags(residuals) / noise_model.per_observation(output, "correlation_length")[:, :, None]
    )
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


def time_lags(residuals: Residuals) -> Floats:
    """(tests, entries, entries) distances on the clock."""
    t = residuals.correlation_time
    return np.abs(t[:, :, None] - t[:, None, :])


def same_output(residuals: Residuals) -> Bools:
    """(tests, entries, entries) whether two entries are of one output."""
    return np.asarray(residuals.output_index[:, :, None] == residuals.output_index[:, None, :])


def cholesky_factors(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """Lower Cholesky factors L of the covariance, (tests, entries, entries); L^-1 r is white."""
    return np.asarray(np.linalg.cholesky(covariance(residuals, noise_model)))


def whiten(covariance_factor: Floats, values: Floats) -> Floats:
    """L^-1 v, whose covariance is the identity where that of v is L L'.

    covariance_factor : (tests, observations, observations) Cholesky factors L.
    values : (tests, observations) or (tests, observations, columns) residuals, derivatives, or both.
    """
    if values.ndim == 2:
        return np.asarray(np.linalg.solve(covariance_factor, values[..., None])[..., 0])
    return np.asarray(np.linalg.solve(covariance_factor, values))


def log_likelihood(residuals: Residuals, noise_model: NoiseModel) -> float:
    """Gaussian log-likelihood of the residuals given the scatter."""
    covariance_factor = cholesky_factors(residuals, noise_model)
    whitened = whiten(covariance_factor, residuals.values)
    k = np.arange(covariance_factor.shape[1])
    log_det = 2.0 * np.log(covariance_factor[:, k, k]).sum()
    count = int(residuals.present.sum())
    return float(-0.5 * ((whitened**2).sum() + log_det + count * np.log(2 * np.pi)))


def predicted_random_effects(residuals: Residuals, noise_model: NoiseModel) -> tuple[Floats, Floats]:
    """Best linear prediction of each test's own offsets, (tests, outputs), and ln rate factor, (tests,)."""
    unweighted = residuals.with_test_weights(np.ones(len(residuals.values)))
    weighted = np.linalg.solve(covariance(unweighted, noise_model), -residuals.values[..., None])[..., 0]
    weighted_sensitivity = residuals.transform_derivatives * weighted
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
"""A drift below this, on its scale, is none."""
