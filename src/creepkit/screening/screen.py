"""screen: the laws of many alloys are identified on all cores; the result of each is kept as soon as it is done.

Laws are ranked, compared with the law without sparsity, and the best one is simulated by the specimen where that is
asked for or in doubt.
"""

from __future__ import annotations

import logging
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, ClassVar

from creepkit.arrays import usable_cores
from creepkit.checked_arguments import checked
from creepkit.errors import SAID, CreepkitError, FitError, HistoryError, restated
from creepkit.files.writing import hashed_stem
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.history_checks import sound_tests
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.predictor_documents import history_text, predictor_fingerprint, short_hash
from creepkit.inverse.reference_conditions import with_arrhenius
from creepkit.inverse.selection.select import select
from creepkit.inverse.settings import IdentificationSettings
from creepkit.jobs.progress import ProgressCallback, duration_text
from creepkit.jobs.worker_pools import ProcessWorkers
from creepkit.jobs.worker_process import TaskResult, run_task
from creepkit.language import CreepLaw
from creepkit.limits import WORKERS
from creepkit.records import History, Predictor
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictors
from creepkit.registry.reading import read_histories
from creepkit.screening.alloys import (
    Alloy,
    Compositions,
    check_tests,
    group_by_alloy,
    limitations,
    resolve_compositions,
)
from creepkit.screening.results import AlloyResult, ScreeningResult, read_result, write_result


def screen_alloy(job: ScreeningJob, alloy: Alloy) -> AlloyResult:
    """The result for one alloy; that it cannot be identified is a result too."""
    start = time.process_time()
    try:
        check_tests(alloy, job.predictor)
        result = _identify_alloy(job, alloy)
    except CreepkitError as error:
        result = AlloyResult(alloy.name, failure=str(error))
    return replace(result, cpu_seconds=time.process_time() - start)


def _identify_alloy(job: ScreeningJob, alloy: Alloy) -> AlloyResult:
    laws = [with_arrhenius(law, alloy.tests) for law in job.laws]
    through = job.surrogate if any(len(law.terms) > 1 for law in laws) else None  # others cost no more without it
    # A plate compares alloys by the same laws; what else might explain one of them is a question for select() itself.
    ranking = select(laws, alloy.tests, job.predictor, settings=job.settings, through=through, sums=False)
    best, notes = ranking.best, list(limitations(alloy, job.predictor))
    dense = None if job.dense_law is None else _fit_dense_law(job, job.dense_law, alloy, notes)
    return AlloyResult(
        alloy.name,
        laws=ranking.laws,
        failed_laws=dict(ranking.failed),
        verdict=ranking.verdict,
        decisive=ranking.decisive,
        equivalents=tuple(str(pair) for pair in ranking.equivalents()),
        dense_fit=dense,
        notes=(*notes, *best.remarks),
    )


def _fit_dense_law(job: ScreeningJob, dense: CreepLaw, alloy: Alloy, notes: list[str]) -> Identification | None:
    """The dense law; a failure of it is a note, for the ranking stands."""
    law = with_arrhenius(dense, alloy.tests)
    try:
        return identify(law, alloy.tests, job.predictor, settings=job.settings, through=job.surrogate)
    except CreepkitError as error:
        notes.append(f"misfit without sparsity is not known: {error}")
        return None


FITS_FOLDER = "fits"
"""The folder of the best identifications, inside that of the results."""


