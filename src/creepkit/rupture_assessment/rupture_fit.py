"""RuptureFit: one method with its estimates, and the distributions of the times that it predicts.

The degrees of freedom of the variances that it adds up are Satterthwaite's for mixed models.

A predicted log time has a variance V(theta) that depends on the variances theta = (of a test, of each kind of effect),
through the covariance C of the location parameters as well as directly. With A the covariance of the estimated theta,
V has 2 V^2 / (g' A g) degrees of freedom, g = dV / dtheta (Giesbrecht, Burns (1985), Biometrics 41, 477; Fai, Cornelius
(1996), J. Stat. Comput. Simul. 54, 363; for a sum of independent variances this is Satterthwaite (1946), Biometrics
Bull. 2, 110). So a median time whose error comes from a few heats has about as many degrees of freedom as there are
heats less one, however many tests there are.

C, its derivatives and A (by the restricted likelihood) are those of the normal model of the tests that broke: with
Z the members of the effects, V = theta_0 I + sum theta_g Z_g Z_g'.

log10 of a time is Student's, or a mixture of such.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from creepkit.arrays import Floats, frozen
from creepkit.errors import FitError
from creepkit.rupture_assessment.methods import METHODS, Centre, Conditions

MOST_LEVELS = 400
"""Of one kind of effect: with more its variance is taken for known."""

LEAST_INFORMATION = 1e-10
"""Of the largest: combinations of variances that the tests do not tell apart are left out of A."""


@dataclass(frozen=True, eq=False)
class VarianceFreedom:
    """What degrees of freedom are found from, for kinds 0 (tests of one heat) and 1, 2 ... (effects).

    variances : (kinds,) of log10 of time. uncertainty : (kinds, kinds), their covariance A.
    derivatives : (kinds, location, location), of the covariance of the location parameters by each variance.
    most : tests that broke less location parameters.
    """

    variances: Floats
    uncertainty: Floats
    derivatives: Floats
    most: float

    def of(self, location: Floats, *, between: bool = False, within: bool = False) -> Floats:
        """(points,) of the variance of a prediction, with that between effects and within heats where included.

        location : (points, location), derivatives of the prediction by the location parameters.
        """
        gradient = np.einsum("pi,kij,pj->pk", location, self.derivatives, location)
        gradient[:, 1:] += between
        gradient[:, 0] += within
        variance = gradient @ self.variances
        error = np.einsum("pk,kl,pl->p", gradient, self.uncertainty, gradient)
        with np.errstate(divide="ignore", invalid="ignore"):
            freedom = 2.0 * variance**2 / error
        return np.asarray(np.clip(np.where(np.isfinite(freedom), freedom, self.most), 1.0, self.most))

    def transformed(self, jacobian: Floats) -> VarianceFreedom:
        """The same for other location parameters, jacobian @ those of now.

        jacobian : (others, parameters).
        """
        derivatives = np.einsum("mi,kij,nj->kmn", jacobian, self.derivatives, jacobian)
        return VarianceFreedom(self.variances, self.uncertainty, frozen(derivatives), self.most)


def variance_freedom(
    columns: Floats, members: Sequence[Floats], within: float, between: Sequence[float], added: float = 0.0
) -> VarianceFreedom:
    """Of a linear model with effects.

    columns : (tests, location). members : (tests, levels) of zeros and ones, one for each kind. within : variance of a
    test. between : variances of effects. added : tests as which a usual variance of a test counts beside these.
    """
    kept = [(Z, v) for Z, v in zip(members, between, strict=True) if Z.shape[1] <= MOST_LEVELS]
    levels = [Z.shape[1] for Z, _ in kept]
    Z = np.column_stack([np.zeros((len(columns), 0)), *(Z for Z, _ in kept)])
    spread = np.repeat([v for _, v in kept], levels) if kept else np.zeros(0)
    parts = [slice(end - count, end) for count, end in zip(levels, np.cumsum(levels), strict=True)]

    def solved(right: Floats) -> Floats:
        """V^-1 right, by Woodbury's identity."""
        inner = within * np.eye(spread.size) + spread[:, None] * (Z.T @ Z)
        return np.asarray((right - Z @ np.linalg.solve(inner, spread[:, None] * (Z.T @ right))) / within)

    VX, VZ = solved(columns), solved(Z)
    C = np.linalg.pinv(columns.T @ VX, hermitian=True)
    PZ = VZ - VX @ (C @ (columns.T @ VZ))
    ZPZ = Z.T @ PZ
    # P V P = P and tr(P V) = tests - location give the traces that tests alone would need a square matrix for.
    mixed = [float((PZ[:, part] ** 2).sum()) for part in parts]
    free = float(max(len(columns) - columns.shape[1], 1))
    trace = (free - float(spread @ np.diag(ZPZ))) / within
    square = (trace - sum(v * m for (_, v), m in zip(kept, mixed, strict=True))) / within
    information = np.empty((len(kept) + 1, len(kept) + 1))
    information[0, 0] = square + added / within**2
    information[0, 1:] = information[1:, 0] = mixed
    for i, one in enumerate(parts):
        for j, other in enumerate(parts):
            information[i + 1, j + 1] = float((ZPZ[one, other] ** 2).sum())
    slopes = [C @ (VX.T @ VX) @ C]
    for part in parts:
        side = C @ (columns.T @ VZ[:, part])
        slopes.append(side @ side.T)
    uncertainty = np.linalg.pinv(0.5 * information, rcond=LEAST_INFORMATION, hermitian=True)
    return VarianceFreedom(
        frozen([within, *(v for _, v in kept)]), frozen(uncertainty), frozen(np.array(slopes)), free + added
    )


