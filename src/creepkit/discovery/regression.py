"""One form for each parameter, through all points at once: generalised least squares, with pysindy on small libraries.

The rows are all parameters at all temperatures, multiplied by the inverse Cholesky factor of each temperature's
covariance; the columns are the functions of the libraries. pysindy regresses one on the other without threshold or
ridge: with ten per cent of temperature its functions are collinear, and a threshold on one wide library keeps all of
them with coefficients of +-1000. What stands inside exponentials is found by variable projection (Golub and Pereyra
(1973), SIAM J. Numer. Anal. 10, 413): the coefficients are solved for at each trial of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.discovery.libraries import Library, curves
from creepkit.discovery.points import Points
from creepkit.language import Param

DRAWS = 8
"""Trials from which what is inside exponentials is searched."""
BEYOND = 2.0
"""Standard deviations that a number may lie outside its bounds."""


@dataclass(frozen=True, eq=False)
class Regression:
    """Forms of all parameters, fitted to the points.

    values : {name: value} of coefficients and of what is inside exponentials, internal (logarithm of a coefficient of
        log scale); covariance in the same order. curves : (temperatures, parameters) of theta. chi_square : of rows.
    """

    libraries: tuple[Library, ...]
    values: Mapping[str, float]
    covariance: Floats
    curves: Floats
    chi_square: float
    rows: int

    @property
    def size(self) -> int:
        """How many numbers were found."""
        return len(self.values)

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its form}."""
        return {one.parameter: one.name for one in self.libraries}

    @property
    def odds(self) -> float:
        """Prior odds of the forms together."""
        return float(np.prod([one.odds for one in self.libraries]))

    @property
    def table(self) -> dict[str, Param]:
        """{name: Param} of its numbers."""
        return {name: one.table[name] for one in self.libraries for name in one.names}

    def admissible(self) -> bool:
        """Whether its numbers lie within their bounds, or near."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        for (name, value), s in zip(self.values.items(), sd, strict=True):
            low, high = (self.table[name].to_internal(b) for b in self.table[name].bounds)
            if not low - BEYOND * s <= value <= high + BEYOND * s:
                return False
        return True


class _Design:
    """The columns of all parameters' libraries, over temperatures."""

    def __init__(self, libraries: Sequence[Library]) -> None:
        self.libraries = tuple(libraries)
        self.owner = np.concatenate([np.full(len(one.terms), p) for p, one in enumerate(libraries)])
        self.inner: dict[sympy.Symbol, Param] = {s: p for one in libraries for s, p in one.inner.items()}

    def raw(self, T: Floats, inner: Sequence[float] | Floats) -> tuple[Floats, Floats]:
        """Functions (temperatures, terms) and offsets (temperatures, parameters)."""
        parts, start = [], 0
        for one in self.libraries:
            parts.append(one.columns(T, [float(v) for v in inner[start : start + len(one.inner)]]))
            start += len(one.inner)
        return np.concatenate([p[:, :-1] for p in parts], axis=1), np.stack([p[:, -1] for p in parts], axis=1)

    def white(self, points: Points, inner: Sequence[float] | Floats) -> tuple[Floats, Floats]:
        """Features (temperatures * parameters, terms) and target (rows,) after multiplication by the whiteners."""
        functions, offsets = self.raw(points.temperatures, inner)
        features = np.concatenate(points.whiteners[:, :, self.owner] * functions[:, None, :])
        return features, np.concatenate(np.einsum("kij,kj->ki", points.whiteners, points.theta - offsets))


def regress(points: Points, libraries: Sequence[Library]) -> Regression:
    """The best numbers of one library for each parameter, with their covariance."""
    design = _Design(libraries)
    inner = _projected(design, points) if design.inner else np.zeros(0)
    white, target = design.white(points, inner)
    coefficients = by_pysindy(white, target)
    slopes = np.concatenate([white, _inner_slopes(design, points, inner, coefficients)], axis=1)
    names = [name for one in libraries for name in one.terms] + [s.name for s in design.inner]
    values = dict(zip(names, map(float, (*coefficients, *inner)), strict=True))
    return Regression(
        tuple(libraries),
        values,
        _covariance(slopes, design),
        curves(libraries, values, points.temperatures),
        float(((target - white @ coefficients) ** 2).sum()),
        target.size,
    )


def by_pysindy(features: Floats, target: Floats) -> Floats:
    """Coefficients (terms,) of target (rows,) on features (rows, terms), by pysindy; no term is dropped."""
    import pysindy

    size = np.linalg.norm(features, axis=0)
    size = np.where(size > 0, size, 1.0)
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.0, alpha=0.0), feature_library=pysindy.IdentityLibrary())
    model.fit(features / size, t=np.arange(len(target), dtype=float), x_dot=target[:, None])
    return np.asarray(model.coefficients()[0] / size, float)


def _projected(design: _Design, points: Points) -> Floats:
    """What is inside exponentials, with the coefficients solved for at each trial."""
    low, high = (np.array([p.bounds[end] for p in design.inner.values()]) for end in (0, 1))
    scale = high - low

    def residual(unit: Floats) -> Floats:
        white, target = design.white(points, low + unit * scale)
        scaled = white / np.linalg.norm(white, axis=0)
        return np.asarray(target - scaled @ np.linalg.lstsq(scaled, target, rcond=None)[0])

    trials = qmc.Sobol(low.size, seed=0).random(DRAWS)
    start = min(trials, key=lambda unit: float((residual(unit) ** 2).sum()))
    found = least_squares(residual, start, bounds=(0.0, 1.0), diff_step=1e-6, x_scale=0.1)
    return np.asarray(low + found.x * scale)


def _inner_slopes(design: _Design, points: Points, inner: Floats, coefficients: Floats) -> Floats:
    """Derivatives of the white curves to what is inside exponentials, (rows, inner), by central differences."""
    found = np.zeros((points.theta.size, inner.size))
    for k, param in enumerate(design.inner.values()):
        step = np.zeros(inner.size)
        step[k] = 1e-5 * (param.bounds[1] - param.bounds[0])
        (more, up), (less, down) = (design.white(points, inner + s * step) for s in (1.0, -1.0))
        found[:, k] = ((more - less) @ coefficients - (up - down)) / (2 * step[k])
    return found


def _covariance(slopes: Floats, design: _Design) -> Floats:
    """Of all numbers; what is inside exponentials has the variance of its bounds where the points say nothing."""
    matrix = slopes.T @ slopes
    for k, param in enumerate(design.inner.values(), start=len(design.owner)):
        matrix[k, k] += 12.0 / (param.bounds[1] - param.bounds[0]) ** 2
    size = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.pinv(matrix / np.outer(size, size), hermitian=True) / np.outer(size, size))
