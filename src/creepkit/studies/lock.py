"""study.lock: every default, seed, version and hash of a run, so that it can be repeated and differences are seen."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from creepkit.errors import CreepkitError, StudyError, quoted
from creepkit.files.json_documents import DocumentFormat, as_read_back, check_heading, check_keys, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import record_to_json
from creepkit.studies import arguments
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import InputFile
from creepkit.studies.numbers import MISSING, changed_numbers
from creepkit.studies.study_file import StudyFile

STUDY_LOCK = DocumentFormat(
    "creepkit-study-lock",
    1,
    FileKind("a study.lock", StudyError, "remove it: 'creepkit run' writes it again"),
    remedy="remove it: 'creepkit run' writes it again",
)


PACKAGES = ("creepkit", "numpy", "scipy", "sympy", "torch", "llvmlite", "pydantic")
"""Whose versions are recorded."""


KEYS = ("study", "seed", "versions", "inputs", "declared", "settings", "laws", "stages")


def versions_of() -> dict[str, str]:
    """Versions of Python and of the packages that compute."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def lock_of(
    file: StudyFile,
    study_hash: str,
    files: Sequence[InputFile],
    records: Sequence[StageRecord],
    before: Mapping[str, Any] | None = None,
) -> Any:
    """The content of study.lock; the same for the same run. before : the lock, whose stages that are left out stay."""
    known = {} if before is None else before["stages"]
    model = file.model
    settings = record_to_json(asdict(arguments.settings_of(file)))
    laws = {} if model.identification is None else {law.name: law.fingerprint for law in arguments.laws_of(file)}
    content = {
        "study": study_hash,
        "seed": model.study.seed,
        "versions": versions_of(),
        "inputs": {one.name: one.sha256 for one in files},
        "declared": model.model_dump(),
        "settings": settings,
        "laws": laws,
        "stages": {one.name: _stage(one, known.get(one.name)) for one in records},
    }
    return as_read_back({**STUDY_LOCK.heading, **content})


def _stage(record: StageRecord, known: Any) -> Any:
    if record.state == "left out" and isinstance(known, dict) and known.get("key") == record.key:
        return known
    state = {"failed": "failed", "left out": "left out"}.get(record.state, "done")
    return {"key": record.key, "state": state, "numbers": dict(record.numbers), "sha256": record.sha256 or None}


def write_lock(content: Any, path: Path) -> Path:
    """Write study.lock, whole or not at all."""
    return write_json(content, path, STUDY_LOCK.kind, internal=True)


def read_lock(path: Path) -> dict[str, Any]:
    """The content of a study.lock below its heading; StudyError for any other file."""
    content = check_heading(read_json(path, STUDY_LOCK.kind), str(path), STUDY_LOCK)
    problem = check_keys(content, KEYS, "study.lock")
    tables = ("versions", "inputs", "declared", "settings", "laws", "stages")
    wrong = "" if problem else next((name for name in tables if not isinstance(content[name], dict)), "")
    if problem or wrong:
        raise StudyError(f"{path}: {problem or f'{wrong} is no object'}; {STUDY_LOCK.kind.advice}")
    return content


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs between two locks, one sentence each; stages are not compared (see changed_results)."""
    found = []
    for name in ("versions", "inputs", "laws"):
        old, new = before[name], now[name]
        what = {"versions": "version of", "inputs": "file", "laws": "law"}[name]
        for key in sorted({*old, *new}):
            if key not in new:
                found.append(f"{what} {key}: was there, and is not any more")
            elif key not in old:
                found.append(f"{what} {key}: is new")
            elif old[key] != new[key]:
                detail = f" from {old[key]} to {new[key]}" if name == "versions" else ""
                found.append(f"{what} {key}: changed{detail}")
    for name in ("declared", "settings"):
        found += [f"setting {place}: changed from {a} to {b}" for place, a, b in _changes(before[name], now[name], "")]
    if before["seed"] != now["seed"]:
        found.append(f"seed: changed from {before['seed']} to {now['seed']}")
    return list(dict.fromkeys(found))


def changed_results(before: Mapping[str, Any], records: Sequence[StageRecord]) -> list[str]:
    """Numbers that a run gives otherwise than the lock has them, though all that decides them is the same."""
    found = []
    same = {one.name for one in records if _sha256(before, one.name) in ("", one.sha256)}
    for one in records:
        old = before["stages"].get(one.name)
        if one.kind == "export" and one.sha256 and one.name not in same and same.issuperset(one.needs):
            found.append(f"result of {one.name}: its text is another one than the lock states")
        if isinstance(old, dict) and old.get("key") == one.key and one.state in ("made", "kept"):
            found += [
                f"result of {one.name}: {_change_of(name, a, b)}"
                for name, a, b in changed_numbers(old.get("numbers", {}), one.numbers)
            ]
    return found


def _sha256(lock: Mapping[str, Any], stage: str) -> str:
    """The hash of a result that a lock states; "" where it states none."""
    known = lock["stages"].get(stage)
    return str(known.get("sha256") or "") if isinstance(known, dict) else ""


def _change_of(name: str, old: Any, new: Any) -> str:
    if old is MISSING:
        return f"the lock had no {name}, which it records from now on"
    if new is MISSING:
        return f"{name} stood in the lock, and is not among the numbers any more"
    return f"{name} was {_short(old)}, and is {_short(new)}"


def _changes(old: Any, new: Any, place: str) -> list[tuple[str, str, str]]:
    if isinstance(old, dict) and isinstance(new, dict):
        inner = (_changes(old.get(key), new.get(key), f"{place}.{key}".lstrip(".")) for key in sorted({*old, *new}))
        return [change for changes in inner for change in changes]
    if _are_tables(old) and _are_tables(new):
        pairs = _paired(old, new)
        return [change for number, a, b in pairs for change in _changes(a, b, f"{place} {number}")]
    return [] if old == new else [(place, _short(old), _short(new))]


def _paired(old: Sequence[Any], new: Sequence[Any]) -> list[tuple[int, Any, Any]]:
    """(number, before, now) of tables of a list, None where there is none: paired by their names, else by order."""
    named = [{one.get("name", k): (k, one) for k, one in enumerate(tables, 1)} for tables in (old, new)]
    if [len(each) for each in named] != [len(old), len(new)]:  # names that are not of one table each
        named = [{k: (k, one) for k, one in enumerate(tables, 1)} for tables in (old, new)]
    before, now = named
    nothing = (0, None)
    return [
        ((now.get(key) or before[key])[0], before.get(key, nothing)[1], now.get(key, nothing)[1])
        for key in dict.fromkeys([*before, *now])
    ]


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _short(value: Any) -> str:
    return "nothing" if value is None else quoted(repr(value), 60)


def lock_if_any(path: Path) -> dict[str, Any] | None:
    """The lock that is there, or None."""
    if path.is_symlink() and not path.exists():
        raise StudyError(f"{path}: is a link to a file that there is not; {STUDY_LOCK.kind.advice}")
    if not path.exists():
        return None
    try:
        return read_lock(path)
    except CreepkitError as error:
        raise StudyError(str(error)) from None
