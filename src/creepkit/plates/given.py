"""What a screening is given, checked before any work: histories or their folder, laws, predictors, folder, workers."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from creepkit import registry
from creepkit.errors import FitError, HistoryError
from creepkit.inverse.together import Together
from creepkit.language import CreepLaw
from creepkit.readers.reading import read_histories
from creepkit.records import History, Predictor


def histories_given(given: Sequence[History] | str | Path, beside: object = None) -> list[History]:
    """The histories, or those in a folder; HistoryError or FitError where there are none.

    beside : the file of compositions, which may lie in the folder too.
    """
    if isinstance(given, (str, Path)):
        return _read(Path(given).expanduser(), Path(beside) if isinstance(beside, (str, Path)) else None)
    if isinstance(given, History) or not all(isinstance(h, History) for h in given):
        raise FitError("screen() takes a list of histories, as read_histories(path) returns them, or a folder of files")
    if not given:
        raise FitError("there are no histories to screen")
    return _named(list(given))


def _read(folder: Path, beside: Path | None) -> list[History]:
    paths: list[Path] = [folder]
    if folder.is_dir():
        tables = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".csv")
        others = [p for p in tables if beside is None or p.resolve() != beside.resolve()]
        if not others:
            raise HistoryError(f"{folder}: no CSV file of a history is in it; name the folder that holds them")
        paths = [folder] if len(others) == len(tables) else others
    return read_histories(paths, [found.value for found in registry.default().readers().values()])


def _named(histories: list[History]) -> list[History]:
    names = Counter(h.name for h in histories)
    for name, count in names.items():
        if count > 1:
            raise FitError(f"{count} histories are called '{name}'; give each its own name")
    return histories


def laws_given(given: Sequence[CreepLaw | str]) -> tuple[CreepLaw, ...]:
    """The laws themselves, or those of these names."""
    laws = tuple(registry.default().law(one) if isinstance(one, str) else one for one in given)
    names = Counter(law.name for law in laws)
    if not laws or max(names.values()) > 1:
        found = f"'{names.most_common(1)[0][0]}' twice" if laws else "none"
        raise FitError(f"laws must be at least one, each with a name of its own; found {found}")
    return laws


def using_given(given: Predictor | str | Mapping[str, Predictor] | None, histories: Sequence[History]) -> Predictor:
    """The predictor, or those of several specimens as one; by default the specimens that the histories name."""
    if isinstance(given, str):
        return registry.default().specimen(given)
    if given is None:
        known = {name: registry.default().specimen(name) for name in sorted({h.specimen for h in histories})}
        return next(iter(known.values())) if len(known) == 1 else Together(known)
    return Together(dict(given)) if isinstance(given, Mapping) else given


def folder_made(folder: Path, inner: str) -> Path:
    """The folder, which is there from now on, and one inside it."""
    try:
        (folder / inner).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FitError(f"{folder}: cannot be made ({error.strerror}); name another folder for the answers") from None
    return folder


def size_given(workers: int | None) -> int:
    """How many processes."""
    if workers is not None and (workers != int(workers) or workers < 1):
        raise FitError(f"workers is {workers}; allowed are whole numbers above zero, or None for one on each core")
    return workers or len(os.sched_getaffinity(0))
