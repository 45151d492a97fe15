"""Tables of a proposed study for folders of camera frames, and for the records and times of frames beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import CreepkitError
from creepkit.registry.reading import frame_files, read_frames, read_record
from creepkit.studies.proposed_tables import comment, quoted

if TYPE_CHECKING:
    from creepkit.records import Frames, InstrumentRecord

MOST_FOLDERS, MOST_FILES = 20, 40
"""Folders that are looked into for frames, and files beside them that are tried as records or times."""


FEWEST_FRAMES = 2


LOADS = ("pressure", "force")
"""Quantities of channels that make a table a record of what was imposed."""


@dataclass(frozen=True)
class CameraProposal:
    """Lines of the tables [[record]] and [[camera]], what was found in sentences, and files that they name."""

    lines: tuple[str, ...] = ()
    summary: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()


def proposed_cameras(folder: Path, path: Path, others: Sequence[Path], base: str) -> CameraProposal:
    """What a folder and those in it hold of cameras.

    path : the study file. others : files that hold tests. base : of the folder, relative to the study file.
    """
    place, visible = "" if base == "." else f"{base}/", sorted(folder.iterdir())
    below = [one for one in visible if one.is_dir() and one.name[0] != "."]
    tried = {one: _of(read_frames, one) for one in (folder, *below)[:MOST_FOLDERS]}
    cameras = {one: frames for one, frames in tried.items() if frames is not None and len(frames) >= FEWEST_FRAMES}
    if not cameras:
        return CameraProposal()
    named = {file for one in cameras for file in frame_files(one)}
    beside = [one for one in visible if one.is_file() and one not in {path, *named, *others}][:MOST_FILES]
    read = {one: _of(read_record, one) for one in beside}
    records = {
        one: record
        for one, record in read.items()
        if record is not None and any(channel.quantity in LOADS for channel in record.channels.values())
    }
    times = {one: _of(read_frame_times, one) for one in beside if one not in records}
    lines = [line for file, record in records.items() for line in _record_lines(file, record, place)]
    summary = []
    for one, frames in cameras.items():
        own = next((file for file, found in times.items() if found is not None and found.size == len(frames)), None)
        source = base if one == folder else f"{place}{one.name}"
        beside_it = None if own is None else f"{place}{own.name}"
        lines += _camera_lines(one.absolute().name, source, frames, beside_it, records)
        summary.append(f"{one}: {len(frames)} frames of {frames.system or 'a camera'}")
        named |= set() if own is None else {own}
    summary += [f"{one}: an instrument record with {len(record.channels)} channels" for one, record in records.items()]
    return CameraProposal(tuple(lines[:-1]), tuple(summary), tuple(sorted({*named, *records})))


def _of(read: Callable[[Path], Any], path: Path) -> Any:
    """What is read of a file or folder; None where it holds no such thing."""
    with suppress(CreepkitError, OSError):
        return read(path)
    return None


def _record_lines(file: Path, record: InstrumentRecord, place: str) -> list[str]:
    unstated = any(one.quantity == "pressure" and not one.reference for one in record.channels.values())
    lines = {
        comment(f"{file.name}: {record.times.size} rows; channels {', '.join(record.channels)}"): True,
        **{comment(f"assumed: {note}"): True for note in record.notes[:5]},
        "[[record]]": True,
        f"name = {quoted(file.stem)}": True,
        f"file = {quoted(place + file.name)}": True,
        '# time_zone = "Europe/Berlin"  # of its times, which do not state one': record.start is None,
        'pressure_reference = "gauge"  # assumed, for the file does not say; or "absolute"': unstated,
        "": True,
    }
    return [line for line, shown in lines.items() if shown]


def _camera_lines(
    title: str, source: str, frames: Frames, times: str | None, records: dict[Path, InstrumentRecord]
) -> list[str]:
    """A table [[camera]], with what was assumed in comments."""
    lines = [comment(f"{len(frames)} frames, by their heads of {frames.system or 'a camera'}")]
    if frames.missing:
        lines.append(comment(f"numbers that are absent: {len(frames.missing)}"))
    lines += ["[[camera]]", f"name = {quoted(title or 'camera')}", f"frames = {quoted(source)}"]
    if bool(np.isnan(frames.times).any()):
        rows = None if times is None else f"times = {quoted(times)}  # assumed: it has as many rows as there are frames"
        lines.append(rows or "interval_s = 1  # assumed, for the files hold no times; or times = a file")
    lines.append("subset_mm = 0  # side of a subset, whose smoothing is taken out; 0 leaves it in")
    if records:
        (file, record), *others = records.items()
        more = f"  # assumed; there are also {', '.join(one.stem for one, _ in others)}" if others else ""
        lines.append(f"record = {quoted(file.stem)}{more}")
        if not record.channel_patterns:
            load = next(n for n, one in record.channels.items() if one.quantity in LOADS)
            warm = next((n for n, one in record.channels.items() if one.quantity == "temperature"), "temperature")
            pair = f"[{quoted(load)}, {quoted(warm)}]"
            lines.append(f"channels = {pair}  # assumed: load and temperature, the first of each")
    else:
        lines.append("# record = a [[record]] of loads and temperatures, or without one:")
        lines += ["# load = { pressure_bar = 50 }", "# temperature_C = 800"]
    return [*lines, "# modulus_GPa = 150  # a specimen of finite elements needs it", '# names = ["D1"]', ""]
