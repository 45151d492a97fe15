"""Tables of a proposed study for folders of camera frames, and for the records and times of frames beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import CreepkitError
from creepkit.registry.reading import frame_files, read_frames, read_record
from creepkit.studies.toml_text import CITATION_LINE, comment, quoted, quoted_list, study_part

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
    below = [one for one in sorted(folder.iterdir()) if one.is_dir() and one.name[0] != "."]
    found = {one: pair for one in (folder, *below)[:MOST_FOLDERS] if (pair := _frames(one)) is not None}
    if not found:
        return CameraProposal()
    inside = {file for one, (files, _) in found.items() for file in files}
    beside = [one for one in sorted(folder.iterdir()) if one.is_file() and one != path]
    tried = list(islice((one for one in beside if one not in inside and one not in others), MOST_FILES))
    records = {one: record for one in tried if (record := _record(one)) is not None}
    place = "" if base == "." else f"{base}/"
    lines: list[str] = []
    for file, record in records.items():
        lines += _record_lines(file, record, place)
    times = {one: count for one in tried if one not in records and (count := _count_of_times(one))}
    summary = []
    for one, (files, frames) in found.items():
        name = "." if one == folder else one.name
        own = next((file for file, count in times.items() if count == len(frames)), None)
        lines += _camera_lines(name if name != "." else folder.absolute().name, place, name, frames, own, records)
        summary.append(f"{one}: {len(frames)} frames of {frames.system or 'a camera'}")
        inside |= {*files, *([] if own is None else [own])}
    summary += [
        f"{file}: an instrument record with {len(record.channels)} channels" for file, record in records.items()
    ]
    return CameraProposal(tuple(lines[:-1]), tuple(summary), tuple(sorted({*inside, *records})))


def _frames(folder: Path) -> tuple[list[Path], Frames] | None:
    """The frames of a folder by their heads; None where there are none."""
    try:
        files = frame_files(folder)
        frames = read_frames(folder)
    except (CreepkitError, OSError):
        return None
    return (files, frames) if len(frames) >= FEWEST_FRAMES else None


def _record(file: Path) -> InstrumentRecord | None:
    """The record of a file that has a load or a pressure over time."""
    try:
        record = read_record(file)
    except (CreepkitError, OSError):
        return None
    return record if any(one.quantity in LOADS for one in record.channels.values()) else None


def _count_of_times(file: Path) -> int:
    """How many times of frames a file holds; 0 where it is no such table."""
    try:
        return int(read_frame_times(file).size)
    except (CreepkitError, OSError):
        return 0


def _record_lines(file: Path, record: InstrumentRecord, place: str) -> list[str]:
    notes = [comment(f"assumed: {note}") for note in record.notes[:5]]
    zone = [] if record.start is not None else ['# time_zone = "Europe/Berlin"  # of its times, which do not state one']
    unstated = [name for name, one in record.channels.items() if one.quantity == "pressure" and not one.reference]
    reference = (
        ['pressure_reference = "gauge"  # assumed, for the file does not say; or "absolute"'] if unstated else []
    )
    return [
        comment(f"{file.name}: {record.times.size} rows; channels {', '.join(record.channels)}"),
        *notes,
        "[[record]]",
        f"name = {quoted(file.stem)}",
        f"file = {quoted(place + file.name)}",
        *zone,
        *reference,
        "",
    ]


def _camera_lines(
    title: str, place: str, name: str, frames: Frames, times: Path | None, records: dict[Path, InstrumentRecord]
) -> list[str]:
    """A table [[camera]], with what was assumed in comments."""
    lines = [
        comment(f"{len(frames)} frames, by their heads of {frames.system or 'a camera'}"),
        *([comment(f"numbers that are absent: {len(frames.missing)}")] if frames.missing else []),
        "[[camera]]",
        f"name = {quoted(title or 'camera')}",
        f"frames = {quoted((place.rstrip('/') or '.') if name == '.' else place + name)}",
    ]
    if bool(np.isnan(frames.times).any()):
        lines.append(
            f"times = {quoted(place + times.name)}  # assumed: it has as many rows as there are frames"
            if times is not None
            else "interval_s = 1  # assumed, for the files hold no times; or times = a file"
        )
    lines.append("subset_mm = 0  # side of a subset, whose smoothing is taken out; 0 leaves it in")
    if records:
        (file, record), *others = records.items()
        more = f"  # assumed; there are also {', '.join(one.stem for one, _ in others)}" if others else ""
        lines.append(f"record = {quoted(file.stem)}{more}")
        if not record.channel_patterns:
            load = next(n for n, one in record.channels.items() if one.quantity in LOADS)
            warm = next((n for n, one in record.channels.items() if one.quantity == "temperature"), "temperature")
            lines.append(
                f"channels = [{quoted(load)}, {quoted(warm)}]  # assumed: load and temperature, the first of each"
            )
    else:
        lines += [
            "# record = a [[record]] of loads and temperatures, or without one:",
            "# load = { pressure_bar = 50 }",
        ]
        lines += ["# temperature_C = 800"]
    return [*lines, "# modulus_GPa = 150  # a specimen of finite elements needs it", '# names = ["D1"]', ""]


def text_of_cameras(folder: Path, cameras: CameraProposal, names: Sequence[str]) -> str:
    """A study whose tests are all of cameras: what they hold is known when it has been extracted.

    names : of candidate laws, those of them that are installed.
    """
    import creepkit as ck

    laws = [name for name in names if name in ck.available("laws")]
    identification = ["# The tests are not known before the frames are extracted.", "[identification]"]
    identification += [f"laws = {quoted_list(laws)}  # creepkit list laws lists all", "", "[selection]", 'by = "bic"']
    report = ["[report]", 'file = "report.html"', "attach_MB = 3  # data files up to this size in all are put into it"]
    data = ["# [data]", CITATION_LINE]
    parts = [study_part(folder), list(cameras.lines), data, identification, report]
    return "\n\n".join("\n".join(lines) for lines in parts) + "\n"
