"""The flat plate that frames show: its axes, the rigid motion of each frame, the areas of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError

_TUKEY = 6.0
"""Robust standard deviations at which a point's weight has fallen to zero."""


_ROUNDS = 12
"""Most rounds of reweighting."""


_RESIDUAL_FLOOR = 1e-9
"""mm; residuals below it are equal."""


@dataclass(frozen=True, eq=False)
class PlateAxes:
    """Axes of the undeformed plate: z normal to it and towards the cameras, x the cameras' x within it.

    origin : (3,) mm, of the frames' own axes. axes : (3, 3), rows are the unit vectors.
    """

    origin: Floats
    axes: Floats

    def places(self, points: Floats) -> Floats:
        """(points, 3) mm in the plate's axes of points (points, 3) mm of the frames."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def camera_places(self, places: Floats) -> Floats:
        """(points, 3) mm in the axes of the frames of places (points, 2) mm of the plate."""
        return np.asarray(self.origin + places @ self.axes[:2])

    def place_of(self, x: float, y: float) -> Floats:
        """(2,) mm in the plate of its point at x, y mm of the frames."""
        normal = self.axes[2]
        z = self.origin[2] - (normal[0] * (x - self.origin[0]) + normal[1] * (y - self.origin[1])) / normal[2]
        return np.asarray(self.places(np.array([[x, y, z]]))[0, :2])


class RigidMotions(NamedTuple):
    """What takes the plate of each frame back to where it was.

    rotations : (frames, 3, 3). shifts : (frames, 3) mm: X = R x + t. weights : (frames, points) of the robust fit.
    residual_sd : (frames, 3) mm, robust, of what it leaves.
    """

    rotations: Floats
    shifts: Floats
    weights: Floats
    residual_sd: Floats

    def taken_off(self, places: Floats, displacements: Floats) -> Floats:
        """Displacements without the rigid motion, (frames, points, 3) mm.

        places : (points, 3) mm. displacements : (frames, points, 3) mm.
        """
        moved = places + displacements
        return np.asarray(np.matmul(moved, self.rotations.transpose(0, 2, 1)) + self.shifts[:, None, :] - places)

    def rotation_vectors(self) -> Floats:
        """(frames, 3) rad, of the plate since the reference, exact for small and large angles."""
        from scipy.spatial.transform import Rotation

        turned = self.rotations.transpose(0, 2, 1)  # of the plate, not of what takes it back
        return np.asarray(Rotation.from_matrix(turned).as_rotvec())

    def translations(self) -> Floats:
        """(frames, 3) mm of the plate at the origin of the places."""
        return np.asarray(-np.einsum("fji,fj->fi", self.rotations, self.shifts))


def plate_axes(points: Floats) -> PlateAxes:
    """The plane through points (points, 3) mm, robust: points off it, such as a fixture's, do not count."""
    if len(points) < 10:
        raise HistoryError(f"only {len(points)} valid points of the undeformed plate; extraction needs at least 10")
    middle = np.median(points, axis=0)
    X = points - middle
    terms = np.stack([np.ones(len(X)), X[:, 0], X[:, 1]], axis=1)
    weights, values = np.ones(len(X)), np.zeros(3)
    for k in range(30):
        weighted = terms * weights[:, None]
        values = np.asarray(np.linalg.lstsq(weighted.T @ terms, weighted.T @ X[:, 2], rcond=None)[0], dtype=float)
        residual = X[:, 2] - terms @ values
        weights = _robust_weights(residual / _spread(residual), first=k < 5)
    normal = np.array([-values[1], -values[2], 1.0])
    normal /= np.linalg.norm(normal)
    across = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    across /= np.linalg.norm(across)
    return PlateAxes(middle + np.array([0.0, 0.0, values[0]]), np.stack([across, np.cross(normal, across), normal]))


