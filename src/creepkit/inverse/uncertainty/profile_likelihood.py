"""Profile likelihood: how the misfit rises as one quantity is held away from its best value, all else refitted.

With chi2(x) the sum of squares that the fit minimises under the covariance it found, the profile of a quantity q is
min {chi2(x) : q(x) = v} over v. Its 95 % interval is where the rise stays below the 0.95 quantile of F(1, freedom),
which is that of chi-square with one degree of freedom where the scatter is well known (Venzon & Moolgavkar (1988),
J. R. Stat. Soc. C 37, 87; Bates & Watts (1988), Nonlinear Regression Analysis, ch. 6). Unlike Laplace's intervals it
may be lopsided, and open where the data never rise against a value.

Each point minimises chi2(x) + ((q(x) - v) / w)^2. Where that ends is a point of the profile whatever w is: nothing
of the same q fits better. A w far below the spread of q brings it to the v that was asked for.

Where rates scatter from test to test, a test whose rate is off by a factor exp(b) leaves residuals of b d to first
order, d the derivative to ln rate. On the scale of strains d changes along the way, and far from the optimum what is
left of second order would count as misfit: with d half way between the optimum and where one is, it cancels.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import t as student

from creepkit.arrays import Floats, single_threaded_blas
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.uncertainty.posterior import REFIT_TOLERANCES, residuals_with_errors
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, gradient, quantity_of
from creepkit.records.presentable import Presentable

CONSTRAINT_WIDTH = 0.02
"""w over the standard deviation of the quantity."""


STEP_RISE = 0.35
"""Aimed at from point to point: the rise of sqrt(chi2) over that of the interval's end."""


MAX_POINTS = 15
"""Points to each side; an end that lies further out than they reach is called open."""


BLOCKED_FRACTION = 0.5
"""Share of a step below which what was asked for cannot be had: the law's bounds are in the way."""


ZERO_TOLERANCE = 1e-9
"""Of the standard deviation: nearer to zero than this is zero."""


@dataclass(frozen=True, eq=False)
class ProfileLikelihood(Presentable):
    """The profile of one quantity.

    values, chi_square : (points,) values in the quantity's unit, rising, and the rise of chi-square at each.
    best : the value of least chi-square. low, high : ends of the interval, None where it is open.
    limit : the rise of chi-square at the ends; level : how sure.
    laplace : the interval of the Laplace approximation, for comparison.
    """

    name: str
    unit: str
    values: Floats
    chi_square: Floats
    best: float
    low: float | None
    high: float | None
    limit: float
    level: float
    laplace: tuple[float, float]
    notes: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        return f"<ProfileLikelihood of {self}>"

    shown_by = "inference.profile_text"


@dataclass(frozen=True)
class _ProfilePoint:
    """One point of a profile: where, the quantity on its scale, and chi-square."""

    x: Floats
    value: float
    chi_square: float


class _ProfileTrace:
    """Points of a profile, one after the other outwards from the optimum."""

    def __init__(self, fit: Identification, quantity: DerivedQuantity, root: float) -> None:
        self.root, self.size = root, fit.u.size
        self.residuals, self.noise_model = residuals_with_errors(fit)
        covariance_factor = CovarianceFactor.of_residuals(self.residuals, self.noise_model)
        self.problem = fit.least_squares_problem.with_covariance(covariance_factor)
        self.function, self.covariance = quantity.function(fit.coordinates), fit.covariance
        quantity_gradient = gradient(self.function, fit.u, np.sqrt(np.diag(fit.covariance)))
        self.sd = float(np.sqrt(quantity_gradient @ fit.covariance @ quantity_gradient))
        if not (np.isfinite(self.sd) and self.sd > 0):
            raise FitError(
                f"{quantity.name} does not depend on any parameter of law '{fit.law.name}': no profile of it"
            )
        self.start = self._constrained_minimum(fit.x, None)

    def one_side(self, sign: float) -> tuple[list[_ProfilePoint], bool]:
        """Points to one side, and whether chi-square rose as far as wanted there."""
        points, step = [self.start], sign * STEP_RISE * self.root * self.sd
        for _ in range(MAX_POINTS):
            last = points[-1]
            point = self._constrained_minimum(self._predicted_start(last, step), last.value + step)
            relative_step = (point.value - last.value) / step
            points += [point] if relative_step > 0 else []
            if self._root_rise(points[-1]) >= self.root:
                return points, True
            if relative_step < BLOCKED_FRACTION:
                return points, False
            root_rise_rate = (self._root_rise(point) - self._root_rise(last)) / (point.value - last.value) * sign
            wanted_step = STEP_RISE * self.root / root_rise_rate if root_rise_rate > 0 else np.inf
            step = sign * float(np.clip(wanted_step, 0.3 * abs(step), 2.0 * abs(step)))
        return points, False

    def _root_rise(self, point: _ProfilePoint) -> float:
        return float(np.sqrt(max(point.chi_square - self.start.chi_square, 0.0)))

    def _predicted_start(self, last: _ProfilePoint, step: float) -> Floats:
        """Where Laplace's approximation expects the next point."""
        u = last.x[: self.size]
        quantity_gradient = gradient(self.function, u, np.sqrt(np.diag(self.covariance)))
        direction = self.covariance @ quantity_gradient
        directional_variance = float(quantity_gradient @ direction)
        x = np.array(last.x)
        x[: self.size] += direction * (step / directional_variance) if directional_variance > 0 else 0.0
        return self.problem.bounds.clip(x)

    def _constrained_minimum(self, start: Floats, value: float | None) -> _ProfilePoint:
        def held(x: Floats) -> tuple[Floats, Floats]:
            """The residual (q(x) - value) / width, which holds the quantity at a value."""
            u, width = x[: self.size], CONSTRAINT_WIDTH * self.sd
            slope = gradient(self.function, u, np.maximum(np.abs(u), 1.0))
            row = np.pad(slope, (0, x.size - self.size))[None] / width
            return np.array([float(self.function(u)) - float(value or 0.0)]) / width, row

        constraint = None if value is None else held
        x = self.problem.minimise(start, additional=constraint, tolerances=REFIT_TOLERANCES).x
        if self.noise_model.rate > 0:
            x = self._problem_at(x).minimise(x, additional=constraint, tolerances=REFIT_TOLERANCES).x
        value_reached = float(self.function(x[: self.size]))
        return _ProfilePoint(
            x, 0.0 if abs(value_reached) < ZERO_TOLERANCE * self.sd else value_reached, self._chi_square(x)
        )

    def _problem_at(self, x: Floats) -> LeastSquaresProblem:
        """The problem with what a test's own rate does taken half way between the optimum and x."""
        rate_effect = 0.5 * (self.residuals.log_rate_sensitivity + self.problem.residuals(x).log_rate_sensitivity)
        residuals = replace(self.residuals, log_rate_sensitivity=rate_effect)
        return self.problem.with_covariance(CovarianceFactor.of_residuals(residuals, self.noise_model))

    def _chi_square(self, x: Floats) -> float:
        """Of the data and the priors, without the penalties of bounds, at which a value is still possible."""
        return (self._problem_at(x) if self.noise_model.rate > 0 else self.problem).chi_square(x)


