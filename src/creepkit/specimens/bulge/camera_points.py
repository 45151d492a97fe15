"""What a bulge test makes of points that cameras measured: the centre, D, S, p of Eq. (7), or means on rings.

The window is a disc of the undeformed radius, points weigh by their area, so that the outputs are those that
`Observation("field", window)` gives of a simulated top, and a fitted model is averaged over subsets as the camera
averages the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError, SolveError
from creepkit.records import SurfaceObservation, SurfacePoints
from creepkit.specimens.bulge.field_fit import (
    LOOSE,
    SHAPES,
    FrameFits,
    fit_frames,
    joint_center,
    model,
    smoothing_columns,
    without_smoothing,
)
from creepkit.specimens.bulge.observation import Observation

CENTER_FRAMES = 40
"""Frames, those of the greatest signal, that the centre is taken from; more leave it within a few um."""


LEAST_SIGNAL = 8.0
"""Ratio of D to its standard error (of independent points) below which a frame shows no width or shape of its own."""


FEWEST_WINDOW_POINTS = 30
"""Points within the window below which a frame is not fitted."""


RING_BAND, APEX_BAND = 1.3, 2.0
"""mm on both sides of a ring, and about the apex, within which points say what the mean displacement there is.

At least 2.2 and 3.5 spacings of the points. Their polynomials miss less than 0.1 % of the apex displacement of a
dimple of 7.5 mm (docs/measured/camera_extraction.md).
"""


UNSMOOTHED_FOURTH = 0.75 * (1.0 / 576.0 - 1.0 / 1920.0) + 1.0 / (8.0 * 576.0)
"""Of h^4 and the second Laplacian in the mean on a circle of what was smoothed over squares of side h.

The mean over such a square is 1 + (h^2 / 24) (a + b) + (h^4 / 1920) (a^2 + b^2) + (h^4 / 576) a b of a and b, the
second derivatives along x and y. Its inverse is 1 - (h^2 / 24) (a + b) + h^4 ((1 / 576 - 1 / 1920) (a^2 + b^2) + a b
/ 576); on a circle the mean of a^2 + b^2 is 3/4 of the second Laplacian, that of a b one eighth.
"""


BALANCED_TERMS = {0: 10, 1: 2, 2: 2, 4: 6, 8: 3}
"""Even powers of the radius by multiples of the angle, that weights integrate over the disc.

Eq. (7) goes with 4 and 8 times the angle where p is not 2, the others are those of a centre a little off.
"""


MISS_FRAMES = 25
"""Neighbours in time that say together what Eq. (7) misses, as a share of D."""


RIDGE = 1e-4
"""Of the mean diagonal of the equations of these weights, added to it."""


WEIGHT_CHANGE = (0.2, 4.0)
"""Least and greatest factor on a weight for that."""


_START = (np.log(0.5), np.log(2.1))
"""ln of S over the window, and ln p, where fits of the first frame begin."""


def surface_center(points: SurfacePoints, window: float) -> tuple[Floats, Floats]:
    """The one centre of all frames, (2,) mm, and its covariance, (2, 2) mm2, if points err independently.

    window : mm. The frames of the greatest mean height within it are used; the window follows the centre.
    """
    center = np.zeros(2)
    mean = _mean_within(points.places, points.heights, 0.5 * window)
    frames = np.argsort(np.where(np.isfinite(mean), np.abs(mean), -1.0))[-CENTER_FRAMES:]
    heights = points.heights[frames]
    matrix, variance = np.eye(2), np.inf
    for _ in range(6):
        distance = np.hypot(*(points.places - center).T)
        inside = distance <= window + np.sqrt(points.areas)
        weights, seen = _weights(distance[inside], points.areas[inside], heights[:, inside], window)
        if np.count_nonzero(weights.sum(axis=0)) < FEWEST_WINDOW_POINTS:
            raise FitError(
                f"only {np.count_nonzero(inside)} points lie within {window:g} mm of ({center[0]:g}, {center[1]:g}) mm"
            )
        start = _shared_start(points.places[inside] - center, seen, weights, points.subset, window)
        moved, fits, matrix = joint_center(points.places[inside], seen, weights, center, start, points.subset, LOOSE)
        variance = 2.0 * fits.cost.sum() / max(np.count_nonzero(weights) - 3 * len(frames) - 2, 1)
        step, center = float(np.hypot(*(moved - center))), moved
        if not np.hypot(*center) < 2.0 * window:
            raise FitError("the points show no centre of a bulge; give it")
        if step < 1e-3:  # mm: the window has moved by nothing
            break
    covariance = variance * np.linalg.pinv(matrix, hermitian=True)
    return np.asarray(center), np.asarray(covariance)


def observe_surface(points: SurfacePoints, operator: str) -> SurfaceObservation:
    """Outputs of each frame by the operator's text: "field 0-7.5 mm" or "rings 0, 2, 4 mm"."""
    observation = Observation.from_text(operator)
    if observation.form == "rings":
        return _observe_rings(points, observation.radii, str(observation))
    if observation.form != "field":
        raise SolveError(
            f"observation: points of cameras are not observed as '{operator}', which is of profiles; "
            "write 'field 0-7.5 mm' or 'rings 0, 2, 4 mm'"
        )
    return _observe_field(points, observation.window, str(observation))


