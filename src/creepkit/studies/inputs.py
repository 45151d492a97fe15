"""Inputs of a study: its files with their hashes, the tests that they hold, what is left out, and groups of tests."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from creepkit.errors import StudyError, nearest
from creepkit.files.reading import FileKind, check_readable
from creepkit.files.reading import sha256_of as hash_of_file
from creepkit.inverse.history_checks import SUSPECT_LABEL, truncated_at_strain
from creepkit.quality import without_copies
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS, History
from creepkit.records.history_selection import select_tests
from creepkit.records.plugin_calls import accepts_path
from creepkit.registry import default_registry
from creepkit.reports.contents import Exclusion
from creepkit.studies.arguments import carried_name, plain_path
from creepkit.studies.study_file import StudyFile

DATA_FILE = FileKind("a data file", StudyError, "name files of tests", maximum_bytes=2_000_000_000)


MOST_FILES = 10_000
"""Of one study."""


MOST_NAMES = 300_000
"""Names of files that the patterns of one key are compared with."""


NOT_STATED = "not stated"
"""The group of tests that lack the label by which tests are grouped."""


@dataclass(frozen=True)
class InputFile:
    """A file that a study reads. name : relative to the study file, `..` written `up`; sha256 : of its content."""

    name: str
    path: Path
    sha256: str


@dataclass(frozen=True)
class TestGroup:
    """Tests that are identified together. name : value of the label that they share, "" where all are together."""

    __test__ = False  # not a test case, whatever its name says to pytest

    name: str
    histories: tuple[History, ...]


@dataclass(frozen=True)
class StudyInputs:
    """The tests of a study as they are used, and what was left out.

    measured : all tests as files hold them. exclusions : with reasons. groups : of the tests that remain.
    """

    measured: tuple[History, ...]
    exclusions: tuple[Exclusion, ...]
    groups: tuple[TestGroup, ...]

    @property
    def histories(self) -> tuple[History, ...]:
        """The tests that remain."""
        return tuple(history for group in self.groups for history in group.histories)


def resolve_paths(file: StudyFile, key: tuple[str | int, ...], texts: Sequence[str], root: Path | None) -> list[Path]:
    """Existing files and folders of patterns relative to the study file; StudyError where there is none.

    root : folder of files that a report carried, in which `..` is written `up`.
    """
    found: dict[Path, None] = {}
    search = _Search()
    for k, text in enumerate(texts):
        place = (*key, k)
        pattern = plain_path(file, place, text)
        if "**" in pattern.parts:
            raise file.error(place, f"'{text}' goes through folders of any depth; name the folders")
        base, relative = (file.path.parent, pattern) if root is None else (root, PurePosixPath(carried_name(pattern)))
        path = base / relative
        try:
            matches = [path] if path.exists() else search.matches(base, relative)
        except _TooManyNamesError:
            raise file.error(
                place,
                f"'{text}' and those before it look at more than {MOST_NAMES} names of files; name folders in the "
                "place of patterns",
            ) from None
        except OSError as error:  # a folder that may not be entered, a name too long
            refused = (
                "" if error.filename in (None, str(path)) else f", for {_relative(Path(error.filename), base)} cannot"
            )
            raise file.error(
                place, f"'{text}' cannot be read{refused} ({error.strerror}); check its name and who may read it"
            ) from None
        if not matches:
            raise file.error(place, f"there is no file or folder '{text}' beside the study, and none matches it")
        found.update(dict.fromkeys(matches))
    return list(found)


class _TooManyNamesError(Exception):
    """More names than patterns are compared with."""


class _Search:
    """What matches patterns; each counts the names that it looks at, of which there are MOST_NAMES for all together."""

    def __init__(self) -> None:
        self.looked_at = 0

    def matches(self, base: Path, pattern: PurePosixPath) -> list[Path]:
        """Files and folders that match; of folders that are the same one, by links, the first alone.

        OSError for a folder on the way that cannot be read.
        """
        found = [base]
        for part in pattern.parts:
            if not set(part) & set("*?["):
                self._count(len(found))
                found = [one / part for one in found if _is_there(one / part)]
                continue
            matching = self._matching((one for one in found if one.is_dir()), part)
            found = list(_without_other_names(islice(matching, MOST_FILES + 1)))
        return found if found != [base] else []

    def _matching(self, folders: Iterable[Path], part: str) -> Iterator[Path]:
        for folder in folders:
            names = sorted(os.listdir(folder))
            self._count(1 + len(names))
            yield from (folder / name for name in names if fnmatchcase(name, part))

    def _count(self, names: int) -> None:
        self.looked_at += names
        if self.looked_at > MOST_NAMES:
            raise _TooManyNamesError


def _without_other_names(paths: Iterable[Path]) -> Iterator[Path]:
    """Paths without those of folders that had another name among them already, by a link."""
    seen: set[tuple[int, int] | str] = set()
    for path in paths:
        if path.is_dir():
            status = path.stat()
            place = (status.st_dev, status.st_ino) if status.st_ino else os.path.realpath(path)
            if place in seen:
                continue
            seen.add(place)
        yield path


def _is_there(path: Path) -> bool:
    """Whether there is such a file; OSError where nobody may look, which Path.exists answers otherwise since 3.13."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def input_files(file: StudyFile, paths: Sequence[Path], root: Path | None, left_out: Sequence[Path]) -> list[InputFile]:
    """Every regular file among paths and in folders among them, with its hash; without what the study itself writes."""
    base = file.path.parent if root is None else root
    files: dict[Path, None] = {}
    for path in paths:
        for one in sorted(islice(_files_below(file, path), 2 * MOST_FILES)) if path.is_dir() else [path]:
            if one.is_file() and not any(one == own or own in one.parents for own in left_out):
                files[one] = None
            if len(files) > MOST_FILES:
                raise file.error(("data", "files"), f"they are more than {MOST_FILES} files; name fewer")
    for one in files:  # of all, before any is read from its beginning to its end
        check_readable(one, DATA_FILE)
    result = []
    for one in files:
        relative = PurePosixPath(_relative(one, base))
        name = str(relative) if root is not None else carried_name(relative)
        result.append(InputFile(name, one, sha256_of(one)))
    return result


