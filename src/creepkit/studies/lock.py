"""study.lock: every default, seed, version and hash of a run, so that it can be repeated and differences are seen."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from creepkit.errors import SAID, StudyError, quoted, restated
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.reports.contents import versions_of
from creepkit.studies import arguments
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import InputFile
from creepkit.studies.study_file import StudyFile

REMEDY = "remove it: 'creepkit run' writes it again"
STUDY_LOCK = DocumentFormat("creepkit-study-lock", 2, FileKind("a study.lock", StudyError, REMEDY), remedy=REMEDY)


PACKAGES = ("creepkit", "numpy", "scipy", "sympy", "torch", "llvmlite", "pydantic")
"""Whose versions are recorded."""


SAME_NUMBER = 1e-6
"""Relative difference up to which two results are taken as equal: other processors round otherwise."""


CODEC = RecordCodec()


@dataclass(frozen=True)
class LockedStage:
    """A stage of a run. key : hash of all that decides its result. state : "done", "failed" or "left out"."""

    key: str
    state: str
    numbers: Mapping[str, Any]


@dataclass(frozen=True)
class StudyLock:
    """What a run depended on, and the numbers that came out.

    study : SHA-256 of the study file. versions : of packages. inputs : {file: SHA-256}. declared : the study file with
    its defaults. settings : of every identification. laws : {candidate: fingerprint}. stages : by name.
    """

    study: str
    versions: Mapping[str, str]
    inputs: Mapping[str, str]
    declared: Mapping[str, Any]
    settings: Mapping[str, Any]
    laws: Mapping[str, str]
    stages: Mapping[str, LockedStage]


def lock_of(
    file: StudyFile, files: Sequence[InputFile], records: Sequence[StageRecord] = (), before: StudyLock | None = None
) -> StudyLock:
    """The lock of a run; the same for the same run. before : the lock whose stages that are left out stay."""
    known = {} if before is None else before.stages
    stages = {}
    for one in records:
        old = known.get(one.name)
        state = one.state if one.state in ("failed", "left out") else "done"
        kept = old is not None and one.state == "left out" and old.key == one.key
        stages[one.name] = old if kept else LockedStage(one.key, state, one.numbers)
    laws = {} if file.model.identification is None else {law.name: law.fingerprint for law in arguments.laws_of(file)}
    data = CODEC.to_json(
        {
            "study": hashlib.sha256(file.text.encode()).hexdigest(),
            "versions": versions_of(PACKAGES),
            "inputs": {one.name: one.sha256 for one in files},
            "declared": file.model.model_dump(),
            "settings": asdict(arguments.settings_of(file)),
            "laws": laws,
            "stages": stages,
        }
    )
    return CODEC.from_json(StudyLock, data)  # as a file gives it back, to be compared with one


def write_lock(lock: StudyLock, path: Path) -> None:
    """Write study.lock, whole or not at all."""
    write_json({**STUDY_LOCK.heading, **CODEC.to_json(lock)}, path, STUDY_LOCK.kind, internal=True)


def read_lock(path: Path) -> StudyLock | None:
    """The lock of a file, None where there is none; StudyError for any other file."""
    if not path.exists():
        return None
    content = check_heading(read_json(path, STUDY_LOCK.kind), str(path), STUDY_LOCK)
    with restated(RecordError, StudyError, f"{path}: {SAID}; {REMEDY}"):
        return CODEC.from_json(StudyLock, content)


def differences(before: StudyLock, now: StudyLock) -> list[str]:
    """What differs between two locks, one sentence each; stages are not compared (see changed_results)."""
    tables = {"versions": "version of", "inputs": "file", "laws": "law", "declared": "setting", "settings": "setting"}
    found = []
    for table, what in tables.items():
        for place, old, new in changes(getattr(before, table), getattr(now, table)):
            how = "changed" if table in ("inputs", "laws") else f"changed from {_short(old)} to {_short(new)}"
            if what != "setting" and None in (old, new):
                how = "is new" if old is None else "was there, and is not any more"
            found.append(f"{what} {place}: {how}")
    return list(dict.fromkeys(found))


def changed_results(before: StudyLock, records: Sequence[StageRecord]) -> list[str]:
    """Numbers that a run gives otherwise than the lock has them, though all that decides them is the same."""
    now = [one for one in records if one.state in ("made", "kept")]
    pairs = [(one, before.stages[one.name]) for one in now if one.name in before.stages]
    return [
        f"result of {one.name}: {place} was {_short(a)}, and is {_short(b)}"
        for one, old in pairs
        if old.key == one.key
        for place, a, b in changes(old.numbers, one.numbers, SAME_NUMBER)
    ]


def changes(old: Any, new: Any, tolerance: float = 0.0, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """(place, old, new) of values that differ by more than a relative tolerance; None where there is none.

    Tables of a list are paired by their names, so that one more in front of others changes none of them.
    """
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in dict.fromkeys((*old, *new)):
            yield from changes(old.get(key), new.get(key), tolerance, f"{place}.{key}".removeprefix("."))
    elif _are_tables(old) and _are_tables(new):
        before, now = _by_name(old), _by_name(new)
        for key in dict.fromkeys((*before, *now)):
            yield from changes(before.get(key), now.get(key), tolerance, f"{place} {key}")
    elif tolerance and isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for a, b in zip(old, new, strict=True):
            yield from changes(a, b, tolerance, place)
    elif isinstance(old, int | float) and isinstance(new, int | float):
        if not math.isclose(old, new, rel_tol=tolerance, abs_tol=0.0):
            yield place, old, new
    elif old != new:
        yield place, old, new


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, Mapping) for one in value)


def _by_name(tables: Sequence[Any]) -> dict[Any, Any]:
    named = {one.get("name", k): one for k, one in enumerate(tables, 1)}
    return named if len(named) == len(tables) else dict(enumerate(tables, 1))


def _short(value: Any) -> str:
    return "nothing" if value is None else quoted(value if isinstance(value, str) else repr(value), 60)