def _observe_field(points: SurfacePoints, window: float, operator: str) -> SurfaceObservation:
    distance = np.hypot(*points.places.T)
    inside = distance <= window + np.sqrt(points.areas)
    places = points.places[inside]
    weights, heights = _weights(distance[inside], points.areas[inside], points.heights[:, inside], window)
    enough = np.count_nonzero(weights, axis=1) >= max(FEWEST_WINDOW_POINTS, 0.5 * np.count_nonzero(weights.any(axis=0)))
    balance = _Balance.of(places, window, points.areas[inside].mean())
    weights = balance.weights(weights)
    start = _shared_start(places, heights, weights, points.subset, window)
    fits, values = _fitted(places, heights, weights, start, points.subset)
    weights = balance.weights(weights, *balance.missed(places, heights, weights, values, points.subset, enough))
    fits, values = _fitted(places, heights, weights, values, points.subset)
    left, columns, surface = smoothing_columns(places, values, points.subset)
    residuals = np.where(weights > 0.0, heights - surface, np.nan)
    gains = _gains(columns, weights, left)
    greatest = _greatest(np.where(enough, values[:, 0], np.nan))
    model_terms = columns[greatest].T, np.array(gains[greatest])
    errors = np.sqrt(np.maximum((gains**2).sum(axis=2), 0.0)) * _residual_size(residuals)[:, None]
    widths, shapes = np.exp(values[:, 1]), np.exp(values[:, 2])
    determined = (
        fits.converged & enough & (np.abs(values[:, 0]) > LEAST_SIGNAL * errors[:, 0]) & (errors[:, 1] < 0.2)
        & (shapes > SHAPES[0]) & (shapes < SHAPES[1]) & (widths < 4.0 * window)
    )  # fmt: skip
    gains[:, 1] *= widths[:, None]
    gains[:, 2] *= shapes[:, None]
    _lend_shapes(values, determined)
    if not determined.all():  # the amplitude of a lent shape: a linear fit
        k = np.flatnonzero(~determined)
        bell = model(places, np.concatenate([np.ones((k.size, 1)), values[k, 1:]], axis=1), points.subset)[0]
        gains[k] = 0.0
        gains[k, 0] = weights[k] * bell / np.maximum((weights[k] * bell**2).sum(axis=1, keepdims=True), 1e-300)
        values[k, 0] = (gains[k, 0] * heights[k]).sum(axis=1)
        residuals[k] = np.where(weights[k] > 0.0, heights[k] - values[k, :1] * bell, np.nan)
    hidden = np.where(determined, 0.0, np.nan)
    outputs = {
        "amplitude": np.where(enough, values[:, 0], np.nan),
        "width": np.exp(values[:, 1]) + hidden,
        "shape": np.exp(values[:, 2]) + hidden,
    }
    terms = _spread(model_terms[0].T, inside).T, _spread(model_terms[1], inside)
    return SurfaceObservation(
        operator, outputs, _spread(gains, inside), _spread(residuals, inside, np.nan), enough, *terms
    )


