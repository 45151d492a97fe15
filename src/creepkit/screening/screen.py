"""screen: identify the laws of many alloys on all cores; the result of each is kept as soon as it is done."""

from __future__ import annotations

import logging
import os
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

from creepkit import registry
from creepkit.errors import FitError, HistoryError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.selection.select import SELECTION_FRAMES
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets, check_penalty
from creepkit.jobs.shard_progress import duration_text
from creepkit.jobs.worker import TaskResult, run_task
from creepkit.jobs.workers import ProcessWorkers
from creepkit.language import CreepLaw
from creepkit.readers.reading import read_histories
from creepkit.records import History, Nuisance, Predictor
from creepkit.screening import files
from creepkit.screening.alloys import Compositions, group_by_alloy, resolve_compositions
from creepkit.screening.job import FITS_FOLDER, ScreeningJob
from creepkit.screening.results import AlloyResult, Plate


def resolve_histories(histories: Sequence[History] | str | Path, compositions_file: object = None) -> list[History]:
    """The histories, or those in a folder; HistoryError or FitError where there are none.

    beside : the file of compositions, which may lie in the folder too.
    """
    if isinstance(histories, (str, Path)):
        return _read_folder(
            Path(histories).expanduser(),
            Path(compositions_file) if isinstance(compositions_file, (str, Path)) else None,
        )
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


def resolve_predictor(
    predictor: Predictor | str | Mapping[str, Predictor] | None, histories: Sequence[History]
) -> Predictor:
    """The predictor, or those of several specimens as one; by default the specimens that the histories name."""
    if isinstance(predictor, str):
        return registry.default_registry().specimen(predictor)
    if predictor is None:
        specimens = {
            name: registry.default_registry().specimen(name) for name in sorted({h.specimen for h in histories})
        }
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


ScreeningProgress: TypeAlias = Callable[[str, int, int, str], None]
"""Called with a task, alloys done, alloys in all, and a note on the time left."""


CANDIDATE_LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
"""Those of Table 1 of Chen et al."""


DENSE_LAW = "combined"
"""The law of Eq. (2), to be had without sparsity."""


MAX_CRASHES = 2
"""How often an alloy may kill its worker process."""


POLL_INTERVAL = 1.0
"""s between looks at who has died."""


_log = logging.getLogger("creepkit.screening")


def screen(
    histories: Sequence[History] | str | Path,
    laws: Sequence[CreepLaw | str] | None = None,
    using: Predictor | str | Mapping[str, Predictor] | None = None,
    *,
    compositions: Compositions | str | Path | None = None,
    to: str | Path | None = None,
    nuisances: Sequence[Nuisance] | None = None,
    settings: IdentificationSettings | None = None,
    through: Predictor | None = None,
    dense: CreepLaw | str | None = DENSE_LAW,
    penalty: ContributionPenalty | Subsets | None = None,
    confirm: bool | Literal["when in doubt"] = "when in doubt",
    workers: int | None = None,
    progress: ScreeningProgress | None = None,
) -> Plate:
    """Identify the law of every alloy from its tests, and set the alloys side by side.

    histories : of all alloys, or a folder of their files. Tests of one alloy are identified together; one that names
        no alloy is an alloy by itself.
    laws : candidates, by default the four of Table 1 of Chen et al.; times an Arrhenius factor where the tests of an
        alloy span several temperatures. using : predictor, by default the specimen that the histories name; through :
        a surrogate in which laws of several terms are searched before `using` has the last word (see identify()).
    compositions : table of what the alloys are made of, or its file; classes follow from it.
    to : folder for one JSON file an alloy, in which an interrupted call finds what is done. Alloys whose tests and
        settings are the same as there are not identified again. Its folder `fits` has the best identification of each.
    dense : the law whose misfit without sparsity is set against the reduced one's (Fig. 7b), None for none; penalty :
        what makes the reduced one of it, such as Sqrt(); by default it is the best of `laws`.
    confirm : whether the best law is simulated by the specimen itself: True, False, or "when in doubt", that is where
        a surrogate's guard says that its answer lies outside its domain.
    workers : processes, by default one for each core; 1 works in this process.

    An alloy that cannot be identified is recorded with the reason, and the others go on.
    """
    tests, composition_table = resolve_histories(histories, compositions), resolve_compositions(compositions)
    settings = replace(settings or IdentificationSettings(frames=SELECTION_FRAMES), weights="likelihood")
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    if penalty is not None:
        check_penalty(penalty)
        if dense is None:
            raise FitError("a penalty reduces the dense law, and there is none; give dense=, such as 'combined'")
    if confirm not in (True, False, "when in doubt"):
        raise FitError(f'confirm is {confirm!r}; allowed are True, False and "when in doubt"')
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory()) if to is None else to
        job = ScreeningJob(
            alloys=group_by_alloy(tests), laws=resolve_laws(CANDIDATE_LAWS if laws is None else laws), predictor=resolve_predictor(using, tests),
            surrogate=through, settings=settings, dense_law=None if dense is None else resolve_laws([dense])[0],
            penalty=penalty, confirm=confirm, folder=make_folder(Path(folder), FITS_FOLDER),
        )  # fmt: skip
        results = _screen_all(job, worker_count(workers), progress)
    return Plate.from_results(job.alloys, results, job.predictor, composition_table, None if to is None else Path(to))


