"""Frames as series of points: the same points in every frame, read once, one frame in memory at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import CreepkitError, HistoryError
from creepkit.extraction.plate import PlateAxes, plate_axes, point_areas, point_spacing
from creepkit.records import CameraFrame, Frames

SingleFloats: TypeAlias = NDArray[np.float32]


MATCHING_DISTANCE = 0.3
"""Of the spacing: a point of a frame belongs to the point of the reference frame that lies as near as that."""


@dataclass(frozen=True, eq=False)
class ReferencePlate:
    """The undeformed plate, from the first frame that can be read.

    index : of that frame. places : (points, 3) mm in the plate's axes. areas : (points,) mm2 that each stands for.
    known : (points,) which points that frame has. camera_points : (points, 3) mm in the frames' axes. spacing : mm.
    turned : whether the plate's z is against that of the frames, which points away from the cameras.
    """

    index: int
    axes: PlateAxes
    places: Floats
    areas: Floats
    known: Bools
    camera_points: Floats
    spacing: float
    turned: bool = False

    def turned_over(self) -> ReferencePlate:
        """The same plate seen from its other side: turned by half a turn about x."""
        half = np.array([1.0, -1.0, -1.0])
        axes = PlateAxes(self.axes.origin, self.axes.axes * half[:, None])
        return replace(self, axes=axes, places=self.places * half, turned=not self.turned)


@dataclass(frozen=True, eq=False)
class PointSeries:
    """Displacements of some points of the plate in every frame.

    points : (points,) their numbers in the reference plate. displacements : (frames, points, 3) mm, in the plate's
    axes. valid : (frames, points).
    """

    points: Ints
    displacements: SingleFloats
    valid: Bools


@dataclass(frozen=True, eq=False)
class SeriesOfFrames:
    """What was read of a sequence: a series for each group of points, and what could not be read.

    unreadable : {frame: reason}. valid_share : (frames,) of the reference's points that a frame holds.
    zero_reference : whether the first frame's displacements are zero by definition, being the reference image.
    """

    series: Sequence[PointSeries]
    unreadable: Mapping[int, str]
    valid_share: Floats
    zero_reference: bool


def reference_plate(frames: Frames) -> ReferencePlate:
    """The plate of the first frame that can be read; HistoryError where there is none among the first ten."""
    problem = ""
    for index in range(min(len(frames), 10)):
        try:
            frame = frames[index]
        except (CreepkitError, OSError) as error:
            problem = problem or str(error)
            continue
        if frame.valid.sum() < 10:
            problem = problem or f"{frame.source}: {int(frame.valid.sum())} valid points; a plate needs at least 10"
            continue
        axes = plate_axes(frame.points[frame.valid])
        places = np.where(frame.valid[:, None], axes.places(frame.points), np.inf)
        spacing = point_spacing(places[frame.valid])
        areas = np.zeros(len(places))
        areas[frame.valid] = point_areas(places[frame.valid, :2], spacing)
        return ReferencePlate(index, axes, places, areas, np.array(frame.valid), np.array(frame.points), spacing)
    raise HistoryError(f"frames '{frames.name}': none of the first ten frames shows a plate ({problem})")


def aligned_frame(frame: CameraFrame, plate: ReferencePlate) -> tuple[Floats, Bools]:
    """Displacements (points, 3) mm in the frames' axes, and validity (points,), in the order of the reference plate.

    Points are found by their undeformed place where the frame has others or another order.
    """
    seen = frame.valid
    if frame.points.shape == plate.camera_points.shape:
        both = seen & plate.known
        apart = np.abs(frame.points[both] - plate.camera_points[both])
        if not apart.size or float(apart.max()) < MATCHING_DISTANCE * plate.spacing:
            return frame.displacements, both
    from scipy.spatial import cKDTree

    own = np.flatnonzero(plate.known)
    distance, nearest = cKDTree(plate.camera_points[own]).query(frame.points[seen])
    order = np.flatnonzero(distance < MATCHING_DISTANCE * plate.spacing)
    moved, valid = np.zeros_like(plate.camera_points), np.zeros(len(plate.known), bool)
    moved[own[nearest[order]]] = frame.displacements[seen][order]
    valid[own[nearest[order]]] = True
    return moved, valid


def read_series(frames: Frames, plate: ReferencePlate, groups: Sequence[Ints]) -> SeriesOfFrames:
    """Read every frame once and keep the displacements of each group of points; groups : of numbers (points,).

    Kept in single precision: 6e-8 of a displacement of a mm is far below any camera's noise, and memory holds half.
    """
    count = len(frames)
    moved = [np.zeros((count, group.size, 3), np.float32) for group in groups]
    valid = [np.zeros((count, group.size), bool) for group in groups]
    unreadable: dict[int, str] = {}
    share = np.zeros(count)
    zero_reference = False
    for index in range(count):
        try:
            displacements, seen = aligned_frame(frames[index], plate)
        except (CreepkitError, OSError) as error:
            unreadable[index] = " ".join(str(error).split())
            continue
        share[index] = seen.sum() / max(int(plate.known.sum()), 1)
        if index == plate.index:
            zero_reference = bool(seen.any()) and float(np.abs(displacements[seen]).max()) < 1e-9
        for k, group in enumerate(groups):
            turned = np.where(seen[group, None], displacements[group], 0.0) @ plate.axes.axes.T
            moved[k][index], valid[k][index] = turned, seen[group]
    series = [PointSeries(g, m, v) for g, m, v in zip(groups, moved, valid, strict=True)]
    return SeriesOfFrames(series, unreadable, share, zero_reference)
