"""What a band is made of: variances of its parts, to first order, in the transformed output; the noise of a test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.forecasts.drawn_law import DrawnLaw
from creepkit.forecasts.results import CHOICE_OF_LAW, LAW, MISFIT, NOISE, NUMERICAL, OFFSET
from creepkit.forecasts.simulation import at_times
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import OutputNoise, components_fixed_by_priors
from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH, RELATIVE_DISCREPANCY_UNIT
from creepkit.inverse.output_transforms import LinearTransform, LogTransform, OutputTransform
from creepkit.records import History, is_logarithmic

SMALLEST_STRAIN_RATIO = 1e-3
"""Floor of the logarithmic scale of a strain in a band, over its largest value."""


NOISES_IN_FLOOR = 3.0
"""Noises of a frame, or offsets, below which that scale is linear, so that they are symmetrical about the curve."""


COMPARED_STRAIN_RATIO = 1e-2
"""The same of the scale on which tests are compared (see inverse.observation_vector.log_transform_for)."""


def band_transform(fit: Identification, history: History, name: str, central: Floats) -> OutputTransform:
    """The scale on which an output is banded: logarithmic for a strain; central : (times,) in the output's unit."""
    largest = float(np.nanmax(np.abs(central), initial=0.0))
    if is_logarithmic(name):
        known = fit.noise_model.outputs.get(name)
        noise = max(float(np.median(frame_noise_of(fit, history, name))), 0.0 if known is None else known.offset)
        return LogTransform(max(SMALLEST_STRAIN_RATIO * largest, NOISES_IN_FLOOR * noise, 1e-14))
    scale = fit.scatter_of_rates.output_scales.get(name, 0.0) or max(float(np.nanstd(central)), 1e-12 + 1e-3 * largest)
    return LinearTransform(scale, largest)


def frame_noise_of(fit: Identification, history: History, name: str) -> Floats:
    """(times,) standard deviation of a frame: as the history states it, else that of the fitted tests."""
    known, stated = fit.noise_model.outputs.get(name), history.standard_deviation.get(name)
    usual = np.full(history.times.size, 0.0 if known is None else known.noise)
    return usual if stated is None else np.where(np.isfinite(stated) & (stated > 0), stated, usual)


def offset_draws(fit: Identification, name: str, count: int, rng: np.random.Generator) -> Floats:
    """(count,) offsets of a test in one output: where n tests told of their size they are Student's t of n."""
    known = fit.noise_model.outputs.get(name)
    if known is None:
        return np.zeros(count)
    if (name, "offset") in components_fixed_by_priors(fit.settings.nuisances, [name]):
        return np.asarray(known.offset * rng.standard_normal(count))
    return np.asarray(known.offset * rng.standard_t(len(fit.scatter_of_rates.tests), count))


def noise_in_output(
    fit: Identification, history: History, name: str, central: Floats, transform: OutputTransform
) -> tuple[Floats, Floats]:
    """Root of the covariance of correlated noise (times, times), and white noise (times,), in the transformed output.

    Of an output that was not fitted only what the history states is known. central : (times,) in the output's unit.
    """
    times = history.times
    slope = transform.derivative(np.where(np.isfinite(central), central, 0.0))
    known: OutputNoise | None = fit.noise_model.outputs.get(name)
    frame = frame_noise_of(fit, history, name)
    if known is None:
        return np.zeros((times.size, 0)), np.abs(slope * frame)
    logarithmic = is_logarithmic(name)
    coordinate = (
        np.log(np.maximum(times, 1e-9 * times[-1]))
        if logarithmic
        else LINEAR_COORDINATE_LENGTH * times / max(float(times[-1]), 1e-300)
    )
    unit = RELATIVE_DISCREPANCY_UNIT if logarithmic else known.noise / float(getattr(transform, "scale", 1.0))
    lags = np.abs(coordinate[:, None] - coordinate[None, :])
    total = known.drift**2 * np.exp(-lags / known.correlation_length)
    total = total + (fit.noise_model.discrepancy * unit) ** 2 * np.exp(-lags / fit.noise_model.discrepancy_length)
    size = float(total[0, 0])
    # What lies beside the law has one size on the scale on which tests are compared, whose floor is higher.
    finite = np.where(np.isfinite(central), central, 0.0)
    floor = fit.scatter_of_rates.output_floors.get(name, COMPARED_STRAIN_RATIO * float(np.abs(finite).max()))
    fitted = LogTransform(max(floor, 1e-14)) if logarithmic else transform
    visible = slope / fitted.derivative(finite)
    root = (
        np.linalg.cholesky(total + 1e-9 * size * np.eye(times.size)) * visible[:, None]
        if size > 0
        else np.zeros((times.size, 0))
    )
    return root, np.hypot(slope * frame, known.misfit * visible)


