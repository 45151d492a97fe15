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

from creepkit.dataset.shards import Answer
from creepkit.inverse.settings import Settings
from creepkit.inverse.sparsity.penalties import Penalty, Subsets
from creepkit.language import CreepLaw
from creepkit.plates import files
from creepkit.plates.alloys import Alloy
from creepkit.plates.predictors import fingerprint_of, on_one_thread
from creepkit.records import History, Predictor, Program

FITS = "fits"
"""The folder of the best identifications, inside that of the answers."""
NOT_DATA = ("source", "labels")
"""Fields of a history that no identification looks at."""


@dataclass(frozen=True)
class Screening:
    """What is asked of each alloy, and the folder that answers are kept in.

    using, through : predictors, as identify() takes them. dense : the law that is set against the reduced one, or None;
    penalty : what reduces it, else the best of `laws` is taken. confirm : True, False or "when in doubt".
    """

    alloys: tuple[Alloy, ...]
    laws: tuple[CreepLaw, ...]
    using: Predictor
    through: Predictor | None
    settings: Settings
    dense: CreepLaw | None
    penalty: Penalty | Subsets | None
    confirm: bool | str
    folder: Path
    part: ClassVar[str] = "alloy"

    def path(self, number: int) -> Path:
        """The file of an alloy's answer: its name where that can be one, and its fingerprint's beginning elsewhere."""
        name = self.alloys[number].name
        plain = re.sub(r"[^A-Za-z0-9.=+-]+", "-", name).strip("-.")
        same = plain == name and [a.name.lower() for a in self.alloys].count(name.lower()) == 1
        return self.folder / (f"{plain}.json" if same else f"{plain or 'alloy'}_{_hash(name.encode())[:6]}.json")

    def fingerprint(self, number: int) -> str:
        """Of the tests of an alloy and of all that is asked."""
        return _hash("\n".join([self._asked, *map(_of_history, self.alloys[number].tests)]).encode())

    def on_one_thread(self) -> Screening:
        """The same with predictors that start no threads."""
        through = None if self.through is None else on_one_thread(self.through)
        return replace(self, using=on_one_thread(self.using), through=through)

    def run(self, number: int) -> Answer:
        """Screen an alloy and write its answer, and its best identification beside it, which other commands take."""
        from creepkit.plates.one_alloy import screened

        answer = replace(screened(self, self.alloys[number]), fingerprint=self.fingerprint(number))
        if answer.identified:
            answer.best.save(self.path(number).parent / FITS / self.path(number).name)
        files.save(answer, self.path(number))
        return Answer(number, "done", accepted=int(answer.identified))

    @cached_property
    def _asked(self) -> str:
        return "\n".join(self._questions())

    def _questions(self) -> Iterator[str]:
        yield f"creepkit {version('creepkit')}"
        for law in (*self.laws, *([self.dense] if self.dense is not None else [])):
            yield f"{law.name} {law.fingerprint} {[(name, p.bounds, p.off) for name, p in law.table.items()]}"
        for predictor in (self.using, self.through):
            yield "none" if predictor is None else fingerprint_of(predictor)
        yield repr((self.settings, self.dense is None, self.penalty, self.confirm))


def _of_history(history: History) -> str:
    """All that a history says of its test, for hashing."""
    told = {f.name: getattr(history, f.name) for f in fields(history) if f.name not in NOT_DATA}
    program = history.loading.program()
    loading = (type(history.loading).__name__, _plain(program), getattr(history.loading, "control", ""))
    return repr([(name, _plain(value)) for name, value in {**told, "loading": loading}.items()])


def _plain(value: Any) -> Any:
    """A value whose repr tells all of it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Program):
        return value.times.tolist(), value.values.tolist()
    if hasattr(value, "items"):
        return sorted((name, _plain(one)) for name, one in value.items())
    return value


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:24]