def _files_below(file: StudyFile, folder: Path) -> Iterator[Path]:
    """The visible files of a folder that tests are read from; StudyError where a folder in it cannot be read.

    Of a folder that a reader takes as a whole all files below are, of another those that a reader accepts; what else
    lies there is nobody's business.
    """
    readers = [found.value for found in default_registry().readers().values()]
    is_whole = any(accepts_path(reader, folder) for reader in readers)

    def refuse(error: OSError) -> None:
        raise file.error(
            ("data", "files"),
            f"folder {error.filename} cannot be read ({error.strerror}); make it readable, or move it",
        )

    for parent, folders, names in os.walk(folder, onerror=refuse):
        folders[:] = [name for name in folders if name[0] != "."] if is_whole else []
        for one in (Path(parent, name) for name in names if name[0] != "."):
            if is_whole or (one.is_file() and any(accepts_path(reader, one) for reader in readers)):
                yield one


def _relative(path: Path, base: Path) -> str:
    return os.path.relpath(path, base).replace("\\", "/")


def sha256_of(path: Path) -> str:
    """Of the content of a regular file."""
    return hash_of_file(path, DATA_FILE)


# ---- tests ---------------------------------------------------------------------------------------------------------


def read_inputs(file: StudyFile, paths: Sequence[Path], watched: Sequence[History], *, complete: bool) -> StudyInputs:
    """The tests of a study: read, chosen, with what is left out, in groups.

    watched : tests of cameras. complete : whether no camera failed; else tests may be missing.
    """
    import creepkit as ck

    data = file.model.data
    measured: list[History] = []
    if paths:
        with file.at("data", "reader" if data.reader is not None else "files"):
            measured = ck.read_histories(list(paths), data.reader, data.ignore)
    names = {history.name for history in measured}
    for one in watched:
        if one.name in names:
            raise file.error(("data", "files"), f"hold a test '{one.name}', as a camera does; give that another name")
    measured += watched
    if not measured and not complete:
        return StudyInputs((), (), ())
    chosen = measured
    if data.only:
        with file.at("data", "only"):
            chosen = select_tests(measured, **_labels(file, data.only))
    histories, exclusions = _excluded(file, chosen, complete)
    if data.suspect_frames == "exclude":
        histories, copies = without_copies(histories)
        exclusions += [Exclusion(name, (), reason) for name, reason in copies.items()]
        sound = ck.exclude_suspect_frames(histories)
        exclusions += [
            Exclusion(after.name, _frames(before.used & ~after.used), f"suspect: {after.labels[SUSPECT_LABEL]}")
            for before, after in zip(histories, sound, strict=True)
            if (before.used & ~after.used).any()
        ]
        histories = sound
    if data.up_to_strain is not None:
        before, limit = histories, data.up_to_strain
        histories = truncated_at_strain(histories, limit)
        names = {history.name for history in histories}
        exclusions += [
            Exclusion(h.name, (), f"no two frames below a strain of {limit:g}") for h in before if h.name not in names
        ]
    if not histories:
        raise file.error(("data",), "no test is left; leave out fewer of them")
    return StudyInputs(tuple(measured), tuple(exclusions), tuple(_groups(file, histories)))