@dataclass(frozen=True)
class ScreeningJob:
    """How each alloy is identified, and the folder in which results are kept.

    predictor, surrogate : `using` and `through` of identify(). dense_law : the law that is compared with the best of
        `laws`, or None.
    """

    alloys: tuple[Alloy, ...]
    laws: tuple[CreepLaw, ...]
    predictor: Predictor
    surrogate: Predictor | None
    settings: IdentificationSettings
    dense_law: CreepLaw | None
    folder: Path
    task_name: ClassVar[str] = "alloy"

    def path(self, number: int) -> Path:
        """The file of an alloy's result: its name where that can be a file name, else with the beginning of a hash."""
        names = [alloy.name for alloy in self.alloys]
        return self.folder / f"{hashed_stem(names[number], 'alloy', names)}.json"

    def fingerprint(self, number: int) -> str:
        """SHA-256, shortened, of the tests of an alloy and of how they are identified."""
        return short_hash("\n".join([self._settings_text, *map(history_text, self.alloys[number].tests)]).encode())

    def on_one_thread(self) -> ScreeningJob:
        """The same with predictors that start no threads."""
        surrogate = None if self.surrogate is None else self.surrogate.single_threaded()
        return replace(self, predictor=self.predictor.single_threaded(), surrogate=surrogate)

    def run(self, number: int) -> TaskResult:
        """Screen an alloy and write its result, and its best identification beside it, which other commands take."""
        result = replace(screen_alloy(self, self.alloys[number]), fingerprint=self.fingerprint(number))
        if result.identified:
            result.best.save(self.path(number).parent / FITS_FOLDER / self.path(number).name)
        write_result(result, self.path(number))
        return TaskResult(number, "done", accepted=int(result.identified))

    @cached_property
    def _settings_text(self) -> str:
        laws = (*self.laws, *([self.dense_law] if self.dense_law is not None else []))
        predictors = (self.predictor, self.surrogate)
        lines = [
            f"creepkit {version('creepkit')}",
            *(f"{law.name} {law.fingerprint} {[(n, p.bounds, p.off) for n, p in law.table.items()]}" for law in laws),
            *("none" if one is None else predictor_fingerprint(one) for one in predictors),
            repr((self.settings, self.dense_law is None)),
        ]
        return "\n".join(lines)


CANDIDATE_LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
"""Laws of Table 1 of Chen et al."""


DENSE_LAW = "combined"
"""The law of Eq. (2), which is identified without sparsity."""


_log = logging.getLogger("creepkit.screening")


@checked
@dataclass(frozen=True)
class ScreeningOptions:
    """How the alloys of a plate are identified.

    settings : of every identification; weights are "automatic" or "likelihood".
    through : a surrogate in which laws of several terms are searched before the predictor gives values (see
        identify()).
    dense : the law whose misfit without sparsity is compared with the best one's (Fig. 7b), None for none.
    """

    settings: IdentificationSettings = field(default_factory=IdentificationSettings)
    through: Predictor | None = None
    dense: CreepLaw | str | None = DENSE_LAW

    def __post_init__(self) -> None:
        self.settings.check_by_likelihood("screen()")


@checked
def screen(
    histories: Sequence[History] | str | Path,
    laws: Sequence[CreepLaw | str] | None = None,
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    compositions: Compositions | str | Path | None = None,
    to: str | Path | None = None,
    options: ScreeningOptions | None = None,
    workers: Annotated[int, WORKERS] | None = None,
    progress: ProgressCallback | None = None,
) -> ScreeningResult:
    """Identify the law of every alloy from its tests, and compare the alloys.

    histories : of all alloys, or a folder of their files. Tests of one alloy are identified together; one that names
        no alloy is an alloy by itself.
    laws : candidates, by default the four of Table 1 of Chen et al.; times an Arrhenius factor where the tests of an
        alloy span several temperatures. using : predictor, by default the specimen that the histories name.
    compositions : table of what the alloys are made of, or its file; classes follow from it.
    to : folder for one JSON file an alloy, in which an interrupted call finds what is done. Alloys whose tests and
        settings are the same as there are not identified again. Its folder `fits` has the best identification of each.
    options : settings, surrogate and law without sparsity.
    workers : processes, by default one for each core; 1 works in this process.
    progress : called as progress(task, done, total, note).

    An alloy that cannot be identified is recorded with the reason, and the others go on.
    """
    tests, composition_table = resolve_tests(histories, compositions), resolve_compositions(compositions)
    options, processes = options or ScreeningOptions(), workers or usable_cores()
    tests, notes = sound_tests(tests, options.settings)
    predictors = resolve_predictors(using, tests)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()) if to is None else to)
        job = ScreeningJob(
            alloys=group_by_alloy(tests),
            laws=_distinct_laws(CANDIDATE_LAWS if laws is None else laws),
            predictor=CompositePredictor.of(predictors),
            surrogate=options.through,
            settings=options.settings,
            dense_law=None if options.dense is None else resolve_law(options.dense),
            folder=folder,
        )
        _make_folder(folder / FITS_FOLDER)
        results = _screen_all(job, processes, progress)
    plate = ScreeningResult.from_results(
        job.alloys, results, job.predictor, composition_table, None if to is None else folder
    )
    return replace(plate, notes=(*notes, *plate.notes))


