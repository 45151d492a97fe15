"""screen: the tests of a plate of alloys, alloy after alloy on all cores, kept as they are done."""

from __future__ import annotations

import logging
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

from creepkit.dataset.pace import duration_text
from creepkit.dataset.shards import TaskResult
from creepkit.dataset.worker import run_task
from creepkit.dataset.workers import ProcessWorkers
from creepkit.errors import FitError
from creepkit.inverse.selection.select import SELECTION_FRAMES
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets, check_penalty
from creepkit.language import CreepLaw
from creepkit.plates import files
from creepkit.plates.alloys import group_by_alloy
from creepkit.plates.answer import AlloyResult
from creepkit.plates.compositions import Compositions, resolve_compositions
from creepkit.plates.given import make_folder, resolve_histories, resolve_laws, worker_count, resolve_predictor
from creepkit.plates.plate import Plate
from creepkit.plates.work import FITS_FOLDER, ScreeningJob
from creepkit.records import History, Nuisance, Predictor

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

_log = logging.getLogger("creepkit.plates")


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