def _observe_rings(points: SurfacePoints, radii: tuple[float, ...], operator: str) -> SurfaceObservation:
    """Mean displacement on circles, from local polynomials about each; see `_ring_terms`."""
    frames, count = points.heights.shape
    gains, residuals = np.zeros((frames, len(radii), count)), np.full((frames, count), np.nan)
    enough = np.ones(frames, bool)
    spacing = float(np.sqrt(np.median(points.areas)))
    distance = np.hypot(*points.places.T)
    nearest = np.argmin(np.abs(distance - np.array(radii)[:, None]), axis=0)
    local = []
    for k, radius in enumerate(radii):
        band, terms, wanted = _ring_terms(points.places, radius, spacing, points.subset)
        seen = np.isfinite(points.heights[:, band])
        weights, heights = seen * points.areas[band], np.where(seen, points.heights[:, band], 0.0)
        enough &= seen.sum(axis=1) >= max(2 * len(terms), 0.5 * np.count_nonzero(seen.any(axis=0)))
        fits = _gains(np.broadcast_to(terms, (frames, *terms.shape)), weights)
        gains[:, k, band] = np.einsum("t,ftn->fn", wanted, fits)
        own = nearest[band] == k  # a point between two rings has the residual of the nearer one
        left = np.where(seen, heights - np.einsum("ftn,fn->ft", fits, heights) @ terms, np.nan)
        residuals[:, np.flatnonzero(band)[own]] = left[:, own]
        local.append((_spread(terms * own, band), band, fits))
    filled = np.nan_to_num(points.heights)
    outputs = {
        f"displacement_{k + 1}": np.where(enough, np.einsum("fn,fn->f", gains[:, k], filled), np.nan)
        for k in range(len(radii))
    }
    greatest = _greatest(outputs["displacement_1"])
    terms = np.concatenate([part for part, _, _ in local]).T
    fitted = np.concatenate([_spread(fits[greatest], band) for _, band, fits in local])
    return SurfaceObservation(operator, outputs, gains, residuals, enough, terms, fitted)


def _ring_terms(places: Floats, radius: float, spacing: float, subset: float) -> tuple[Bools, Floats, Floats]:
    """Points (points,) that speak of a ring, terms (terms, these points), and their means there, unsmoothed (terms,).

    About the apex, and on rings that are nearly there: a quadratic in x and y, and r^4. About others: a quartic in
    r - radius, and parts that go with cos and sin of the angle and of twice the angle, so that an error of the centre
    or a tilt does not enter the mean where points are missing.
    """
    x, y = places.T
    r = np.hypot(x, y)
    width = max(RING_BAND, 2.2 * spacing)
    if radius < width:
        band = r <= max(APEX_BAND, 3.5 * spacing, radius + 0.5 * width)
        x, y, r = x[band], y[band], r[band]
        terms = np.stack([np.ones_like(r), r**2, r**4, x, y, x**2 - y**2, x * y])
        mean, laplacian, bilaplacian = [1.0, radius**2, radius**4], [0.0, 4.0, 16.0 * radius**2], [0.0, 0.0, 64.0]
    else:
        band = np.abs(r - radius) <= width
        x, y, r = x[band], y[band], r[band]
        c, s, off = x / r, y / r, r - radius
        terms = np.stack([np.ones_like(r), off, off**2, off**3, off**4, c, s, c * c - s * s, 2.0 * c * s])
        mean, laplacian = [1.0], [0.0, 1.0 / radius, 2.0]
        bilaplacian = [0.0, radius**-3, -2.0 * radius**-2, 12.0 / radius, 24.0]
    orders = [np.array([*values, *np.zeros(len(terms) - len(values))]) for values in (mean, laplacian, bilaplacian)]
    return band, terms, np.array([1.0, -(subset**2) / 24.0, UNSMOOTHED_FOURTH * subset**4]) @ np.array(orders)


def _weights(distance: Floats, areas: Floats, heights: Floats, window: float) -> tuple[Floats, Floats]:
    """Area within the window that each seen point stands for, over its mean, and heights with zeros where lost.

    distance, areas : (points,) mm, mm2. heights : (frames, points) mm. A cell on the edge counts by its share inside.
    """
    share = np.clip((window - distance) / np.sqrt(areas) + 0.5, 0.0, 1.0) * areas / areas.mean()
    seen = np.isfinite(heights)
    return seen * share, np.where(seen, heights, 0.0)


