"""Noise of outputs: from frames at rest, and from block sums of residuals over patches larger than a subset.

An output's error is to first order the sum over points of its gain times the error of the height there. Errors of
points that lie nearer than a subset are correlated, so a variance is never that of independent points:

- Frames at rest show whole fields of errors. The gains of a loaded frame applied to each of them give as many errors
  of that frame's outputs, with whatever correlation in space they have. Their covariance is multiplied by how much
  more the residuals of the loaded frame scatter in time than those at rest.
- The block bootstrap draws patches of the residual field with replacement and adds up what they contribute; in the
  linear limit its covariance is the sum over patches of the square of each patch's contribution, which is taken
  directly, enlarged for what the fit took from the residuals and for correlation across the edges of patches.
  Residuals have what is smooth in time taken off first, for what a model misses of the surface is no noise.

The covariance of a frame is the mean of both, the frames at rest weighing by their number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints, frozen, set_fields
from creepkit.records import SurfaceObservation

PATCHES_WEIGHT = 40
"""Frames at rest that the covariance from patches counts for in the mean of both.

Of 40 fields a standard deviation is known to 11 %, about as well as the patches know it.
"""


FEWEST_REST_FRAMES = 8
"""Frames at rest below which they say nothing of the noise."""


NOISE_FRAMES = 60
"""Loaded frames, evenly spread, whose residuals give the covariance of the block bootstrap."""


LEAST_CORRELATION = 0.1
"""Autocorrelation in space below which errors count as independent."""


LAGS = 13
"""Distances, in spacings from 0 on, at which the autocorrelation in space is estimated."""


@dataclass(frozen=True, eq=False)
class NoiseEstimate:
    """Noise of the outputs of one test.

    covariance : (frames, outputs, outputs) of each frame's outputs, the share of the zero level in it.
    correlation : {(output, output): median of the frames}.
    point_sd : mm, of the height of one point in one frame, its part that changes with time.
    correlation_length : mm, at which the autocorrelation in space has fallen to 0.1.
    lag_one : correlation of an output's error in successive frames.
    """

    covariance: Floats
    correlation: Mapping[tuple[str, str], float]
    point_sd: float
    correlation_length: float
    lag_one: float

    def __post_init__(self) -> None:
        set_fields(self, covariance=frozen(self.covariance), correlation=MappingProxyType(dict(self.correlation)))


@dataclass(frozen=True, eq=False)
class ErrorFields:
    """Fields of errors of heights, zeros where lost.

    rest : (fields, points) mm, of frames at rest. loaded : (fields, points) mm, of loaded frames. loaded_frames :
    (fields,) which frames these are. clamped : (fields, clamped points) mm of the clamped plate in them.
    places : (points, 2) mm. clamped_places : (clamped, 2) mm.
    """

    rest: Floats
    loaded: Floats
    loaded_frames: Ints
    clamped: Floats
    places: Floats
    clamped_places: Floats


def estimate_noise(
    seen: SurfaceObservation, fields: ErrorFields, signal: Floats, shown: Bools, spacing: float
) -> NoiseEstimate:
    """The noise of the outputs of an observation.

    signal : (frames,) the leading output, for the correlation in time
    where there are no frames at rest. shown : (frames, outputs) which outputs a frame shows. spacing : mm of points.
    """
    names, gains = tuple(seen.outputs), seen.gains
    enough = len(fields.rest) >= FEWEST_REST_FRAMES
    # The clamped plate lost the least to a fit: three numbers over its whole area.
    rho = autocorrelation(fields.clamped, fields.clamped_places, spacing)
    patch = max(2.0 * rho.length, 3.0 * spacing)
    reference = int(np.nanargmax(np.where(np.isfinite(signal), np.abs(signal), -1.0)))
    of_plate = clamped_covariance(fields.clamped, fields.clamped_places, patch, rho)
    by_blocks = _block_covariance(seen, fields, patch, rho, reference, of_plate)
    covariance = by_blocks
    if enough:
        at_rest = _rest_covariance(gains, fields.rest) * _growth(fields, len(gains))[:, None, None] ** 2
        covariance = by_blocks + len(fields.rest) / (len(fields.rest) + PATCHES_WEIGHT) * (at_rest - by_blocks)
        lag_one, integral = time_correlation(fields.rest @ gains[reference, 0])
    else:
        lag_one, integral = time_correlation(smooth_free(signal[np.isfinite(signal)][:, None])[:, 0])
    # The zero level is a mean of frames at rest, and the reference image's own noise where there are none.
    covariance = covariance * (1.0 + min(integral / max(len(fields.rest), 1), 1.0))
    loaded = shown.all(axis=1)
    some = loaded if loaded.any() else np.ones(len(gains), bool)
    source = fields.rest if enough else fields.loaded
    return NoiseEstimate(
        covariance=np.where(shown[:, :, None] & shown[:, None, :], covariance, np.nan),
        correlation=_correlations(names, covariance[some]),
        point_sd=_point_sd(source),
        correlation_length=rho.length,
        lag_one=lag_one,
    )


def whole(fields: Floats) -> Floats:
    """Fields enlarged so that each has the squares of one without lost points, (fields, points).

    fields : (fields, points) mm, zeros where lost.
    """
    seen = np.count_nonzero(fields, axis=1)[:, None]
    used = np.count_nonzero(fields.any(axis=0))  # others lie outside of what is observed, or are lost for good
    return np.asarray(fields * np.sqrt(used / np.maximum(seen, 1)))


def smooth_free(values: Floats, positions: Floats | None = None) -> Floats:
    """What is left, (frames, columns), without what is smooth along the frames, scaled for what that took.

    values : (frames, columns). positions : (frames,) from 0 to 1, along which quadratic splines, one for about eight
    frames and at most twelve, are taken off; evenly spaced by default. NaN counts as nothing and stays nothing.
    """
    from scipy.interpolate import BSpline

    frames = len(values)
    count = int(np.clip(frames // 8, 3, 12))
    if frames <= count + 1:
        return np.zeros_like(values)
    x = np.linspace(0.0, 1.0, frames) if positions is None else np.clip(positions, 0.0, 1.0)
    knots = np.r_[0.0, 0.0, np.linspace(0.0, 1.0, count - 1), 1.0, 1.0]
    basis = np.linalg.qr(BSpline.design_matrix(x, knots, 2).toarray())[0]
    seen = np.isfinite(values)
    mean = np.where(seen, values, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    left = np.where(seen, values - mean, 0.0)
    for _ in range(3):  # lost ones take the smooth part's value, so that they pull it nowhere
        smooth = basis @ (basis.T @ left)
        left = np.where(seen, values - mean, smooth)
    taken = (basis**2).sum(axis=1)
    return np.asarray(np.where(seen, left - smooth, 0.0) / np.sqrt(np.maximum(1.0 - taken, 0.2))[:, None])


def autocorrelation(fields: Floats, places: Floats, spacing: float) -> SpatialCorrelation:
    """Mean correlation of errors at about 0, 1 ... 12 spacings of distance; 1 at the first.

    fields : (fields, points) mm, zeros where lost. places : (points, 2) mm. spacing : mm.
    """
    if len(fields) < 2 or not np.abs(fields).max() > 0.0:
        return SpatialCorrelation(np.eye(1, LAGS)[0], np.asarray(spacing * np.arange(LAGS), dtype=float))
    chosen = np.arange(len(places))
    if chosen.size > 800:  # the middle ones, so that neighbours stay neighbours
        chosen = np.argsort(np.hypot(*(places - np.median(places, axis=0)).T))[:800]
    E = fields[:, chosen]
    distance = np.hypot(*(places[chosen, None] - places[None, chosen]).T)
    bins = np.round(distance / spacing).astype(int)
    seen = (E != 0.0).astype(float)
    near = bins < LAGS
    pairs = (seen.T @ seen)[near]
    count = np.maximum(np.bincount(bins[near], pairs, LAGS), 1.0)
    rho = np.bincount(bins[near], (E.T @ E)[near], LAGS) / count
    apart = np.bincount(bins[near], distance[near] * pairs, LAGS) / count  # neighbours across a cell are farther
    apart = np.where(apart > 0.0, apart, spacing * np.arange(LAGS))
    return SpatialCorrelation(rho / (rho[0] if rho[0] > 0.0 else 1.0), apart)


def time_correlation(errors: Floats) -> tuple[float, float]:
    """Correlation of successive errors (frames,), and how many frames share one: 1 + 2 sum of rho to its first zero."""
    e = errors - errors.mean()
    power = float(e @ e)
    if e.size < 4 or not power > 0.0:
        return 0.0, 1.0
    integral, first = 1.0, 0.0
    for lag in range(1, e.size // 3 + 1):
        rho = float(e[:-lag] @ e[lag:]) / power
        if lag == 1:
            first = rho
        if rho <= 2.0 / np.sqrt(e.size):  # no more than chance
            break
        integral += 2.0 * rho
    return first, integral


def patch_numbers(places: Floats, side: float) -> Ints:
    """(points,) which square patch each point lies in; the middle of one is the centre.

    places : (points, 2) mm. side : mm, of a patch.
    """
    cells = np.floor(places / side + 0.5).astype(int)
    cells -= cells.min(axis=0)
    return np.unique(cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1], return_inverse=True)[1]


def rigid_gains(places: Floats) -> Floats:
    """(3, points) of shift along z and rotations about x and y, by least squares of heights at places (points, 2)."""
    terms = np.stack([np.ones(len(places)), places[:, 1], -places[:, 0]])
    return np.asarray(np.linalg.pinv(terms.T))


def _block_covariance(
    seen: SurfaceObservation,
    fields: ErrorFields,
    patch: float,
    rho: SpatialCorrelation,
    reference: int,
    of_plate: Floats,
) -> Floats:
    """(frames, outputs, outputs): squares of what each patch contributes, of points and of the clamped plate."""
    gains = seen.gains
    used = np.abs(gains).max(axis=(0, 1)) > 0.0
    numbers = patch_numbers(fields.places[used], patch)
    total = patch_covariance(gains[:, :, used], fields.loaded[:, used], numbers)
    places, errors = fields.places[used], fields.loaded[:, used]
    kept = rho.kept_by_residuals(gains[reference][:, used], places, numbers, seen.terms[used], seen.fitted[:, used])
    by_patches = total / np.sqrt(np.maximum(kept.within[:, None] * kept.within, 1e-300))
    squares = gains[reference][:, used] ** 2
    variance = (squares @ (errors**2).mean(axis=0)) / np.maximum(squares @ kept.variance, 1e-300)
    by_correlation = np.matmul(np.matmul(gains[:, :, used], rho.matrix(places)), gains[:, :, used].transpose(0, 2, 1))
    shares = np.sqrt(kept.within), np.sqrt(1.0 - kept.within)
    scale = np.sqrt(variance) * shares[1]
    total = by_patches * shares[0][:, None] * shares[0] + by_correlation * scale[:, None] * scale
    plane = np.stack([np.ones(len(fields.places)), fields.places[:, 1], -fields.places[:, 0]])
    tilts = np.matmul(gains, plane.T)
    return np.asarray(total + np.matmul(np.matmul(tilts, of_plate), tilts.transpose(0, 2, 1)))


def clamped_covariance(errors: Floats, places: Floats, patch: float, rho: SpatialCorrelation) -> Floats:
    """(3, 3) of the shift along z, mm, and the rotations about x and y, rad, of one frame, by patches.

    errors : (fields, points) mm of the clamped plate, at places (points, 2) mm.
    """
    gains, numbers = rigid_gains(places), patch_numbers(places, patch)
    within = rho.kept_by_residuals(gains, places, numbers, np.asarray(np.linalg.pinv(gains), dtype=float), gains).within
    return np.asarray(patch_covariance(gains[None], errors, numbers)[0] / np.sqrt(within[:, None] * within))


@dataclass(frozen=True, eq=False)
class SpatialCorrelation:
    """Autocorrelation of errors in space: values (lags,) at distances (lags,) mm."""

    values: Floats
    distances: Floats

    @property
    def length(self) -> float:
        """The distance, mm, at which it has fallen to LEAST_CORRELATION; the last distance at most."""
        rho, below = self.values, np.flatnonzero(self.values < LEAST_CORRELATION)
        if not below.size:
            return float(self.distances[-1])
        k = int(below[0])
        share = (rho[k - 1] - LEAST_CORRELATION) / max(rho[k - 1] - rho[k], 1e-12)
        return float(self.distances[k - 1] + share * (self.distances[k] - self.distances[k - 1]))

    def matrix(self, places: Floats) -> Floats:
        """(points, points) of places (points, 2) mm; nothing from the first distance without correlation on."""
        below = np.flatnonzero(self.values < 0.02)
        values = np.array(self.values)
        if below.size:
            values[below[0] :] = 0.0
        distance = np.hypot(*(places[:, None] - places[None, :]).T)
        return np.asarray(np.interp(distance, self.distances, values, right=0.0))

    def kept_by_residuals(
        self, gains: Floats, places: Floats, numbers: Ints, terms: Floats, fitted: Floats
    ) -> KeptByResiduals:
        """What patches of residuals show of errors with this correlation.

        The fit has taken a part of the errors from the residuals, and neighbours across the edges of patches err
        together; both are worked out exactly for a linear fit.

        gains : (outputs, points). places : (points, 2) mm. numbers : (points,) of patches. terms, fitted : (points,
        terms), (terms, points), residuals are errors less terms @ fitted @ errors.
        """
        C = self.matrix(places)
        whole = np.einsum("oi,oi->o", gains @ C, gains)
        taken = fitted @ C
        residual = C - terms @ taken - (terms @ taken).T + terms @ (taken @ fitted.T) @ terms.T
        within = np.einsum("oi,oi->o", gains @ np.where(numbers[:, None] == numbers, residual, 0.0), gains)
        return KeptByResiduals(np.clip(within / np.maximum(whole, 1e-300), 0.02, 1.0), np.diag(residual))


class KeptByResiduals(NamedTuple):
    """What residuals show of errors: within (outputs,) of the variance of an output, variance (points,) of a point."""

    within: Floats
    variance: Floats


def patch_covariance(gains: Floats, errors: Floats, numbers: Ints) -> Floats:
    """Mean over fields of the sum over patches of squared contributions, (frames, outputs, outputs).

    gains : (frames, outputs, points). errors : (fields, points) mm. numbers : (points,) of patches.
    """
    total = np.zeros((len(gains), gains.shape[1], gains.shape[1]))
    for patch in range(int(numbers.max()) + 1):
        some = numbers == patch
        part = np.matmul(gains[:, :, some], errors[:, some].T)
        total += np.matmul(part, part.transpose(0, 2, 1))
    return total / max(len(errors), 1)


def _rest_covariance(gains: Floats, rest: Floats) -> Floats:
    errors = gains @ rest.T
    return np.asarray(np.matmul(errors, errors.transpose(0, 2, 1)) / len(rest))


def _growth(fields: ErrorFields, frames: int) -> Floats:
    """(frames,) how much more residuals scatter in time than at rest, over a running median of eleven frames."""
    base = _point_sd(fields.rest)
    if not base > 0.0 or len(fields.loaded) < 11:
        return np.ones(frames)
    each = np.array([_point_sd(row[None]) for row in fields.loaded]) / base
    padded = np.pad(each, 5, mode="edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, 11), axis=1)
    growth = np.interp(np.arange(frames), fields.loaded_frames, smooth)
    growth[: fields.loaded_frames[0]] = 1.0
    return np.maximum(growth, 1.0)


def _point_sd(fields: Floats) -> float:
    seen = fields[fields != 0.0]
    return float(np.sqrt((seen**2).mean())) if seen.size else 0.0


def _correlations(names: Sequence[str], covariance: Floats) -> dict[tuple[str, str], float]:
    """Medians over the frames, shrunk a little where they would not be those of any covariance."""
    sd = np.sqrt(np.maximum(np.einsum("fii->fi", covariance), 1e-300))
    matrix = np.median(covariance / (sd[:, :, None] * sd[:, None, :]), axis=0)
    matrix = 0.5 * (matrix + matrix.T)
    np.fill_diagonal(matrix, 1.0)
    while np.linalg.eigvalsh(matrix)[0] < 1e-3:
        matrix = 0.98 * matrix + 0.02 * np.eye(len(matrix))
    return {(names[i], names[j]): float(matrix[i, j]) for i in range(len(names)) for j in range(i + 1, len(names))}
