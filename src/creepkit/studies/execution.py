"""Stages of a study, and carrying them out: what was made before from the same inputs is read, the rest is kept."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from types import FunctionType
from typing import Any, Literal, get_args

from creepkit.errors import CreepkitError, StudyError
from creepkit.files.locking import locked
from creepkit.files.record_codec import RecordError
from creepkit.inverse.kept_fits import COMPUTING, keep_fits
from creepkit.jobs.progress import ProgressCallback, duration_text, series_of_task
from creepkit.records import History, Predictor
from creepkit.reports.contents import StageFailure
from creepkit.studies.kept_results import ResultFolder, codec_of, key_of

MOST_NAMED = 6
"""Stages that a sentence names."""


_log = logging.getLogger("creepkit.studies")


@dataclass(frozen=True)
class StageRecord:
    """How a stage of a run ended.

    name, kind, group : of the stage. state : "made", "kept" from an earlier run, "failed", or "left out" where it was
    not asked for. key : hash of all that decides its result. sentence : why it failed, or cannot be kept.
    """

    name: str
    kind: StageKind
    group: str
    state: Literal["made", "kept", "failed", "left out"]
    key: str
    sentence: str = ""


class LazyResults(dict[str, Any]):
    """{name of a stage: its result}; of a function the result is made when it is asked for first."""

    def __getitem__(self, name: str) -> Any:
        value = super().__getitem__(name)
        if isinstance(value, FunctionType):
            self[name] = value = value()
        return value


@contextmanager
def running_alone(folder: Path) -> Iterator[None]:
    """StudyError where another process is carrying out the same study; the system frees the lock of one that dies."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with locked(folder / "running.lock") as held:
            if not held:
                raise StudyError(f"{folder}: another process is carrying out this study; wait for it, or end it")
            yield
    except OSError as error:
        raise StudyError(
            f"{folder}: results cannot be kept there ({error.strerror}); name another folder by --to"
        ) from None


def failure_text(error: Exception) -> str:
    """Why a stage failed, in one line; errors that are not creepkit's, as of a plugin, with their class."""
    return " ".join((str(error) if isinstance(error, CreepkitError) else f"{type(error).__name__}: {error}").split())


@dataclass
class Execution:
    """One run over the stages of a study.

    folder : of kept results. histories : the tests. progress : called as progress(task, done, total, note).
    documents : {stage: what was written of its result}.
    """

    folder: ResultFolder
    progress: ProgressCallback | None = None
    histories: Sequence[History] = ()
    records: list[StageRecord] = field(default_factory=list)
    results: LazyResults = field(default_factory=LazyResults)
    documents: dict[str, Any] = field(default_factory=dict)

    @property
    def failures(self) -> tuple[StageFailure, ...]:
        """Stages that failed, with their reasons."""
        return tuple(StageFailure(one.name, one.sentence) for one in self.records if one.state == "failed")

    def run(self, stages: Sequence[Stage], wanted: Collection[str], *, read_others: bool = False) -> None:
        """Carry out the stages of these names, each behind those that it needs.

        read_others : whether results of other stages, where they are kept of the same inputs, are read for a report.
        A KeyboardInterrupt says which stages are kept.
        """
        for number, stage in enumerate(stages, 1):
            try:
                self._run(stage, stage.name in wanted, read_others, f"stage {number} of {len(stages)}")
            except KeyboardInterrupt:
                kept = [one.name for one in self.records if one.state in ("made", "kept")]
                more = f" and {len(kept) - MOST_NAMED} more" if len(kept) > MOST_NAMED else ""
                named = f"kept: {', '.join(kept[:MOST_NAMED])}{more}" if kept else "laws that are fitted are kept"
                raise KeyboardInterrupt(f"{named}; the same command goes on with {stage.name}") from None

    def _run(self, stage: Stage, wanted: bool, read_others: bool, place: str) -> None:
        key = self._key(stage)
        missing = [name for name in stage.needs if name not in self.results]
        if not wanted:
            if read_others and not missing and self._read(stage, key):
                self._record(stage, "kept", key, "was not asked for; the report shows what was kept of it")
            else:
                lacking = "was not asked for, and nothing of these inputs is kept: the report lacks it"
                self._record(stage, "left out", key, lacking if read_others else "")
        elif missing:
            self._record(stage, "failed", key, f"{missing[0]} failed, which it needs")
        else:
            self._report(stage, 0, 1, place)
            if self._read(stage, key):
                self._record(stage, "kept", key, stage.remark)
                self._end(stage, "kept from before")
            else:
                self._make(stage, key)

    def _key(self, stage: Stage) -> str:
        keys = {one.name: one.key for one in self.records}
        needs = [keys.get(name, "") for name in stage.needs]
        versions = {name: version(name) for name in COMPUTING}
        return key_of({"kind": stage.kind, "settings": stage.settings, "needs": needs, "versions": versions})

    def _record(self, stage: Stage, state: Any, key: str, sentence: str = "") -> None:
        self.records.append(StageRecord(stage.name, stage.kind, stage.group, state, key, sentence))

    def _report(self, stage: Stage, done: int, total: int, note: str) -> None:
        if self.progress is not None:
            self.progress(stage.name, done, total, note)

    def _end(self, stage: Stage, note: str) -> None:
        """Report that a stage has its result, and what it says, as a task that is done when it is named first."""
        self._report(stage, 1, 1, note)
        if stage.answer is not None and self.progress is not None and (line := stage.answer(self.results[stage.name])):
            self.progress(f"{stage.group}: {line}" if stage.group else line, 1, 1, "")

    def _read(self, stage: Stage, key: str) -> bool:
        """Whether there is a result of this key that can be read.

        A record is read at once, for its file may be damaged; what is no record is made again when it is asked for.
        """
        data = self.folder.load(stage.name, key)
        try:
            result = (
                self._codec(stage).from_json(stage.record, data["record"])
                if stage.record
                else lambda: self._made(stage, lambda task, done, total: None)
            )
            document = data.get("document")
        except (CreepkitError, LookupError, AttributeError, TypeError, ValueError, ArithmeticError, AssertionError):
            return False
        self.results[stage.name], self.documents[stage.name] = result, document
        return True

    def _codec(self, stage: Stage) -> Any:
        return codec_of(self.histories, stage.predictor)

    def _make(self, stage: Stage, key: str) -> None:
        start = time.monotonic()
        begun: dict[str, float] = {}

        def tick(task: str, done: int, total: int) -> None:
            now = time.monotonic()
            elapsed = now - begun.setdefault(series_of_task(task)[0], now if begun else start)
            if elapsed > 0 and 0 < done < total:
                task += f", {duration_text(elapsed / done * (total - done))} left"
            self._report(stage, min(done, total), total, task)

        try:
            result = self._made(stage, tick)
        except NothingToMake as nothing:
            self._record(stage, "left out", key, str(nothing))
            self._report(stage, 1, 1, "left out")
            return
        except Exception as error:  # of a plugin, too: the other stages go on
            _log.debug("%s failed", stage.name, exc_info=error)
            self._record(stage, "failed", key, failure_text(error))
            self._report(stage, 1, 1, "failed")
            return
        if getattr(result, "interrupted", False):  # by Ctrl-C, with the best so far, which is not the result
            raise KeyboardInterrupt
        self.results[stage.name] = result
        kept, sentence = dict[str, Any](), stage.remark
        try:
            if stage.document is not None:
                kept["document"] = self.documents[stage.name] = stage.document(result)
            if stage.record is not None:
                kept["record"] = self._codec(stage).to_json(result)
            self.folder.save(stage.name, key, kept)
        except RecordError as error:  # of what a plugin brought
            again = f"is made again in each run, for it cannot be stored: {failure_text(error)}"
            sentence = "; ".join(filter(None, (sentence, again)))
        self._record(stage, "made", key, sentence)
        self._end(stage, f"done in {duration_text(time.monotonic() - start)}")

    def _made(self, stage: Stage, tick: Callable[[str, int, int], None]) -> Any:
        with keep_fits(self.folder.fits):
            return stage.make(self.results, tick)


