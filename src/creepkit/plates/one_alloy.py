"""One alloy screened: its laws ranked, set against the law without sparsity, and confirmed where that is in doubt."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError
from creepkit.inverse.confirm import Confirmation, confirm, outside_domain
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.equivalence import equivalent_laws
from creepkit.inverse.selection.select import select
from creepkit.inverse.sparsity.sparse import identify_full, identify_reduced
from creepkit.inverse.warmth import with_arrhenius
from creepkit.language import CreepLaw
from creepkit.plates.alloys import Alloy, check_tests, limitations
from creepkit.plates.answer import AlloyResult, PredictedOutputs, WeightedLaw
from creepkit.plates.predictors import underlying_specimen
from creepkit.records import History, Predictor

if TYPE_CHECKING:
    from creepkit.plates.work import ScreeningJob


def screen_alloy(job: ScreeningJob, alloy: Alloy) -> AlloyResult:
    """The answer for one alloy; what is wrong with it is an answer too."""
    start = time.process_time()
    try:
        check_tests(alloy, job.predictor)
        result = _identify_alloy(job, alloy)
    except CreepkitError as error:
        result = AlloyResult(alloy.name, failure=str(error))
    return replace(result, cpu_seconds=time.process_time() - start)


def _identify_alloy(job: ScreeningJob, alloy: Alloy) -> AlloyResult:
    laws = [with_arrhenius(law, alloy.tests) for law in job.laws]
    ranking = select(laws, alloy.tests, job.predictor, settings=job.settings, through=_surrogate_for(job, laws))
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
        equivalents=tuple(str(pair) for pair in equivalent_laws(ranking)),
        dense_fit=dense,
        sparse_fit=sparse,
        confirmation=confirmation,
        predicted=_predict_tests(best, alloy.tests, predictor),
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
        test.name: {name: prediction.of(k)[:, prediction.outputs.index(name)] for name in prediction.outputs if name in test.outputs}
        for k, test in enumerate(tests)
    }
