"""Extraction: what one test piece in the field of view gave, with everything by which it is judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints, frozen, set_fields
from creepkit.errors import HistoryError
from creepkit.extraction.noise import NoiseEstimate
from creepkit.quality.flags import QualityFlag, frame_ranges_text
from creepkit.records import History, Loading, Program, SurfaceRegion, constant_load, known_specimens, loads_of
from creepkit.records.presentable import Plotted, Presentable

TURNED = "z of the frames points away from the cameras, for the surface moves along -z; heights are counted against it"
"""What is assumed of frames in which the surface falls."""


class PlateMotion(NamedTuple):
    """Rigid motion of the clamped plate about the centre of a test piece.

    translations : (frames, 3) mm. rotations : (frames, 3) rad, rotation vectors. points : of the ring. residual :
    (frames,) mm, along z.
    """

    translations: Floats
    rotations: Floats
    points: int
    residual: Floats


class FieldMap(NamedTuple):
    """One frame for a picture.

    frame : its index. heights : (points,) mm. residuals : (points,) mm; both NaN where lost or outside.
    """

    frame: int
    heights: Floats
    residuals: Floats


@dataclass(frozen=True, eq=False)
class Extraction(Presentable, Plotted):
    """The measured outputs of one test piece, and how they came about.

    name : D1, D2 ... or as given. source : the frames. specimen, operator : what was observed, and how.
    times : (frames,) s since the first frame. first_time : s, of that on the clock of the frames. outputs : {name:
    (frames,)}, NaN where a frame does not show one. standard_deviation : {name: (frames,)} of the noise of a single
    frame and of the zero level. used : (frames,). flags : why frames are not used. rest : (frames at rest,) their
    indices; the mean of them is the zero of heights. center : (2,) mm, in the axes of the frames; center_sd : (2,) mm,
    zeros where it was given. center_given : whether it was. region : which part moves and which is held. subset : mm,
    side of the mean that was taken out. motion, noise : see there. residual : (frames,) mm, root mean square over the
    operator's points. places : (points, 2) mm about the centre, in the plate; clamped : (points,) which of them gave
    the motion. maps : some frames for a picture. spacing : mm of points. turned : whether the z of the frames was taken
    to point away from the cameras. history : the test as creepkit identifies
    from it, where loading and temperature were given; `history_under` makes one.
    """

    name: str
    source: str
    specimen: str
    operator: str
    times: Floats
    outputs: Mapping[str, Floats]
    standard_deviation: Mapping[str, Floats]
    used: Bools
    flags: tuple[QualityFlag, ...]
    rest: Ints
    center: Floats
    center_sd: Floats
    center_given: bool
    region: SurfaceRegion
    subset: float
    motion: PlateMotion
    noise: NoiseEstimate
    residual: Floats
    places: Floats
    clamped: Bools
    maps: tuple[FieldMap, ...]
    spacing: float
    first_time: float = 0.0
    turned: bool = False
    history: History | None = field(default=None)

    def __post_init__(self) -> None:
        for name in ("outputs", "standard_deviation"):
            values = {key: frozen(value) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(values))
        for name in ("times", "center", "center_sd", "residual", "places"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        set_fields(self, used=frozen(self.used, dtype=bool), clamped=frozen(self.clamped, dtype=bool))

    drawn_by = "extraction.extraction_figure", "extraction.draw_extraction"

    def history_under(
        self, loading: Loading | float, temperature: float | Program, *, time_zero: float | None = None
    ) -> History:
        """The test as a history, whose time starts with the load.

        loading : a record of the specimen's load, or its constant value, MPa. temperature : K, a number or a Program.
        Programs count from `time_zero`, s since the first frame; by default that is `load_start`. Frames
        before it, and those that do not show every output, are no part of the history, which labels say; flagged frames
        are part of it and unused.
        """
        zero = self.load_start if time_zero is None else float(time_zero)
        after, complete = self.times >= zero, np.isfinite(list(self.outputs.values())).all(axis=0)
        kept = np.flatnonzero(after & complete)
        if not kept.size:
            raise HistoryError(
                f"frames '{self.source}': no frame after time zero, {zero:g} s after the first, has outputs; check the "
                "alignment of the clocks"
            )
        record = constant_load(self.load_name, loading) if isinstance(loading, int | float) else loading
        labels = {"place": self.name, "extraction": _label(self)}
        if self.turned:
            labels["assumed"] = TURNED
        if not after.all():
            labels["frames_before_time_zero"] = str(np.count_nonzero(~after))
        if (missing := np.flatnonzero(after & ~complete)).size:
            labels["frames_without_all_outputs"] = frame_ranges_text(missing.tolist())
        if not self.used.all():
            labels["suspect"] = "; ".join(f"frame {f.frames[0]} {f.kind}: {f.reason}" for f in self.flags)[:2000]
        return History(
            name=f"{PurePath(self.source).name} {self.name}",
            times=self.times[kept] - zero,
            outputs={name: values[kept] for name, values in self.outputs.items()},
            loading=record,
            temperature=temperature,
            specimen=self.specimen,
            standard_deviation={name: values[kept] for name, values in self.standard_deviation.items()},
            used=self.used[kept],
            operator=self.operator,
            labels=labels,
            noise_correlation=self.noise.correlation,
        )

    @property
    def load_start(self) -> float:
        """When the load began, s since the first frame: the last frame before the leading output leaves its noise.

        It is known to the interval between two frames.
        """
        name = next(iter(self.outputs))
        signal = np.abs(self.outputs[name]) > 5.0 * self.standard_deviation[name]
        first = int(self.rest[-1]) + 1 if self.rest.size else 1
        loaded = np.flatnonzero(signal[first:] & self.used[first:])
        return float(self.times[first + int(loaded[0]) - 1 if loaded.size else 0])

    @property
    def load_name(self) -> str:
        """The first load of the specimen, which `history_under` takes a number to be."""
        loads = loads_of(known_specimens().get(self.specimen))
        return loads[0].name if loads else "stress"

    def replace(self, **changes: object) -> Extraction:
        """The same extraction with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    shown_by = "extraction.extraction_text"


def _label(extraction: Extraction) -> str:
    x, y = extraction.center
    given = "given" if extraction.center_given else "of all frames"
    return (
        f"centre {x:.4g}, {y:.4g} mm ({given}); rigid motion from {extraction.motion.points} points of the plate; "
        f"zero from {max(extraction.rest.size, 1)} frames; "
        f"lag-1 correlation of the noise {extraction.noise.lag_one:.2f}"
    )
