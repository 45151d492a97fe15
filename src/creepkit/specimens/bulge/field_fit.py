"""Eq. (7), D exp(-|(x - x_c)/S|^p - |(y - y_c)/S|^p), by least squares to measured points of one or many frames.

`fit_frames` fits D, S, p of every frame about one given centre, all frames at once; `joint_center` finds the centre
that serves all frames best.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats

SHAPES = (0.25, 40.0)
"""Least and greatest p of a result, as in the fit of profiles."""


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


class FrameFits(NamedTuple):
    """Fits of frames about one centre.

    values : (frames, 3) of D mm, ln S, ln p. converged : (frames,). cost : (frames,) mm2, half the weighted squares.
    """

    values: Floats
    converged: Bools
    cost: Floats


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
