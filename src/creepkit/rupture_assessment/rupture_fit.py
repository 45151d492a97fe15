"""RuptureFit: one method with its estimates, and the distributions of the times that it predicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.rupture_assessment.degrees_of_freedom import VarianceFreedom
from creepkit.rupture_assessment.likelihood import Distribution
from creepkit.rupture_assessment.log_time_distributions import (
    WEIBULL_MEDIAN,
    LogTimeDistribution,
    StudentLogTime,
    WeibullLogTime,
)
from creepkit.rupture_assessment.methods import METHODS, Centre, Conditions

LEAST_SCALE = 1e-6
"""Standard deviation of log10 of times at which a fit is taken for exact."""


@dataclass(frozen=True)
class RuptureParameter:
    """A constant of a method with its interval: observed information, the delta method, Student's distribution."""

    name: str
    value: float
    low: float
    high: float
    unit: str = ""


@dataclass(frozen=True, eq=False)
class RuptureFit:
    """One method with its estimates.

    coefficients : (coefficients,), curvature : Manson-Haferd's k (0 elsewhere), of the basis of the method.
    scale : of log10 of the times of one heat; a standard deviation for lognormal times. scatter : {group: standard
    deviation of its effect}. levels : {group: how many}.
    covariance : (estimates, estimates) of coefficients, curvature where the method has one, scale and scatters, by
    observed information, with the corrections below.
    scale_corrected, scatter_corrected : with which predictions are made: scale^2 n / (n - p), scatter^2 h / (h - 1).
    variance_freedom : degrees of freedom of variances. level : of intervals.
    """

    method: str
    degree: int
    distribution: Distribution
    fixed: Mapping[str, float]
    centre: Centre
    coefficients: Floats
    curvature: float
    scale: float
    scatter: Mapping[str, float]
    levels: Mapping[str, int]
    covariance: Floats
    scale_corrected: float
    scatter_corrected: Mapping[str, float]
    log_likelihood: float
    variance_freedom: VarianceFreedom
    observations: int
    parameters: tuple[RuptureParameter, ...]
    effects: Mapping[str, Mapping[str, float]]
    level: float

    @property
    def name(self) -> str:
        """The method, with the degree of its stress function where that is chosen."""
        return f"{self.method}, degree {self.degree}" if METHODS[self.method].degrees else self.method

    @property
    def parameter_count(self) -> int:
        """All that was estimated."""
        return int(self.covariance.shape[0])

    def __getitem__(self, name: str) -> RuptureParameter:
        """The estimate of one parameter."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise FitError(f"{self.method} has no parameter '{name}'; it has {', '.join(p.name for p in self.parameters)}")

    def location(self, at: Conditions) -> Floats:
        """(points,) log10 of the median time in hours, of the average heat."""
        return self._location(at)[0]

    def _location(self, at: Conditions) -> tuple[Floats, Floats]:
        """Median of log10 of time (points,), and its derivatives (points, estimates)."""
        method = METHODS[self.method]
        basis = method.basis(at, self.degree, self.fixed, self.centre)
        columns = basis.linear if basis.bilinear is None else basis.linear + self.curvature * basis.bilinear
        median = basis.offset + columns @ self.coefficients
        derivatives = np.zeros((at.stress.size, self.parameter_count))
        derivatives[:, : columns.shape[1]] = columns
        count = columns.shape[1]
        if basis.bilinear is not None:
            derivatives[:, count] = basis.bilinear @ self.coefficients
            count += 1
        if self.distribution == "weibull":
            median = median + WEIBULL_MEDIAN * self.scale
            derivatives[:, count] = WEIBULL_MEDIAN
        return median, derivatives

    def log_time(self, at: Conditions, of: str) -> LogTimeDistribution:
        """Distribution of log10 of a time in hours.

        of : "mean", the median time of the average heat, which only the estimates make uncertain; "heat", the median
        time of a new heat (and laboratory); "test", the time of one test of it.
        """
        median, derivatives = self._location(at)
        estimates = np.einsum("pi,ij,pj->p", derivatives, self.covariance, derivatives)
        total = np.maximum(estimates, LEAST_SCALE**2)
        if of != "mean":
            total = total + sum(v**2 for v in self.scatter_corrected.values())
        location = derivatives[:, : self.parameter_count - 1 - len(self.scatter)]
        freedom = self.variance_freedom.of(location, between=of != "mean", within=of == "test")
        if of == "test" and self.distribution == "weibull":
            return WeibullLogTime(median, np.sqrt(total), self.scale_corrected, freedom)
        if of == "test":
            total = total + self.scale_corrected**2
        return StudentLogTime(median, np.sqrt(total), freedom)

    def test_scatter(self, at: Conditions) -> LogTimeDistribution:
        """Distribution of log10 of the time of one test over the median time of its heat."""
        none: Floats = np.zeros(at.stress.size)
        spread, freedom = none + self.scale_corrected, none + self.variance_freedom.most
        if self.distribution == "weibull":
            return WeibullLogTime(none, none + LEAST_SCALE * self.scale_corrected, self.scale_corrected, freedom)
        return StudentLogTime(none, spread, freedom)
