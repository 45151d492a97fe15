"""What a folder holds of cameras for a proposed study: frames, and the records and times of frames beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import CreepkitError
from creepkit.registry.reading import frame_files, read_frames, read_record

if TYPE_CHECKING:
    from creepkit.records import Frames, InstrumentRecord

MOST_FOLDERS, MOST_FILES = 20, 40
"""Folders that are looked into for frames, and files beside them that are tried as records or times."""


FEWEST_FRAMES = 2


LOADS = ("pressure", "force")
"""Quantities of channels that make a table a record of what was imposed."""


@dataclass(frozen=True)
class FoundCamera:
    """A folder of frames. source : it as the study file names it. times : a file with a row for each frame."""

    folder: Path
    source: str
    frames: Frames
    times: Path | None

    @property
    def untimed(self) -> bool:
        """Whether its files hold no times."""
        return bool(np.isnan(self.frames.times).any())


@dataclass(frozen=True)
class FoundCameras:
    """Cameras and records of a folder. place : of files in it, relative to the study file; files : that are named."""

    place: str = ""
    cameras: tuple[FoundCamera, ...] = ()
    records: Mapping[Path, InstrumentRecord] = field(default_factory=dict)
    files: tuple[Path, ...] = ()

    @property
    def summary(self) -> tuple[str, ...]:
        """What was found, in sentences."""
        seen = (f"{one.folder}: {len(one.frames)} frames of {one.frames.system or 'a camera'}" for one in self.cameras)
        recorded = (f"{file}: an instrument record with {len(r.channels)} channels" for file, r in self.records.items())
        return (*seen, *recorded)

    @property
    def other_records(self) -> str:
        """Records beside the one that is proposed, as a remark."""
        others = ", ".join(one.stem for one in [*self.records][1:])
        return f"  # assumed; there are also {others}" if others else ""

    def channels_of(self, record: InstrumentRecord) -> list[str]:
        """The first load and the first temperature of a record."""
        load = next(name for name, one in record.channels.items() if one.quantity in LOADS)
        warm = (name for name, one in record.channels.items() if one.quantity == "temperature")
        return [load, next(warm, "temperature")]


def found_cameras(folder: Path, path: Path, others: Sequence[Path], base: str) -> FoundCameras:
    """What a folder and those in it hold of cameras.

    path : the study file. others : files that hold tests. base : of the folder, relative to the study file.
    """
    place, visible = "" if base == "." else f"{base}/", sorted(folder.iterdir())
    below = [one for one in visible if one.is_dir() and one.name[0] != "."]
    tried = {one: _of(read_frames, one) for one in (folder, *below)[:MOST_FOLDERS]}
    frames = {one: found for one, found in tried.items() if found is not None and len(found) >= FEWEST_FRAMES}
    if not frames:
        return FoundCameras()
    named = {file for one in frames for file in frame_files(one)}
    beside = [one for one in visible if one.is_file() and one not in {path, *named, *others}][:MOST_FILES]
    read = {one: _of(read_record, one) for one in beside}
    records = {
        one: record
        for one, record in read.items()
        if record is not None and any(channel.quantity in LOADS for channel in record.channels.values())
    }
    times = {one: _of(read_frame_times, one) for one in beside if one not in records}
    cameras = []
    for one, found in frames.items():
        own = next((file for file, rows in times.items() if rows is not None and rows.size == len(found)), None)
        cameras.append(FoundCamera(one, base if one == folder else f"{place}{one.name}", found, own))
    named |= {*records, *(one.times for one in cameras if one.times is not None)}
    return FoundCameras(place, tuple(cameras), records, tuple(sorted(named)))


def _of(read: Callable[[Path], Any], path: Path) -> Any:
    """What is read of a file or folder; None where it holds no such thing."""
    with suppress(CreepkitError, OSError):
        return read(path)
    return None
