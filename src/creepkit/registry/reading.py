"""Files of tests, cameras and instruments, read by what plugins know of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from creepkit.arrays import ArrayLike
from creepkit.cameras import reading as camera_reading
from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError
from creepkit.instruments import reading as instrument_files
from creepkit.instruments.reading_options import RecordOptions
from creepkit.options import takes_options
from creepkit.readers import reading
from creepkit.records import Frames, Histories, History, InstrumentRecord
from creepkit.registry import kinds
from creepkit.registry.plugin_registry import default_registry

if TYPE_CHECKING:
    from creepkit.option_keywords import RecordOptionsKeywords


@checked
def read_histories(paths: reading.PathsLike, reader: str | None = None, ignore: Collection[str] = ()) -> Histories:
    """Read measured histories from a file, a folder, a pattern such as "in625/*.csv", or several of these.

    reader : name of the reader; by default the one that accepts the file.
    ignore : columns that nobody needs, such as ["load_kN", "date"]; they are left out wherever they stand.
    """
    readers = default_registry().values(kinds.READERS)
    return Histories(reading.read_histories(paths, readers, reader, ignore))


def read_those_that_can_be(
    files: Iterable[Path], reader: str | None = None, ignore: Collection[str] = ()
) -> tuple[list[Path], list[History], list[CreepkitError]]:
    """The files that hold tests, these tests, and the error of each other file; each file is read by itself."""
    read, tests, errors = list[Path](), list[History](), list[CreepkitError]()
    readers = [one for one in default_registry().values(kinds.READERS) if reader in (None, one.name)]
    for file in (one for path in files for one in reading.readable_paths(path, readers)):
        try:
            tests += read_histories([file], reader, ignore)
            read.append(file)
        except CreepkitError as error:
            errors.append(error)
    if len({history.name for history in tests}) < len(tests):
        tests = read_histories(read, reader, ignore)  # which says so, or tells them apart
    return read, tests, errors


@checked
def read_frames(
    path: camera_reading.FramePath,
    format: camera_reading.FormatLike = None,
    times: ArrayLike | str | Path | None = None,
) -> Frames:
    """Read what cameras measured of a surface: a folder of one file a frame, a file of several images, a pattern.

    Frames are read one at a time when they are asked for; one that cannot be read raises HistoryError then.

    path : folder, file, pattern such as "run_3/*.csv", or a list of files in their order.
    format : a ck.CameraFormat, the name of one of ck.available("cameras"), or {quantity: column} for x y z u v w; by
        default the one whose columns the head of the first file names.
    times : (frames,) s, increasing, or a file with a column of them, in s or as "time [ms]"; by default as the files
        say, and NaN where they do not.
    """
    formats = default_registry().values(kinds.CAMERAS)
    return camera_reading.read_frames(path, formats, format, times)


def frame_files(path: camera_reading.FramePath, format: camera_reading.FormatLike = None) -> list[Path]:
    """The files that read_frames reads of a folder, a file, a pattern or a list, in order."""
    formats = default_registry().values(kinds.CAMERAS)
    return camera_reading.frame_files(path, formats, format)


@takes_options(RecordOptions)
@checked
def read_record(
    path: str | Path, format: str | None = None, **options: Unpack[RecordOptionsKeywords]
) -> InstrumentRecord:
    """Read the record of an instrument: channels of pressure, temperature and others over one clock.

    format : name of one of `available("instruments")`; by default the one whose columns are there.
    time="", date="" : names of their columns, where they are not called so. time_unit="" : "s", "ms", "min", "h", of
    times without a unit. date_order=None : "month first", "day first" or "year first". time_zone="" : such as
    "America/Chicago" or "+01:00". channels=None : names of those that are kept; all by default. units={} : {channel:
    unit} of heads without one. pressure_reference=None : "gauge" or "absolute", of pressures whose unit does not say.
    ambient_pressure=None : MPa, to be taken off absolute pressures. missing=() : texts in the place of a reading,
    beside the usual ones.
    """
    formats = default_registry().values(kinds.INSTRUMENTS)
    return instrument_files.read_record(path, formats, format, options)
