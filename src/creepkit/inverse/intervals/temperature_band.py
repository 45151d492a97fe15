"""Bands of the creep rate over stress at one temperature that is itself uncertain, as in Fig. 6d of Chen et al.

At an uncertain temperature T the rate has the distribution over laws, their parameters and T together,

    p(ln rate) = sum_i w_i integral p_i(ln rate | T') g(T') dT',

g uniform over T +- delta ("uniform": a controller keeps within delta) or normal with a standard deviation of delta
/ 1.96 ("normal": delta is a 95 % interval itself). The integral is a sum over the middles of NODES slices of equal
probability, so nothing is made linear in T. delta = 0 leaves the band of the parameters alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.stats import norm

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.mixture import WeightedLaws, ModelAverage, MixtureDistribution
from creepkit.inverse.intervals.quantities import log_rate
from creepkit.language import temperature as TEMPERATURE
from creepkit.records import ZERO_CELSIUS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TEMPERATURE_NODES = 81
"""Slices of the temperature's distribution."""
SAME_TEMPERATURE = 5.0
"""K: tests within it of one another say nothing of how a rate depends on temperature."""


@dataclass(frozen=True, eq=False)
class RateBand:
    """Creep rates over stress at an uncertain temperature.

    stress : (points,) MPa; rate, low, high : (points,) 1/s, median and 95 % band, by parameters, laws and temperature.
    inner : (low, high) of parameters and laws alone. temperature, plus_minus : K. notes : what it cannot know.
    """

    stress: Floats
    rate: Floats
    low: Floats
    high: Floats
    parameter_band: tuple[Floats, Floats]
    temperature: float
    temperature_uncertainty: float
    name: str = ""
    notes: tuple[str, ...] = ()

    def plot(self, path: str | Path | None = None) -> Figure:
        """Rate over stress, both logarithmic, with both bands; written to `path` when given."""
        from creepkit.inverse.intervals.plots import rate_bands_figure

        return rate_bands_figure([self], path)

    def __str__(self) -> str:
        temperature_text = f"{self.temperature - ZERO_CELSIUS:.0f} +- {self.temperature_uncertainty:g} C"
        lines = [f"creep rate at {temperature_text}, 95 % band"]
        for row in zip(self.stress, self.rate, self.low, self.high, strict=True):
            lines.append("  {:8.4g} MPa  {:9.3g}  [{:.3g}, {:.3g}] 1/s".format(*row))
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])


def rate_band(
    source: Identification | WeightedLaws | ModelAverage, stresses: ArrayLike, temperature: float, *, temperature_uncertainty: float = 10.0,
    temperature_distribution: Literal["uniform", "normal"] = "uniform", strain: float | None = None, time: float | None = None,
) -> RateBand:  # fmt: skip
    """Creep rates at `stresses` (MPa) and temperature +- plus_minus (K), over one law or the laws of a ranking.

    A law without temperature cannot know how the temperature moves its rate: its part of the band is not widened, and
    a note says so.
    """
    mixture = source if isinstance(source, ModelAverage) else ModelAverage.from_ranking(source)
    levels = np.atleast_1d(np.asarray(stresses, float))
    if not (temperature_uncertainty >= 0 and np.isfinite(temperature_uncertainty) and temperature - temperature_uncertainty > 0):
        raise FitError(
            f"a temperature of {temperature:g} +- {temperature_uncertainty:g} K was asked for; give kelvin, and a finite "
            "uncertainty that is not negative"
        )
    if temperature_distribution not in ("uniform", "normal"):
        raise FitError(f"shape is '{temperature_distribution}'; allowed are 'uniform' and 'normal'")
    if not (levels > 0).all():
        raise FitError("a rate band was asked for at a stress that is not above zero; give von Mises stresses, in MPa")
    _, inner_low, inner_high = mixture.distribution(log_rate, levels, temperature, strain, time).interval()
    temperatures = temperature + temperature_uncertainty * _standard_temperatures(temperature_distribution) if temperature_uncertainty > 0 else np.array([temperature])
    distribution_by_temperature = mixture.distribution(log_rate, levels, temperatures[:, None], strain, time)
    median, low, high = _flattened(distribution_by_temperature).interval()
    return RateBand(
        levels, np.exp(median), np.exp(low), np.exp(high), (np.exp(inner_low), np.exp(inner_high)), float(temperature),
        float(temperature_uncertainty), " or ".join(fit.law.title or fit.law.name for fit in mixture.fits),
        _band_notes(mixture, temperature, temperature_uncertainty),
    )  # fmt: skip


def _standard_temperatures(temperature_distribution: str) -> Floats:
    """(nodes,) temperatures of equal probability, in units of plus_minus about the middle."""
    probabilities = (np.arange(TEMPERATURE_NODES) + 0.5) / TEMPERATURE_NODES
    return 2.0 * probabilities - 1.0 if temperature_distribution == "uniform" else norm.ppf(probabilities) / norm.ppf(0.975)


def _flattened(distribution: MixtureDistribution) -> MixtureDistribution:
    """Parts (laws, nodes, points) as parts (laws x nodes, points)."""
    nodes = distribution.location.shape[1]
    flat = (v.reshape(-1, v.shape[-1]) for v in (distribution.location, distribution.scale))
    return MixtureDistribution(np.repeat(distribution.weight, nodes) / nodes, np.repeat(distribution.degrees_of_freedom, nodes), *flat)


def _band_notes(mixture: ModelAverage, temperature: float, temperature_uncertainty: float) -> tuple[str, ...]:
    """What the laws, or their tests, cannot know of temperature."""
    notes = []
    laws_without_temperature = [fit.law.name for fit in mixture.fits if not fit.law.uses(TEMPERATURE)]
    if laws_without_temperature and temperature_uncertainty > 0:
        notes.append(
            f"without a temperature in the law {' and '.join(laws_without_temperature)} the band cannot hold what {temperature_uncertainty:g} K do to "
            "the rate; identify law.times(arrhenius())"
        )
    fit = mixture.fits[0]
    low, high = fit.ranges["temperature"]
    if len(laws_without_temperature) < len(mixture.fits) and high - low < SAME_TEMPERATURE:
        notes.append(
            f"all tests were made at {0.5 * (low + high) - ZERO_CELSIUS:.0f} C: how the rate depends on temperature is "
            "not determined by them, and the band shows it"
        )
    extrapolation = max(low - SAME_TEMPERATURE - temperature, temperature - high - SAME_TEMPERATURE)
    if extrapolation > 0:
        notes.append(f"{temperature - ZERO_CELSIUS:.0f} C lies {extrapolation + SAME_TEMPERATURE:.0f} K outside the tests")
    return tuple(notes)
