"""One output of one test by weighted laws: its scale, noise, draws and bands, and the variances that these are of.

Bands are pointwise, and simultaneous, which hold a whole curve with the stated probability. With m the median of the
draws at a time and l, h the ends of the pointwise band there, the simultaneous band is m - c (m - l) to m + c (h - m),
c being the quantile of the largest excess of a draw over all times (Montiel Olea and Plagborg-Moller (2019), J. Appl.
Econom. 34, 1).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import norm

from creepkit.arrays import Bools, Floats
from creepkit.forecasts.draws import LIFE_SCATTER, DrawnLaw
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import OutputNoise, known_sd
from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH, RELATIVE_DISCREPANCY_UNIT
from creepkit.inverse.output_transforms import LinearTransform, LogTransform, OutputTransform
from creepkit.records import History, is_logarithmic

MOST_ALIVE = 0.5
"""Share of the draws that must last to a time for a band of an output that says nothing after the end of a test."""


@dataclass(frozen=True, eq=False)
class Band:
    """A band about a curve, in the output's unit: infinite above where draws have ruptured.

    median, low, high : (times,) pointwise, of measured values. lowest, highest : (times,) simultaneous.
    """

    median: Floats
    low: Floats
    high: Floats
    lowest: Floats
    highest: Floats


def band_of_draws(
    values: Floats,
    times: Floats,
    noise: Floats,
    transform: OutputTransform,
    level: float,
    rng: np.random.Generator,
    *,
    grows: bool,
) -> Band:
    """The band of draws of a curve, to which white noise is added.

    values : (draws, times) in the output's unit. times : (times,) s.
    noise : (times,) standard deviation in the transformed output.
    grows : whether a curve that has ended counts as infinitely large.
    """
    alive = np.isfinite(values)
    transformed = np.where(alive, transform.forward(np.where(alive, values, 0.0)), np.nan)
    if grows:
        transformed = _continued(transformed, times)
    counted = np.isfinite(transformed).any(axis=0)
    probabilities = (0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level)
    low, median, high = (
        np.where(counted, q, np.nan) for q in np.nanquantile(np.where(counted, transformed, 0.0), probabilities, axis=0)
    )
    quantile = float(norm.ppf(0.5 + 0.5 * level))
    below = np.hypot(median - low, quantile * noise)
    above = np.hypot(high - median, quantile * noise)
    noisy = transformed + noise * rng.standard_normal(transformed.shape)
    factor = _simultaneous_factor(noisy, median, below, above, level)
    enough = alive.mean(axis=0) >= MOST_ALIVE
    largest = np.max(transformed, initial=-np.inf, where=alive)
    first_ended = np.min(transformed, axis=0, initial=np.inf, where=~alive) if grows else np.full(times.size, np.inf)

    def outputs(g: Floats, infinite: Bools) -> Floats:
        usable = np.isfinite(g) & ~infinite & (enough | grows)
        outside = np.where(infinite & grows, np.inf, np.nan)
        return np.where(usable, transform.inverse(np.where(usable, g, 0.0)), outside)

    def lower(g: Floats) -> Floats:
        return outputs(g, (g > largest) & grows)

    def upper(g: Floats) -> Floats:
        return outputs(g, g >= first_ended)

    return Band(
        outputs(median, ~enough & grows),
        lower(median - below),
        upper(median + above),
        lower(median - factor * below),
        upper(median + factor * above),
    )


def _continued(values: Floats, times: Floats) -> Floats:
    """Curves (draws, times), NaN after their ends, continued in ln t with the slope at which such curves end.

    So a curve that ends early is far above one that ends late, and the band of a curve that is still there where most
    have ended has a lower end.
    """
    log_times = np.log(np.maximum(times, 1e-9 * times[-1]))
    alive = np.isfinite(values)
    lasting, frames = alive.any(axis=1), np.arange(times.size)
    last = times.size - 1 - alive[:, ::-1].argmax(axis=1)
    at_end = np.take_along_axis(values, last[:, None], axis=1)
    before = np.take_along_axis(values, np.maximum(last - 1, 0)[:, None], axis=1)
    slopes = (at_end - before)[:, 0] / np.maximum(log_times[last] - log_times[last - 1], 1e-12)
    slopes = slopes[lasting & (last > 0) & (last < times.size - 1)]
    slope = max(float(np.median(slopes)), 0.0) if slopes.size else 0.0
    beyond = at_end + slope * (log_times - log_times[last][:, None])
    continued = np.where(frames > last[:, None], beyond, values)
    if lasting.any() and not lasting.all():
        continued[~lasting] = np.nanmax(continued[lasting], axis=0)
    return continued


def _simultaneous_factor(values: Floats, median: Floats, below: Floats, above: Floats, level: float) -> float:
    """The factor on half widths (times,) at which `level` of the draws (draws, times) are inside at all times."""
    counted = np.isfinite(median) & (below > 0) & (above > 0)
    if not counted.any():
        return 1.0
    deviation = values[:, counted] - median[counted]
    excess = np.where(deviation > 0, deviation / above[counted], -deviation / below[counted])
    largest = np.nan_to_num(excess, nan=0.0).max(axis=1)
    return max(1.0, float(np.quantile(largest, level, method="higher")))


LAW, CHOICE_OF_LAW, OFFSET, NOISE, MISFIT, NUMERICAL = (
    "parameters of the law",
    "choice of the law",
    "offset",
    "noise",
    "misfit of the law",
    "numerical error",
)
"""Parts of a band, beside the scatter of rates and the dimensions."""


@dataclass(frozen=True, eq=False)
class OutputForecast:
    """One output of one test.

    times : (times,) s. value : (times,) at the identified values. band : of measured values.
    shares : {part of the band: (times,) its share of the variance}, to first order, in the logarithm of a strain.
    """

    output: str
    times: Floats
    value: Floats
    band: Band
    shares: Mapping[str, Floats]


SMALLEST_STRAIN_RATIO = 1e-3
"""Floor of the logarithmic scale of a strain in a band, over its largest value."""


NOISES_IN_FLOOR = 3.0
"""Noises of a frame, or offsets, below which that scale is linear, so that they are symmetrical about the curve."""


COMPARED_STRAIN_RATIO = 1e-2
"""The same of the scale on which tests are compared (see inverse.observation_vector.transform_for)."""


@dataclass(frozen=True, eq=False)
class BandedOutput:
    """One output of one test.

    drawn : laws, with weights. history : the test, at the times of its bands.
    """

    drawn: Sequence[DrawnLaw]
    history: History
    name: str

    @cached_property
    def best(self) -> DrawnLaw:
        """The law of most weight."""
        return max(self.drawn, key=lambda one: one.weight)

    @property
    def fit(self) -> Identification:
        """The identification of that law."""
        return self.best.draws.fit

    @cached_property
    def central(self) -> Floats:
        """(times,) at the identified values, in the output's unit."""
        return np.asarray(self.best.central.of(self.name, self.history.times)[0])

    # ---- scale and noise -----------------------------------------------------------------------------------------

    @property
    def is_fitted(self) -> bool:
        """Whether some fitted test has this output; of another one only what the history states is known."""
        return self.name in self.fit.noise_model.outputs

    @property
    def known(self) -> OutputNoise:
        """Its noise in the fitted tests; none of an output that was not fitted."""
        return self.fit.noise_model.outputs.get(self.name, OutputNoise(0.0))

    @cached_property
    def frame_noise(self) -> Floats:
        """(times,) standard deviation of a frame: as the history states it, else that of the fitted tests."""
        stated = self.history.standard_deviation.get(self.name)
        usual = np.full(self.history.times.size, self.known.noise)
        return usual if stated is None else np.where(np.isfinite(stated) & (stated > 0), stated, usual)

    @cached_property
    def transform(self) -> OutputTransform:
        """The scale on which it is banded: logarithmic for a strain."""
        largest = float(np.nanmax(np.abs(self.central), initial=0.0))
        if is_logarithmic(self.name):
            noise = max(float(np.median(self.frame_noise)), self.known.offset)
            return LogTransform(max(SMALLEST_STRAIN_RATIO * largest, NOISES_IN_FLOOR * noise, 1e-14))
        usual = self.fit.scatter_of_rates.output_scales.get(self.name, 0.0)
        return LinearTransform(usual or max(float(np.nanstd(self.central)), 1e-12 + 1e-3 * largest), largest)

    @property
    def slope(self) -> Floats:
        """(times,) derivative of the transformed output to the output."""
        return self.transform.derivative(_finite(self.central))

    @property
    def discrepancy(self) -> float:
        """Standard deviation of the model discrepancy, in the transformed output."""
        unit = RELATIVE_DISCREPANCY_UNIT
        if isinstance(self.transform, LinearTransform):
            unit = self.known.noise / self.transform.scale
        return self.fit.noise_model.discrepancy * unit if self.is_fitted else 0.0

    @cached_property
    def noise(self) -> tuple[Floats, Floats]:
        """Root of the covariance of correlated noise (times, sources), and white noise (times,), in the transform."""
        times, known, slope, linear = self.history.times, self.known, self.slope, not is_logarithmic(self.name)
        if linear:
            coordinate = LINEAR_COORDINATE_LENGTH * times / max(float(times[-1]), 1e-300)
        else:
            coordinate = np.log(np.maximum(times, 1e-9 * times[-1]))
        lags = np.abs(coordinate[:, None] - coordinate[None, :])
        total = known.drift**2 * np.exp(-lags / known.correlation_length)
        total = total + self.discrepancy**2 * np.exp(-lags / self.fit.noise_model.discrepancy_length)
        size, finite = float(total[0, 0]), _finite(self.central)
        # What lies beside the law has one size on the scale on which tests are compared, whose floor is higher.
        usual = COMPARED_STRAIN_RATIO * float(np.abs(finite).max())
        floor = self.fit.scatter_of_rates.output_floors.get(self.name, usual)
        compared = self.transform if linear else LogTransform(max(floor, 1e-14))
        visible = slope / compared.derivative(finite)
        root = np.zeros((times.size, 0))
        if size > 0:
            root = np.linalg.cholesky(total + 1e-9 * size * np.eye(times.size)) * visible[:, None]
        return root, np.hypot(slope * self.frame_noise, known.misfit * visible)

    # ---- draws ---------------------------------------------------------------------------------------------------

    def offsets(self, count: int, rng: np.random.Generator) -> Floats:
        """(count,) offsets of a test: where n tests told of their size they are Student's t of n."""
        if not self.is_fitted:
            return np.zeros(count)
        if known_sd(self.fit.settings.nuisances, "offset", self.name):
            return np.asarray(self.known.offset * rng.standard_normal(count))
        return np.asarray(self.known.offset * rng.standard_t(len(self.fit.scatter_of_rates.tests), count))

    def reached(self, target: float, count: int, rng: np.random.Generator) -> Floats:
        """(count,) what predicted curves must reach, so that measured ones reach the target: without what lies beside.

        That is the offset of the test and what lasts over many frames; the noise of a single frame is left out.
        """
        if not self.is_fitted:
            return np.full(count, target)
        shifted = target - self.offsets(count, rng)
        slow = np.sqrt(self.known.drift**2 + self.discrepancy**2) * rng.standard_normal(count)
        if isinstance(self.transform, LinearTransform):
            return np.asarray(shifted - self.transform.scale * slow)
        return np.asarray(shifted * np.exp(-slow))

    def forecast(self, level: float, rng: np.random.Generator) -> OutputForecast:
        """The curve with its band, which holds a measured value with probability `level`, and what it is made of."""
        parts, (smooth, white) = [], self.noise
        for one in self.drawn:
            values = one.drawn.of(self.name, self.history.times)
            values = values + self.offsets(len(values), rng)[:, None]
            parts.append(values + one.numerical.get(self.name, 0.0) * rng.standard_normal((len(values), 1)))
        values = np.concatenate(parts)
        alive = np.isfinite(values)
        correlated = rng.standard_normal((len(values), smooth.shape[1])) @ smooth.T
        g = self.transform.forward(np.where(alive, values, 0.0)) + correlated
        values = np.where(alive, self.transform.inverse(g), np.nan)
        finite = self.central[np.isfinite(self.central)]
        grows = self.best.central.outputs[0] == self.name and bool(finite.size < 2 or finite[-1] >= finite[0])
        band = band_of_draws(values, self.history.times, white, self.transform, level, rng, grows=grows)
        return OutputForecast(self.name, self.history.times, self.central, band, self.shares())

    # ---- variances -----------------------------------------------------------------------------------------------

    def shares(self) -> dict[str, Floats]:
        """{part: (times,) share of the variance}, to first order, in the transformed output."""
        (smooth, white), known = self.noise, self.known
        weight = np.array([one.weight for one in self.drawn]) / sum(one.weight for one in self.drawn)
        variances: dict[str, Any] = defaultdict(float)
        for one, share in zip(self.drawn, weight, strict=True):
            for part, value in self._law_variances(one).items():
                variances[part] = variances[part] + share * value
        if len(self.drawn) > 1:
            curves = [one.central.of(self.name, self.history.times)[0] for one in self.drawn]
            g = np.stack([self.transform.forward(np.nan_to_num(curve)) for curve in curves])
            variances[CHOICE_OF_LAW] = weight @ (g - weight @ g) ** 2
        variances[OFFSET] = (self.slope * known.offset) ** 2
        variances[NUMERICAL] = (self.slope * self.best.numerical.get(self.name, 0.0)) ** 2
        correlated = (smooth**2).sum(axis=1)
        both = known.drift**2 + self.discrepancy**2
        share_of_drift = known.drift**2 / both if both > 0 else 0.0
        variances[NOISE] = np.maximum(white**2 - known.misfit**2, 0.0) + correlated * share_of_drift
        variances[MISFIT] = np.minimum(known.misfit**2, white**2) + correlated * (1.0 - share_of_drift)
        total = np.sum([*variances.values()], axis=0)
        return {
            part: np.where(total > 0, value / np.maximum(total, 1e-300), 0.0)
            for part, value in variances.items()
            if np.nanmax(value, initial=0.0) > 0
        }

    def _law_variances(self, one: DrawnLaw) -> dict[str, Floats]:
        """{part: (times,) variance of the transformed output} by parameters, scatter of rates and dimensions.

        What was estimated together with the law, a known heat or what all tests share, is one part with it.
        """
        of, column = one.sensitivities, one.sensitivities.outputs.index(self.name)
        slope = self.transform.derivative(_finite(one.central.of(self.name, self.history.times)[0]))
        rate, scatter = slope * of.rate[:, column], one.draws.fit.scatter_of_rates
        by_joint = np.zeros((self.history.times.size, scatter.joint_design.shape[1]))
        by_joint[:, : one.draws.fit.u.size] = slope[:, None] * of.coordinates[:, column]
        by_joint[:, [*scatter.new_test(self.history).known.values()]] = rate[:, None]
        variances = {source: rate**2 * variance for source, variance in one.own_variances.items()}
        variances[LIFE_SCATTER] = (slope * of.life[:, column] * one.draws.fit.noise_model.life) ** 2
        for dimension in one.dimensions:
            change = slope * of.dimensions[dimension.kind][:, column]
            if dimension.shared is None:
                variances[dimension.kind] = (change * dimension.sd) ** 2
            else:
                by_joint[:, dimension.shared] = change
        return {LAW: np.einsum("ti,ij,tj->t", by_joint, scatter.mean_joint[1], by_joint), **variances}


def _finite(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, 0.0)
