"""Where the surface has risen: domes of the displacement field, found by their height above the noise of the plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import CreepkitError, HistoryError
from creepkit.extraction.plate import plate_axes
from creepkit.extraction.series import ReferencePlate, aligned_frame
from creepkit.records import Frames, SurfaceRegion

if TYPE_CHECKING:
    from scipy.sparse import csr_array

LEAST_HEIGHT = 6.0
"""Robust standard deviations of the smoothed field of the plate above which a dome stands out."""


LEAST_COVERAGE = 0.75
"""Share of a dome's area that the points must cover; one cut by the edge of the picture is not extracted."""


Centers = Mapping[str, tuple[float, float]] | Sequence[tuple[float, float]]


class Found(NamedTuple):
    """Test pieces in the field of view.

    plate : turned over where they fall in it. centers : {name: (2,) mm in that plate}.
    """

    plate: ReferencePlate
    centers: dict[str, Floats]


def find_domes(frames: Frames, plate: ReferencePlate, region: SurfaceRegion) -> Found:
    """Domes, named D1, D2 ... row by row from the top, each from left to right.

    The frame among some late ones that shows most is searched: heights are averaged over a disc of half the radius
    that moves, and a maximum counts that stands out of the plate and lies nearer than that radius to no higher one.
    Surfaces rise towards the cameras: where more falls than rises, z points away from them.
    """
    late, discs = _late_frames(frames, plate), _discs(plate, region)
    risen, fallen = (
        max((_domes_of(plate, sign * heights, valid, region, discs) for heights, valid in late), key=_total, default=[])
        for sign in (1.0, -1.0)
    )
    if not (risen or fallen):
        raise HistoryError(
            f"frames '{frames.name}': no dome of about {region.moving:g} mm radius stands out of the noise in the late "
            "frames; give its centre"
        )
    if _total(risen) >= _total(fallen):
        return Found(plate, _named([place for _, place in risen], region.moving))
    return Found(plate.turned_over(), _named([place * [1.0, -1.0] for _, place in fallen], region.moving))


def _total(domes: Sequence[tuple[float, Floats]]) -> float:
    return sum(height for height, _ in domes)


def place_centers(frames: Frames, plate: ReferencePlate, region: SurfaceRegion, centers: Centers) -> Found:
    """Given centres, in the plate turned over where the middles about them fall in the last frame that can be read."""
    over = plate.turned_over()
    for heights, valid in _late_frames(frames, plate):
        noise = 1.4826 * float(np.median(np.abs(heights)))
        near = [
            np.hypot(*(plate.places[valid, :2] - center).T) < 0.3 * region.moving
            for center in given_centers(centers, plate).values()
        ]
        middles = [float(heights[some].mean()) for some in near if some.any()]
        if middles and max(map(abs, middles)) > LEAST_HEIGHT * noise / np.sqrt(max(min(map(np.sum, near)), 1)):
            side = over if sum(middles) < 0.0 else plate
            return Found(side, given_centers(centers, side))
    return Found(plate, given_centers(centers, plate))


def _late_frames(frames: Frames, plate: ReferencePlate) -> list[tuple[Floats, Bools]]:
    """Heights (valid points,) mm and validity (points,) of some late frames that can be read, the last first."""
    read, count = [], len(frames)
    for index in dict.fromkeys(int(k) for k in (count - 1, 0.95 * count, 0.75 * count, 0.5 * count)):
        if index <= plate.index or index < 0:
            continue
        try:
            moved, valid = aligned_frame(frames[index], plate)
        except (CreepkitError, OSError):
            continue
        if valid.sum() >= 0.5 * plate.known.sum():
            read.append((_heights(plate, moved, valid), valid))
    return read


def given_centers(centers: Centers, plate: ReferencePlate) -> dict[str, Floats]:
    """Centres {name: (2,) mm in the plate} of centres in the axes of the frames; D1, D2 ... as they are listed."""
    named = centers if isinstance(centers, Mapping) else {f"D{k + 1}": pair for k, pair in enumerate(centers)}
    result = {}
    for name, pair in named.items():
        values = np.asarray(pair, dtype=float)
        if values.shape != (2,) or not np.isfinite(values).all():
            raise HistoryError(f"centre of {name} is {pair!r}; give x and y in mm, in the axes of the frames")
        result[str(name)] = plate.axes.place_of(*values)
    if not result:
        raise HistoryError("no centres were given; leave them out to have domes found")
    return result


class _Discs(NamedTuple):
    """Places at which domes are looked for, and the points about each.

    places : (discs, 2) mm. near : sparse (discs, points) of areas, mm2.
    """

    places: Floats
    near: csr_array


