"""Carrying out stages: what was made before from the same inputs is read, the rest is made and kept."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from creepkit.errors import CreepkitError, StudyError
from creepkit.files.locking import locked
from creepkit.files.record_codec import RecordError, record_to_json
from creepkit.files.writing import check_folder_target
from creepkit.inverse.kept_fits import COMPUTING, keep_fits
from creepkit.jobs.shard_progress import ProgressCallback, duration_text, series_of_task
from creepkit.records import History
from creepkit.reports.contents import ExportedFile, StageFailure
from creepkit.studies.documents import (
    FITS_FOLDER,
    IDENTIFIED_FOLDER,
    ResultCodec,
    ResultFolder,
    digest_of_result,
    key_of,
)
from creepkit.studies.stage import Stage

RUNNING_LOCK = "running.lock"


CHANGED = "was made again, for what was kept of it had been changed since it was written"


MOST_NAMED = 6
"""Stages that a sentence names."""


_log = logging.getLogger("creepkit.studies")


@dataclass(frozen=True)
class StageRecord:
    """How a stage of a run ended.

    name, kind, group : of the stage. state : "made", "kept" from an earlier run, "failed", or "left out" where it was
    not asked for. key : hash of all that decides its result. sentence : why it failed, cannot be kept, or was made
    again. numbers : of its result, and sha256 : of all of it, "" where there is none, which study.lock records.
    needs : the stages that it was made from.
    """

    name: str
    kind: str
    group: str
    state: Literal["made", "kept", "failed", "left out"]
    key: str
    sentence: str = ""
    numbers: Mapping[str, Any] = field(default_factory=dict, repr=False)
    sha256: str = ""
    needs: tuple[str, ...] = ()


class LazyResults:
    """{name of a stage: its result}; what a file holds is read when it is asked for."""

    def __init__(self) -> None:
        self._makers: dict[str, Callable[[], Any]] = {}
        self._values: dict[str, Any] = {}

    def set(self, name: str, value: Any) -> None:
        """Keep a result."""
        self._values[name] = value

    def defer(self, name: str, make: Callable[[], Any]) -> None:
        """Read, or make, a result when it is asked for first."""
        self._makers[name] = make

    def __contains__(self, name: object) -> bool:
        return name in self._values or name in self._makers

    def __getitem__(self, name: str) -> Any:
        if name not in self._values:
            self._values[name] = self._makers[name]()
        return self._values[name]


@contextmanager
def running_alone(folder: Path) -> Iterator[None]:
    """StudyError where another process is carrying out the same study; the system frees the lock of one that dies."""
    for one in (folder, folder / FITS_FOLDER, folder / IDENTIFIED_FOLDER):
        if one.is_symlink():
            raise StudyError(f"{one}: is a link, and results are kept in a folder of the study's own; remove the link")
    check_folder_target(folder, StudyError)
    with ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            held = stack.enter_context(locked(folder / RUNNING_LOCK))
        except OSError as error:
            raise StudyError(
                f"{folder}: results cannot be kept there ({error.strerror}); remove what stands in their place, or "
                "name another folder by --to"
            ) from None
        if not held:
            raise StudyError(f"{folder}: another process is carrying out this study; wait for it, or end it")
        yield


@dataclass
class Execution:
    """One run over the stages of a study.

    folder : of kept results. histories : the tests. asked : keys of the identifications that the stages rest on.
    progress : called as progress(task, done, total, note). documents : {stage: what was written of its result}.
    stated : {stage: what study.lock says of it}. locked : StudyError for a kept result that is not that of the lock.
    digests : {stage: hash of its result}.
    """

    folder: ResultFolder
    histories: Sequence[History]
    progress: ProgressCallback | None = None
    asked: set[str] = field(default_factory=set)
    records: list[StageRecord] = field(default_factory=list)
    results: Any = field(default_factory=LazyResults)
    documents: dict[str, Any] = field(default_factory=dict)
    stated: Mapping[str, Any] = field(default_factory=dict)
    locked: bool = False
    digests: dict[str, str] = field(default_factory=dict)

    @property
    def failures(self) -> tuple[StageFailure, ...]:
        """Stages that failed, with their reasons."""
        return tuple(StageFailure(one.name, one.sentence) for one in self.records if one.state == "failed")

    def run(self, stages: Sequence[Stage], wanted: Collection[str], *, read_others: bool = False) -> None:
        """Carry out the stages of these names, each behind those that it needs.

        read_others : whether results of other stages, where they are kept of the same inputs, are read for a report.
        A KeyboardInterrupt says which stages are kept.
        """
        try:
            self._run(stages, wanted, read_others=read_others)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(self._kept_sentence(stages, wanted)) from None

    def _kept_sentence(self, stages: Sequence[Stage], wanted: Collection[str]) -> str:
        """Half a sentence on what an interrupted run leaves."""
        kept = [one.name for one in self.records if one.state in ("made", "kept")]
        ended = {one.name for one in self.records}
        left = [stage.name for stage in stages if stage.name in wanted and stage.name not in ended]
        named = f"kept: {_listed(kept)}" if kept else "no stage was finished, laws that are fitted are kept"
        return f"{named}; the same command goes on with {left[0] if left else 'the report'}"

    def _run(self, stages: Sequence[Stage], wanted: Collection[str], *, read_others: bool) -> None:
        for number, stage in enumerate(stages, 1):
            key = self._key(stage)
            if stage.name not in wanted:
                kept = self._read(stage, key) if read_others and all(n in self.results for n in stage.needs) else None
                if kept is not None:
                    self._record(stage, "kept", key, "was not asked for; the report shows what was kept of it", kept)
                    continue
                lacking = "was not asked for, and nothing of these inputs is kept: the report lacks it"
                self._record(stage, "left out", key, lacking if read_others else "")
                self._note_unread(stage, key)
                continue
            failed = [name for name in stage.needs if name not in self.results]
            if failed:
                self._record(stage, "failed", key, f"{failed[0]} failed, which it needs")
                continue
            self._report(stage, 0, 1, f"stage {number} of {len(stages)}")
            numbers = self._read(stage, key)
            if numbers is not None:
                self._record(stage, "kept", key, numbers=numbers)
                self._report(stage, 1, 1, "kept from before")
                continue
            remark = CHANGED if self.folder.is_altered(stage.name, readable=self._data(stage, key) is not None) else ""
            self._make(stage, key, remark)

    def _key(self, stage: Stage) -> str:
        keys = {one.name: one.key for one in self.records}
        needs = [keys.get(name, "") for name in stage.needs]
        versions = {name: version(name) for name in COMPUTING}
        return key_of({"kind": stage.kind, "settings": stage.settings, "needs": needs, "versions": versions})

    def _record(
        self, stage: Stage, state: Any, key: str, sentence: str = "", numbers: Mapping[str, Any] | None = None
    ) -> None:
        sha256 = self.digests.get(stage.name, "")
        if state in ("made", "kept"):
            sentence = "; ".join(filter(None, (stage.remark, sentence)))
        self.records.append(
            StageRecord(stage.name, stage.kind, stage.group, state, key, sentence, numbers or {}, sha256, stage.needs)
        )

    def _report(self, stage: Stage, done: int, total: int, note: str) -> None:
        if self.progress is not None:
            self.progress(stage.name, done, total, note)

    def _codec(self, stage: Stage) -> Any:
        return ResultCodec(self.histories, stage.predictor).codec

    def _read(self, stage: Stage, key: str) -> dict[str, Any] | None:
        """The numbers of a result of this key, None where there is none.

        A record is read at once, for its file may be damaged; what is no record is made again when it is asked for.
        """
        data = self._data(stage, key)
        if self._is_altered(stage, key, data) or data is None:
            return None
        numbers: dict[str, Any] = data["numbers"]
        self._note_fits(data)
        self.digests[stage.name] = digest_of_result(data)
        if stage.document is not None:
            self.documents[stage.name] = data.get("document")
        if stage.record is None:
            self.results.defer(stage.name, lambda: self._made(stage, _no_tick))
            return numbers
        try:
            result = self._codec(stage).from_json(stage.record, data["record"])
            if isinstance(result, ExportedFile):
                _check_export(stage, result)
            numbers = _numbers_of(stage, result)  # not those of the file, which anybody may have written
        except (CreepkitError, KeyError, AttributeError, TypeError, ValueError, ArithmeticError, AssertionError):
            return None
        self.results.set(stage.name, result)
        return numbers

    def _data(self, stage: Stage, key: str) -> dict[str, Any] | None:
        """What the file of a stage holds, where it was made of what its needs are now."""
        data = self.folder.load(stage.name, self._content_key(stage, key))
        return data if isinstance(data, dict) and isinstance(data.get("numbers"), dict) else None

    def _content_key(self, stage: Stage, key: str) -> str:
        """Hash of all that decides a result, the results that it is made from included."""
        return key_of({"key": key, "needs": [self.digests.get(name, "") for name in stage.needs]})

    def _is_altered(self, stage: Stage, key: str, data: dict[str, Any] | None) -> bool:
        """Whether a kept result is not the one that was written; under --locked, StudyError for that."""
        known = self.stated.get(stage.name)
        known = known if isinstance(known, dict) and known.get("key") == key else {}
        stated = known.get("sha256") if data is not None else None
        same = data is not None and stated is not None and digest_of_result(data) == stated
        altered = not same and self.folder.is_altered(stage.name, readable=data is not None)
        if self.locked and (altered or (stated is not None and not same)):
            raise StudyError(
                f"{self.folder.path(stage.name)}: the study cannot be repeated exactly: what was kept of {stage.name} "
                "is not what study.lock states; leave --locked out, and it is made again"
            )
        return altered

    def _note_unread(self, stage: Stage, key: str) -> None:
        """Note what the result of a stage that was not asked for rests on, and its hash for those made from it."""
        data = self._data(stage, key)
        if data is not None:
            self._note_fits(data)
            self.digests[stage.name] = digest_of_result(data)

    def _note_fits(self, data: Any) -> None:
        """Note the identifications that a kept result was made from."""
        keys = data.get("fits") if isinstance(data, dict) else None
        self.asked.update(str(key) for key in (keys if isinstance(keys, list) else ()))

    def _make(self, stage: Stage, key: str, remark: str) -> None:
        start = time.monotonic()
        begun: dict[str, float] = {}

        def tick(task: str, done: int, total: int) -> None:
            series = series_of_task(task)[0]
            elapsed = time.monotonic() - begun.setdefault(series, start if not begun else time.monotonic())
            left = (
                f", {duration_text(elapsed / done * (total - done))} left" if elapsed > 0 and 0 < done < total else ""
            )
            self._report(stage, min(done, total), total, f"{task}{left}")

        self.digests.pop(stage.name, None)
        fits: list[str] = []
        altered: list[int] = []
        try:
            result = self._made(stage, tick, fits, altered)
        except Exception as error:  # of a plugin, too: the other stages go on
            what = str(error) if isinstance(error, CreepkitError) else f"{type(error).__name__}: {error}"
            _log.debug("%s failed", stage.name, exc_info=error)
            self._record(stage, "failed", key, " ".join(what.split()))
            self._report(stage, 1, 1, "failed")
            return
        if getattr(result, "interrupted", False):  # by Ctrl-C, with the best so far, which is not the result
            raise KeyboardInterrupt
        self.results.set(stage.name, result)
        numbers = _numbers_of(stage, result)
        if sum(altered):
            remark = CHANGED
        kept: dict[str, Any] = {"numbers": numbers}
        try:
            record = {} if stage.record is None else {"record": self._codec(stage).to_json(result)}
            if stage.document is not None:
                self.documents[stage.name] = record["document"] = stage.document(result)
            kept |= record
            self.folder.save(stage.name, self._content_key(stage, key), {**kept, "fits": fits})
        except RecordError as error:  # of what a plugin brought
            remark = f"is made again in each run, for it cannot be stored: {' '.join(str(error).split())}"
        self.digests[stage.name] = digest_of_result(kept)
        self._record(stage, "made", key, remark, numbers)
        self._report(stage, 1, 1, f"done in {duration_text(time.monotonic() - start)}")

    def _made(
        self,
        stage: Stage,
        tick: Callable[[str, int, int], None],
        fits: list[str] | None = None,
        altered: list[int] | None = None,
    ) -> Any:
        """The result. fits : to which the keys of the identifications that it rests on are added.

        altered : to which the number of kept identifications is added that were not as they were written.
        """
        with keep_fits(self.folder.fits) as kept:
            try:
                return stage.make(self.results, tick)
            finally:
                keys = list(dict.fromkeys(kept.keys))
                self.asked.update(keys)
                if fits is not None:
                    fits += keys
                if altered is not None:
                    altered.append(kept.altered)


def _numbers_of(stage: Stage, result: Any) -> dict[str, Any]:
    """The numbers of a result by name, as JSON holds them."""
    numbers: dict[str, Any] = record_to_json(dict(stage.numbers(result)))
    return numbers


def _listed(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _check_export(stage: Stage, export: ExportedFile) -> None:
    """ValueError for a kept export that is not the file that the study names."""
    export.text.encode()
    if export.name != stage.file:
        raise ValueError("another file")


def _no_tick(task: str, done: int, total: int) -> None:
    """Progress of what is only read again."""