def rigid_motions(places: Floats, displacements: Floats, valid: Bools) -> RigidMotions:
    """Rotation and translation of every frame from points of the clamped plate, by Kabsch's method, reweighted.

    places : (points, 3) mm. displacements : (frames, points, 3) mm. valid : (frames, points); at least 3 a frame.

    A point counts by Tukey's biweight of its distance from the rigid motion, in robust standard deviations of each
    coordinate; the first rounds weigh by the inverse distance, so that the start need not be near. Nothing is random.
    """
    moved = np.where(valid[..., None], places + displacements, 0.0)
    weights = valid.astype(float)
    rotations, shifts, residuals = _kabsch(places, moved, weights)
    sd = _robust_sd(residuals, valid)
    for k in range(_ROUNDS):
        square = sum((residuals[:, :, axis] / sd[:, axis, None]) ** 2 for axis in range(3))
        new = valid * _robust_weights(np.sqrt(square / 3.0), first=k < 3)
        change = np.abs(new - weights).max()
        weights = new
        rotations, shifts, residuals = _kabsch(places, moved, weights)
        if k < 5:
            sd = _robust_sd(residuals, valid)
        elif change < 1e-2:
            break
    return RigidMotions(rotations, shifts, weights, sd)


def _kabsch(places: Floats, moved: Floats, weights: Floats) -> tuple[Floats, Floats, Floats]:
    """R, t of X = R x + t by weighted least squares, and residuals (frames, points, 3)."""
    total = np.maximum(weights.sum(axis=1), 1e-300)[:, None]
    target_middle, source_middle = weights @ places / total, np.einsum("fn,fnk->fk", weights, moved) / total
    centred = moved - source_middle[:, None, :]
    product = np.matmul((weights[..., None] * centred).transpose(0, 2, 1), places[None] - target_middle[:, None, :])
    u, _, vt = np.linalg.svd(product)
    vt[:, 2] *= np.sign(np.linalg.det(np.matmul(u, vt)))[:, None]
    rotations = np.matmul(u, vt).transpose(0, 2, 1)
    shifts = target_middle - np.einsum("fij,fj->fi", rotations, source_middle)
    residuals = np.matmul(moved, rotations.transpose(0, 2, 1)) + shifts[:, None, :] - places
    return rotations, shifts, residuals


def _robust_sd(residuals: Floats, valid: Bools) -> Floats:
    """(frames, 3) from medians over the valid points of residuals (frames, points, 3), some 300 of them."""
    some = slice(None, None, max(1, valid.shape[1] // 300))
    residuals, valid = residuals[:, some], valid[:, some]
    size = np.where(valid[..., None], np.abs(residuals), np.inf)
    rows = [
        np.median(row[:, seen], axis=1) for row, seen in zip(size.transpose(0, 2, 1), valid, strict=True) if seen.any()
    ]
    result = np.full((len(size), 3), _RESIDUAL_FLOOR)
    result[valid.any(axis=1)] = 1.4826 * np.array(rows).reshape(-1, 3)
    return np.asarray(np.maximum(result, _RESIDUAL_FLOOR))


def _robust_weights(distance: Floats, first: bool) -> Floats:
    """Weights of distances in robust standard deviations."""
    size = np.abs(distance)
    return 1.0 / np.maximum(size, 0.5) if first else np.maximum(1.0 - (size / _TUKEY) ** 2, 0.0) ** 2


def _spread(residual: Floats) -> float:
    return max(1.4826 * float(np.median(np.abs(residual))), _RESIDUAL_FLOOR)


def point_spacing(places: Floats) -> float:
    """mm, median distance between neighbours of places (points, 2 or more)."""
    from scipy.spatial import cKDTree

    nearest = cKDTree(places[:, :2]).query(places[:, :2], k=2)[0][:, 1]
    return float(np.median(nearest))


def point_areas(places: Floats, spacing: float) -> Floats:
    """(points,) mm2 that each point stands for: its Voronoi cell, at most four times the square of the spacing.

    places : (points, 2) mm of all points of the undeformed surface, lost ones too, so that a lost subset is not
    given to its neighbours. spacing : mm.
    """
    from scipy.spatial import QhullError, Voronoi

    areas = np.full(len(places), spacing**2)
    try:
        cells = Voronoi(places)
    except QhullError:
        return areas
    lengths = np.array([len(region) if region and -1 not in region else 0 for region in cells.regions])
    own = lengths[cells.point_region]
    for corners in np.unique(own[own > 2]):  # cells of as many corners, which go round, at once
        some = np.flatnonzero(own == corners)
        x, y = cells.vertices[[cells.regions[k] for k in cells.point_region[some]]].transpose(2, 0, 1)
        areas[some] = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1))
    return np.asarray(np.clip(areas, 0.1 * spacing**2, 4.0 * spacing**2))
