"""What cameras measured of a surface: frames of points with displacements, read one at a time.

A specimen says how cameras see it, and what it makes of measured points of its surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats, frozen, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import SAID, HistoryError, restated


@dataclass(frozen=True)
class SurfaceRegion:
    """Which part of a flat surface moves and which is held, by the distance from the centre of a test piece.

    moving : mm, radius within which the surface moves. held : mm, inner and outer radius of the ring that is clamped,
    from which the rigid motion of a frame is taken. operator : the observation operator of camera points by default.
    """

    moving: float
    held: tuple[float, float]
    operator: str


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a surface in several frames, in the plane of the plate and about the centre of a test piece.

    places : (points, 2) mm, of the undeformed surface. areas : (points,) mm2 that each stands for.
    heights : (frames, points) mm of displacement normal to the plate; NaN where a subset was lost.
    subset : mm, side of the square over which each height is a mean, along the axes; 0 of points.
    """

    places: Floats
    areas: Floats
    heights: Floats
    subset: float = 0.0


@dataclass(frozen=True, eq=False)
class SurfaceObservation:
    """What an observation operator makes of points.

    operator : its text, as histories carry it. outputs : {name: (frames,)}; NaN where a frame does not show one.
    gains : (frames, outputs, points) derivatives of the outputs to the heights, with the weights of the points held;
        zero of lost points.
    residuals : (frames, points) mm, heights less those of the operator's model; NaN outside of what it uses.
    converged : (frames,) whether the frame was observed at all.
    terms : (points, terms) and
    fitted : (terms, points) of the frame of the greatest leading output, whose residuals change by errors less terms @
    fitted @ errors.
    """

    operator: str
    outputs: Mapping[str, Floats]
    gains: Floats
    residuals: Floats
    converged: Bools
    terms: Floats
    fitted: Floats

    def __post_init__(self) -> None:
        set_fields(self, **{name: frozen(getattr(self, name)) for name in ("gains", "residuals", "terms", "fitted")})
        outputs = MappingProxyType({n: frozen(v) for n, v in self.outputs.items()})
        set_fields(self, converged=frozen(self.converged, dtype=bool), outputs=outputs)


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """One frame of a sequence: a surface at one moment, in right-handed axes whose z points to the cameras.

    points : (points, 3) mm, of the undeformed surface. displacements : (points, 3) mm, since the reference image.
    valid : (points,) which points the correlation found; what the others hold means nothing.
    time : s, NaN where the file does not say. source : the file.
    """

    points: Floats
    displacements: Floats
    valid: Bools
    time: float = float("nan")
    source: str = ""

    def __post_init__(self) -> None:
        points, displacements = frozen(self.points), frozen(self.displacements)
        valid = frozen(self.valid, dtype=bool)
        if points.ndim != 2 or points.shape[1:] != (3,) or displacements.shape != points.shape:
            raise HistoryError(
                f"{self.source or 'frame'}: points and displacements have the shapes {points.shape} and "
                f"{displacements.shape}; both must be (points, 3)"
            )
        if valid.shape != points.shape[:1]:
            what = f"{points.shape[0]} points with {valid.size} marks of validity; give one for every point"
            raise HistoryError(f"{self.source or 'frame'}: {what}")
        seen = np.concatenate([points[valid], displacements[valid]], axis=1)
        if not np.isfinite(seen).all():
            raise HistoryError(f"{self.source or 'frame'}: a valid point has a coordinate that is no finite number")
        set_fields(self, points=points, displacements=displacements, valid=valid)


@checked
@dataclass(frozen=True, eq=False)
class Frames(Sequence[CameraFrame]):
    """A sequence of frames; each is read when it is asked for and not kept, so that memory holds one at a time.

    name : of the sequence, such as its folder. times : (frames,) s, as the files say; NaN where they do not.
    read_frame : returns the frame of an index, 0 to len(times) - 1.
    system : the camera system or format that wrote it.
    missing : numbers that are absent from the names of the files, of frames that were lost or left out.
    """

    name: str
    times: Floats
    read_frame: Callable[[int], CameraFrame]
    system: str = ""
    missing: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        times = frozen(self.times)
        if times.ndim != 1 or not times.size:
            raise HistoryError(f"frames '{self.name}': no frames; a sequence needs at least one")
        set_fields(self, times=times)

    @classmethod
    @checked
    def of(
        cls,
        points: ArrayLike,
        displacements: ArrayLike,
        times: ArrayLike,
        *,
        valid: ArrayLike | None = None,
        name: str = "frames",
    ) -> Frames:
        """Frames in memory.

        points : (points, 3) or (frames, points, 3) mm. displacements : (frames, points, 3) mm. times : (frames,) s.
        valid : (frames, points); None: where all coordinates are finite.
        """
        moved = np.asarray(displacements, dtype=float)
        if moved.ndim != 3 or moved.shape[2] != 3:
            raise HistoryError(f"frames '{name}': displacements have the shape {moved.shape}; not (frames, points, 3)")
        with restated(ValueError, HistoryError, f"frames '{name}': the shapes do not belong together ({SAID})"):
            rest = np.broadcast_to(np.asarray(points, dtype=float), moved.shape)
            seen = np.isfinite(rest).all(axis=2) & np.isfinite(moved).all(axis=2)
            marks = seen if valid is None else seen & np.broadcast_to(np.asarray(valid, dtype=bool), moved.shape[:2])
            moments = np.broadcast_to(np.asarray(times, dtype=float), moved.shape[:1])

        def frame(index: int) -> CameraFrame:
            return CameraFrame(rest[index], moved[index], marks[index], float(moments[index]), f"{name}, frame {index}")

        return cls(name, moments, frame)

    def __len__(self) -> int:
        return int(self.times.size)

    def __getitem__(self, index: int) -> CameraFrame:  # type: ignore[override]  # a slice would hold many in memory
        if not -len(self) <= index < len(self):
            raise IndexError(f"frames '{self.name}' has {len(self)} frames; {index} is not among them")
        return self.read_frame(index % len(self))

    def __iter__(self) -> Iterator[CameraFrame]:
        return (self.read_frame(index) for index in range(len(self)))