def _screen_all(job: ScreeningJob, processes: int, progress: ScreeningProgress | None) -> list[AlloyResult]:
    """The answers for all alloys, in their order; those that are in the folder are taken from there."""
    results = {k: stored for k in range(len(job.alloys)) if (stored := _stored_result(job, k)) is not None}
    pending = [k for k in range(len(job.alloys)) if k not in results]
    stored_count, start = len(results), time.monotonic()
    for outcome in _run_job(job, pending, processes):
        results[outcome.number], name = _completed_result(job, outcome), job.alloys[outcome.number].name
        if progress is not None:
            rate = (time.monotonic() - start) / (len(results) - stored_count)
            time_left = f"{duration_text(rate * (len(job.alloys) - len(results)))} left"
            progress("alloys", len(results), len(job.alloys), f"{name} done, {time_left}")
    return [results[k] for k in range(len(job.alloys))]


def _stored_result(job: ScreeningJob, number: int) -> AlloyResult | None:
    """The answer in the folder, if it is one to these tests and settings."""
    path = job.path(number)
    if not path.exists():
        return None
    try:
        result = files.read_result(path)
    except FitError as error:
        _log.warning("%s", error)
        return None
    return result if result.fingerprint == job.fingerprint(number) else None


def _completed_result(job: ScreeningJob, outcome: TaskResult) -> AlloyResult:
    """The answer that a worker left, or why it left none."""
    if outcome.status != "done":
        return AlloyResult(job.alloys[outcome.number].name, failure=outcome.text)
    try:
        return files.read_result(job.path(outcome.number))
    except FitError as error:
        return AlloyResult(job.alloys[outcome.number].name, failure=str(error))


def _run_job(job: ScreeningJob, pending: Sequence[int], processes: int) -> Iterator[TaskResult]:
    """Each alloy as it is done."""
    if min(processes, len(pending)) <= 1:
        yield from (run_task(job, number) for number in pending)
        return
    queue, crashes = list(reversed(pending)), Counter[int]()
    with ProcessWorkers(job, min(processes, len(pending))) as workers:
        remaining = len(pending)
        while remaining:
            while workers.free_slots and queue:
                workers.submit(queue.pop())
            for outcome in workers.results(POLL_INTERVAL):
                crashes[outcome.number] += outcome.status == "died"
                if outcome.status == "died" and crashes[outcome.number] < MAX_CRASHES:
                    queue.append(outcome.number)
                    continue
                remaining -= 1
                yield _explained(outcome)


def _explained(outcome: TaskResult) -> TaskResult:
    if outcome.status != "died":
        return outcome
    text = f"its worker process died {MAX_CRASHES} times, the last time by {outcome.text}; is there memory enough?"
    return replace(outcome, text=text)
