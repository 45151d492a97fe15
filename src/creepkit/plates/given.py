"""What a screening is given, checked before any work: histories or their folder, laws, predictors, folder, workers."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from creepkit import registry
from creepkit.errors import FitError, HistoryError
from creepkit.inverse.together import CompositePredictor
from creepkit.language import CreepLaw
from creepkit.readers.reading import read_histories
from creepkit.records import History, Predictor


def resolve_histories(histories: Sequence[History] | str | Path, compositions_file: object = None) -> list[History]:
    """The histories, or those in a folder; HistoryError or FitError where there are none.

    beside : the file of compositions, which may lie in the folder too.
    """
    if isinstance(histories, (str, Path)):
        return _read_folder(Path(histories).expanduser(), Path(compositions_file) if isinstance(compositions_file, (str, Path)) else None)
    if isinstance(histories, History) or not all(isinstance(h, History) for h in histories):
        raise FitError("screen() takes a list of histories, as read_histories(path) returns them, or a folder of files")
    if not histories:
        raise FitError("there are no histories to screen")
    return _check_unique_names(list(histories))


def _read_folder(folder: Path, compositions_file: Path | None) -> list[History]:
    paths: list[Path] = [folder]
    if folder.is_dir():
        tables = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".csv")
        history_files = [p for p in tables if compositions_file is None or p.resolve() != compositions_file.resolve()]
        if not history_files:
            raise HistoryError(f"{folder}: no CSV file of a history is in it; name the folder that holds them")
        paths = [folder] if len(history_files) == len(tables) else history_files
    return read_histories(paths, [found.value for found in registry.default_registry().readers().values()])


def _check_unique_names(histories: list[History]) -> list[History]:
    names = Counter(h.name for h in histories)
    for name, count in names.items():
        if count > 1:
            raise FitError(f"{count} histories are called '{name}'; give each its own name")
    return histories


def resolve_laws(laws_or_names: Sequence[CreepLaw | str]) -> tuple[CreepLaw, ...]:
    """The laws themselves, or those of these names."""
    laws = tuple(registry.default_registry().law(one) if isinstance(one, str) else one for one in laws_or_names)
    names = Counter(law.name for law in laws)
    if not laws or max(names.values()) > 1:
        problem = f"'{names.most_common(1)[0][0]}' twice" if laws else "none"
        raise FitError(f"laws must be at least one, each with a name of its own; found {problem}")
    return laws


def resolve_predictor(predictor: Predictor | str | Mapping[str, Predictor] | None, histories: Sequence[History]) -> Predictor:
    """The predictor, or those of several specimens as one; by default the specimens that the histories name."""
    if isinstance(predictor, str):
        return registry.default_registry().specimen(predictor)
    if predictor is None:
        specimens = {name: registry.default_registry().specimen(name) for name in sorted({h.specimen for h in histories})}
        return next(iter(specimens.values())) if len(specimens) == 1 else CompositePredictor(specimens)
    return CompositePredictor(dict(predictor)) if isinstance(predictor, Mapping) else predictor


def make_folder(folder: Path, subfolder: str) -> Path:
    """The folder, which is there from now on, and one inside it."""
    try:
        (folder / subfolder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FitError(f"{folder}: cannot be made ({error.strerror}); name another folder for the answers") from None
    return folder


def worker_count(workers: int | None) -> int:
    """How many processes."""
    if workers is not None and (workers != int(workers) or workers < 1):
        raise FitError(f"workers is {workers}; allowed are whole numbers above zero, or None for one on each core")
    return workers or len(os.sched_getaffinity(0))
