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
from creepkit.inverse.intervals.mixture import Laws, Mixture, Parts
from creepkit.inverse.intervals.quantities import log_rate
from creepkit.language import temperature as TEMPERATURE
from creepkit.records import ZERO_CELSIUS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NODES = 81
"""Slices of the temperature's distribution."""
CLOSE = 5.0
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
    inner: tuple[Floats, Floats]
    temperature: float
    plus_minus: float
    name: str = ""
    notes: tuple[str, ...] = ()

    def plot(self, path: str | Path | None = None) -> Figure:
        """Rate over stress, both logarithmic, with both bands; written to `path` when given."""
        from creepkit.inverse.intervals.plots import bands_figure

        return bands_figure([self], path)

    def __str__(self) -> str:
        warm = f"{self.temperature - ZERO_CELSIUS:.0f} +- {self.plus_minus:g} C"
        lines = [f"creep rate at {warm}, 95 % band"]
        for row in zip(self.stress, self.rate, self.low, self.high, strict=True):
            lines.append("  {:8.4g} MPa  {:9.3g}  [{:.3g}, {:.3g}] 1/s".format(*row))
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])


def rate_band(
    source: Identification | Laws | Mixture, stresses: ArrayLike, temperature: float, *, plus_minus: float = 10.0,
    shape: Literal["uniform", "normal"] = "uniform", strain: float | None = None, time: float | None = None,
) -> RateBand:  # fmt: skip
    """Creep rates at `stresses` (MPa) and temperature +- plus_minus (K), over one law or the laws of a ranking.

    A law without temperature cannot know how the temperature moves its rate: its part of the band is not widened, and
    a note says so.
    """
    mixture = source if isinstance(source, Mixture) else Mixture.of(source)
    levels = np.atleast_1d(np.asarray(stresses, float))
    if not (plus_minus >= 0 and np.isfinite(plus_minus) and temperature - plus_minus > 0):
        raise FitError(
            f"a temperature of {temperature:g} +- {plus_minus:g} K was asked for; give kelvin, and a finite "
            "uncertainty that is not negative"
        )
    if shape not in ("uniform", "normal"):
        raise FitError(f"shape is '{shape}'; allowed are 'uniform' and 'normal'")
    if not (levels > 0).all():
        raise FitError("a rate band was asked for at a stress that is not above zero; give von Mises stresses, in MPa")
    _, inner_low, inner_high = mixture.parts(log_rate, levels, temperature, strain, time).interval()
    warmth = temperature + plus_minus * _slices(shape) if plus_minus > 0 else np.array([temperature])
    each = mixture.parts(log_rate, levels, warmth[:, None], strain, time)
    middle, low, high = _joined(each).interval()
    return RateBand(
        levels, np.exp(middle), np.exp(low), np.exp(high), (np.exp(inner_low), np.exp(inner_high)), float(temperature),
        float(plus_minus), " or ".join(fit.law.title or fit.law.name for fit in mixture.fits),
        _notes(mixture, temperature, plus_minus),
    )  # fmt: skip


def _slices(shape: str) -> Floats:
    """(nodes,) temperatures of equal probability, in units of plus_minus about the middle."""
    share = (np.arange(NODES) + 0.5) / NODES
    return 2.0 * share - 1.0 if shape == "uniform" else norm.ppf(share) / norm.ppf(0.975)


def _joined(each: Parts) -> Parts:
    """Parts (laws, nodes, points) as parts (laws x nodes, points)."""
    nodes = each.middle.shape[1]
    flat = (v.reshape(-1, v.shape[-1]) for v in (each.middle, each.sd))
    return Parts(np.repeat(each.weight, nodes) / nodes, np.repeat(each.freedom, nodes), *flat)


def _notes(mixture: Mixture, temperature: float, plus_minus: float) -> tuple[str, ...]:
    """What the laws, or their tests, cannot know of temperature."""
    found = []
    blind = [fit.law.name for fit in mixture.fits if not fit.law.uses(TEMPERATURE)]
    if blind and plus_minus > 0:
        found.append(
            f"without a temperature in the law {' and '.join(blind)} the band cannot hold what {plus_minus:g} K do to "
            "the rate; identify law.times(arrhenius())"
        )
    fit = mixture.fits[0]
    low, high = fit.ranges["temperature"]
    if len(blind) < len(mixture.fits) and high - low < CLOSE:
        found.append(
            f"all tests were made at {0.5 * (low + high) - ZERO_CELSIUS:.0f} C: how the rate depends on temperature is "
            "not determined by them, and the band shows it"
        )
    outside = max(low - CLOSE - temperature, temperature - high - CLOSE)
    if outside > 0:
        found.append(f"{temperature - ZERO_CELSIUS:.0f} C lies {outside + CLOSE:.0f} K outside the tests")
    return tuple(found)
