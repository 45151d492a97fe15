"""Eq. (7), D exp(-|(x - x_c)/S|^p - |(y - y_c)/S|^p), by least squares to measured points of one or many frames.

`fit_frames` fits D, S, p of every frame about one given centre, all frames at once; `joint_center` finds the centre
that serves all frames best; `fit_field`, for a single field, is both with one frame. `paper_parameters` maps the form
with eight parameters, by which such fields are described elsewhere, to D, S, p.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError

SHAPES = (0.25, 40.0)
"""Least and greatest p of a result, as in the fit of profiles."""


_FEWEST_POINTS = 12


_LEAST_SIGNAL_TO_ERROR = 5.0
"""Least ratio of D to its standard error in a result; the best fit to noise alone reached 3 in forty trials."""


_START_QUANTILES = (1.0, 0.98)
"""Searches start from the greatest height, right for a small bulge, and from one that a few wild points leave alone."""


_MOST_STEPS, _MOST_CENTERS = 60, 40
TIGHT, LOOSE = 1e-9, 1e-6
"""Tolerances of fits; noise changes ln S and ln p by 1e-3 and more, and the last step is quadratically better."""


_FRAMES_AT_ONCE = 48
"""Of a fit: so many keep its arrays in the processor's cache."""


_GAUSS_POINTS = np.polynomial.legendre.leggauss(3)


class Bells(NamedTuple):
    """exp(-|x/S|^p) averaged over subsets, and its derivatives.

    value : (frames, points). to_width, to_shape, to_center : (frames, points), to ln S, ln p and the centre's x, 1/mm.
    """

    value: Floats
    to_width: Floats
    to_shape: Floats
    to_center: Floats


@dataclass(frozen=True)
class FieldFit:
    """A bulge D exp(-|(x - x_c)/S|^p - |(y - y_c)/S|^p) fitted to points.

    amplitude, width : D and S, mm. shape : p. x_center, y_center : mm.
    standard_errors : of these five, in this order, if the points err independently. Pixels with overlapping subsets do
        not: true errors are greater by the root of the number of pixels that share one error.
    residual_sd : mm, root mean square of the residuals. points : how many were fitted.
    """

    amplitude: float
    width: float
    shape: float
    x_center: float
    y_center: float
    standard_errors: tuple[float, ...]
    residual_sd: float
    points: int


class PaperParameters(NamedTuple):
    """D and S of Eq. (7), mm, and p."""

    amplitude: float
    width: float
    shape: float


class FrameFits(NamedTuple):
    """Fits of frames about one centre.

    values : (frames, 3) of D mm, ln S, ln p. converged : (frames,). cost : (frames,) mm2, half the weighted squares.
    """

    values: Floats
    converged: Bools
    cost: Floats


@checked
def paper_parameters(
    amplitude: float, sigma_x: float, sigma_y: float, shape: float, theta: float = 0.0, offset: float = 0.0
) -> PaperParameters:
    """D, S, p of Eq. (7) from offset + A exp(-(|x'/s_x|^p + |y'/s_y|^p) / 2) with axes turned by theta.

    amplitude, sigma_x, sigma_y, offset : A, s_x, s_y and the offset, mm. theta : rad.

    D = A + offset, S = sqrt(s_x s_y) 2^(1/p), p. That is exact for s_x = s_y, no offset, and theta = 0 or p = 2.
    Otherwise: an ellipse becomes the square bulge of its area; an offset is taken as part of the bulge, for it was
    fitted beside it and Eq. (7) has none, so that D is the height of the fitted apex and S is left as it is; and theta
    has no counterpart, for Eq. (7) keeps its axes and for p other than 2 is not round: at 45 degrees and p = 2.2 it is
    3.2 % wider along x than the same form unturned. A field is better fitted anew than mapped.
    """
    numbers = np.array([amplitude, sigma_x, sigma_y, shape, theta, offset], dtype=float)
    if not np.isfinite(numbers).all() or min(sigma_x, sigma_y) <= 0.0 or not SHAPES[0] <= shape <= SHAPES[1]:
        raise FitError(
            f"no bulge has sigma_x = {sigma_x!r}, sigma_y = {sigma_y!r}, p = {shape!r} and finite other numbers; both "
            f"sigma must be above zero and p within {SHAPES[0]:g} to {SHAPES[1]:g}"
        )
    return PaperParameters(amplitude + offset, float(np.sqrt(sigma_x * sigma_y) * 2.0 ** (1.0 / shape)), shape)