def _labels(file: StudyFile, only: dict[str, list[Any]]) -> dict[str, list[Any]]:
    """Labels as select_tests takes them; temperature_C in K."""
    labels = {name: values for name, values in only.items() if name != "temperature_C"}
    if "temperature_C" in only:
        if not all(isinstance(value, int | float) for value in only["temperature_C"]):
            raise file.error(("data", "only", "temperature_C"), "must be a number in C, or a list of them")
        labels["temperature"] = [float(value) + ZERO_CELSIUS for value in only["temperature_C"]]
    return labels


def _excluded(file: StudyFile, histories: Sequence[History], complete: bool) -> tuple[list[History], list[Exclusion]]:
    """The histories without what the study excludes."""
    remaining = list(histories)
    exclusions: list[Exclusion] = []
    for k, part in enumerate(file.model.exclude):
        if part.from_h is not None and part.to_h is not None and not part.from_h < part.to_h:
            raise file.error(("exclude", k, "to_h"), f"{part.to_h:g} h does not lie after from_h, {part.from_h:g} h")
        named = [h for h in histories if fnmatchcase(h.name, part.test)]
        if not named and not complete:
            continue  # it may be of a camera that failed
        if not named:
            names = [h.name for h in histories]
            raise file.error(("exclude", k, "test"), f"there is no test '{part.test}'; {nearest(part.test, names)}")
        before = len(exclusions)
        for history in named:
            if part.frames is None and part.from_h is None and part.to_h is None:
                remaining = [h for h in remaining if h.name != history.name]
                exclusions.append(Exclusion(history.name, (), part.reason))
                continue
            unused = np.zeros(history.times.size, bool)
            if part.frames is not None:
                unused[_frame_numbers(file, k, part.frames, history)] = True
            if part.from_h is not None or part.to_h is not None:
                hours = history.times / SECONDS_PER_HOUR
                within = (hours >= (part.from_h or 0.0)) & (hours <= (np.inf if part.to_h is None else part.to_h))
                unused |= within
            if not unused.any():
                continue  # another test of the pattern has frames there
            exclusions.append(Exclusion(history.name, _frames(unused), part.reason))
            remaining = [replace(h, used=h.used & ~unused) if h.name == history.name else h for h in remaining]
        if len(exclusions) == before:
            given = "from_h" if part.from_h is not None else "to_h"
            first = min(h.times[0] for h in named) / SECONDS_PER_HOUR
            last = max(h.times[-1] for h in named) / SECONDS_PER_HOUR
            what = f"test '{part.test}' has no frame there; its frames are from {first:g} h to {last:g} h"
            raise file.error(("exclude", k, given), what)
    return remaining, exclusions


def _frame_numbers(file: StudyFile, number: int, text: str, history: History) -> list[int]:
    """Frames of a text such as 97-191, 193, counted from 0."""
    frames: list[int] = []
    for part in text.split(","):
        first, _, last = (one.strip() for one in part.partition("-"))
        if not (first.isascii() and first.isdigit() and (not last or (last.isascii() and last.isdigit()))):
            raise file.error(("exclude", number, "frames"), f"'{text}' is not known; write frames = \"97-191, 193\"")
        low, high = int(first[:9]), int((last or first)[:9])
        if not low <= high < history.times.size:
            size = history.times.size
            raise file.error(
                ("exclude", number, "frames"), f"test '{history.name}' has frames 0 to {size - 1}, found {part.strip()}"
            )
        frames += range(low, high + 1)
    return frames


def _frames(mask: Any) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(mask))


def _groups(file: StudyFile, histories: Sequence[History]) -> list[TestGroup]:
    """Groups by the label that the study names; by alloy where it names none."""
    part = file.model.identification
    label = "alloy" if part is None or part.group_by is None else part.group_by
    known = {"alloy", "specimen", *(name for history in histories for name in history.labels)} - {SUSPECT_LABEL}
    if label == "none":
        return [TestGroup("", tuple(histories))]
    if label not in known:
        raise file.error(
            ("identification", "group_by"), f"no test has a label '{label}'; {nearest(label, known | {'none'})}"
        )
    by_value: dict[str, list[History]] = {}
    for history in histories:
        stated = getattr(history, label) if label in ("alloy", "specimen") else ""
        value = stated or history.labels.get(label, "")
        by_value.setdefault(value or NOT_STATED, []).append(history)
    if len(by_value) == 1 and (part is None or part.group_by is None):
        return [TestGroup("", tuple(histories))]
    return [TestGroup(name, tuple(tests)) for name, tests in by_value.items()]
