"""What a folder holds of cameras for a proposed study: frames, and the records and times of frames beside them.

Files go together by name first (`run1/`, `run1_times.csv`, `run1_log.csv`), then by number of rows and by time. Where
several would do none is taken: the study file names them as a question.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.api.extraction import WATCHED
from creepkit.arrays import Floats
from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import CreepkitError
from creepkit.extraction.domes import find_domes
from creepkit.extraction.series import reference_plate
from creepkit.instruments.clock_alignment import UNIX_TIME
from creepkit.instruments.imposed import named_specimens
from creepkit.registry.arguments import specimen_by_name
from creepkit.registry.reading import frame_files, read_frames, read_record
from creepkit.studies.alloy_table import empty_table, looks_like_alloys

if TYPE_CHECKING:
    from creepkit.records import Frames, InstrumentRecord

MOST_FOLDERS, MOST_FILES = 60, 300
"""Folders that are looked into for frames, and files beside them that are tried as records or times."""


FEWEST_FRAMES = 2


ALLOYS_FILE = "alloys.csv"
"""Of the table of alloys that is written to be filled in."""


OF_ANY_FRAMES = (
    *("frames", "frame", "images", "image", "exports", "export", "results"),
    *("dic", "dice", "vic", "camera", "cam"),
)
"""Words in the name of a folder that say only that it holds frames."""


LOADS = ("pressure", "force")
"""Quantities of channels that make a table a record of what was imposed."""


COVERED = 0.9
"""Share of the duration of the frames that their record has at least."""


LIKE_TEMPERATURES = 40.0
"""K from the hottest within which thermocouples of one plate are; those of a room or of a cold junction are not."""


ISOTHERMAL, FEWEST_TEMPERATURES = 5.0, 3
"""K within which tests are at one temperature, and temperatures for which forms are sought."""


@dataclass(frozen=True)
class Choice:
    """A file that goes with frames. file : None where it is not known; why : in words; open : those that would do."""

    file: Path | None = None
    why: str = ""
    open: tuple[Path, ...] = ()


@dataclass(frozen=True)
class FoundCamera:
    """A folder of frames.

    source : it as the study file names it. times : a file with a row for each frame. record : of what was imposed.
    dimples : names of the test pieces that it shows, () where none was found. unseen : why not. named : those of which
    its record has channels.
    """

    folder: Path
    source: str
    frames: Frames
    times: Choice
    record: Choice
    dimples: tuple[str, ...] = ()
    unseen: str = ""
    named: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """As the study calls it."""
        return self.folder.absolute().name or "camera"

    @property
    def untimed(self) -> bool:
        """Whether its files hold no times."""
        return bool(np.isnan(self.frames.times).any())

    @property
    def questions(self) -> tuple[str, ...]:
        """What only who made the test knows, one sentence each."""
        asked = []
        for choice, what in ((self.times, "times"), (self.record, "record")):
            if choice.open and (what == "record" or self.untimed):
                asked.append(f"which of {', '.join(one.name for one in choice.open)} is the {what} of {self.name}?")
        if self.untimed and self.times == Choice():
            asked.append(f"when were the frames of {self.name} taken? give times = a file, or interval_s")
        if len(self.dimples) > 1 and self.named and {*self.named} != {*self.dimples}:
            row = f"{self.dimples[0]} to {self.dimples[-1]}"
            asked.append(f"which of {', '.join(self.named)} are {row} of {self.name}, row by row? give names")
        return tuple(asked)


@dataclass(frozen=True)
class FoundCameras:
    """Cameras and records of a folder.

    names : {file: it as the study names it}. alloys : the file of the table of alloys as the study names it, "" for
    none; empty_alloys : the text of one that is to be written beside the study and filled in.
    """

    names: Mapping[Path, str] = field(default_factory=dict)
    cameras: tuple[FoundCamera, ...] = ()
    records: Mapping[Path, InstrumentRecord] = field(default_factory=dict)
    alloys: str = ""
    empty_alloys: str = ""

    @property
    def summary(self) -> tuple[str, ...]:
        """What was found, in sentences."""
        lines = []
        for one in self.cameras:
            parts = [f"{one.folder}: {len(one.frames)} frames of {one.frames.system or 'a camera'}"]
            parts += [f"test pieces {one.dimples[0]} to {one.dimples[-1]}"] if len(one.dimples) > 1 else []
            choices = ((one.times, "times"), (one.record, "record"))
            parts += [f"{what} of {choice.file.name}" for choice, what in choices if choice.file]
            lines.append(", ".join(parts))
        lines += [f"{file}: an instrument record with {len(r.channels)} channels" for file, r in self.records.items()]
        return (*lines, *(f"question: {text}" for one in self.cameras for text in one.questions))

    def listed(self, files: Sequence[Path]) -> str:
        """Files as the study names them, one or the other."""
        return " or ".join(json.dumps(self.names[one], ensure_ascii=False) for one in files)

    def record_name(self, file: Path) -> str:
        """What the study calls a record."""
        alike = [one for one in self.records if one.stem == file.stem]
        return file.stem if len(alike) == 1 else f"{file.parent.name} {file.stem}"

    def channels_of(self, record: InstrumentRecord) -> list[str]:
        """The first load, and the thermocouples of a plate: those that are about as hot as the hottest."""
        channels = record.channels.items()
        load = next(name for name, one in channels if one.quantity in LOADS)
        warm = {
            name: one.values
            for name, one in channels
            if one.quantity == "temperature" and one.missing < one.values.size
        }
        means = {name: float(np.nanmean(values)) for name, values in warm.items()}
        hottest = max(means.values(), default=0.0)
        return [load, *(name for name, mean in means.items() if mean > hottest - LIKE_TEMPERATURES)]

    @property
    def several_temperatures(self) -> bool:
        """Whether cameras of one test piece each were at enough temperatures for forms of it."""
        levels: list[float] = []
        for one in self.cameras:
            record = None if one.record.file is None else self.records[one.record.file]
            if len(one.dimples) > 1 or record is None or not (names := self.channels_of(record)[1:]):
                continue
            mean = float(np.mean([np.nanmean(record.channel(name).values) for name in names]))
            if all(abs(mean - other) > ISOTHERMAL for other in levels):
                levels.append(mean)
        return len(levels) >= FEWEST_TEMPERATURES


def found_cameras(folder: Path, path: Path, others: Sequence[Path], base: str) -> FoundCameras:
    """What a folder and those in it hold of cameras.

    path : the study file. others : files that hold tests. base : of the folder, relative to the study file.
    """
    place, visible = "" if base == "." else f"{base}/", sorted(folder.iterdir())
    below = [one for one in visible if one.is_dir() and one.name[0] != "." and not one.name.endswith(".results")]
    tried = {one: _of(read_frames, one) for one in (folder, *below)[:MOST_FOLDERS]}
    frames = {one: found for one, found in tried.items() if found is not None and len(found) >= FEWEST_FRAMES}
    if not frames:
        return FoundCameras()
    named = {file for one in frames for file in frame_files(one)}
    inside = [file for one in frames if one != folder for file in sorted(one.iterdir()) if file not in named]
    beside = [one for one in visible if one not in {path, *named, *others}]
    files = [one for one in (*beside, *inside) if one.is_file() and one.name[0] != "."][:MOST_FILES]
    watched = specimen_by_name(WATCHED)
    tables = [one for one in files if looks_like_alloys(one, watched)]
    files = [one for one in files if one not in tables]
    read = {one: _of(read_record, one) for one in files}
    records = {
        one: record
        for one, record in read.items()
        if record is not None and any(channel.quantity in LOADS for channel in record.channels.values())
    }
    times = {one: rows for one in files if one not in records and (rows := _of(read_frame_times, one)) is not None}
    owners = {one: _owner(one, list(frames)) for one in files}
    for kind in (times, records):
        owners |= _one_of_each([one for one in kind if owners[one] is None], list(frames))
    cameras = []
    for one, found in frames.items():
        right = {file: rows for file, rows in times.items() if rows.size == len(found)}
        own = _chosen({file: owners[file] for file in right}, one, "it has as many rows as there are frames")
        clock = found.times if own.file is None or not np.isnan(found.times).any() else times[own.file]
        covering = {file: owners[file] for file, record in records.items() if _covers(record, clock)}
        by_name = [file for file in records if owners[file] == one]
        under = _chosen(covering | dict.fromkeys(by_name, one), one, "it is the only one that lasts as long")
        dimples, unseen = _dimples(found)
        source = base if one == folder else f"{place}{one.name}"
        named_in = () if under.file is None else tuple(named_specimens(records[under.file]))
        cameras.append(FoundCamera(one, source, found, own, under, dimples, unseen, named_in))
    used = {c.file for camera in cameras for c in (camera.times, camera.record)} - {None}
    offered = {file for camera in cameras for c in (camera.times, camera.record) for file in c.open}
    kept = {file: record for file, record in records.items() if file in used | offered}
    names = {camera.name: camera.dimples or ("D1",) for camera in cameras}
    file_names = {file: place + file.relative_to(folder).as_posix() for file in (*named, *files, *tables)}
    alloys = (ALLOYS_FILE, empty_table(names))
    if tables or (path.parent / ALLOYS_FILE).exists():
        alloys = (file_names[tables[0]] if len(tables) == 1 else "", "")
    return FoundCameras(file_names, tuple(cameras), kept, *alloys)


def _words(text: str) -> list[str]:
    """Letters and numbers of a name, each by itself: run and 1 of run1 and of Run_01."""
    return [word.lstrip("0") or "0" for word in re.findall(r"[^\W\d_]+|\d+", text.casefold())]


def _owner(file: Path, folders: Sequence[Path]) -> Path | None:
    """The folder of frames in which a file lies, or of which it has the name, the longest where it has several."""
    if file.parent in folders and len(folders) > 1 and all(file.parent != one.parent for one in folders):
        return file.parent
    words, found = _words(file.stem), list[tuple[int, Path]]()
    for folder in folders:
        name = [word for word in _words(folder.absolute().name) if word not in OF_ANY_FRAMES]
        if name and any(words[k : k + len(name)] == name for k in range(len(words))):
            found.append((len(name), folder))
    longest = max((size for size, _ in found), default=0)
    best = [folder for size, folder in found if size == longest]
    return best[0] if len(best) == 1 else None


def _one_of_each(files: Sequence[Path], folders: Sequence[Path]) -> dict[Path, Path]:
    """{file: folder} where what tells folders apart, as the number in run1 and run2, tells files apart alike."""
    names = {folder: set(_words(folder.absolute().name)) for folder in folders}
    own = {
        folder: words.difference(*(names[one] for one in folders if one != folder)) for folder, words in names.items()
    }
    found = {file: [one for one in folders if own[one] and own[one] <= set(_words(file.stem))] for file in files}
    pairs = {file: owners[0] for file, owners in found.items() if len(owners) == 1}
    return pairs if len(folders) > 1 and len(pairs) == len(files) == len(set(pairs.values())) == len(folders) else {}


def _chosen(owners: Mapping[Path, Path | None], folder: Path, reason: str) -> Choice:
    """The file of these that goes with a folder of frames, each of a folder or of none."""
    own = [file for file, owner in owners.items() if owner == folder]
    if len(own) == 1:
        return Choice(own[0], "by its name")
    common = own or [file for file, owner in owners.items() if owner is None]
    if len(common) == 1:
        return Choice(common[0], reason)
    return Choice(open=tuple(common))


def _covers(record: InstrumentRecord, times: Floats) -> bool:
    """Whether a record may be of the time of frames, as far as both clocks say."""
    if np.isnan(times).any():
        return True
    start, end = (float(one) for one in times[[0, -1]])
    if record.start is not None and start > UNIX_TIME:
        first, last = (record.start + float(one) for one in record.times[[0, -1]])
        return min(last, end) - max(first, start) > 0.5 * COVERED * (end - start)
    return float(np.ptp(record.times)) >= COVERED * (end - start)


def _dimples(frames: Frames) -> tuple[tuple[str, ...], str]:
    """The test pieces that frames show, or why none is seen."""
    try:
        region = specimen_by_name(WATCHED).surface_region
        return tuple(find_domes(frames, reference_plate(frames), region).centers), ""
    except (CreepkitError, OSError) as error:
        return (), " ".join(str(error).split())


def _of(read: Callable[[Path], Any], path: Path) -> Any:
    """What is read of a file or folder; None where it holds no such thing."""
    with suppress(CreepkitError, OSError):
        return read(path)
    return None
