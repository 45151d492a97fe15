"""Least squares fit of a generalised Gaussian to profiles, compiled, with exact derivatives to the data."""

from __future__ import annotations

from math import exp, isfinite, log, nan, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints

LOG_OF_ZERO = -700.0
"""Stands for ln 0: exp(LOG_OF_ZERO p) is nothing beside 1 for any admitted p, and nothing times -700 still is."""


_FARTHEST = 6.0  # exp(-exp(6)) = 1e-175 is nothing, and its products with q still are numbers


class PolarGrid(NamedTuple):
    """Where profiles are sampled.

    log_radius : (radii,) ln(r / window). radial : (radii,) their weights.
    log_cosine, log_sine : (angles,) logarithms of |cos a| and |sin a|. angular : (angles,) their weights.
    """

    log_radius: Floats
    radial: Floats
    log_cosine: Floats
    log_sine: Floats
    angular: Floats


class NormalEquations(NamedTuple):
    """Half the sum of squares at one place, and its derivatives.

    squares : (1,) half the sum. slope : (3,) its derivatives. matrix : (3, 3) its second derivatives, the upper half.
    diagonal : (3,) of the part of `matrix` that knows no residuals, as in the Gauss-Newton method: never negative.
    """

    slope: Floats
    matrix: Floats
    diagonal: Floats
    squares: Floats


@njit(cache=True, error_model="numpy")
def _angle(grid: PolarGrid, p: float, j: int) -> tuple[float, float, float]:
    """g of an angle, and the first and second derivative of ln g to p."""
    cosine, sine = exp(p * grid.log_cosine[j]), exp(p * grid.log_sine[j])
    g = cosine + sine
    first = (cosine * grid.log_cosine[j] + sine * grid.log_sine[j]) / g
    second = (cosine * grid.log_cosine[j] ** 2 + sine * grid.log_sine[j] ** 2) / g - first * first
    return g, first, second


@njit(cache=True, error_model="numpy")
def _bell(far: float, p: float, g: float) -> tuple[float, float]:
    """q and exp(-q) at the distance `far` = ln(r/S)."""
    q = g * exp(min(p * far, _FARTHEST))
    return q, exp(-q)


@njit(cache=True, error_model="numpy")
def best_amplitude(grid: PolarGrid, y: Floats, x: Floats) -> float:
    """D in mm of the least squares at given ln S and ln p; D is linear.

    y : (radii,) mm, the profile. x : (3,) D, ln S and ln p.
    """
    p = exp(x[2])
    product, square = 0.0, 0.0
    for j in range(grid.angular.size):
        g, _, _ = _angle(grid, p, j)
        for i in range(y.size):
            _, m = _bell(grid.log_radius[i] - x[1], p, g)
            product += grid.angular[j] * grid.radial[i] * m * y[i]
            square += grid.angular[j] * grid.radial[i] * m * m
    return product / square


@njit(cache=True, error_model="numpy")
def sum_up(grid: PolarGrid, y: Floats, x: Floats, normal: NormalEquations) -> None:
    """Half the sum of squares, and its derivatives, into `normal`.

    y : (radii,) mm, the profile. x : (3,) D, ln S and ln p.
    """
    p, squares = exp(x[2]), 0.0
    slope, matrix, diagonal = normal.slope, normal.matrix, normal.diagonal
    for v in range(3):
        slope[v], diagonal[v] = 0.0, 0.0
        for w in range(3):
            matrix[v, w] = 0.0
    for j in range(grid.angular.size):
        g, first, second = _angle(grid, p, j)
        for i in range(y.size):
            weight = grid.angular[j] * grid.radial[i]
            far = grid.log_radius[i] - x[1]
            q, m = _bell(far, p, g)
            left, steep = weight * (x[0] * m - y[i]), p * (far + first)
            fq = x[0] * m * q
            fs, fp = fq * p, -fq * steep
            squares += left * (x[0] * m - y[i])
            slope[0] += left * m
            slope[1] += left * fs
            slope[2] += left * fp
            diagonal[0] += weight * m * m
            diagonal[1] += weight * fs * fs
            diagonal[2] += weight * fp * fp
            matrix[0, 1] += weight * m * fs + left * m * q * p
            matrix[0, 2] += weight * m * fp - left * m * q * steep
            matrix[1, 1] += left * fq * (q - 1.0) * p * p
            matrix[1, 2] += weight * fs * fp + left * fq * (p - (q - 1.0) * p * steep)
            matrix[2, 2] += left * fq * ((q - 1.0) * steep * steep - p * p * second - steep)
    for v in range(3):
        matrix[v, v] += diagonal[v]
    normal.squares[0] = 0.5 * squares