@checked
def fit_field(x: ArrayLike, y: ArrayLike, heights: ArrayLike) -> FieldFit:
    """Fit Eq. (7) by unweighted least squares to points; x, y, heights : (points,) mm, in any order or shape.

    Points that are not finite (a camera lost them) are left out. The fit has no offset: take off first what the surface
    showed without pressure.
    """
    X, Y, H = _points(x, y, heights)
    scale, weights = float(np.abs(H).max()), np.ones((1, H.size))
    places, field = np.stack([X, Y], axis=1), H[None] / scale
    results = [joint_center(places, field, weights, *_start(X, Y, H / scale, share)) for share in _START_QUANTILES]
    center, fits, _ = min(results, key=lambda result: float(result[1].cost[0]))
    jacobian = model(places - center, fits.values)[1][0]
    D, S, p = scale * fits.values[0, 0], *np.exp(fits.values[0, 1:])
    left = 2.0 * float(fits.cost[0])
    errors = _standard_errors(jacobian.T, left) * np.array([scale, S, p, 1.0, 1.0])
    if not (abs(D) > _LEAST_SIGNAL_TO_ERROR * errors[0] and SHAPES[0] < p < SHAPES[1]):
        raise FitError(
            f"the field of {H.size} points shows no bulge of Eq. (7): the best fit has D = {D:.3g} +- "
            f"{errors[0]:.2g} mm, S = {S:.3g} mm, p = {p:.3g}; take off what the surface showed "
            "without pressure and give the points of one bulge"
        )
    residual_sd = scale * float(np.sqrt(left / H.size))
    x_center, y_center = center.tolist()
    return FieldFit(float(D), float(S), float(p), x_center, y_center, tuple(errors.tolist()), residual_sd, int(H.size))


def model(places: Floats, values: Floats, subset: float = 0.0) -> tuple[Floats, Floats]:
    """Heights (frames, points) of Eq. (7) and derivatives (frames, 5, points) to D, ln S, ln p, x_c, y_c.

    places : (points, 2) mm about the centre. values : (frames, 3) of D, ln S, ln p. subset : mm, side of the square
    over which each height is a mean, by three Gauss points along each axis.
    """
    across, along = (_bells(coordinate, values, subset) for coordinate in places.T)
    D = values[:, :1]
    bell = across.value * along.value
    derivatives = [
        bell,
        D * (across.to_width * along.value + across.value * along.to_width),
        D * (across.to_shape * along.value + across.value * along.to_shape),
        D * across.to_center * along.value,
        D * across.value * along.to_center,
    ]
    return D * bell, np.stack(derivatives, axis=1)


def _bells(x: Floats, values: Floats, subset: float) -> Bells:
    """x : (points,) mm; values : (frames, 3)."""
    places, shares = (np.zeros(1), np.ones(1)) if subset == 0.0 else _GAUSS_POINTS
    p = np.exp(values[:, 2:])
    sums = [np.zeros((len(values), x.size)) for _ in range(4)]
    for place, share in zip(places, shares / shares.sum(), strict=True):
        moved = x + 0.5 * subset * place
        logarithm = np.log(np.maximum(np.abs(moved), 1e-100)) - values[:, 1:2]
        power = np.exp(np.minimum(p * logarithm, 6.0))  # exp(-exp(6)) = 1e-175: nothing, and no overflow
        bell = share * np.exp(-power)
        falling = p * power * bell
        sums[0] += bell
        sums[1] += falling
        sums[2] -= falling * logarithm
        sums[3] += falling / np.where(moved == 0.0, np.inf, moved)
    return Bells(*sums)


