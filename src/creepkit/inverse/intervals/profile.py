"""Profile likelihood: how the misfit rises as one quantity is held away from its best value, all else refitted.

With chi2(x) the sum of squares that the fit minimises under the covariance it found, the profile of a quantity q is
min {chi2(x) : q(x) = v} over v. Its 95 % interval is where the rise stays below the .95 quantile of F(1, freedom),
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
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import t as student

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.covariance import whitener
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.opening import opened
from creepkit.inverse.intervals.quantities import Function, Quantity, chosen, gradient
from creepkit.inverse.problem import Opened
from creepkit.inverse.threads import single_threaded_algebra

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARPNESS = 0.02
"""w over the standard deviation of the quantity."""
RISE = 0.35
"""Aimed at from point to point: the rise of sqrt(chi2) over that of the interval's end."""
MOST = 15
"""Points to each side; an end that lies further out than they reach is called open."""
STUCK = 0.5
"""Share of a step below which what was asked for cannot be had: the law's bounds are in the way."""
NOTHING = 1e-9
"""Of the standard deviation: nearer to zero than this is zero."""


@dataclass(frozen=True, eq=False)
class Profile:
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

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        low, high = (f"{end:.4g}" if end is not None else "open" for end in (self.low, self.high))
        line = f"{self.name} = {self.best:.5g}{unit}, {100 * self.level:g} % interval [{low}, {high}] by its profile"
        return "; ".join([line, *self.notes])

    def plot(self, path: str | Path | None = None) -> Figure:
        """The rise of chi-square over the quantity, with that of Laplace's approximation; written to `path`."""
        from creepkit.inverse.intervals.plots import profile_figure

        return profile_figure(self, path)


@dataclass(frozen=True)
class _Held:
    """The residual (q(x) - value) / width, which holds a quantity at a value."""

    function: Function
    size: int
    value: float
    width: float

    def residuals(self, x: Floats) -> Floats:
        return np.array([(float(self.function(x[: self.size])) - self.value) / self.width])

    def jacobian(self, x: Floats) -> Floats:
        u = x[: self.size]
        own = gradient(self.function, u, np.maximum(np.abs(u), 1.0))
        return np.concatenate([own, np.zeros(x.size - self.size)])[None] / self.width


@dataclass(frozen=True)
class _Point:
    """One point of a profile: where, the quantity on its scale, and chi-square."""

    x: Floats
    value: float
    chi_square: float


class _Walk:
    """Points of a profile, one after the other outwards from the optimum."""

    def __init__(self, fit: Identification, problem: Opened, quantity: Quantity, root: float) -> None:
        self.problem, self.root, self.size = problem, root, fit.u.size
        self.function, self.covariance = quantity.of(fit.coordinates), fit.covariance
        slope = gradient(self.function, fit.u, np.sqrt(np.diag(fit.covariance)))
        self.sd = float(np.sqrt(slope @ fit.covariance @ slope))
        if not (np.isfinite(self.sd) and self.sd > 0):
            raise FitError(
                f"{quantity.name} does not depend on any parameter of law '{fit.law.name}': no profile of it"
            )
        self.start = self._point(problem.x, None)

    def side(self, sign: float) -> tuple[list[_Point], bool]:
        """Points to one side, and whether chi-square rose as far as wanted there."""
        points, step = [self.start], sign * RISE * self.root * self.sd
        for _ in range(MOST):
            last = points[-1]
            found = self._point(self._ahead(last, step), last.value + step)
            moved = (found.value - last.value) / step
            points += [found] if moved > 0 else []
            if self._rise(points[-1]) >= self.root:
                return points, True
            if moved < STUCK:
                return points, False
            gained = (self._rise(found) - self._rise(last)) / (found.value - last.value) * sign
            wanted = RISE * self.root / gained if gained > 0 else np.inf
            step = sign * float(np.clip(wanted, 0.3 * abs(step), 2.0 * abs(step)))
        return points, False

    def _rise(self, point: _Point) -> float:
        return float(np.sqrt(max(point.chi_square - self.start.chi_square, 0.0)))

    def _ahead(self, last: _Point, step: float) -> Floats:
        """Where Laplace's approximation expects the next point."""
        u = last.x[: self.size]
        slope = gradient(self.function, u, np.sqrt(np.diag(self.covariance)))
        way = self.covariance @ slope
        along = float(slope @ way)
        x = np.array(last.x)
        x[: self.size] += way * (step / along) if along > 0 else 0.0
        return self.problem.box.clip(x)

    def _point(self, start: Floats, value: float | None) -> _Point:
        extra = None if value is None else _Held(self.function, self.size, value, SHARPNESS * self.sd)
        x = self.problem.minimise(start, extra=extra).u
        x = self._bent(x).minimise(x, extra=extra).u if self.problem.scatter.rate > 0 else x
        found = float(self.function(x[: self.size]))
        return _Point(x, 0.0 if abs(found) < NOTHING * self.sd else found, self._chi_square(x))

    def _bent(self, x: Floats) -> Opened:
        """The problem with what a test's own rate does taken half way between the optimum and x."""
        p = self.problem
        effect = 0.5 * (p.residuals.rate_effect + p.objective.at(x).rate_effect)
        return replace(p, factor=whitener(replace(p.residuals, rate_effect=effect), p.scatter))

    def _chi_square(self, x: Floats) -> float:
        """Of the data and the priors: the walls stand for bounds, at which a value is possible still."""
        problem = self._bent(x) if self.problem.scatter.rate > 0 else self.problem
        white, own = problem.white(x), x.size - self.size
        data = int(problem.objective.entries.present.sum())
        return float((white[:data] ** 2).sum() + (white[white.size - own :] ** 2).sum())