def _discs(plate: ReferencePlate, region: SurfaceRegion) -> _Discs:
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    known = np.flatnonzero(plate.known)
    tree = cKDTree(plate.places[known, :2])
    places = plate.places[known[_thinned(plate.places[known, :2], 0.15 * region.moving)], :2]
    near = tree.query_ball_point(places, 0.5 * region.moving, return_sorted=False)
    ends = np.cumsum([0, *map(len, near)])
    columns = known[np.concatenate([np.asarray(some, int) for some in near])]
    return _Discs(places, csr_array((plate.areas[columns], columns, ends), shape=(len(places), len(plate.known))))


def _domes_of(
    plate: ReferencePlate, heights: Floats, valid: Bools, region: SurfaceRegion, discs: _Discs
) -> list[tuple[float, Floats]]:
    """Heights in mm and centres of domes; heights : (valid points,) mm."""
    places, field = plate.places[valid], np.zeros(len(valid))
    field[valid] = heights
    radius = 0.5 * region.moving
    area = discs.near @ valid.astype(float)
    candidates = discs.places[area > 0.0]
    sums = ((discs.near @ field)[area > 0.0]) / area[area > 0.0]
    covered = area[area > 0.0] / (np.pi * radius**2)
    # Domes only raise: what lies below the plate measures its noise even where domes fill half of the field.
    low, single = -sums[sums < 0.0], -heights[heights < 0.0]
    independent = 1.4826 * float(np.median(single)) / np.sqrt(max(np.pi * radius**2 / plate.spacing**2, 1.0))
    scale = max(1.4826 * float(np.median(low)) if low.size else 0.0, independent if single.size else 0.0, 1e-7)
    domes: list[tuple[float, Floats]] = []
    for k in np.argsort(-sums):
        place = candidates[k]
        if sums[k] < LEAST_HEIGHT * scale or (domes and sums[k] < 0.05 * domes[0][0]):
            break
        if covered[k] < LEAST_COVERAGE:
            continue
        if all(np.hypot(*(place - other)) > region.held[0] for _, other in domes) and _is_summit(
            place, sums[k], candidates, sums, region.moving
        ):
            domes.append((float(sums[k]), _center_of_mass(place, places, heights, region.moving)))
    return [dome for dome in domes if _coverage(dome[1], plate, region.moving) >= LEAST_COVERAGE]


def _heights(plate: ReferencePlate, moved: Floats, valid: Bools) -> Floats:
    """(valid points,) mm above the plane that the plate has moved to, less those at rest."""
    places = plate.places[valid]
    risen = places + moved[valid] @ plate.axes.axes.T
    # What is not flat at rest is no dome.
    return np.asarray(plate_axes(risen).places(risen)[:, 2] - plate_axes(places).places(places)[:, 2])


def _is_summit(place: Floats, height: float, candidates: Floats, heights: Floats, reach: float) -> bool:
    """Whether the surface falls off around a place: at a distance of the radius that moves it stands below half."""
    distance = np.hypot(*(candidates - place).T)
    ring = (distance > 0.8 * reach) & (distance < 1.3 * reach)
    return (
        bool(ring.any())
        and float(np.median(heights[ring])) < 0.5 * height
        and (height >= heights[distance < 0.8 * reach].max())
    )


def _center_of_mass(place: Floats, places: Floats, heights: Floats, reach: float) -> Floats:
    """Of the heights above half of the greatest, about a first guess."""
    for _ in range(3):
        near = np.hypot(*(places[:, :2] - place).T) < 0.7 * reach
        excess = np.maximum(heights[near] - 0.5 * np.quantile(heights[near], 0.98), 0.0)
        if not excess.sum() > 0.0:
            break
        place = (excess[:, None] * places[near, :2]).sum(axis=0) / excess.sum()
    return np.asarray(place)


def _coverage(place: Floats, plate: ReferencePlate, reach: float) -> float:
    near = plate.known & (np.hypot(*(plate.places[:, :2] - place).T) < reach)
    return float(plate.areas[near].sum() / (np.pi * reach**2))


def _thinned(places: Floats, step: float) -> Ints:
    """Numbers of points (some,), one in each square of a side in mm."""
    cells = np.floor((places - places.min(axis=0)) / step).astype(int)
    return np.asarray(np.unique(cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1], return_index=True)[1])


def _named(places: Sequence[Floats], reach: float) -> dict[str, Floats]:
    """Rows hold the domes whose heights in the picture differ by less than the radius that moves."""
    rows: list[list[Floats]] = []
    for place in sorted(places, key=lambda p: -float(p[1])):
        if rows and rows[-1][0][1] - place[1] < reach:
            rows[-1].append(place)
        else:
            rows.append([place])
    ordered = [place for row in rows for place in sorted(row, key=lambda p: float(p[0]))]
    return {f"D{k + 1}": place for k, place in enumerate(ordered)}
