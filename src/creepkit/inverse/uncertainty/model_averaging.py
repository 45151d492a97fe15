"""Bayesian model averaging: intervals over the laws of a ranking, and bands of the creep rate.

A quantity (ln of a rate, a local exponent) is normal, or Student's t, under each law; over all laws it has the
distribution sum_i w_i F_i, whose quantiles are found by bisection (Hoeting et al. (1999), Stat. Sci. 14, 382). At an
uncertain temperature T the rate has the distribution over laws, parameters and T together (Fig. 6d of Chen et al.),

    p(ln rate) = sum_i w_i integral p_i(ln rate | T') g(T') dT',

g uniform over T +- delta or normal with a standard deviation of delta / 1.96. The integral is a sum over the middles of
slices of equal probability, so nothing is linearised in T. delta = 0 gives the band of parameters and laws alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from scipy.stats import norm

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.extrapolation import check_kelvin, warn_of_extrapolation
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.laplace_approximation import delta_method, interval_quantile
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM, MixtureDistribution
from creepkit.inverse.uncertainty.quantities import CoordinateFunction, local_exponent, log_rate
from creepkit.language import temperature as TEMPERATURE
from creepkit.presentation import Presentable, present
from creepkit.records import History
from creepkit.records.units import celsius_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class WeightedFit(Protocol):
    """One law of a ranking: its identification and its weight."""

    @property
    def fit(self) -> Identification:
        """The identification."""
        ...

    @property
    def weight(self) -> float:
        """Its weight."""
        ...


class WeightedLaws(Protocol):
    """A ranking."""

    @property
    def laws(self) -> Sequence[WeightedFit]:
        """Its laws."""
        ...


@dataclass(frozen=True, eq=False)
class ModelAverage(Presentable, text="reports.uncertainty:model_average_text"):
    """Laws with weights that add up to one, each with its own posterior."""

    fits: tuple[Identification, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.fits or len(self.fits) != len(self.weights):
            raise FitError(f"a mixture needs as many laws as weights, found {len(self.fits)} and {len(self.weights)}")
        total = float(sum(self.weights))
        if min(self.weights) < 0 or not (np.isfinite(total) and total > 0):
            raise FitError(f"the weights of a mixture must not be negative, nor all zero; found {self.weights}")
        object.__setattr__(self, "weights", tuple(float(w) / total for w in self.weights))

    @classmethod
    def from_ranking(cls, source: WeightedLaws | Identification) -> ModelAverage:
        """The laws of a ranking; a single identification is a mixture of one."""
        if isinstance(source, Identification):
            return cls((source,), (1.0,))
        weighted = [r for r in source.laws if r.weight > 0]
        return cls(tuple(r.fit for r in weighted), tuple(r.weight for r in weighted))

    @checked
    def rate(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
        warn: bool = True,
    ) -> tuple[Floats, Floats, Floats]:
        """Median creep rate over the laws, 1/s, with its 95 % interval: (rate, low, high).

        stress, temperature, strain, time : numbers or arrays that broadcast, in MPa, K, - and s; what is not given is
        that of the best law's reference point.
        warn : as of Identification.rate.
        """
        self._check_point(warn, stress=stress, temperature=temperature, strain=strain, time=time)
        distribution = self.distribution(log_rate, stress, temperature, strain, time)
        median, low, high = (np.exp(v) for v in distribution.interval())
        return median, low, high

    @checked
    def local_exponent(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
        warn: bool = True,
    ) -> tuple[Floats, Floats, Floats]:
        """Median local stress exponent over the laws, with its 95 % interval: (exponent, low, high).

        stress, temperature, strain, time : as in `rate`, numbers or arrays that broadcast; the results have that shape.
        warn : as of Identification.rate.
        """
        self._check_point(warn, stress=stress, temperature=temperature, strain=strain, time=time)
        return self.distribution(local_exponent, stress, temperature, strain, time).interval()

    def forecast(self, tests: History | Sequence[History], *, level: float = 0.95, **options: Any) -> Any:
        """What tests will show, over the laws, so that bands hold the doubt about the law; as creepkit.forecast()."""
        return present("forecasts.forecast:forecast", self, tests, level=level, **options)

    def _check_point(self, warn: bool, **point: ArrayLike | None) -> None:
        if warn:
            warn_of_extrapolation(self.fits[0].ranges, point, stacklevel=5)

    def distribution(
        self,
        quantity: Callable[..., CoordinateFunction],
        stress: ArrayLike,
        temperature: ArrayLike | None,
        strain: ArrayLike | None,
        time: ArrayLike | None,
    ) -> MixtureDistribution:
        """The distribution over the laws of quantity(coordinates, stress, temperature, strain, time).

        stress, temperature, strain, time : numbers or arrays that broadcast, as in `rate`.
        """
        reference = self.fits[0].reference
        point = [
            default if given is None else given
            for given, default in (
                (temperature, reference.temperature),
                (strain, reference.strain),
                (time, reference.time),
            )
        ]
        functions = [quantity(fit.coordinates, stress, *point) for fit in self.fits]
        normals = [_normal_under_law(fit, function) for fit, function in zip(self.fits, functions, strict=True)]
        location, scale = (np.stack([each[k] for each in normals]) for k in (0, 1))
        if quantity is log_rate:
            at = np.asarray(stress, float), np.asarray(point[0], float)
            misses = [
                f.misfit_half_widths(g, *at) / interval_quantile(f.freedom)
                for f, g in zip(self.fits, functions, strict=True)
            ]
            scale = np.stack([np.hypot(own, more) for own, more in zip(scale, misses, strict=True)])
        return MixtureDistribution(np.array(self.weights), degrees_of_freedom(self.fits), location, scale)


def degrees_of_freedom(fits: Sequence[Identification]) -> Floats:
    """(fits,) degrees of freedom of their intervals."""
    return np.array([min(max(fit.freedom, 1.0), NORMAL_FREEDOM) for fit in fits])


def _normal_under_law(fit: Identification, function: CoordinateFunction) -> tuple[Floats, Floats]:
    """Value and standard deviation under one law; never quite zero, so that a mixture of certainties has quantiles."""
    if fit.samples is not None:
        _, low, high = fit.interval_of(function)
        middle, sd = 0.5 * (low + high), 0.5 * (high - low) / interval_quantile(fit.freedom)
    else:
        middle, sd = delta_method(function, fit.u, fit.covariance)
    return middle, np.maximum(sd, 1e-12 * np.maximum(np.abs(middle), 1.0))


TEMPERATURE_NODES = 81
"""Slices of the temperature's distribution."""