@njit(cache=True, error_model="numpy")
def solve_damped(normal: NormalEquations, damping: float, solution: Floats) -> bool:
    """Solution (3,) of the damped system by Cholesky's method; false where its matrix is not positive definite.

    solution : (3,) is written.
    """
    lower = np.empty((3, 3))
    for a in range(3):
        for b in range(a + 1):
            total = normal.matrix[b, a] + (damping * normal.diagonal[a] if a == b else 0.0)
            for c in range(b):
                total -= lower[a, c] * lower[b, c]
            if a > b:
                lower[a, b] = total / lower[b, b]
            elif total > 1e-13 * normal.diagonal[a]:
                lower[a, a] = sqrt(total)
            else:
                return False
        solution[a] = normal.slope[a]
        for c in range(a):
            solution[a] -= lower[a, c] * solution[c]
        solution[a] /= lower[a, a]
    for a in range(2, -1, -1):
        for c in range(a + 1, 3):
            solution[a] -= lower[c, a] * solution[c]
        solution[a] /= lower[a, a]
    return True


@njit(cache=True, error_model="numpy")
def derivatives_to_profile(grid: PolarGrid, x: Floats, normal: NormalEquations, derivatives: Floats) -> None:
    """Derivatives of x (3,) = (D, ln S, ln p) to the profile, `normal` being that of the result.

    derivatives : (3, radii) is written.
    """
    p, inverse, solution = exp(x[2]), np.empty((3, 3)), np.empty(3)
    for v in range(3):
        normal.slope[0], normal.slope[1], normal.slope[2] = 0.0, 0.0, 0.0
        normal.slope[v] = 1.0
        solve_damped(normal, 0.0, solution)
        for w in range(3):
            inverse[v, w] = solution[w]
    for v in range(derivatives.shape[0]):
        for i in range(derivatives.shape[1]):
            derivatives[v, i] = 0.0
    for j in range(grid.angular.size):
        g, first, _ = _angle(grid, p, j)
        for i in range(derivatives.shape[1]):
            far = grid.log_radius[i] - x[1]
            q, m = _bell(far, p, g)
            weight = grid.angular[j] * grid.radial[i] * m
            fq = x[0] * q * p
            for v in range(3):
                a, b, c = inverse[v, 0], inverse[v, 1], inverse[v, 2]
                derivatives[v, i] += weight * (a + fq * (b - c * (far + first)))


FITTED, AT_REST, FAILED = 0, 1, 2
"""What became of a frame: fitted; no displacement to fit; no fit that deserves the name."""


AT_REST_BELOW = 1e-9
"""Displacement in mm below which a frame shows none; cameras see some 1e-3, solvers resolve some 1e-12."""


_WIDTHS = (log(0.02), log(20.0))


_SHAPES = (log(0.25), log(40.0))
"""Least and greatest ln(S / window) and ln p of a result: beyond them a profile shows an edge or its middle alone."""


_UNEXPLAINED = 0.2
"""Share of the sum of squares that a fit leaves less of: noise of D/4 leaves as much, noise alone nearly all."""


_CLEAR = 0.03
"""Share below which a minimum is the one: that of a plate's profile is below 0.001, of noise of D/10 some 0.03."""


_STARTS = ((0.0, 2.0), (0.0, 4.0), (0.0, 1.2), (0.25, 2.0), (0.5, 2.0), (1.0, 2.0))
"""(S / window, or 0 for where the profile has fallen to D/e; p): where fits start that no frame before them warms."""


_ITERATIONS = 60


_LONGEST_STEP = 0.5


_CONVERGED = 1e-7  # Newton squares it: the step taken last leaves 1e-13 or so


@njit(cache=True, error_model="numpy")
def fit_frames(grid: PolarGrid, samples: Floats, fits: Floats, states: Ints, derivatives: Floats) -> None:
    """Fit every frame of samples (frames, radii), in mm.

    fits : (frames, 3) becomes D in mm, S / window and p, each frame starting from the last one fitted.
    states : (frames,) becomes FITTED, AT_REST or FAILED.
    derivatives : (frames, 3, radii) becomes those of `fits` to `samples`; with a length of zero they are left out.
    """
    normal = NormalEquations(np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(1))
    x, last, y = np.zeros(3), np.zeros(3), np.zeros(samples.shape[1])
    last[1] = nan
    for k in range(samples.shape[0]):
        fits[k, 0], fits[k, 1], fits[k, 2] = nan, nan, nan
        states[k], scale = _state_and_scale(samples[k])
        if states[k] != FITTED:
            continue
        for i in range(y.size):
            y[i] = samples[k, i] / scale
        if not _fit(grid, y, last, x, normal):
            states[k] = FAILED
            continue
        _copy(x, last)
        fits[k, 0], fits[k, 1], fits[k, 2] = scale * x[0], exp(x[1]), exp(x[2])
        if derivatives.shape[0] > 0:
            derivatives_to_profile(grid, x, normal, derivatives[k])
            for i in range(y.size):
                derivatives[k, 1, i] *= fits[k, 1] / scale
                derivatives[k, 2, i] *= fits[k, 2] / scale