@dataclass(frozen=True)
class _Balance:
    """Smooth functions over the disc, whose sums over the points that a frame shows are made their integrals.

    What Eq. (7) misses of a surface is balanced over the whole disc, on which a simulation is observed, and would not
    be where subsets are lost. Weights of the seen points are changed, as little as can be, so that it is: calibration
    of the weights of a sample (Deville and Saerndal, 1992). No height is put in the place of a lost one.

    terms : (terms, points). wanted : (terms,) their integrals over the area of a point. nodes, shares : (nodes, 2) mm,
    (nodes,) of a quadrature over an eighth of the disc, all of its area. node_terms : (terms, nodes).
    """

    terms: Floats
    wanted: Floats
    nodes: Floats
    shares: Floats
    node_terms: Floats

    @classmethod
    def of(cls, places: Floats, window: float, cell: float) -> _Balance:
        """For points at places (points, 2) mm, cell mm2 each on average, in a disc of the radius window, mm."""
        (u, along), (v, around) = np.polynomial.legendre.leggauss(20), np.polynomial.legendre.leggauss(10)
        r, angle = (grid.ravel() for grid in np.meshgrid(window * np.sqrt(0.5 * (u + 1.0)), np.pi / 8.0 * (v + 1.0)))
        nodes = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
        shares = np.pi * window**2 / cell * np.outer(around, along).ravel() / 4.0
        terms = _smooth_terms(places / window)
        wanted = np.zeros(len(terms))
        wanted[0] = shares.sum()  # the others have no mean over the disc
        return cls(terms, wanted, nodes, shares, _smooth_terms(nodes / window))

    def weights(self, weights: Floats, more: Floats | None = None, wanted: Floats | None = None) -> Floats:
        """Weights (frames, points) for these terms, and more (frames, terms, points) with integrals (frames, terms)."""
        result = np.array(weights)
        for k in np.flatnonzero(weights.any(axis=1)):
            row = weights[k]
            terms = self.terms if more is None else np.concatenate([self.terms, more[k]])
            goal = self.wanted if wanted is None else np.concatenate([self.wanted, wanted[k]])
            normal = (terms * row) @ terms.T
            normal += (
                RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
            )  # terms may nearly be one another's sum
            result[k] = row * np.clip(1.0 + np.linalg.solve(normal, goal - terms @ row) @ terms, *WEIGHT_CHANGE)
        return result

    def missed(
        self, places: Floats, heights: Floats, weights: Floats, values: Floats, subset: float, enough: Bools
    ) -> tuple[Floats, Floats]:
        """What the fits miss, in these terms, times its weights, (frames, 3, points), and integrals (frames, 3).

        enough : (frames,) which have points enough for it; those without a bulge above the noise have no part in it.
        """
        left, _, surface = smoothing_columns(places, values, subset)
        normal = np.matmul(self.terms * weights[:, None, :], self.terms.T)
        residuals = np.where(weights > 0.0, heights - surface, 0.0)
        missed = np.matmul(residuals * weights, self.terms.T)
        factors = np.einsum("fij,fj->fi", np.linalg.pinv(normal, rcond=1e-6, hermitian=True), missed)
        size = np.sqrt((residuals**2).sum(axis=1) / np.maximum(np.count_nonzero(weights, axis=1), 1))
        shown = enough & (np.abs(values[:, 0]) > 3.0 * size)
        trust = np.where(shown, np.maximum(size, 1e-9) ** -2.0, 0.0)
        factors = _shared_by_neighbours(factors, values[:, :1], trust[:, None])
        products = left * (factors @ self.terms)[:, None, :]
        size = np.maximum(np.abs(products).max(axis=2), 1e-300)
        over_disc = smoothing_columns(self.nodes, values, subset)[0] * (factors @ self._even_node_terms)[:, None, :]
        return products / size[:, :, None], over_disc @ self.shares / size

    @property
    def _even_node_terms(self) -> Floats:
        """The terms on the quadrature's nodes, but those that change sign over the disc: they have no sum."""
        even = np.concatenate([[k % 4 == 0] * (2 * count) for k, count in BALANCED_TERMS.items()])
        return np.asarray(self.node_terms * even[:, None])