def resolve_tests(histories: Sequence[History] | str | Path, compositions: object) -> list[History]:
    """The histories, or those in a folder, in which the file of compositions may lie too."""
    if isinstance(histories, (str, Path)):
        table = Path(compositions) if isinstance(compositions, (str, Path)) else None
        return _read_folder(Path(histories).expanduser(), table)
    if not histories:
        raise FitError("there are no histories to screen")
    for name, count in Counter(h.name for h in histories).items():
        if count > 1:
            raise FitError(f"{count} histories are called '{name}'; give each its own name")
    return list(histories)


def _read_folder(folder: Path, compositions_file: Path | None) -> list[History]:
    paths: list[Path] = [folder]
    if folder.is_dir():
        tables = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".csv")
        history_files = [p for p in tables if compositions_file is None or p.resolve() != compositions_file.resolve()]
        if not history_files:
            raise HistoryError(f"{folder}: no CSV file of a history is in it; name the folder that holds them")
        paths = [folder] if len(history_files) == len(tables) else history_files
    return read_histories(paths)


def _distinct_laws(laws_or_names: Sequence[CreepLaw | str]) -> tuple[CreepLaw, ...]:
    """The laws; FitError where there are none, or two of one name."""
    laws = tuple(resolve_law(one) for one in laws_or_names)
    names = Counter(law.name for law in laws)
    if not laws or max(names.values()) > 1:
        problem = f"'{names.most_common(1)[0][0]}' twice" if laws else "none"
        raise FitError(f"laws must be at least one, each with a name of its own; found {problem}")
    return laws


def _make_folder(folder: Path) -> None:
    with restated(OSError, FitError, f"{folder}: cannot be made ({SAID}); name another folder for the results"):
        folder.mkdir(parents=True, exist_ok=True)


def _screen_all(job: ScreeningJob, processes: int, progress: ProgressCallback | None) -> list[AlloyResult]:
    """The results of all alloys, in their order; those that are in the folder are taken from there."""
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
    """The result in the folder, if it is of these tests and settings."""
    path = job.path(number)
    if not path.exists():
        return None
    try:
        result = read_result(path)
    except FitError as error:
        _log.warning("%s", error)
        return None
    return result if result.fingerprint == job.fingerprint(number) else None


def _completed_result(job: ScreeningJob, outcome: TaskResult) -> AlloyResult:
    """The result that a worker left, or why it left none."""
    if outcome.status != "done":
        return AlloyResult(
            job.alloys[outcome.number].name, failure=outcome.text.removeprefix(f"{job.task_name} {outcome.number}: ")
        )
    try:
        return read_result(job.path(outcome.number))
    except FitError as error:
        return AlloyResult(job.alloys[outcome.number].name, failure=str(error))


def _run_job(job: ScreeningJob, pending: Sequence[int], processes: int) -> Iterator[TaskResult]:
    """Each alloy as it is done."""
    if min(processes, len(pending)) <= 1:
        yield from (run_task(job, number) for number in pending)
        return
    with ProcessWorkers(job, min(processes, len(pending))) as workers:
        yield from (future.result() for future in as_completed([workers.submit(number) for number in pending]))
