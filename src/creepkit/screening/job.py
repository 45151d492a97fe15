"""ScreeningJob: how each alloy is identified, as it is sent to worker processes, and the screening of one alloy.

Laws are ranked, compared with the law without sparsity, and the best one is simulated by the specimen where that is
asked for or in doubt.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import ClassVar

from creepkit.errors import CreepkitError
from creepkit.files.file_names import hashed_stem
from creepkit.inverse.composite_predictor import predictor_for_law, underlying_specimen
from creepkit.inverse.confirmation import Confirmation, confirm, outside_domain
from creepkit.inverse.fingerprints import history_text, predictor_fingerprint, short_hash, single_threaded
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.reference_conditions import with_arrhenius
from creepkit.inverse.selection.discrimination import equivalent_laws
from creepkit.inverse.selection.select import select
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets
from creepkit.inverse.sparsity.term_selection import identify_full, identify_reduced
from creepkit.jobs.worker_process import TaskResult
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor
from creepkit.screening import files
from creepkit.screening.alloys import Alloy, check_tests, limitations
from creepkit.screening.results import AlloyResult, PredictedOutputs, WeightedLaw


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
    through = _surrogate_for(job, laws)
    # A plate compares alloys by the same laws; what else might explain one of them is a question for select() itself.
    ranking = select(laws, alloy.tests, job.predictor, settings=job.settings, through=through, sums=False)
    best, notes = ranking.best, list(limitations(alloy, job.predictor))
    dense = sparse = None
    if job.dense_law is not None:
        dense, sparse = _fit_dense_law(job, job.dense_law, alloy, notes)
    confirmation = _confirm_best(job, best, alloy, notes)
    predictor = job.predictor if confirmation is None else underlying_specimen(job.predictor)
    return AlloyResult(
        alloy.name,
        laws=tuple(WeightedLaw(r.fit, r.excess, r.weight) for r in ranking.laws),
        failed_laws=dict(ranking.failed),
        verdict=ranking.verdict,
        decisive=ranking.decisive,
        equivalents=tuple(str(pair) for pair in equivalent_laws(ranking)),
        dense_fit=dense,
        sparse_fit=sparse,
        confirmation=confirmation,
        predicted=_predict_tests(best, alloy.tests, predictor_for_law(predictor, best.law)),
        notes=(*notes, *best.notes),
    )


def _surrogate_for(job: ScreeningJob, laws: Sequence[CreepLaw]) -> Predictor | None:
    """The surrogate, where a law has several terms: those of one cost no more without it."""
    return job.surrogate if any(len(law.terms) > 1 for law in laws) else None


def _fit_dense_law(
    job: ScreeningJob, dense: CreepLaw, alloy: Alloy, notes: list[str]
) -> tuple[Identification | None, Identification | None]:
    """The dense law, and what a penalty makes of it; a failure of these is a note, for the ranking stands."""
    law, settings = with_arrhenius(dense, alloy.tests), job.settings
    try:
        if job.penalty is None:
            return identify(law, alloy.tests, job.predictor, settings=settings, through=job.surrogate), None
        dense_fit, reductions = identify_full(law, alloy.tests, job.predictor, job.surrogate, settings, None)
        return dense_fit, identify_reduced(job.penalty, dense_fit, reductions)
    except CreepkitError as error:
        notes.append(f"misfit without sparsity is not known: {error}")
        return None, None


def _confirm_best(job: ScreeningJob, best: Identification, alloy: Alloy, notes: list[str]) -> Confirmation | None:
    """The finite element run of the best law, where it is asked for or in doubt; that it failed is a note."""
    if job.confirm is False or (job.confirm is not True and not outside_domain(best)):
        return None
    try:
        return confirm(best, alloy.tests, underlying_specimen(job.predictor))
    except CreepkitError as error:
        notes.append(f"not confirmed: {error}")
        return None


def _predict_tests(best: Identification, tests: Sequence[History], predictor: Predictor) -> dict[str, PredictedOutputs]:
    prediction = best.predict(tests, predictor)
    return {
        test.name: {
            name: prediction.of(k)[:, prediction.outputs.index(name)]
            for name in prediction.outputs
            if name in test.outputs
        }
        for k, test in enumerate(tests)
    }


FITS_FOLDER = "fits"
"""The folder of the best identifications, inside that of the results."""


@dataclass(frozen=True)
class ScreeningJob:
    """How each alloy is identified, and the folder in which results are kept.

    predictor, surrogate : `using` and `through` of identify(). dense_law : the law that is compared with the reduced
        one, or None; penalty : what reduces it, else the best of `laws` is taken.
    confirm : True, False or "when in doubt".
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
        """The file of an alloy's result: its name where that can be a file name, else with the beginning of a hash."""
        names = [alloy.name for alloy in self.alloys]
        return self.folder / f"{hashed_stem(names[number], 'alloy', names)}.json"

    def fingerprint(self, number: int) -> str:
        """SHA-256, shortened, of the tests of an alloy and of how they are identified."""
        return short_hash("\n".join([self._settings_text, *map(history_text, self.alloys[number].tests)]).encode())

    def on_one_thread(self) -> ScreeningJob:
        """The same with predictors that start no threads."""
        surrogate = None if self.surrogate is None else single_threaded(self.surrogate)
        return replace(self, predictor=single_threaded(self.predictor), surrogate=surrogate)

    def run(self, number: int) -> TaskResult:
        """Screen an alloy and write its result, and its best identification beside it, which other commands take."""
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
