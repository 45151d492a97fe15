"""Screening: what is asked of each alloy, as worker processes are sent it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from creepkit.dataset.shards import TaskResult
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets
from creepkit.language import CreepLaw
from creepkit.plates import files
from creepkit.plates.alloys import Alloy
from creepkit.plates.predictors import predictor_fingerprint, single_threaded
from creepkit.records import History, Predictor, Program

FITS_FOLDER = "fits"
"""The folder of the best identifications, inside that of the answers."""
METADATA_FIELDS = ("source", "labels")
"""Fields of a history that no identification looks at."""


@dataclass(frozen=True)
class ScreeningJob:
    """What is asked of each alloy, and the folder that answers are kept in.

    using, through : predictors, as identify() takes them. dense : the law that is set against the reduced one, or None;
    penalty : what reduces it, else the best of `laws` is taken. confirm : True, False or "when in doubt".
    """

    alloys: tuple[Alloy, ...]
    laws: tuple[CreepLaw, ...]
    predictor: Predictor
    surrogate: Predictor | None
    settings: IdentificationSettings
    dense_law: CreepLaw | None
    penalty: ContributionPenalty | Subsets | None
    confirm: bool | str
    folder: Path
    task_name: ClassVar[str] = "alloy"

    def path(self, number: int) -> Path:
        """The file of an alloy's answer: its name where that can be one, and its fingerprint's beginning elsewhere."""
        name = self.alloys[number].name
        file_name = re.sub(r"[^A-Za-z0-9.=+-]+", "-", name).strip("-.")
        is_valid_name = file_name == name and [a.name.lower() for a in self.alloys].count(name.lower()) == 1
        return self.folder / (f"{file_name}.json" if is_valid_name else f"{file_name or 'alloy'}_{_short_hash(name.encode())[:6]}.json")

    def fingerprint(self, number: int) -> str:
        """Of the tests of an alloy and of all that is asked."""
        return _short_hash("\n".join([self._settings_text, *map(_history_text, self.alloys[number].tests)]).encode())

    def on_one_thread(self) -> ScreeningJob:
        """The same with predictors that start no threads."""
        surrogate = None if self.surrogate is None else single_threaded(self.surrogate)
        return replace(self, predictor=single_threaded(self.predictor), surrogate=surrogate)

    def run(self, number: int) -> TaskResult:
        """Screen an alloy and write its answer, and its best identification beside it, which other commands take."""
        from creepkit.plates.one_alloy import screen_alloy

        result = replace(screen_alloy(self, self.alloys[number]), fingerprint=self.fingerprint(number))
        if result.identified:
            result.best.save(self.path(number).parent / FITS_FOLDER / self.path(number).name)
        files.write_result(result, self.path(number))
        return TaskResult(number, "done", accepted=int(result.identified))

    @cached_property
    def _settings_text(self) -> str:
        return "\n".join(self._settings_lines())

    def _settings_lines(self) -> Iterator[str]:
        yield f"creepkit {version('creepkit')}"
        for law in (*self.laws, *([self.dense_law] if self.dense_law is not None else [])):
            yield f"{law.name} {law.fingerprint} {[(name, p.bounds, p.off) for name, p in law.table.items()]}"
        for predictor in (self.predictor, self.surrogate):
            yield "none" if predictor is None else predictor_fingerprint(predictor)
        yield repr((self.settings, self.dense_law is None, self.penalty, self.confirm))


def _history_text(history: History) -> str:
    """All that a history says of its test, for hashing."""
    values = {f.name: getattr(history, f.name) for f in fields(history) if f.name not in METADATA_FIELDS}
    program = history.loading.program()
    loading = (type(history.loading).__name__, _plain_value(program), getattr(history.loading, "control", ""))
    return repr([(name, _plain_value(value)) for name, value in {**values, "loading": loading}.items()])


def _plain_value(value: Any) -> Any:
    """A value whose repr tells all of it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Program):
        return value.times.tolist(), value.values.tolist()
    if hasattr(value, "items"):
        return sorted((name, _plain_value(item)) for name, item in value.items())
    return value


def _short_hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:24]