# ---- stages ----------------------------------------------------------------------------------------------------------


class NothingToMake(StudyError):
    """Why what a stage makes is there already, or is not of the law that was found: no failure of the study."""


StageKind = Literal[
    "extraction",
    "record",
    "quality",
    "rupture",
    "identification",
    "temperature",
    "forecast",
    "design",
    "export",
    "report",
]


STAGE_KINDS: tuple[StageKind, ...] = get_args(StageKind)
"""In the order in which they are made, which stands here alone; `creepkit run --only` takes these names.

Strengths take seconds and need no law: whoever has a table of ruptures reads them before laws are identified.
"""


Tick = Callable[[str, int, int], None]


Results = Mapping[str, Any]
"""{name of a stage: its result}."""


@dataclass(frozen=True)
class Stage:
    """One stage.

    kind : what it makes. group : of the tests that it is about, "" for all.
    settings : JSON-able data of all that decides the result beside what it `needs`, names of other stages.
    make : from the results of these, with something to report progress to. record : class of the result, by which a
        file is read; None where the result is made again from identifications that are kept.
    document : what of a result that no record can be read from is written down, as JSON-able data.
    predictor : of identifications that its file holds. file : that an export is written to, "" for other stages.
    remark : what is known beforehand that the result leaves out of account, "" where nothing is.
    answer : a line that is told as soon as the result is there.
    name : of its result, by default that of a stage of which each group has one.
    """

    kind: StageKind
    group: str
    settings: Any
    make: Callable[[Results, Tick], Any]
    record: Any = None
    needs: tuple[str, ...] = ()
    document: Callable[[Any], Any] | None = None
    predictor: Predictor | None = field(default=None, repr=False)
    file: str = ""
    remark: str = ""
    name: str = ""
    answer: Callable[[Any], str] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.name or stage_name(self.kind, self.group))


def stage_name(kind: StageKind, group: str = "") -> str:
    """The name of a stage of which each group has one."""
    return f"{kind} of {group}" if group else kind


def needed_stages(stages: Sequence[Stage], kinds: Sequence[str]) -> set[str]:
    """Names of the stages of some kinds, and of all that these need; stages stand behind those that they need."""
    wanted: set[str] = set()
    for stage in reversed(stages):
        if stage.kind in kinds or stage.name in wanted:
            wanted |= {stage.name, *stage.needs}
    return wanted