@njit(cache=True, error_model="numpy")
def _copy(source: Floats, target: Floats) -> None:
    for v in range(source.size):
        target[v] = source[v]


@njit(cache=True, error_model="numpy")
def _state_and_scale(profile: Floats) -> tuple[int, float]:
    """FITTED when the profile can be fitted, and its largest size."""
    total, largest = 0.0, 0.0
    for value in profile:
        total += abs(value)
        largest = max(largest, abs(value))
    if not isfinite(total):
        return FAILED, largest
    return (FITTED if largest > AT_REST_BELOW else AT_REST), largest


@njit(cache=True, error_model="numpy")
def _fit(grid: PolarGrid, y: Floats, last: Floats, x: Floats, normal: NormalEquations) -> bool:
    """Fit one profile, largest value 1; `x` (3,) and `normal` are the result.

    The first clear fit is taken, started from the result before it or else at the starts; of noisy ones, the
    best of all.
    """
    whole = _half_square(grid, y)
    trial, least = np.empty(3), _UNEXPLAINED * whole
    for k in range(-1, len(_STARTS)):
        if k < 0:
            _copy(last, trial)
        else:
            width, shape = _STARTS[k]
            trial[1] = log(width) if width > 0.0 else _fallen(grid, y)
            trial[2] = log(shape)
        if isfinite(trial[1]) and _descend(grid, y, trial, normal) and normal.squares[0] < least:
            _copy(trial, x)
            least = normal.squares[0]
            if least < _CLEAR * whole:
                return True
    if least == _UNEXPLAINED * whole:
        return False
    sum_up(grid, y, x, normal)
    return True


@njit(cache=True, error_model="numpy")
def _half_square(grid: PolarGrid, y: Floats) -> float:
    """Half the weighted sum of squares of a profile itself."""
    along, around = 0.0, 0.0
    for i in range(y.size):
        along += grid.radial[i] * y[i] * y[i]
    for weight in grid.angular:
        around += weight
    return 0.5 * along * around


@njit(cache=True, error_model="numpy")
def _fallen(grid: PolarGrid, y: Floats) -> float:
    """ln(r / window) of the place where a profile has fallen to 1/e of its largest value."""
    peak = 0
    for i in range(1, y.size):
        peak = i if abs(y[i]) > abs(y[peak]) else peak
    for i in range(peak + 1, y.size):
        if y[i] * y[peak] < y[peak] * y[peak] * exp(-1.0):
            return float(grid.log_radius[i])
    return 0.0


@njit(cache=True, error_model="numpy")
def _descend(grid: PolarGrid, y: Floats, x: Floats, normal: NormalEquations) -> bool:
    """Minimise from ln S and ln p in `x`; true when a strict minimum was reached that the grid can see."""
    step, trial = np.empty(3), np.empty(3)
    x[0] = best_amplitude(grid, y, x)
    sum_up(grid, y, x, normal)
    squares, damping = normal.squares[0], 0.0
    for _ in range(_ITERATIONS):
        if not solve_damped(normal, damping, step):
            damping = max(4.0 * damping, 1e-3)
            continue
        longest = max(abs(step[1]), abs(step[2]))
        shrink = min(1.0, _LONGEST_STEP / longest) if longest > 0.0 else 1.0
        for v in range(3):
            trial[v] = x[v] - shrink * step[v]
        sum_up(grid, y, trial, normal)
        close = damping == 0.0 and longest < _CONVERGED and abs(step[0]) < _CONVERGED
        if close or normal.squares[0] <= squares:
            _copy(trial, x)
            squares = normal.squares[0]
            damping = 0.0 if damping < 1e-5 else 0.1 * damping
        else:
            damping = max(4.0 * damping, 1e-3)
            sum_up(grid, y, x, normal)
        if close:
            inside = _WIDTHS[0] < x[1] < _WIDTHS[1] and _SHAPES[0] < x[2] < _SHAPES[1]
            return inside and solve_damped(normal, 0.0, step)
    return False