def profile(fit: Identification, of: str | Quantity, *, level: float = 0.95) -> Profile:
    """Profile a parameter, by its name, or another quantity such as rate_at(120) or exponent_at(120).

    The interval holds the value with probability `level`, 0.95 unless told otherwise.
    """
    if not 0.0 < level < 1.0:
        raise FitError(f"level is {level:g}; a probability between 0 and 1 is needed, such as 0.95")
    quantity = chosen(fit.coordinates, of)
    root = float(student.ppf(0.5 + 0.5 * level, max(fit.freedom, 1.0)))
    with single_threaded_algebra():
        walk = _Walk(fit, opened(fit), quantity, root)
        (below, low), (above, high) = walk.side(-1.0), walk.side(1.0)
    return _profile(quantity, walk, [*below[:0:-1], *above], (low, high), level)


def _profile(quantity: Quantity, walk: _Walk, points: list[_Point], closed: tuple[bool, bool], level: float) -> Profile:
    values, chi_square = (np.array([getattr(p, name) for p in points]) for name in ("value", "chi_square"))
    k = int(chi_square.argmin())
    rise = chi_square - chi_square[k]
    ends = [
        _end(values, np.sqrt(rise), walk.root, k, sign) if c else None for c, sign in zip(closed, (-1, 1), strict=True)
    ]
    low, high = (None if end is None else float(quantity.shown(end)) for end in ends)
    reach = [float(quantity.shown(walk.start.value + s * walk.root * walk.sd)) for s in (-1, 1)]
    return Profile(
        quantity.name, quantity.unit, quantity.shown(values), rise, float(quantity.shown(values[k])), low, high,
        walk.root**2, level, (reach[0], reach[1]), _notes(quantity, points, rise, closed, walk),
    )  # fmt: skip


def _end(values: Floats, roots: Floats, limit: float, k: int, sign: int) -> float:
    """Where sqrt(rise), nearly straight, passes its limit to one side of point k."""
    own = slice(k, None) if sign > 0 else slice(k, None, -1)
    v, r = values[own], roots[own]
    keep = np.concatenate([[True], r[1:] > np.maximum.accumulate(r)[:-1]])
    return float(PchipInterpolator(r[keep], v[keep])(limit))


def _notes(
    quantity: Quantity, points: list[_Point], rise: Floats, closed: tuple[bool, bool], walk: _Walk
) -> tuple[str, ...]:
    found = []
    for done, k, side in ((closed[0], 0, "below"), (closed[1], -1, "above")):
        if not done:
            reached = float(quantity.shown(points[k].value))
            found.append(
                f"not bounded {side} within the law's bounds: at {reached:.4g} chi-square has risen by {rise[k]:.2g} "
                f"of {walk.root**2:.2g}"
            )
    better = walk.start.chi_square - min(p.chi_square for p in points)
    if better > 0.5:
        found.append(f"a better minimum was met on the way, by {better:.2g} in chi-square: identify with more starts")
    return tuple(found)