def profile(fit: Identification, quantity_or_name: str | DerivedQuantity, *, level: float = 0.95) -> ProfileLikelihood:
    """Profile a parameter, by its name, or another quantity such as rate_at(120) or exponent_at(120).

    The interval holds the value with probability `level`, 0.95 by default, with those errors of the tests that the
    fit's intervals include.
    """
    if not 0.0 < level < 1.0:
        raise FitError(f"level is {level:g}; a probability between 0 and 1 is needed, such as 0.95")
    quantity = quantity_of(fit.coordinates, quantity_or_name)
    root = float(student.ppf(0.5 + 0.5 * level, max(fit.freedom, 1.0)))
    with single_threaded_blas():
        trace = _ProfileTrace(fit, quantity, root)
        (below, low), (above, high) = trace.one_side(-1.0), trace.one_side(1.0)
    return _profile(quantity, trace, [*below[:0:-1], *above], (low, high), level)


def _profile(
    quantity: DerivedQuantity,
    trace: _ProfileTrace,
    points: list[_ProfilePoint],
    is_closed: tuple[bool, bool],
    level: float,
) -> ProfileLikelihood:
    values, chi_square = (np.array([getattr(p, name) for p in points]) for name in ("value", "chi_square"))
    best = int(chi_square.argmin())
    rise = chi_square - chi_square[best]
    ends = [
        _interval_end(values, np.sqrt(rise), trace.root, best, sign) if c else None
        for c, sign in zip(is_closed, (-1, 1), strict=True)
    ]
    low, high = (None if end is None else float(quantity.to_unit(end)) for end in ends)
    laplace = [float(quantity.to_unit(trace.start.value + s * trace.root * trace.sd)) for s in (-1, 1)]
    return ProfileLikelihood(
        quantity.name,
        quantity.unit,
        quantity.to_unit(values),
        rise,
        float(quantity.to_unit(values[best])),
        low,
        high,
        trace.root**2,
        level,
        (laplace[0], laplace[1]),
        _notes(quantity, points, rise, is_closed, trace),
    )


def _interval_end(values: Floats, roots: Floats, limit: float, best: int, sign: int) -> float:
    """Where sqrt(rise), nearly straight, passes its limit to one side of point k."""
    side = slice(best, None) if sign > 0 else slice(best, None, -1)
    side_values, side_roots = values[side], roots[side]
    is_rising = np.concatenate([[True], side_roots[1:] > np.maximum.accumulate(side_roots)[:-1]])
    return float(PchipInterpolator(side_roots[is_rising], side_values[is_rising])(limit))


def _notes(
    quantity: DerivedQuantity,
    points: list[_ProfilePoint],
    rise: Floats,
    is_closed: tuple[bool, bool],
    trace: _ProfileTrace,
) -> tuple[str, ...]:
    notes = []
    for is_side_closed, k, side in ((is_closed[0], 0, "below"), (is_closed[1], -1, "above")):
        if not is_side_closed:
            reached = float(quantity.to_unit(points[k].value))
            notes.append(
                f"not bounded {side} within the law's bounds: at {reached:.4g} chi-square has risen by {rise[k]:.2g} "
                f"of {trace.root**2:.2g}"
            )
    better = trace.start.chi_square - min(p.chi_square for p in points)
    if better > 0.5:
        notes.append(f"a better minimum was met on the way, by {better:.2g} in chi-square: identify with more starts")
    return tuple(notes)