SAME_TEMPERATURE = 5.0
"""K: tests within it of one another say nothing of how a rate depends on temperature."""


@dataclass(frozen=True, eq=False)
class RateBand(Presentable, text="reports.uncertainty:rate_band_text"):
    """Creep rates over stress at an uncertain temperature.

    stress : (points,) MPa; rate, low, high : (points,) 1/s, median and 95 % band, by parameters, laws and temperature.
    parameter_band : (low, high), (points,) 1/s each, of parameters and laws alone. temperature,
    temperature_uncertainty : K. notes : its limitations.
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
        return present("reports.uncertainty:rate_band_figure", self, path)


@checked
def rate_band(
    source: Identification | WeightedLaws | ModelAverage,
    stresses: ArrayLike,
    temperature: float,
    *,
    temperature_uncertainty: float = 10.0,
    temperature_distribution: Literal["uniform", "normal"] = "uniform",
    strain: float | None = None,
    time: float | None = None,
    warn: bool = True,
) -> RateBand:
    """Creep rates at stresses (points,) MPa and temperature +- uncertainty (K), over one law or the laws of a ranking.

    A law without temperature cannot know how the temperature moves its rate, and a note says so. warn : whether a
    temperature that seems to be in Celsius is a FitError.
    """
    mixture = source if isinstance(source, ModelAverage) else ModelAverage.from_ranking(source)
    levels = np.atleast_1d(np.asarray(stresses, float))
    if warn:
        check_kelvin(mixture.fits[0].ranges, temperature)
    if not (
        temperature_uncertainty >= 0
        and np.isfinite(temperature_uncertainty)
        and temperature - temperature_uncertainty > 0
    ):
        raise FitError(
            f"a temperature of {temperature:g} +- {temperature_uncertainty:g} K was asked for; give kelvin, and a "
            "finite uncertainty that is not negative"
        )
    if temperature_distribution not in ("uniform", "normal"):
        raise FitError(f"shape is '{temperature_distribution}'; allowed are 'uniform' and 'normal'")
    if levels.ndim != 1 or not levels.size or not (levels > 0).all():
        raise FitError("a rate band needs von Mises stresses (points,), in MPa, each above zero")
    _, inner_low, inner_high = mixture.distribution(log_rate, levels, temperature, strain, time).interval()
    temperatures = (
        temperature + temperature_uncertainty * _standard_temperatures(temperature_distribution)
        if temperature_uncertainty > 0
        else np.array([temperature])
    )
    distribution_by_temperature = mixture.distribution(log_rate, levels, temperatures[:, None], strain, time)
    median, low, high = _flattened(distribution_by_temperature).interval()
    return RateBand(
        levels,
        np.exp(median),
        np.exp(low),
        np.exp(high),
        (np.exp(inner_low), np.exp(inner_high)),
        float(temperature),
        float(temperature_uncertainty),
        " or ".join(fit.law.title or fit.law.name for fit in mixture.fits),
        _band_notes(mixture, temperature, temperature_uncertainty),
    )


def _standard_temperatures(temperature_distribution: str) -> Floats:
    """(nodes,) temperatures of equal probability, in units of the uncertainty about the middle."""
    probabilities = (np.arange(TEMPERATURE_NODES) + 0.5) / TEMPERATURE_NODES
    return (
        2.0 * probabilities - 1.0
        if temperature_distribution == "uniform"
        else norm.ppf(probabilities) / norm.ppf(0.975)
    )


def _flattened(distribution: MixtureDistribution) -> MixtureDistribution:
    """Parts (laws, nodes, points) as parts (laws x nodes, points)."""
    nodes = distribution.location.shape[1]
    flat = (v.reshape(-1, v.shape[-1]) for v in (distribution.location, distribution.scale))
    return MixtureDistribution(
        np.repeat(distribution.weight, nodes) / nodes, np.repeat(distribution.degrees_of_freedom, nodes), *flat
    )


def _band_notes(mixture: ModelAverage, temperature: float, temperature_uncertainty: float) -> tuple[str, ...]:
    """What the laws, or their tests, cannot know of temperature."""
    notes = []
    laws_without_temperature = [fit.law.name for fit in mixture.fits if not fit.law.uses(TEMPERATURE)]
    if laws_without_temperature and temperature_uncertainty > 0:
        notes.append(
            f"without a temperature in the law {' and '.join(laws_without_temperature)} the band cannot hold what "
            f"{temperature_uncertainty:g} K do to the rate; identify law.times(arrhenius())"
        )
    fit = mixture.fits[0]
    low, high = fit.ranges["temperature"]
    if len(laws_without_temperature) < len(mixture.fits) and high - low < SAME_TEMPERATURE:
        notes.append(
            f"all tests were made at {celsius_text(0.5 * (low + high), digits=0)}: how the rate depends on temperature "
            "is not determined by them, and the band shows it"
        )
    extrapolation = max(low - SAME_TEMPERATURE - temperature, temperature - high - SAME_TEMPERATURE)
    if extrapolation > 0:
        notes.append(
            f"{celsius_text(temperature, digits=0)} lies {extrapolation + SAME_TEMPERATURE:.0f} K outside the tests"
        )
    return tuple(notes)
