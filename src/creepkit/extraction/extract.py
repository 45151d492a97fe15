"""Extraction of all test pieces in a field of view, in one pass through the frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import SAID, FitError, HistoryError, restated
from creepkit.extraction.domes import Centers, find_domes, place_centers
from creepkit.extraction.extraction import Extraction, FieldMap, PlateMotion
from creepkit.extraction.frame_checks import FrameFlags, frames_at_rest, motion_reasons, residual_reasons
from creepkit.extraction.noise import NOISE_FRAMES, ErrorFields, estimate_noise, smooth_free, whole
from creepkit.extraction.plate import RigidMotions, rigid_motions
from creepkit.extraction.series import PointSeries, ReferencePlate, SeriesOfFrames, read_series, reference_plate
from creepkit.records import Frames, Specimen, SurfaceObservation, SurfacePoints, SurfaceRegion

FEWEST_CLAMPED_POINTS = 30
"""Points of the clamped plate that a frame needs for its rigid motion."""


FEWEST_SHARE = 0.5
"""Share of the usual number of points below which a frame is not used."""


LARGEST_RISE, SMALLEST_RISE = 0.03, 2e-3
"""Of the height of the middle, and mm: by how much the plate may rise towards a test piece where it is held and flat. A
test piece that is larger than was said loses as much of its height to the rigid motion."""


LEAST_PRESENCE = 0.5
"""Share of the good frames in which a point of the clamped plate must be seen to be used at all."""


SHOWN_FRAMES = 6
"""Frames that a contact sheet shows."""


@dataclass(frozen=True)
class ExtractionRequest:
    """What is asked of an extraction.

    operator : text of the observation operator; None for the specimen's own. centers : {name: (x, y)} or [(x, y), ...],
    mm in the axes of the frames; None to find domes and fit their centres. names : of those that are found, row by row;
    by default D1, D2 .... rest : slice of the frames that are at rest; None to find them. subset : mm, side of the
    square that the camera system averages over, whose smoothing is taken out; 0 leaves it in. load : (frames,) imposed,
    any unit; None where it is not known.
    """

    operator: str | None = None
    centers: Centers | None = None
    names: Sequence[str] = ()
    rest: slice | None = None
    subset: float = 0.0
    load: Floats | None = None


class TakenOff(NamedTuple):
    """Frames without their rigid motion.

    heights : (frames, points) mm, NaN where lost. motion : what was taken off.
    clamped_heights : (frames, clamped points) mm of the clamped plate, NaN where lost or not counted.
    """

    heights: Floats
    motion: RigidMotions
    clamped_heights: Floats


def extract_surfaces(
    frames: Frames, specimen: Specimen, request: ExtractionRequest, failed: dict[str, str] | None = None
) -> list[Extraction]:
    """Extract every test piece in the field of view, in one pass through the frames.

    specimen : says how cameras see it. failed : takes {test piece: why nothing is extracted of it}; None: the first
    such is a HistoryError.
    """
    _check(frames, request.subset)
    region = specimen.surface_region
    plate = reference_plate(frames)
    names = request.names
    if request.centers is not None:
        plate, found = place_centers(frames, plate, region, request.centers)
    else:
        plate, found = find_domes(frames, plate, region)
        if names and len(names) != len(found):
            raise HistoryError(
                f"{len(found)} test pieces were found, and {len(names)} names are given: {', '.join(names)}; give as "
                "many names, or the centres of those that have them"
            )
        found = dict(zip(names or found, found.values(), strict=True))
    problems: dict[str, str] = {}
    groups: dict[str, Ints] = {}
    for name, center in found.items():
        with problem_kept(problems, name, failed):
            groups[name] = _group(plate, center, region, list(found.values()), name)
    read = read_series(frames, plate, list(groups.values()))
    extracted = []
    for name, series in zip(groups, read.series, strict=True):
        with problem_kept(problems, name, failed):
            piece = _Piece(name, found[name], plate, read, series)
            extracted.append(_extract_one(frames, specimen, request, piece))
    if not extracted:
        raise HistoryError("; ".join(dict.fromkeys(problems.values())))
    if failed is not None:
        failed.update(problems)
    return extracted


@contextmanager
def problem_kept(problems: dict[str, str], name: str, failed: object) -> Iterator[None]:
    """What is wrong with one test piece is kept beside the others; a HistoryError where `failed` is None."""
    try:
        yield
    except HistoryError as error:
        if failed is None:
            raise
        problems[name] = str(error)


class _Piece(NamedTuple):
    """One test piece: its name, a first centre (2,) mm in the plate, and what was read about it."""

    name: str
    center: Floats
    plate: ReferencePlate
    read: SeriesOfFrames
    series: PointSeries


def _check(frames: Frames, subset: float) -> None:
    if len(frames) < 2:
        raise HistoryError(f"frames '{frames.name}': one frame is no test; extraction needs the reference and others")
    if not np.isfinite(frames.times).all() or (np.diff(frames.times) <= 0.0).any():
        raise HistoryError(
            f"frames '{frames.name}': their times are not known, or do not rise; give them as "
            "dataclasses.replace(frames, times=...), in s"
        )
    if not 0.0 <= subset < 1e3:
        raise HistoryError(f"subset is {subset!r}; give the side of a subset in mm, or 0 to leave its smoothing in")


def _group(plate: ReferencePlate, center: Floats, region: SurfaceRegion, centers: list[Floats], name: str) -> Ints:
    """Points about one centre up to the end of its clamped ring, without those that another piece moves."""
    own = np.hypot(*(plate.places[:, :2] - center).T)
    others = [np.hypot(*(plate.places[:, :2] - other).T) for other in centers if other is not center]
    free = np.ones(len(own), bool) if not others else np.min(others, axis=0) > region.held[0]
    chosen = plate.known & (own < region.held[1]) & (free | (own < region.held[0]))
    held = np.count_nonzero(chosen & (own > region.held[0]))
    if held < FEWEST_CLAMPED_POINTS:
        raise HistoryError(
            f"{name}: only {held} points of the clamped plate lie between {region.held[0]:g} and {region.held[1]:g} mm "
            f"from its centre; the rigid motion needs {FEWEST_CLAMPED_POINTS}: widen the field that is correlated"
        )
    return np.flatnonzero(chosen)


def _extract_one(frames: Frames, specimen: Specimen, request: ExtractionRequest, piece: _Piece) -> Extraction:
    region, series, plate = specimen.surface_region, piece.series, piece.plate
    places = plate.places[series.points] - np.r_[piece.center, 0.0]
    distance = np.hypot(places[:, 0], places[:, 1])
    clamped = distance > region.held[0]
    frame_flags = _first_flags(piece, series, clamped)
    good = frame_flags.good
    clamped = _always_there(series, clamped, good, piece.name)
    taken = _take_off(places, series, clamped, good)
    translations, rotations = taken.motion.translations(), taken.motion.rotation_vectors()
    moved = motion_reasons(translations, rotations, good, region.moving)
    rough = residual_reasons("of the clamped plate", _size(taken.clamped_heights), good)
    frame_flags.add("motion", moved)
    frame_flags.add("residual", rough)
    signal = _mean(taken.heights[:, distance < 0.3 * region.moving])
    rest = _rest_of(request, signal, good, piece.read.zero_reference)
    risen = taken.heights - _zero_level(taken.heights, rest, good)
    _refuse_a_larger_piece(piece.name, risen[good][-SHOWN_FRAMES:], distance, region)
    surface = np.flatnonzero(distance <= region.held[0])
    heights = risen[:, surface]
    points = SurfacePoints(places[surface, :2], plate.areas[series.points[surface]], heights, request.subset)
    loaded = np.setdiff1d(np.flatnonzero(good), rest)
    if loaded.size < 2:
        raise HistoryError(f"{piece.name}: {loaded.size} good frames under load; extraction needs at least 2")
    center, center_sd = np.zeros(2), np.zeros(2)
    if request.centers is None:
        with restated(FitError, HistoryError, f"{piece.name}: {SAID}"):
            center, covariance = specimen.surface_center(replace(points, heights=heights[loaded]))
        center_sd = np.sqrt(np.diag(covariance))
    centred = replace(points, places=points.places - center)
    seen = specimen.observe_surface(centred, request.operator or region.operator)
    failed = np.flatnonzero(good & ~seen.converged)
    frame_flags.add("fit", dict.fromkeys(failed.tolist(), "the observation operator gave no outputs"))
    residual = _size(seen.residuals)
    frame_flags.add("residual", residual_reasons("of the observation", residual, good))
    names = tuple(seen.outputs)
    signal = seen.outputs[names[0]]
    fields, shown = _error_fields(
        seen, taken, centred, good, rest, loaded[good[loaded]], places[clamped] - np.r_[center, 0.0]
    )
    noise = estimate_noise(seen, fields, np.where(good, signal, np.nan), shown, plate.spacing)
    # Points of overlapping subsets err together: the centre of independent ones is known less well by as much.
    inflation = np.sqrt(max(1.0, np.pi * noise.correlation_length**2 / plate.spacing**2))
    motion = PlateMotion(translations, rotations, int(clamped.sum()), _size(taken.clamped_heights))
    sd = np.sqrt(np.einsum("fii->fi", noise.covariance))
    return Extraction(
        name=piece.name,
        source=frames.name,
        specimen=specimen.label,
        operator=seen.operator,
        times=frames.times - frames.times[0],
        outputs=seen.outputs,
        standard_deviation={n: sd[:, k] for k, n in enumerate(names)},
        used=good & np.isfinite(signal),
        flags=tuple(sorted(frame_flags.flags, key=lambda flag: flag.frames)),
        rest=rest,
        center=plate.axes.camera_places((piece.center + center)[None])[0, :2],
        center_sd=center_sd * inflation,
        center_given=request.centers is not None,
        region=region,
        subset=request.subset,
        motion=motion,
        noise=noise,
        residual=residual,
        places=places[:, :2] - center,
        clamped=clamped,
        maps=_maps(taken.heights, seen, surface, good, rest),
        spacing=plate.spacing,
        first_time=float(frames.times[0]),
        turned=plate.turned,
    )


def _first_flags(piece: _Piece, series: PointSeries, clamped: Bools) -> FrameFlags:
    """Flags of frames that cannot be read or lack points."""
    found = FrameFlags(piece.name, len(series.valid))
    share = np.minimum(*(_share(series.valid[:, some]) for some in (clamped, ~clamped)))
    few = (share < FEWEST_SHARE) | (series.valid[:, clamped].sum(axis=1) < FEWEST_CLAMPED_POINTS)
    found.add("unreadable", piece.read.unreadable)
    lacking = np.flatnonzero(few & found.good).tolist()
    found.add("few points", {k: f"{100 * share[k]:.0f} % of the points that other frames have" for k in lacking})
    if found.good.sum() < 3:
        raise HistoryError(
            f"{piece.name}: {found.good.sum()} of {found.good.size} frames can be used "
            f"({found.flags[0].reason if found.flags else 'there are no more'}); "
            "extraction needs at least 3"
        )
    return found


def _share(valid: Bools) -> Floats:
    count = valid.sum(axis=1)
    usual = float(np.median(count[count > 0])) if count.any() else 1.0
    return np.asarray(count / max(usual, 1.0))


def _always_there(series: PointSeries, clamped: Bools, good: Bools, name: str) -> Bools:
    """The clamped points of all frames: those seen in every good frame, or, where a camera loses others each time so
    that these are less than half, those seen in at least half of the frames.
    """
    presence = series.valid[good].mean(axis=0)
    every, often = clamped & (presence >= 1.0), clamped & (presence >= LEAST_PRESENCE)
    chosen = every if every.sum() >= max(0.5 * often.sum(), FEWEST_CLAMPED_POINTS) else often
    if chosen.sum() < FEWEST_CLAMPED_POINTS:
        raise HistoryError(
            f"{name}: {chosen.sum()} points of the clamped plate are seen in half of the frames; "
            f"the rigid motion needs {FEWEST_CLAMPED_POINTS}"
        )
    return np.asarray(chosen)


def _take_off(places: Floats, series: PointSeries, clamped: Bools, good: Bools) -> TakenOff:
    """Heights without the rigid motion of the clamped points, in parts that keep memory small."""
    parts = []
    for k in range(0, len(good), 64):
        some = slice(k, k + 64)
        moved, valid = series.displacements[some].astype(float), series.valid[some] & good[some, None]
        motion = rigid_motions(places[clamped], moved[:, clamped], valid[:, clamped])
        free = motion.taken_off(places, moved)[:, :, 2]
        heights = np.where(valid, free, np.nan)
        parts.append((heights, motion, np.where(motion.weights > 0.0, heights[:, clamped], np.nan)))
    motion = RigidMotions(*(np.concatenate(arrays) for arrays in zip(*(part[1] for part in parts), strict=True)))
    return TakenOff(np.concatenate([p[0] for p in parts]), motion, np.concatenate([p[2] for p in parts]))


def _refuse_a_larger_piece(name: str, heights: Floats, distance: Floats, region: SurfaceRegion) -> None:
    """HistoryError where what should be flat rises towards the middle: it belongs to the test piece.

    heights : (late frames, points) mm. distance : (points,) mm from the centre.
    """
    inner, outer = region.held
    parts = (distance < 0.3 * region.moving, (distance > inner) & (distance < 0.5 * (inner + outer)))
    middle, near, far = (
        float(np.nanmedian(_mean(heights[:, some]))) for some in (*parts, distance > 0.5 * (inner + outer))
    )
    if near - far > max(LARGEST_RISE * middle, SMALLEST_RISE):
        raise HistoryError(
            f"{name}: the plate between {inner:g} and {outer:g} mm from its centre should be flat, and rises towards "
            f"it by {1e3 * (near - far):.3g} um of {1e3 * middle:.3g} um in the middle: the test piece is larger than "
            f"a radius of {region.moving:g} mm; state its lengths, in [[camera]] lengths = {{...}}, in Python "
            "specimen=ck.specimen(...).replace(...)"
        )


def _rest_of(request: ExtractionRequest, signal: Floats, good: Bools, zero_reference: bool) -> Ints:
    if request.rest is None:
        return frames_at_rest(signal, good, zero_reference, request.load)
    asked = np.arange(signal.size)[request.rest]
    rest = asked[good[asked]]
    if not rest.size:
        raise HistoryError(f"none of the frames {request.rest} that are said to be at rest can be used")
    return rest[1:] if zero_reference and rest.size > 1 and rest[0] == np.flatnonzero(good)[0] else rest


def _zero_level(heights: Floats, rest: Ints, good: Bools) -> Floats:
    """(points,) mean height at rest; points never seen at rest have none, and are left out of every frame."""
    return _mean(heights[rest].T) if rest.size else heights[np.flatnonzero(good)[0]]


def _mean(values: Floats) -> Floats:
    """(rows,) means of what is not NaN in values (rows, columns); NaN where nothing is."""
    seen = np.isfinite(values)
    total = np.where(seen, values, 0.0).sum(axis=1)
    return np.where(seen.any(axis=1), total / np.maximum(seen.sum(axis=1), 1), np.nan)


def _size(values: Floats) -> Floats:
    """(frames,) root mean square of what is not NaN."""
    return np.sqrt(_mean(values**2))


def _error_fields(
    seen: SurfaceObservation, taken: TakenOff, points: SurfacePoints, good: Bools, rest: Ints, loaded: Ints,
    clamped_places: Floats,
) -> tuple[ErrorFields, Bools]:  # fmt: skip
    """Fields of errors for the noise, and (frames, outputs) which outputs frames show."""
    own = rest[good[rest]]
    at_rest = points.heights[own] * np.sqrt(own.size / max(own.size - 1, 1)) if own.size > 1 else points.heights[:0]
    position = _positions(np.asarray(next(iter(seen.outputs.values())))[loaded])
    chosen = np.unique(np.linspace(0, loaded.size - 1, min(NOISE_FRAMES, loaded.size)).astype(int))
    residuals = smooth_free(seen.residuals[loaded], position)[chosen]
    clamped = smooth_free(taken.clamped_heights[loaded], position)[chosen]
    fields = ErrorFields(
        whole(np.nan_to_num(at_rest)), whole(residuals), loaded[chosen], whole(clamped), points.places,
        clamped_places[:, :2],
    )  # fmt: skip
    shown = np.stack([np.isfinite(values) for values in seen.outputs.values()], axis=1)
    return fields, shown


def _positions(signal: Floats) -> Floats:
    """(frames,) from 0 to 1: half the share of the frames, half that of the growth of the signal up to each."""
    steps = np.abs(np.diff(np.nan_to_num(signal), prepend=np.nan_to_num(signal[:1])))
    noise = float(np.median(steps))
    growth = np.cumsum(np.maximum(steps - 3.0 * noise, 0.0))
    even = np.linspace(0.0, 1.0, signal.size)
    return even if not growth[-1] > 0.0 else 0.5 * (even + growth / growth[-1])


def _maps(heights: Floats, seen: SurfaceObservation, surface: Ints, good: Bools, rest: Ints) -> tuple[FieldMap, ...]:
    """Some good frames, the last at rest first and the last of all last, evenly spread over the leading output."""
    order = np.flatnonzero(good)
    signal = np.nan_to_num(np.asarray(next(iter(seen.outputs.values())))[order])
    wanted = np.linspace(signal.min(), signal.max(), SHOWN_FRAMES)
    nearest = [int(order[np.argmin(np.abs(signal - level))]) for level in wanted[1:-1]]
    first = int(rest[-1]) if rest.size else int(order[0])
    chosen = list(dict.fromkeys([first, *nearest, int(order[-1])]))
    maps = []
    for k in sorted(chosen):
        residuals = np.full(heights.shape[1], np.nan)
        residuals[surface] = seen.residuals[k]
        maps.append(FieldMap(k, heights[k], residuals))
    return tuple(maps)
