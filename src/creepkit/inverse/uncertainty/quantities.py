"""Quantities that have intervals: a parameter, the creep rate at a point, the local stress exponent there.

Each is a function of the conditioned coordinates u, looked at on the scale on which it is nearly normal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from creepkit import limits
from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.extrapolation import warn_of_extrapolation
from creepkit.language import CreepLaw
from creepkit.language.symbols import GAS_CONSTANT

EXPONENT_STRESS_RATIO = 1.0005
"""Ratio of the stresses between which a local exponent is taken, to each side."""


ENERGY_TEMPERATURE_RATIO = 1.0005
"""The same of the temperatures between which an activation energy is taken."""


CoordinateFunction = Callable[[Floats], Floats]
"""u (..., parameters) to numbers (..., points)."""


PointQuantity = Callable[..., CoordinateFunction]
"""log_rate or local_exponent: of coordinates, and stress, temperature, strain and time by name."""


Interval = tuple[Floats, Floats, Floats]
"""Value with the ends of its 95 % interval, (...,) each."""


class RateStatements:
    """What states creep rates and local exponents with intervals: an identification, laws together, posterior draws.

    ranges : {"stress", "temperature", "strain", "time": (low, high)} that the tests cover; MPa, K, - and s.
    """

    ranges: Mapping[str, tuple[float, float]]

    @property
    def stated_laws(self) -> tuple[CreepLaw, ...]:
        """Whose rates are stated."""
        raise NotImplementedError

    def interval_at(self, quantity: PointQuantity, point: Mapping[str, ArrayLike | None]) -> Interval:
        """Value and 95 % interval of a quantity; point : {name: (...,) or None for that of the reference point}."""
        raise NotImplementedError

    @checked
    def rate(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
        warn: bool = True,
    ) -> Interval:
        """Creep rate, 1/s, with its 95 % interval: (rate, low, high), each of the broadcast shape; of draws the median.

        stress, temperature, strain, time : numbers or arrays that broadcast, in MPa, K, - and s; by default those of
        the reference point: without a temperature the rate is that at `reference.temperature`, the median of the tests.
        warn : whether a point outside `ranges` gives a FitWarning, and a temperature that seems to be in Celsius a
            FitError.

        Outside the tests, and by a law that they contradict, the interval of an identification is widened by what the
        law misses there as far as the tests tell (see uncertainty.law_misfit).
        """
        value, low, high = self._interval(log_rate, warn, stress, temperature, strain, time)
        return np.exp(value), np.exp(low), np.exp(high)

    @checked
    def local_exponent(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
        warn: bool = True,
    ) -> Interval:
        """Local stress exponent d ln rate / d ln stress with its 95 % interval: (exponent, low, high).

        stress, temperature, strain, time : as in `rate`, numbers or arrays that broadcast; results have that shape.
        warn : as in `rate`.
        """
        return self._interval(local_exponent, warn, stress, temperature, strain, time)

    def _interval(self, quantity: PointQuantity, warn: bool, *point: ArrayLike | None) -> Interval:
        named = dict(zip(STATE_LIMITS, point, strict=True))
        check_state(named)
        if warn:
            warn_of_extrapolation(self.stated_laws, self.ranges, named, stacklevel=5)
        return self.interval_at(quantity, named)


@dataclass(frozen=True)
class DerivedQuantity:
    """Something that follows from the values of a law.

    scale : "log" where its logarithm is what is nearly normal.
    function : the function of u, on that scale, of a law's coordinates; u (..., parameters) to (...,).
    point : {"stress", "temperature", ...: number} where it is asked for, in MPa, K, - and s.
    """

    name: str
    unit: str
    scale: Literal["linear", "log"]
    function: Callable[[Coordinates], CoordinateFunction]
    point: Mapping[str, float | None] = field(default_factory=dict)

    def to_unit(self, value: Floats | float) -> Floats:
        """In the quantity's unit, (...,), from a value (...,) on its scale."""
        return np.exp(value) if self.scale == "log" else np.asarray(value, float)


def parameter(coordinates: Coordinates, name: str) -> DerivedQuantity:
    """One parameter of the law of these coordinates, by name."""
    position = coordinates.names.index(coordinates.law.symbol(name).name)
    param = coordinates.law.table[name]
    return DerivedQuantity(name, param.unit, param.scale, lambda c: lambda u: c.theta(u)[..., position])


@checked
def rate_at(
    stress: float, temperature: float | None = None, *, strain: float | None = None, time: float | None = None
) -> DerivedQuantity:
    """The creep rate, 1/s, at a stress (MPa) and temperature (K); what is left out is that of the reference point."""
    return _at(("rate", "1/s", "log"), log_rate, stress, temperature, strain, time)