BISECTIONS = 50
"""Of a bracket some units of log10 wide: to 1e-14."""


@dataclass(frozen=True, eq=False)
class StudentLogTime:
    """Student's distribution of log10 of a time in hours; median, spread, freedom : (points,)."""

    median: Floats
    spread: Floats
    freedom: Floats

    def cumulative(self, log_time: Floats) -> Floats:
        """(points,) probability of less than log_time (points,)."""
        return np.asarray(stdtr(self.freedom, (log_time - self.median) / self.spread))

    def quantile(self, probability: float) -> Floats:
        """(points,) the log time that is not reached with a probability."""
        return np.asarray(self.median + self.spread * stdtrit(self.freedom, probability))


@dataclass(frozen=True, eq=False)
class MixedLogTime:
    """Several distributions with weights that add up to one."""

    parts: Sequence[StudentLogTime]
    weights: Sequence[float]

    def cumulative(self, log_time: Floats) -> Floats:
        """(points,) probability of less than log_time (points,)."""
        shares = [w * part.cumulative(log_time) for w, part in zip(self.weights, self.parts, strict=True)]
        return np.asarray(np.sum(shares, axis=0))

    def quantile(self, probability: float) -> Floats:
        """(points,) the log time that is not reached with a probability."""
        quantiles = np.array([part.quantile(probability) for part in self.parts])
        low, high = quantiles.min(axis=0), quantiles.max(axis=0)
        for _ in range(BISECTIONS if len(self.parts) > 1 else 0):
            middle = 0.5 * (low + high)
            below = self.cumulative(middle) < probability
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.asarray(0.5 * (low + high))


def power_of_ten(exponent: float) -> float:
    """10 to a power, infinite where that is beyond a double."""
    return 10.0 ** float(exponent) if exponent < 300.0 else float("inf")


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
    scale : standard deviation of log10 of the times of one heat. scatter : {group: standard deviation of its effect}.
    levels : {group: how many}.
    covariance : (estimates, estimates) of coefficients, curvature where the method has one, scale and scatters, by
    observed information, with the corrections below.
    scale_corrected, scatter_corrected : with which predictions are made: scale^2 n / (n - p), scatter^2 h / (h - 1).
    variance_freedom : degrees of freedom of variances. level : of intervals.
    """

    method: str
    degree: int
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
        """(points,) log10 of the median time in hours, of the average heat; of symbols expressions."""
        offset, columns, _ = self._basis(at)
        return np.asarray(offset + columns @ self.coefficients)

    def _basis(self, at: Conditions) -> tuple[Floats, Floats, Floats | None]:
        """Offset, columns with the curvature in them, and the part that this multiplies."""
        basis = METHODS[self.method].basis(at, self.degree, self.fixed, self.centre)
        columns = basis.linear if basis.bilinear is None else basis.linear + self.curvature * basis.bilinear
        return basis.offset, columns, basis.bilinear

    def _location(self, at: Conditions) -> tuple[Floats, Floats]:
        """Median of log10 of time (points,), and its derivatives (points, estimates)."""
        offset, columns, bilinear = self._basis(at)
        median = offset + columns @ self.coefficients
        derivatives = np.zeros((at.stress.size, self.parameter_count))
        derivatives[:, : columns.shape[1]] = columns
        count = columns.shape[1]
        if bilinear is not None:
            derivatives[:, count] = bilinear @ self.coefficients
        return median, derivatives

    def log_time(self, at: Conditions, of: str) -> StudentLogTime:
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
        if of == "test":
            total = total + self.scale_corrected**2
        return StudentLogTime(median, np.sqrt(total), freedom)

    def test_scatter(self, at: Conditions) -> StudentLogTime:
        """Distribution of log10 of the time of one test over the median time of its heat."""
        none: Floats = np.zeros(at.stress.size)
        return StudentLogTime(none, none + self.scale_corrected, none + self.variance_freedom.most)
