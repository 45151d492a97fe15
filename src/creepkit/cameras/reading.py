"""Files and folders to frames, read one at a time, whichever declared format they have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.cameras.array_files import ArrayTable
from creepkit.cameras.columns import FrameColumns, columns_of, frame_of, time_in
from creepkit.cameras.recognition import Recognised, recognise
from creepkit.cameras.sequences import in_order, missing_numbers, skeleton
from creepkit.cameras.text_files import FRAME_FILE, HEAD_BYTES, FrameText, frame_ranges, table_in_range
from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import SAID, HistoryError, quoted, restated
from creepkit.files.reading import read_bytes
from creepkit.records import CameraFrame, Frames
from creepkit.records.camera_format import CameraFormat
from creepkit.records.plugin_calls import call_on_file, named_one

MOST_LOOKED_AT = 10
"""Files of one name, but for its numbers, whose heads decide whether they are frames."""


FormatLike = CameraFormat | str | Mapping[str, Any] | None


FramePath = str | Path | Iterable[str | Path]


def read_frames(
    path: FramePath,
    formats: Sequence[CameraFormat],
    format: FormatLike = None,
    times: ArrayLike | str | Path | None = None,
) -> Frames:
    """The frames in a folder, in a file, in files that match a pattern, or in a list of files in order.

    formats : those that are known. format : the one to take, its name, or {quantity: column}; None: that of the head.
    times : (frames,) s, increasing, or a file of them; None: as the files say, NaN where they do not.
    """
    return call_on_file(lambda: _frames(path, formats, format, times), f"{quoted(path, 300)}: read_frames()")


def _frames(
    path: FramePath, formats: Sequence[CameraFormat], format: FormatLike, times: ArrayLike | str | Path | None
) -> Frames:
    candidates = _candidates(format, formats)
    files = _files(path, candidates, chosen=format is not None)
    first = recognise(files[0], candidates, chosen=format is not None)
    tables = _Tables.of(files, first)
    columns = columns_of(first.format, first.head.names, tables.place)
    name = str(path) if isinstance(path, (str, Path)) else str(files[0].parent)
    listed = read_frame_times(times) if isinstance(times, (str, Path)) else times
    stated = _checked_times(name if listed is times else str(times), len(tables), listed)
    moments = _times_of_files(first.format, tables, columns) if stated is None else stated

    def frame(index: int) -> CameraFrame:
        return call_on_file(lambda: read_frame(index), f"{tables.source(index)}: reading frame {index}")

    def read_frame(index: int) -> CameraFrame:
        table = tables.table(index)
        own = columns if table.names == columns.names else columns_of(first.format, table.names, tables.source(index))
        values = table.numbers(own.positions)
        return frame_of(first.format, own, values, table.location, float(moments[index]), tables.source(index))

    missing = missing_numbers(files) if len(files) > 1 else ()
    return Frames(name, moments, frame, first.format.title, missing)


def frame_files(path: FramePath, formats: Sequence[CameraFormat], format: FormatLike = None) -> list[Path]:
    """The files that read_frames reads, in order; one file may hold all frames."""
    return _files(path, _candidates(format, formats), chosen=format is not None)


def _candidates(format: FormatLike, formats: Sequence[CameraFormat]) -> tuple[CameraFormat, ...]:
    if format is None:
        return tuple(formats)
    if isinstance(format, CameraFormat):
        return (format,)
    if isinstance(format, Mapping):
        return (CameraFormat("columns", "columns named by the user", format),)
    return (named_one("camera format", format, formats),)


# ---- which files ---------------------------------------------------------------------------------------------------


def _files(path: FramePath, formats: Sequence[CameraFormat], chosen: bool) -> list[Path]:
    """The files of a sequence in order; one file may hold all of it."""
    if not isinstance(path, (str, Path)):
        listed = [Path(one).expanduser() for one in path]
        if not listed:
            raise HistoryError("no files are given to read frames from; name a folder, a file or a list of files")
        if twice := [one for k, one in enumerate(listed) if one.absolute() in {p.absolute() for p in listed[:k]}]:
            raise HistoryError(f"{twice[0]}: stands twice in the list of frames; name each file once")
        return listed
    place = Path(path).expanduser()
    if place.is_dir():
        return in_order(_frames_in_folder(place, formats, chosen))
    if place.exists() or not any(sign in str(path) for sign in "*?["):
        return [place]
    matches = [Path(one) for one in glob(str(place)) if Path(one).is_file()]
    if not matches:
        raise HistoryError(f"{path}: no file matches this pattern; name a folder of frames or a file")
    return in_order(matches)


def _frames_in_folder(folder: Path, formats: Sequence[CameraFormat], chosen: bool) -> list[Path]:
    """The files of a folder that are frames by their heads, and others that are called as those are.

    These are frames that cannot be read: they must be missed where they stand, not left out in silence.
    """
    patterns = [pattern.lower() for one in formats for pattern in one.patterns]
    with restated(OSError, HistoryError, f"{folder}: the folder cannot be read ({SAID}); name another one"):
        entries = sorted(folder.iterdir())
    files = [
        file
        for file in entries
        if file.is_file() and file.name[0] != "." and any(fnmatch(file.name.lower(), one) for one in patterns)
    ]
    if not files:
        wanted = ", ".join(sorted(set(patterns)))
        raise HistoryError(f"{folder}: has no files of frames; their names are {wanted}")
    groups: dict[str, list[Path]] = {}
    for file in files:
        groups.setdefault(skeleton(file.name), []).append(file)
    refused: list[HistoryError] = []
    frames = {name for name, group in groups.items() if _has_a_frame(group, formats, chosen, refused)}
    if not frames:
        raise refused[0]
    return [file for file in files if skeleton(file.name) in frames]


def _has_a_frame(
    group: Sequence[Path], formats: Sequence[CameraFormat], chosen: bool, refused: list[HistoryError]
) -> bool:
    """Whether a file of a name is a frame, of which some are looked at; errors of those that are none are appended."""
    for file in group[:: -(-len(group) // MOST_LOOKED_AT)]:
        try:
            recognise(file, formats, chosen)
        except HistoryError as error:
            refused.append(error)
        else:
            return True
    return False


# ---- tables of a sequence ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Tables:
    """The tables of a sequence: one frame a file, or several images in one file of text.

    ranges : bytes of the images in the one file; () where each frame has a file of its own.
    """

    files: Sequence[Path]
    first: Recognised
    ranges: Sequence[tuple[int, int]] = ()

    @classmethod
    def of(cls, files: Sequence[Path], first: Recognised) -> _Tables:
        if len(files) > 1 or not first.is_text:
            return cls(files, first)
        mark = read_bytes(files[0], FRAME_FILE, first=3)
        if mark[:2] in (b"\xff\xfe", b"\xfe\xff"):  # in UTF-16: bytes of the file are not those of the text
            return cls(files, first)
        return cls(files, first, frame_ranges(files[0], first.head, 3 if mark == b"\xef\xbb\xbf" else 0))

    def __len__(self) -> int:
        return len(self.ranges or self.files)

    @property
    def place(self) -> str:
        """Where the names of columns stand."""
        return self.first.head.location(self.first.path)

    def table(self, index: int, *, beginning: bool = False) -> FrameText | ArrayTable:
        """The table of a frame, or its first row."""
        if self.ranges:
            start, end = self.ranges[index]
            last = index == len(self.ranges) - 1 or beginning
            end = min(end, start + HEAD_BYTES) if beginning else end
            found: FrameText | ArrayTable = table_in_range(self.files[0], self.first.head, start, end, last)
        else:
            found = self.first.table(self.files[index], beginning=beginning)
        return found.first_row() if beginning else found

    def source(self, index: int) -> str:
        """What a frame is called in messages."""
        return f"{self.files[0]}, image {index + 1}" if len(self.ranges) > 1 else str(self.files[index])


# ---- times ---------------------------------------------------------------------------------------------------------


def _checked_times(name: str, count: int, times: ArrayLike | None) -> Floats | None:
    """Times (frames,) s that a user gave; HistoryError unless there is one for each frame, and they increase."""
    if times is None:
        return None
    try:
        moments = np.asarray(times, dtype=float)
    except (TypeError, ValueError):
        raise HistoryError(f"{name}: times are {quoted(repr(times))}; give an array of s, one for each frame") from None
    if moments.shape != (count,):
        raise HistoryError(f"{name}: {moments.size} times for {count} frames; give one for each")
    _check_increasing(name, moments)
    return moments


def _check_increasing(name: str, moments: Floats) -> None:
    if not np.isfinite(moments).all():
        raise HistoryError(f"{name}: the time of frame {int(np.argmin(np.isfinite(moments)))} is no finite number")
    if (np.diff(moments) <= 0).any():
        k = int(np.argmax(np.diff(moments) <= 0))
        raise HistoryError(
            f"{name}: the time of frame {k + 1} is {moments[k + 1]:g} s, after {moments[k]:g} s of the frame before; "
            "times must increase"
        )


def _times_of_files(format: CameraFormat, tables: _Tables, columns: FrameColumns) -> Floats:
    """(frames,) s, as a column of the files says; NaN where any does not."""
    moments = np.full(len(tables), np.nan)
    if "time" in columns.quantities:
        moments = np.array([_time_in_column(format, tables, index) for index in range(len(tables))])
    if np.isnan(moments).any():
        return np.full(len(tables), np.nan)
    _check_increasing(tables.place, moments)
    return moments


def _time_in_column(format: CameraFormat, tables: _Tables, index: int) -> float:
    """The time in the first row of a frame; NaN of one that cannot be read, which says so when it is asked for."""
    try:
        table = tables.table(index, beginning=True)
        own = columns_of(format, table.names, tables.source(index))
        return time_in(own, table.numbers(own.positions))
    except HistoryError:
        return float("nan")