def fit_frames(
    places: Floats, heights: Floats, weights: Floats, start: Floats, subset: float = 0.0, tolerance: float = TIGHT
) -> FrameFits:
    """D, S, p of every frame by least squares about the centre: Levenberg-Marquardt, many frames at once.

    places : (points, 2) mm about the centre. heights : (frames, points) mm; anything where the weight is zero.
    weights : (frames, points). start : (frames, 3) of D, ln S, ln p; D is not used, for it follows from the others.
    subset : mm, as in `model`. tolerance : change of ln S and ln p at which a fit has converged.
    """
    parts = [
        _fit_some(places, heights[some], weights[some], start[some], subset, tolerance)
        for some in (slice(k, k + _FRAMES_AT_ONCE) for k in range(0, len(heights), _FRAMES_AT_ONCE))
    ]
    return FrameFits(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _fit_some(
    places: Floats, heights: Floats, weights: Floats, start: Floats, subset: float, tolerance: float
) -> FrameFits:
    values = np.array(start)
    damping = np.full(len(values), 1e-3)
    converged = np.zeros(len(values), bool)
    values, cost, normal, gradient = _normal_equations(places, heights, weights, values, subset)
    for _ in range(_MOST_STEPS):
        active = np.flatnonzero(~converged)
        if not active.size:
            break
        diagonal = np.einsum("fii->fi", normal[active])
        damped = normal[active] + (damping[active, None] * np.maximum(diagonal, 1e-300))[:, :, None] * np.eye(3)
        step = np.einsum("fij,fj->fi", np.linalg.pinv(damped, hermitian=True), gradient[active])
        step[:, 1:] = np.clip(step[:, 1:], -0.5, 0.5)
        tried = values[active] + step
        tried[:, 2] = np.clip(tried[:, 2], np.log(0.5 * SHAPES[0]), np.log(2.0 * SHAPES[1]))
        trial = _normal_equations(places, heights[active], weights[active], tried, subset)
        better = trial[1] <= cost[active] * (1.0 + 1e-14)
        small = np.abs(step[:, 1:]).max(axis=1) < tolerance
        stuck = ~better & (damping[active] > 1e10)
        for array, new in zip((values, cost, normal, gradient), trial, strict=True):
            array[active[better]] = new[better]
        damping[active] = np.where(better, np.maximum(damping[active] * 0.1, 1e-12), damping[active] * 10.0)
        nearly = ~better & (np.abs(step[:, 1:]).max(axis=1) < 1e-7)  # the cost is flat to its last digits
        converged[active[(small & better) | nearly | stuck]] = True
    return FrameFits(values, converged, cost)


def without_smoothing(places: Floats, heights: Floats, weights: Floats, values: Floats, subset: float) -> Floats:
    """Values (frames, 3) of D, ln S, ln p as least squares to a surface that no subsets had smoothed would give them.

    places : (points, 2) mm about the centre. heights, weights : (frames, points). values : (frames, 3) of the fit with
    a smoothed model. subset : mm.

    Fitting a smoothed model leaves out that what the model misses was smoothed as well. With r what is left of the
    smoothed field, J the derivatives of the model and B the mean over a subset, J^T (what is missed) is to second
    order in the subset (2 J - B J)^T r, for the mean is self-adjoint; its zero is sought instead of that of (B J)^T r.
    """
    values = np.array(values)
    for _ in range(4):
        left, columns, surface = smoothing_columns(places, values, subset)
        heavy = left * weights[:, None, :]
        normal = np.matmul(heavy, columns.transpose(0, 2, 1))
        gradient = np.einsum("fin,fn->fi", heavy, np.where(weights > 0.0, heights - surface, 0.0))
        step = np.einsum("fij,fj->fi", np.linalg.pinv(normal), gradient)
        values += np.clip(step, -0.2 * np.maximum(np.abs(values), 1e-3), 0.2 * np.maximum(np.abs(values), 1e-3))
    return values


def smoothing_columns(places: Floats, values: Floats, subset: float) -> tuple[Floats, Floats, Floats]:
    """2 J - B J and B J (frames, 3, points) to D, ln S, ln p, and the smoothed surface (frames, points).

    places : (points, 2) mm about the centre. values : (frames, 3). subset : mm.
    """
    surface, smoothed = model(places, values, subset)
    if subset == 0.0:
        return smoothed[:, :3], smoothed[:, :3], surface
    return 2.0 * model(places, values)[1][:, :3] - smoothed[:, :3], smoothed[:, :3], surface


def _normal_equations(
    places: Floats, heights: Floats, weights: Floats, values: Floats, subset: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Values with the best D, cost (frames,), normal matrices (frames, 3, 3) and gradients (frames, 3)."""
    with_unit = np.concatenate([np.ones((len(values), 1)), values[:, 1:]], axis=1)
    bell, derivatives = model(places, with_unit, subset)
    weighted = weights * bell
    top = np.einsum("fn,fn->f", weighted, heights)
    D = top / np.maximum(np.einsum("fn,fn->f", weighted, bell), 1e-300)
    columns = derivatives[:, :3] * np.stack([np.ones_like(D), D, D], axis=1)[:, :, None]
    residuals = heights - D[:, None] * bell
    heavy = columns * weights[:, None, :]
    normal = np.matmul(heavy, columns.transpose(0, 2, 1))
    gradient = np.einsum("fin,fn->fi", heavy, residuals)
    cost = 0.5 * np.einsum("fn,fn,fn->f", weights, residuals, residuals)
    return np.concatenate([D[:, None], values[:, 1:]], axis=1), cost, normal, gradient


def joint_center(
    places: Floats,
    heights: Floats,
    weights: Floats,
    center: Floats,
    start: Floats,
    subset: float = 0.0,
    tolerance: float = TIGHT,
) -> tuple[Floats, FrameFits, Floats]:
    """The centre (2,) mm for which all frames together are fitted best, their fits, and the centre's normal matrix.

    places : (points, 2) mm. heights, weights : (frames, points) as in fit_frames. center : (2,) mm, where to begin.
    start : (frames, 3). tolerance : as in fit_frames. The frames' own D, S, p are eliminated (Schur complement); a
    frame weighs as its signal does, for the derivative of its heights to the centre is proportional to them.
    """
    center = np.asarray(center, float)
    fits = fit_frames(places - center, heights, weights, start, subset, tolerance)
    matrix = np.zeros((2, 2))
    for _ in range(_MOST_CENTERS):
        surface, derivatives = model(places - center, fits.values, subset)
        heavy = derivatives * weights[:, None, :]
        normal = np.matmul(heavy, derivatives.transpose(0, 2, 1))
        gradient = np.einsum("fin,fn->fi", heavy, heights - surface)
        coupling = np.matmul(normal[:, 3:, :3], np.linalg.pinv(normal[:, :3, :3], hermitian=True))
        matrix = (normal[:, 3:, 3:] - np.matmul(coupling, normal[:, :3, 3:])).sum(axis=0)
        total = (gradient[:, 3:] - np.einsum("fij,fj->fi", coupling, gradient[:, :3])).sum(axis=0)
        step = np.linalg.pinv(matrix, hermitian=True) @ total
        reach = 0.5 * float(np.median(np.exp(fits.values[:, 1])))
        step *= min(1.0, reach / max(float(np.hypot(*step)), 1e-300))
        for _ in range(8):
            trial = fit_frames(places - center - step, heights, weights, fits.values, subset, tolerance)
            if trial.cost.sum() <= fits.cost.sum() * (1.0 + 1e-12):
                break
            step = 0.25 * step
        else:
            break
        center, fits = center + step, trial
        if np.hypot(*step) < 10.0 * tolerance * reach:
            break
    return center, fits, matrix


def _points(x: ArrayLike, y: ArrayLike, heights: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """The points that were seen, as three arrays (points,)."""
    arrays = [np.asarray(values, dtype=float) for values in (x, y, heights)]
    if len({array.shape for array in arrays}) > 1:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise FitError(f"a field needs as many x as y as heights; found the shapes {shapes}")
    seen = np.isfinite(arrays).all(axis=0)
    X, Y, H = (array[seen] for array in arrays)
    if H.size < _FEWEST_POINTS or not np.abs(H).max() > 0.0 or not min(np.ptp(X), np.ptp(Y)) > 0.0:
        raise FitError(
            f"a field of {H.size} finite points cannot be fitted; it needs at least {_FEWEST_POINTS}, over x and y, "
            "and heights that are not all zero"
        )
    return X, Y, H


def _start(X: Floats, Y: Floats, H: Floats, share: float) -> tuple[Floats, Floats]:
    """Centre (2,) and (1, 3) of D, ln S, ln p from the moments of the points above half of the height of the bulge.

    share : of the points that stay below that height: noise moves it little.

    A Gaussian stands above its half within r = S sqrt(ln 2), where the mean of x^2 about its centre is S^2 ln(2) / 4.
    """
    size = np.abs(H)
    top = float(np.quantile(size, share))
    turned = H * np.sign(H[np.argmin(np.abs(size - top))])
    high = turned >= 0.5 * top
    spread = 0.5 * (X[high].var() + Y[high].var())
    width = np.sqrt(4.0 * spread / np.log(2.0)) if spread > 0.0 else 0.25 * min(np.ptp(X), np.ptp(Y))
    amplitude = top * np.sign(np.sum(H[high]))
    return np.array([X[high].mean(), Y[high].mean()]), np.array([[amplitude, np.log(width), np.log(2.0)]])


def _standard_errors(jacobian: Floats, left: float) -> Floats:
    """Roots of the diagonal of s^2 (J^T J)^-1, s^2 being what each degree of freedom leaves; infinite if singular."""
    points, unknowns = jacobian.shape
    if np.linalg.matrix_rank(jacobian) < unknowns:
        return np.full(unknowns, np.inf)
    variance = left / (points - unknowns)
    return np.asarray(np.sqrt(variance * np.diag(np.linalg.inv(jacobian.T @ jacobian))))