@checked
def exponent_at(
    stress: float, temperature: float | None = None, *, strain: float | None = None, time: float | None = None
) -> DerivedQuantity:
    """The local stress exponent d ln rate / d ln stress there."""
    return _at(("local exponent", "1", "linear"), local_exponent, stress, temperature, strain, time)


def _at(
    named: tuple[str, str, Literal["linear", "log"]], quantity: PointQuantity, *given: float | None
) -> DerivedQuantity:
    """A quantity at a point; named : its name, unit and scale."""
    (name, unit, scale), point = named, dict(zip(STATE_LIMITS, given, strict=True))
    check_state(point)
    where = f"{point['stress']:g} MPa" + ("" if point["temperature"] is None else f", {point['temperature']:g} K")
    return DerivedQuantity(f"{name} at {where}", unit, scale, lambda c: quantity(c, **point), point)


STATE_LIMITS = {
    "stress": limits.MEGAPASCAL_OF_STATE,
    "temperature": limits.KELVIN,
    "strain": limits.numbers(0, 1e3),
    "time": limits.numbers(0, 1e300),
}
"""Of a state at which a quantity can be asked for, in MPa, K, - and s."""


def check_state(point: Mapping[str, Any]) -> None:
    """FitError for what is no state of a material; point : {name: number or (...,)} in MPa, K, - and s, or None."""
    for name, value in point.items():
        if value is not None or name == "stress":
            limits.check_numbers(f"{name} of a creep rate", value, STATE_LIMITS[name], FitError)


def log_rate(
    coordinates: Coordinates,
    stress: ArrayLike,
    temperature: ArrayLike | None = None,
    strain: ArrayLike | None = None,
    time: ArrayLike | None = None,
) -> CoordinateFunction:
    """ln of the creep rate (1/s) of virgin material at points, as a function of u: (..., parameters) to (..., points).

    stress, temperature, strain, time : numbers or arrays that broadcast to (points,), in MPa, K, - and s; what is not
    given is that of the reference point.
    """
    from creepkit.kernels import lower, tension_point

    law, reference = coordinates.law_there, coordinates.reference
    kernel = lower(law, "numpy")
    stated = {"stress": stress, "strain": strain, "time": time, "temperature": temperature}
    check_state(stated)
    given = ((value, getattr(reference, name)) for name, value in stated.items())
    point = np.broadcast_arrays(*(np.asarray(default if v is None else v, float) for v, default in given))
    point, shape = tension_point(law, *point), point[0].shape

    def function(u: Floats) -> Floats:
        theta = coordinates.theta(u)
        columns = np.moveaxis(theta.reshape(*theta.shape, *(1 for _ in shape)), theta.ndim - 1, 0)
        out = kernel.internal_log_rate(*point, *columns)
        return np.asarray(out + np.zeros((*theta.shape[:-1], *shape)), float)

    return function


def local_exponent(
    coordinates: Coordinates, stress: ArrayLike, temperature: ArrayLike | None = None, **state: ArrayLike | None
) -> CoordinateFunction:
    """The local stress exponent at points.

    stress, temperature : as in `log_rate`, they broadcast to (points,). state : strain and time, numbers or (points,).
    """
    level = np.asarray(stress, float)
    above, below = (
        log_rate(coordinates, level * f, temperature, **state)
        for f in (EXPONENT_STRESS_RATIO, 1 / EXPONENT_STRESS_RATIO)
    )
    return lambda u: (above(u) - below(u)) / (2 * np.log(EXPONENT_STRESS_RATIO))


def activation_energy(
    coordinates: Coordinates, stress: ArrayLike, temperature: float, **state: ArrayLike | None
) -> CoordinateFunction:
    """The activation energy -R d ln rate / d(1/T), J/mol, at points.

    stress : number or (points,) MPa. temperature : one, K. state : strain and time, numbers or (points,).
    """
    ends = (temperature / ENERGY_TEMPERATURE_RATIO, temperature * ENERGY_TEMPERATURE_RATIO)
    colder, hotter = (log_rate(coordinates, stress, end, **state) for end in ends)
    return lambda u: GAS_CONSTANT * (hotter(u) - colder(u)) / (1 / ends[0] - 1 / ends[1])


def quantity_of(coordinates: Coordinates, quantity_or_name: str | DerivedQuantity) -> DerivedQuantity:
    """The quantity meant: itself, or a parameter by its name."""
    return parameter(coordinates, quantity_or_name) if isinstance(quantity_or_name, str) else quantity_or_name


def gradient(function: CoordinateFunction, u: Floats, scale: Floats, step: float = 1e-4) -> Floats:
    """(..., parameters) derivatives at one u (parameters,); central differences of step times scale (parameters,)."""
    steps = np.diag(step * np.maximum(scale, 1e-8))
    return np.stack([(function(u + h) - function(u - h)) / (2 * h.sum()) for h in steps], axis=-1)
