"""Files and folders to frames, read one at a time, whichever declared format they have."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cached_property
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.cameras.array_files import ArrayTable
from creepkit.cameras.columns import FrameColumns, columns_of, frame_of, time_in
from creepkit.cameras.recognition import Recognised, recognise
from creepkit.cameras.sequences import in_order, last_number, missing_numbers, skeleton
from creepkit.cameras.text_files import (
    FRAME_FILE,
    FrameText,
    TextHead,
    frame_ranges,
    head_bytes,
    is_remark,
    table_in_file,
    table_in_range,
)
from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import HistoryError, nearest, quoted
from creepkit.files.reading import read_bytes
from creepkit.records import CameraFrame, Frames
from creepkit.records.camera_format import TIME_UNITS, CameraFormat
from creepkit.records.plugin_calls import call_on_file

MOST_LOOKED_AT = 10
"""Files of one name, but for its numbers, whose heads decide whether they are frames."""


FormatLike = CameraFormat | str | Mapping[str, Any] | None


FramePath = str | Path | Iterable[str | Path]


Table = FrameText | ArrayTable


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
    tables = _tables(files, first)
    columns = columns_of(first.format, tables.names, tables.place)
    name = str(path) if isinstance(path, (str, Path)) else str(files[0].parent)
    listed = read_frame_times(times) if isinstance(times, (str, Path)) else times
    stated = _checked_times(name if listed is times else str(times), len(tables.files), listed)
    moments = _times_of_files(first.format, tables, columns) if stated is None else stated

    def frame(index: int) -> CameraFrame:
        return call_on_file(lambda: read_frame(index), f"{tables.source(index)}: reading frame {index}")

    def read_frame(index: int) -> CameraFrame:
        table = tables.table(index)
        own = columns if table.names == columns.names else columns_of(first.format, table.names, tables.source(index))
        values = table.numbers(own.positions)
        return frame_of(first.format, own, values, table.location, float(moments[index]), tables.source(index))

    missing = missing_numbers(files) if len(files) > 1 else ()
    return Frames(name, moments, frame, first.format.title, columns.confidence_unit, missing)


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
    known = {one.name: one for one in formats}
    if not isinstance(format, str):
        raise HistoryError(
            f"format is {quoted(repr(format), 60)}; give a name, {{quantity: column}} or ck.CameraFormat(...)"
        )
    if format not in known:
        raise HistoryError(f"no camera format is called '{format}'; {nearest(str(format), known)}")
    return (known[format],)


# ---- which files ---------------------------------------------------------------------------------------------------


def _files(path: FramePath, formats: Sequence[CameraFormat], chosen: bool) -> list[Path]:
    """The files of a sequence in order; one file may hold all of it."""
    if not isinstance(path, (str, Path)):
        return _listed_files(path)
    place = Path(path).expanduser()
    if place.is_dir():
        return in_order(_frames_in_folder(place, formats, chosen))
    if place.exists() or not any(sign in str(path) for sign in "*?["):
        return [place]
    matches = [Path(one) for one in glob(str(place)) if Path(one).is_file()]
    if not matches:
        raise HistoryError(f"{path}: no file matches this pattern; name a folder of frames or a file")
    return in_order(matches)


def _listed_files(paths: object) -> list[Path]:
    """The files of a list, in its order; HistoryError for what is none, and for a file that stands in it twice."""
    given = list(paths) if isinstance(paths, Iterable) else None
    if given is None or not all(isinstance(one, (str, Path)) for one in given):
        raise HistoryError(
            f"read_frames() takes a folder, a file, a pattern or a list of files, found {quoted(repr(paths), 60)}"
        )
    if not given:
        raise HistoryError("no files are given to read frames from; name a folder, a file or a list of files")
    listed = [Path(one).expanduser() for one in given]
    seen: set[Path] = set()
    for one in listed:
        if one.absolute() in seen:
            raise HistoryError(f"{one}: stands twice in the list of frames; name each file once")
        seen.add(one.absolute())
    return listed


def _frames_in_folder(folder: Path, formats: Sequence[CameraFormat], chosen: bool) -> list[Path]:
    """The files of a folder that are frames by their heads, and others that are called as those are.

    These are frames that cannot be read: they must be missed where they stand, not left out in silence.
    """
    patterns = [pattern.lower() for one in formats for pattern in one.patterns]
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise HistoryError(f"{folder}: the folder cannot be read ({error.strerror}); name another one") from None
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
class _FileSequence:
    """One frame a file."""

    files: Sequence[Path]
    first: Recognised

    @cached_property
    def place(self) -> str:
        """Where the names of columns stand."""
        head = self.first.head
        return str(self.first.path) if head is None else head.location(self.first.path)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return self.table(0).names if self.first.head is None else self.first.head.names

    def table(self, index: int) -> Table:
        path = self.files[index]
        if self.first.head is None:
            return self.first.array_table(path)
        return table_in_file(path, lambda content: self.first.find_head(content, path))

    def beginning(self, index: int) -> Table:
        """The table, of text only its first rows."""
        path = self.files[index]
        if self.first.head is None:
            return self.table(index)
        content = head_bytes(path)
        head = self.first.find_head(content, path)
        return FrameText(path, _first_row(content[head.end :]), head.delimiter, head.names, lambda: head.number + 1)

    def source(self, index: int) -> str:
        return str(self.files[index])


@dataclass(frozen=True)
class _ImagesInFile:
    """Several images in one file of text, each below a line of columns."""

    path: Path
    head: TextHead
    ranges: Sequence[tuple[int, int]]

    @property
    def files(self) -> Sequence[tuple[int, int]]:
        return self.ranges

    @property
    def place(self) -> str:
        return self.head.location(self.path)

    @property
    def names(self) -> tuple[str, ...]:
        return self.head.names

    def table(self, index: int) -> Table:
        start, end = self.ranges[index]
        return table_in_range(self.path, self.head, start, end, index == len(self.ranges) - 1)

    def beginning(self, index: int) -> Table:
        start, end = self.ranges[index]
        table = table_in_range(self.path, self.head, start, min(end, start + 65536), is_last=True)
        return FrameText(self.path, _first_row(table.rows), table.delimiter, table.names, table.first_line)

    def source(self, index: int) -> str:
        return str(self.path) if len(self.ranges) == 1 else f"{self.path}, image {index + 1}"


_Tables = _FileSequence | _ImagesInFile


def _tables(files: Sequence[Path], first: Recognised) -> _Tables:
    if len(files) > 1 or first.head is None:
        return _FileSequence(files, first)
    mark = read_bytes(files[0], FRAME_FILE, first=3)
    if mark[:2] in (b"\xff\xfe", b"\xfe\xff"):  # in UTF-16: bytes of the file are not those of the text
        return _FileSequence(files, first)
    ranges = frame_ranges(files[0], first.head, 3 if mark == b"\xef\xbb\xbf" else 0)
    return _ImagesInFile(files[0], first.head, ranges)


def _first_row(rows: bytes) -> bytes:
    lines = (line for line in rows.splitlines(keepends=True) if line.strip() and not is_remark(line))
    return next(lines, b"")


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
    """(frames,) s, as columns, heads or names of the files say; NaN where any does not."""
    read = _time_source(format, tables, columns)
    if read is None:
        return np.full(len(tables.files), np.nan)
    moments = np.array([read(index) for index in range(len(tables.files))])
    if np.isnan(moments).any():
        return np.full(len(tables.files), np.nan)
    _check_increasing(tables.place, moments)
    return moments


def _time_source(format: CameraFormat, tables: _Tables, columns: FrameColumns) -> Callable[[int], float] | None:
    if "time" in columns.quantities:
        return lambda index: _time_in_column(format, tables, index)
    if not format.time or (isinstance(tables, _ImagesInFile) and len(tables.files) > 1):
        return None
    source, key, unit = format.time
    factor = TIME_UNITS[unit]
    if source == "head":
        return lambda index: factor * _number_above(tables, index, key)
    return lambda index: factor * last_number(Path(tables.source(index)).name)


def _time_in_column(format: CameraFormat, tables: _Tables, index: int) -> float:
    """The time in the first row of a frame; NaN of one that cannot be read, which says so when it is asked for."""
    try:
        table = tables.beginning(index)
        own = columns_of(format, table.names, tables.source(index))
        return time_in(own, table.numbers(own.positions))
    except HistoryError:
        return float("nan")


def _number_above(tables: _Tables, index: int, key: str) -> float:
    """The number of a line `key: value` above the columns; NaN where there is none."""
    path = Path(tables.source(index))
    try:
        lines = head_bytes(path).decode("utf-8", errors="replace").splitlines()
    except HistoryError:
        return float("nan")
    for line in lines:
        found, sign, value = line.strip().lstrip("#*; ").partition(":")
        if sign and found.strip().casefold() == key.casefold():
            try:
                return float(value.split()[0])
            except (ValueError, IndexError):
                return float("nan")
    return float("nan")
