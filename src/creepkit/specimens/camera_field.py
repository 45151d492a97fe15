"""The generalised Gaussian of Eq. (7) fitted to a field of points, as cameras measure it: its centre is unknown too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError

_FEWEST_POINTS = 12
_SHAPES = (0.25, 40.0)
"""Least and greatest p of an answer, as in the fit of profiles."""

_LEAST_SIGNAL_TO_ERROR = 5.0
"""Least ratio of D to its standard error in an answer; the best fit to noise alone reached 3 in forty trials."""

_START_QUANTILES = (1.0, 0.98)
"""Searches start from the greatest height, right for a small bulge, and from one that a few wild points leave alone."""


@dataclass(frozen=True)
class FieldFit:
    """A bulge D exp(-|(x - x_c)/S|^p - |(y - y_c)/S|^p) fitted to points.

    amplitude, width : D and S, mm. shape : p. x_center, y_center : mm.
    standard_errors : of these five, in this order, if the points err independently. Pixels with overlapping subsets do
        not: true errors are greater by the root of the number of pixels that share one error.
    scatter : mm, root mean square of what the fit leaves. points : how many were fitted.
    """

    amplitude: float
    width: float
    shape: float
    x_center: float
    y_center: float
    standard_errors: tuple[float, ...]
    residual_sd: float
    points: int


def fit_field(x: ArrayLike, y: ArrayLike, heights: ArrayLike) -> FieldFit:
    """Fit Eq. (7) by unweighted least squares to points x, y, heights, each (points,) in mm, in any order or shape.

    Points that are not finite (a camera lost them) are left out. The fit has no offset: take off first what the surface
    showed without pressure.
    """
    X, Y, H = _points(x, y, heights)
    scale = float(np.abs(H).max())
    v, jacobian, left = _search(X, Y, H / scale)
    values = np.array([scale * v[0], np.exp(v[1]), np.exp(v[2]), v[3], v[4]])
    errors = _standard_errors(jacobian, left) * np.array([scale, values[1], values[2], 1.0, 1.0])
    if not (abs(values[0]) > _LEAST_SIGNAL_TO_ERROR * errors[0] and _SHAPES[0] < values[2] < _SHAPES[1]):
        raise FitError(
            f"the field of {H.size} points shows no bulge of Eq. (7): the best fit has D = {values[0]:.3g} +- "
            f"{errors[0]:.2g} mm, S = {values[1]:.3g} mm, p = {values[2]:.3g}; take off what the surface showed "
            "without pressure and give the points of one bulge"
        )
    D, S, p, a, b = values.tolist()
    return FieldFit(D, S, p, a, b, tuple(errors.tolist()), scale * float(np.sqrt(left / H.size)), int(H.size))


def _search(X: Floats, Y: Floats, heights: Floats) -> tuple[Floats, Floats, float]:
    """v of the least squares, the Jacobian there and the sum of squares that is left."""
    from scipy.optimize import least_squares  # heavy, and a list of specimens needs none of it

    fits = [
        least_squares(
            lambda v: _model(v, X, Y)[0] - heights,
            start,
            jac=lambda v: _model(v, X, Y)[1],
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=200,
        )
        for start in (_start(X, Y, heights, share) for share in _START_QUANTILES)
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    return best.x, best.jac, 2.0 * float(best.cost)


def _points(x: ArrayLike, y: ArrayLike, heights: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """The points that were seen, as three arrays (points,)."""
    arrays = [np.asarray(values, dtype=float) for values in (x, y, heights)]
    if len({array.shape for array in arrays}) > 1:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise FitError(f"a field needs as many x as y as heights; found the shapes {shapes}")
    outputs = np.isfinite(arrays).all(axis=0)
    X, Y, H = (array[outputs] for array in arrays)
    if H.size < _FEWEST_POINTS or not np.abs(H).max() > 0.0 or not min(np.ptp(X), np.ptp(Y)) > 0.0:
        raise FitError(
            f"a field of {H.size} finite points cannot be fitted; it needs at least {_FEWEST_POINTS}, spread over x and y, "
            "and heights that are not all zero"
        )
    return X, Y, H


def _start(X: Floats, Y: Floats, H: Floats, share: float) -> Floats:
    """v from the moments of the points above half of what a `share` of the points stay below: noise moves them little.

    A Gaussian stands above its half within r = S sqrt(ln 2), where the mean of x^2 about its centre is S^2 ln(2) / 4.
    """
    size = np.abs(H)
    top = float(np.quantile(size, share))
    turned = H * np.sign(H[np.argmin(np.abs(size - top))])
    high = turned >= 0.5 * top
    spread = 0.5 * (X[high].var() + Y[high].var())
    width = np.sqrt(4.0 * spread / np.log(2.0)) if spread > 0.0 else 0.25 * min(np.ptp(X), np.ptp(Y))
    amplitude = top * np.sign(np.sum(H[high]))
    return np.array([amplitude, np.log(width), np.log(2.0), X[high].mean(), Y[high].mean()])


def _model(v: Floats, X: Floats, Y: Floats) -> tuple[Floats, Floats]:
    """Heights (points,) of Eq. (7) and their derivatives (points, 5) to v = (D, ln S, ln p, x_c, y_c)."""
    D, width, p = v[0], np.exp(v[1]), np.exp(v[2])
    parts = []
    for far in ((X - v[3]) / width, (Y - v[4]) / width):
        logarithm = np.log(np.maximum(np.abs(far), 1e-100))
        power = np.exp(np.minimum(p * logarithm, 6.0))  # exp(-exp(6)) = 1e-175: nothing, and no overflow
        parts.append((power, logarithm, p * power / np.where(far == 0.0, np.inf, far) / width))
    (qx, lx, sx), (qy, ly, sy) = parts
    bell = np.exp(-qx - qy)
    high = D * bell
    return high, np.stack([bell, high * p * (qx + qy), -high * p * (qx * lx + qy * ly), high * sx, high * sy], axis=1)


def _standard_errors(jacobian: Floats, left: float) -> Floats:
    """Roots of the diagonal of s^2 (J^T J)^-1, s^2 being what each degree of freedom leaves; infinite if singular."""
    points, unknowns = jacobian.shape
    if np.linalg.matrix_rank(jacobian) < unknowns:
        return np.full(unknowns, np.inf)
    variance = left / (points - unknowns)
    return np.asarray(np.sqrt(variance * np.diag(np.linalg.inv(jacobian.T @ jacobian))))
