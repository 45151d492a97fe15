"""Parameters against temperature: what identifications at single temperatures say, with their covariances.

A coefficient and its exponent are correlated to -0.99999 at one temperature, so that points with error bars of their
own would mislead: all parameters of one temperature stay together, with the whole covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty import quantile
from creepkit.inverse.warmth import ONE_TEMPERATURE
from creepkit.language import CreepLaw, temperature
from creepkit.records import ZERO_CELSIUS

OPEN = 0.15
"""Standard deviation over the width of the bounds above which a parameter is hardly known; .29 is that of nothing."""
ENDLESS = 1e9
"""Degrees of freedom of a normal distribution."""
LEAST = 3
"""Temperatures: two give a slope, which any form can have."""


@dataclass(frozen=True, eq=False)
class Points:
    """One law's parameters at several temperatures.

    temperatures : (fits,) K. theta : (fits, parameters) internal values (the logarithm where the scale is log).
    covariance : (fits, parameters, parameters) of theta, that of the normal distribution with the same 95 % intervals
        where an identification has few degrees of freedom; wide where a bound holds the value.
    reference : the point where rates are compared.
    ranges : {"stress", "temperature", "strain", "time": (low, high)} that they cover together.
    """

    law: CreepLaw
    temperatures: Floats
    theta: Floats
    covariance: Floats
    reference: Reference
    ranges: dict[str, tuple[float, float]]

    @classmethod
    def of(cls, fits: Sequence[Identification]) -> Points:
        """The points of identifications of one law, each at one temperature; FitError where they are not that."""
        check(fits)
        order = np.argsort([fit.reference.temperature for fit in fits])
        ordered = [fits[int(k)] for k in order]
        return cls(
            ordered[0].law,
            np.array([fit.reference.temperature for fit in ordered]),
            np.stack([fit.coordinates.theta(fit.u) for fit in ordered]),
            np.stack([_covariance(fit) for fit in ordered]),
            _middle([fit.reference for fit in ordered]),
            _together([dict(fit.ranges) for fit in ordered]),
        )

    @cached_property
    def whiteners(self) -> Floats:
        """(fits, parameters, parameters) inverse Cholesky factors of the covariances."""
        sd = np.sqrt(np.einsum("kii->ki", self.covariance))
        scaled = self.covariance / (sd[:, :, None] * sd[:, None, :])
        return np.asarray(np.linalg.inv(np.linalg.cholesky(scaled)) / sd[:, None, :])

    def leaves_open(self) -> bool:
        """Whether some parameter is hardly known at most temperatures, but for a coefficient: that goes with others."""
        coordinates = Coordinates(self.law, self.reference)
        width = np.array([p.to_internal(p.bounds[1]) - p.to_internal(p.bounds[0]) for p in self.law.params.values()])
        known = np.sqrt(np.einsum("kii->ki", self.covariance)) < OPEN * width
        known[:, list(coordinates.coefficients)] = True
        return bool((np.median(known, axis=0) < 0.5).any())


def check(fits: Sequence[Identification]) -> None:
    """Identifications of one law without temperature, at three temperatures or more."""
    if isinstance(fits, Identification) or not fits:
        raise FitError("discover() takes a list of identifications, one for each temperature")
    law = fits[0].law
    if law.uses(temperature):
        raise FitError(
            f"law '{law.name}' depends on temperature already; identify it without, at each temperature by itself"
        )
    other = next((fit.law.name for fit in fits if fit.law.fingerprint != law.fingerprint), None)
    if other is not None:
        raise FitError(f"the identifications are of '{law.name}' and of '{other}'; give those of one law")
    for fit in fits:
        low, high = fit.ranges["temperature"]
        if high - low > ONE_TEMPERATURE:
            raise FitError(
                f"an identification of '{law.name}' spans {low:.0f} to {high:.0f} K; identify each temperature alone"
            )
    check_temperatures([fit.reference.temperature for fit in fits])


def check_temperatures(kelvin: Sequence[float]) -> None:
    """Say what fewer than three temperatures leave unknown."""
    levels = _levels(kelvin)
    if len(levels) == 1:
        raise FitError(
            f"all tests are at {levels[0]:.0f} K: from one temperature neither an activation energy nor how any other "
            "parameter depends on temperature can be known; add tests at two other temperatures or more"
        )
    if len(levels) < LEAST:
        raise FitError(
            f"the tests are at {levels[0]:.0f} and {levels[1]:.0f} K alone: two temperatures give an activation energy "
            "but no form; identify the law times arrhenius(), or add a third temperature"
        )


def _levels(kelvin: Sequence[float]) -> list[float]:
    """Temperatures that differ by more than ONE_TEMPERATURE, ascending."""
    found: list[float] = []
    for T in sorted(kelvin):
        if not found or T - found[-1] > ONE_TEMPERATURE:
            found.append(float(T))
    return found


def _covariance(fit: Identification) -> Floats:
    to_theta, wide = fit.coordinates.jacobian(fit.u), (quantile(fit.freedom) / quantile(ENDLESS)) ** 2
    return np.asarray(wide * to_theta @ fit.covariance @ to_theta.T + _held(fit))


def _held(fit: Identification) -> Floats:
    """(parameters, parameters) variance to add where an estimate lies at its bound, which says nothing but that."""
    ends = [[p.to_internal(b) for b in p.bounds] for p in fit.law.params.values()]
    held = [e.verdict == "at its bound" for e in fit.estimates]
    return np.asarray(np.diag(np.where(held, np.ptp(ends, axis=1) ** 2 / 12.0, 0.0)))


def _middle(references: Sequence[Reference]) -> Reference:
    stress, strain, time = (
        float(np.exp(np.mean([np.log(getattr(r, name)) for r in references]))) for name in ("stress", "strain", "time")
    )
    warm = float(np.median([r.temperature for r in references])) - ZERO_CELSIUS
    return Reference(stress, strain, time, float(round(warm / 10.0) * 10.0 + ZERO_CELSIUS))


def _together(ranges: Sequence[dict[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    return {name: (min(r[name][0] for r in ranges), max(r[name][1] for r in ranges)) for name in ranges[0]}