def variance_shares(
    drawn: Sequence[DrawnLaw],
    best: DrawnLaw,
    history: History,
    name: str,
    transform: OutputTransform,
    smooth: Floats,
    white: Floats,
) -> dict[str, Floats]:
    """{part: (times,) share of the variance}, to first order, in the transformed output.

    smooth : (times, sources) root of the covariance of correlated noise; white : (times,) the other noise.
    """
    total_weight = sum(one.weight for one in drawn)
    variances: dict[str, Floats] = {}
    for one in drawn:
        for part, value in _law_variances(one, history, name, transform).items():
            variances[part] = variances.get(part, 0.0) + one.weight / total_weight * value
    fit = best.draws.fit
    known = fit.noise_model.outputs.get(name)
    central = at_times(best.central, history.times).of(name)[0]
    slope = transform.derivative(np.where(np.isfinite(central), central, 0.0))
    if len(drawn) > 1:
        g = np.stack(
            [transform.forward(np.nan_to_num(at_times(one.central, history.times).of(name)[0])) for one in drawn]
        )
        weight = np.array([one.weight for one in drawn]) / total_weight
        variances[CHOICE_OF_LAW] = weight @ (g - weight @ g) ** 2
    variances[OFFSET] = (slope * (0.0 if known is None else known.offset)) ** 2
    variances[NUMERICAL] = (slope * best.numerical.get(name, 0.0)) ** 2
    misfit = 0.0 if known is None else known.misfit
    discrepancy = (smooth**2).sum(axis=1) if smooth.size else np.zeros(history.times.size)
    drift = known.drift**2 if known is not None else 0.0
    both = drift + discrepancy_variance(fit, name, transform)
    share_of_drift = drift / both if both > 0 else 0.0
    variances[NOISE] = np.maximum(white**2 - misfit**2, 0.0) + discrepancy * share_of_drift
    variances[MISFIT] = np.minimum(misfit**2, white**2) + discrepancy * (1.0 - share_of_drift)
    total = np.sum([*variances.values()], axis=0)
    return {
        part: np.where(total > 0, value / np.maximum(total, 1e-300), 0.0)
        for part, value in variances.items()
        if np.nanmax(value, initial=0.0) > 0
    }


def discrepancy_variance(fit: Identification, name: str, transform: OutputTransform) -> float:
    """Variance of the model discrepancy of one output, in the transformed output."""
    known = fit.noise_model.outputs.get(name)
    if known is None:
        return 0.0
    logarithmic = is_logarithmic(name)
    unit = RELATIVE_DISCREPANCY_UNIT if logarithmic else known.noise / float(getattr(transform, "scale", 1.0))
    return float((fit.noise_model.discrepancy * unit) ** 2)


def _law_variances(one: DrawnLaw, history: History, name: str, transform: OutputTransform) -> dict[str, Floats]:
    """{part: (times,) variance of the transformed output} by parameters, scatter of rates and dimensions of one law.

    What was estimated together with the law, a known heat or what all tests share, is one part with it.
    """
    central, column = at_times(one.central, history.times).of(name)[0], one.sensitivities.outputs.index(name)
    slope = transform.derivative(np.where(np.isfinite(central), central, 0.0))[:, None]
    rate = slope[:, 0] * one.sensitivities.rate[:, column]
    scatter, size = one.draws.fit.scatter_of_rates, one.draws.fit.u.size
    by_joint = np.zeros((history.times.size, scatter.joint_design.shape[1]))
    by_joint[:, :size] = slope * one.sensitivities.coordinates[:, column]
    by_joint[:, [*scatter.new_test(history).known.values()]] = rate[:, None]
    for dimension in one.dimensions:
        if dimension.shared is not None:
            by_joint[:, dimension.shared] = slope[:, 0] * one.sensitivities.dimensions[dimension.kind][:, column]
    variances = {LAW: np.einsum("ti,ij,tj->t", by_joint, scatter.mean_joint[1], by_joint)}
    for source, variance in one.own_variances.items():
        variances[source] = rate**2 * variance
    for dimension in (d for d in one.dimensions if d.shared is None):
        change = slope[:, 0] * one.sensitivities.dimensions[dimension.kind][:, column] * dimension.sd
        variances[dimension.kind] = change**2
    return variances