def _shared_by_neighbours(factors: Floats, amplitudes: Floats, trust: Floats) -> Floats:
    """Factors (frames, terms) proportional to amplitudes (frames, 1) among MISS_FRAMES neighbours, by least squares.

    trust : (frames, 1), weights. The noise of a frame must not change its own weights of points.
    """
    ends = np.clip(np.arange(len(factors))[:, None] + MISS_FRAMES * np.array([-0.5, 0.5]) + 0.5, 0, len(factors))
    first, last = ends.astype(int).T
    parts = trust * amplitudes * factors, trust * amplitudes**2
    sums = [np.concatenate([np.zeros((1, part.shape[1])), np.cumsum(part, axis=0)]) for part in parts]
    top, bottom = (total[last] - total[first] for total in sums)
    return np.asarray(np.where(trust > 0.0, amplitudes, 0.0) * top / np.maximum(bottom, 1e-300))


def _smooth_terms(places: Floats) -> Floats:
    """(terms, points) at places (points, 2) in radii of the disc; the first is 1."""
    x, y = places.T
    turned = (x + 1j * y) ** np.arange(9)[:, None]
    radial = np.polynomial.legendre.legvander(2.0 * (x**2 + y**2) - 1.0, max(BALANCED_TERMS.values()) - 1).T
    parts = [part * radial[:count] for k, count in BALANCED_TERMS.items() for part in (turned[k].real, turned[k].imag)]
    return np.concatenate(parts)


def _fitted(places: Floats, heights: Floats, weights: Floats, start: Floats, subset: float) -> tuple[FrameFits, Floats]:
    """The fit of each frame, and D, ln S, ln p (frames, 3) without the smoothing of subsets."""
    fits = fit_frames(places, heights, weights, start, subset, LOOSE)
    if subset == 0.0:
        return fits, np.array(fits.values)
    return fits, without_smoothing(places, heights, weights, fits.values, subset)


def _shared_start(places: Floats, heights: Floats, weights: Floats, subset: float, window: float) -> Floats:
    """(frames, 3) where fits begin: with the width and shape of the frame of the greatest signal."""
    signal = np.abs((weights * heights).sum(axis=1)) / np.maximum(weights.sum(axis=1), 1e-300)
    best = int(np.argmax(signal))
    start = np.array([[0.0, np.log(window) + _START[0], _START[1]]])
    first = fit_frames(places, heights[best : best + 1], weights[best : best + 1], start, subset, LOOSE)
    return np.broadcast_to(first.values, (len(heights), 3))


def _gains(columns: Floats, weights: Floats, left: Floats | None = None) -> Floats:
    """(frames, unknowns, points): (L^T W J)^-1 L^T W with J^T = columns, and L = J of least squares by default."""
    heavy = (columns if left is None else left) * weights[:, None, :]
    normal = np.matmul(heavy, columns.transpose(0, 2, 1))
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("fii->fi", normal), 1e-300))
    inverse = np.linalg.pinv(normal * scale[:, :, None] * scale[:, None, :])
    return np.asarray(np.matmul(inverse * scale[:, :, None] * scale[:, None, :], heavy))


def _residual_size(residuals: Floats) -> Floats:
    """(frames,) root mean square, mm."""
    count = np.maximum(np.isfinite(residuals).sum(axis=1), 1)
    return np.asarray(np.sqrt(np.nansum(residuals**2, axis=1) / count))


def _greatest(signal: Floats) -> int:
    """The frame of the greatest signal (frames,), NaN where there is none."""
    return int(np.argmax(np.where(np.isfinite(signal), np.abs(signal), -1.0)))


def _lend_shapes(values: Floats, determined: Bools) -> None:
    """Give frames without width and shape of their own those of the next frame that has, else of the last."""
    known = np.flatnonzero(determined)
    if known.size:
        lender = known[np.minimum(np.searchsorted(known, np.arange(len(values))), known.size - 1)]
        values[:, 1:] = values[lender, 1:]


def _mean_within(places: Floats, heights: Floats, radius: float) -> Floats:
    """(frames,) mean height of the points seen within a radius, mm; NaN of none."""
    inside = np.hypot(*places.T) <= radius
    seen = np.isfinite(heights[:, inside])
    total = np.where(seen, heights[:, inside], 0.0).sum(axis=1)
    return np.where(seen.any(axis=1), total / np.maximum(seen.sum(axis=1), 1), np.nan)


def _spread(values: Floats, inside: Bools, elsewhere: float = 0.0) -> Floats:
    """(..., points) of values (..., points inside)."""
    result = np.full((*values.shape[:-1], inside.size), elsewhere)
    result[..., inside] = values
    return result
