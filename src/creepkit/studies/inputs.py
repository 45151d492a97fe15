"""Inputs of a study: its files with their hashes, the tests that they hold, what is left out, and groups of tests."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from creepkit.errors import StudyError, nearest
from creepkit.files.reading import FileKind, check_readable, sha256_of
from creepkit.inverse.history_checks import SUSPECT_LABEL, truncated_at_strain
from creepkit.quality import without_copies
from creepkit.readers.questions import ANSWERS_FILE
from creepkit.readers.reading import answered_readers
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS, History
from creepkit.records.history_selection import select_tests
from creepkit.records.plugin_calls import accepts_path
from creepkit.registry import default_registry, kinds
from creepkit.reports.contents import Exclusion
from creepkit.studies.study_file import KeyPath, StudyFile, carried_name
from creepkit.studies.tables import ExcludeTable

DATA_FILE = FileKind("a data file", StudyError, "name files of tests", maximum_bytes=2_000_000_000)


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

    measured: tuple[History, ...] = ()
    exclusions: tuple[Exclusion, ...] = ()
    groups: tuple[TestGroup, ...] = ()

    @property
    def histories(self) -> tuple[History, ...]:
        """The tests that remain."""
        return tuple(history for group in self.groups for history in group.histories)


def input_files(file: StudyFile, paths: Sequence[Path], left_out: Sequence[Path]) -> list[InputFile]:
    """Every regular file among paths and in folders among them, and of answers beside them, with its hash.

    left_out : what the study itself writes.
    """
    found = [one for path in paths for one in (_files_of_tests(path) if path.is_dir() else [path])]
    found += [one.parent / ANSWERS_FILE for one in found if (one.parent / ANSWERS_FILE).is_file()]
    files = list(dict.fromkeys(one for one in found if one.is_file() and one not in left_out))
    for one in files:  # of all, before any is read from its beginning to its end
        check_readable(one, DATA_FILE)
    names = (PurePosixPath(os.path.relpath(one, file.base).replace("\\", "/")) for one in files)
    return [
        InputFile(str(name) if file.root is not None else carried_name(name), one, sha256_of(one, DATA_FILE))
        for name, one in zip(names, files, strict=True)
    ]


def _files_of_tests(folder: Path) -> list[Path]:
    """The visible files of a folder: all below where a reader takes it as a whole, else those that a reader accepts."""
    readers = default_registry().values(kinds.READERS)
    whole = any(accepts_path(reader, folder) for reader in readers)
    below = sorted(folder.rglob("*") if whole else folder.iterdir())
    visible = [one for one in below if not any(part[0] == "." for part in one.relative_to(folder).parts)]
    if whole:
        return visible
    return [one for one in visible if any(accepts_path(each, one) for each in answered_readers(one, readers))]


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
        return StudyInputs()
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
        before, histories = histories, truncated_at_strain(histories, data.up_to_strain)
        reason = f"no two frames below a strain of {data.up_to_strain:g}"
        remaining = {history.name for history in histories}
        exclusions += [Exclusion(h.name, (), reason) for h in before if h.name not in remaining]
    if not histories:
        raise file.error(("data",), "no test is left; leave out fewer of them")
    return StudyInputs(tuple(measured), tuple(exclusions), tuple(_groups(file, histories)))


def _labels(file: StudyFile, only: dict[str, list[Any]]) -> dict[str, list[Any]]:
    """Labels as select_tests takes them; temperature_C in K."""
    labels = dict(only)
    if "temperature_C" in only:
        if not all(isinstance(value, int | float) for value in only["temperature_C"]):
            raise file.error(("data", "only", "temperature_C"), "must be a number in C, or a list of them")
        labels["temperature"] = [float(value) + ZERO_CELSIUS for value in labels.pop("temperature_C")]
    return labels


def _excluded(file: StudyFile, histories: Sequence[History], complete: bool) -> tuple[list[History], list[Exclusion]]:
    """The histories without what the study excludes."""
    remaining = {history.name: history for history in histories}
    exclusions: list[Exclusion] = []
    for k, part in enumerate(file.model.exclude):
        place: KeyPath = ("exclude", k)
        if part.from_h is not None and part.to_h is not None and not part.from_h < part.to_h:
            raise file.error((*place, "to_h"), f"{part.to_h:g} h does not lie after from_h, {part.from_h:g} h")
        named = [h for h in histories if fnmatchcase(h.name, part.test)]
        if not named and complete:  # else it may be of a camera that failed
            names = [h.name for h in histories]
            raise file.error((*place, "test"), f"there is no test '{part.test}'; {nearest(part.test, names)}")
        before = len(exclusions)
        for history in named:
            if part.frames is None and part.from_h is None and part.to_h is None:
                remaining.pop(history.name, None)
                exclusions.append(Exclusion(history.name, (), part.reason))
                continue
            unused = _unused_frames(file, place, part, history)
            if unused.any():
                exclusions.append(Exclusion(history.name, _frames(unused), part.reason))
            if unused.any() and history.name in remaining:
                used = remaining[history.name].used & ~unused
                remaining[history.name] = replace(remaining[history.name], used=used)
        if named and len(exclusions) == before:
            first, last = (f(h.times[k] for h in named) / SECONDS_PER_HOUR for f, k in ((min, 0), (max, -1)))
            what = f"test '{part.test}' has no frame there; its frames are from {first:g} h to {last:g} h"
            raise file.error((*place, "from_h" if part.from_h is not None else "to_h"), what)
    return list(remaining.values()), exclusions


def _unused_frames(file: StudyFile, place: KeyPath, part: ExcludeTable, history: History) -> Any:
    """(frames,) which of a test are left out, by numbers or by times."""
    unused = np.zeros(history.times.size, bool)
    for text in [] if part.frames is None else part.frames.split(","):
        first, _, last = (one.strip() for one in text.partition("-"))
        if not (first.isascii() and first.isdigit() and (not last or (last.isascii() and last.isdigit()))):
            what = f"'{part.frames}' is not known; write frames = \"97-191, 193\""
            raise file.error((*place, "frames"), what)
        low, high = int(first[:9]), int((last or first)[:9])
        if not low <= high < unused.size:
            what = f"test '{history.name}' has frames 0 to {unused.size - 1}, found {text.strip()}"
            raise file.error((*place, "frames"), what)
        unused[low : high + 1] = True
    if part.from_h is not None or part.to_h is not None:
        hours = history.times / SECONDS_PER_HOUR
        unused |= (hours >= (part.from_h or 0.0)) & (hours <= (np.inf if part.to_h is None else part.to_h))
    return unused


def _frames(mask: Any) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(mask))


def _groups(file: StudyFile, histories: Sequence[History]) -> list[TestGroup]:
    """Groups by the label that the study names; by alloy where it names none."""
    part = file.model.identification
    stated = None if part is None else part.group_by
    label = stated or "alloy"
    known = {"alloy", "specimen", *(name for history in histories for name in history.labels)} - {SUSPECT_LABEL}
    if label != "none" and label not in known:
        what = f"no test has a label '{label}'; {nearest(label, known | {'none'})}"
        raise file.error(("identification", "group_by"), what)
    by_value: dict[str, list[History]] = {}
    for history in histories if label != "none" else ():
        value = getattr(history, label) if label in ("alloy", "specimen") else ""
        by_value.setdefault(value or history.labels.get(label, "") or NOT_STATED, []).append(history)
    if label == "none" or (len(by_value) == 1 and stated is None):
        return [TestGroup("", tuple(histories))]
    return [TestGroup(name, tuple(tests)) for name, tests in by_value.items()]
