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
from creepkit.inverse.coordinates import Coordinates, ReferencePoint
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty import interval_quantile
from creepkit.inverse.warmth import ISOTHERMAL_RANGE
from creepkit.language import CreepLaw, temperature
from creepkit.records import ZERO_CELSIUS

UNDETERMINED_WIDTH = 0.15
"""Standard deviation over the width of the bounds above which a parameter is hardly known; .29 is that of nothing."""
INFINITE_FREEDOM = 1e9
"""Degrees of freedom of a normal distribution."""
MIN_TEMPERATURES = 3
"""Temperatures: two give a slope, which any form can have."""


@dataclass(frozen=True, eq=False)
class IsothermalEstimates:
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
    reference: ReferencePoint
    ranges: dict[str, tuple[float, float]]

    @classmethod
    def from_identifications(cls, fits: Sequence[Identification]) -> IsothermalEstimates:
        """The points of identifications of one law, each at one temperature; FitError where they are not that."""
        check_identifications(fits)
        order = np.argsort([fit.reference.temperature for fit in fits])
        ordered = [fits[int(k)] for k in order]
        return cls(
            ordered[0].law,
            np.array([fit.reference.temperature for fit in ordered]),
            np.stack([fit.coordinates.theta(fit.u) for fit in ordered]),
            np.stack([_theta_covariance(fit) for fit in ordered]),
            _central_reference([fit.reference for fit in ordered]),
            _joint_ranges([dict(fit.ranges) for fit in ordered]),
        )

    @cached_property
    def whitening(self) -> Floats:
        """(fits, parameters, parameters) inverse Cholesky factors of the covariances."""
        sd = np.sqrt(np.einsum("kii->ki", self.covariance))
        scaled = self.covariance / (sd[:, :, None] * sd[:, None, :])
        return np.asarray(np.linalg.inv(np.linalg.cholesky(scaled)) / sd[:, None, :])

    def has_undetermined_parameters(self) -> bool:
        """Whether some parameter is hardly known at most temperatures, but for a coefficient: that goes with others."""
        coordinates = Coordinates(self.law, self.reference)
        bound_widths = np.array([p.to_internal(p.bounds[1]) - p.to_internal(p.bounds[0]) for p in self.law.params.values()])
        determined = np.sqrt(np.einsum("kii->ki", self.covariance)) < UNDETERMINED_WIDTH * bound_widths
        determined[:, list(coordinates.coefficients)] = True
        return bool((np.median(determined, axis=0) < 0.5).any())


def check_identifications(fits: Sequence[Identification]) -> None:
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
        if high - low > ISOTHERMAL_RANGE:
            raise FitError(
                f"an identification of '{law.name}' spans {low:.0f} to {high:.0f} K; identify each temperature alone"
            )
    check_temperatures([fit.reference.temperature for fit in fits])


def check_temperatures(temperatures: Sequence[float]) -> None:
    """Say what fewer than three temperatures leave unknown."""
    distinct = _distinct_temperatures(temperatures)
    if len(distinct) == 1:
        raise FitError(
            f"all tests are at {distinct[0]:.0f} K: from one temperature neither an activation energy nor how any other "
            "parameter depends on temperature can be known; add tests at two other temperatures or more"
        )
    if len(distinct) < MIN_TEMPERATURES:
        raise FitError(
            f"the tests are at {distinct[0]:.0f} and {distinct[1]:.0f} K alone: two temperatures give an activation energy "
            "but no form; identify the law times arrhenius(), or add a third temperature"
        )


def _distinct_temperatures(temperatures: Sequence[float]) -> list[float]:
    """Temperatures that differ by more than ONE_TEMPERATURE, ascending."""
    distinct: list[float] = []
    for T in sorted(temperatures):
        if not distinct or T - distinct[-1] > ISOTHERMAL_RANGE:
            distinct.append(float(T))
    return distinct


def _theta_covariance(fit: Identification) -> Floats:
    jacobian, variance_factor = fit.coordinates.jacobian(fit.u), (interval_quantile(fit.freedom) / interval_quantile(INFINITE_FREEDOM)) ** 2
    return np.asarray(variance_factor * jacobian @ fit.covariance @ jacobian.T + _bound_variance(fit))


def _bound_variance(fit: Identification) -> Floats:
    """(parameters, parameters) variance to add where an estimate lies at its bound, which says nothing but that."""
    bounds = [[p.to_internal(b) for b in p.bounds] for p in fit.law.params.values()]
    at_bound = [e.verdict == "at its bound" for e in fit.estimates]
    return np.asarray(np.diag(np.where(at_bound, np.ptp(bounds, axis=1) ** 2 / 12.0, 0.0)))


def _central_reference(references: Sequence[ReferencePoint]) -> ReferencePoint:
    stress, strain, time = (
        float(np.exp(np.mean([np.log(getattr(r, name)) for r in references]))) for name in ("stress", "strain", "time")
    )
    celsius = float(np.median([r.temperature for r in references])) - ZERO_CELSIUS
    return ReferencePoint(stress, strain, time, float(round(celsius / 10.0) * 10.0 + ZERO_CELSIUS))


def _joint_ranges(ranges: Sequence[dict[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    return {name: (min(r[name][0] for r in ranges), max(r[name][1] for r in ranges)) for name in ranges[0]}
