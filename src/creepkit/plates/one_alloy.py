"""One alloy screened: its laws ranked, set against the law without sparsity, and confirmed where that is in doubt."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError
from creepkit.inverse.confirm import Confirmation, confirm, doubtful
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.equivalence import equivalents
from creepkit.inverse.selection.select import select
from creepkit.inverse.sparsity.sparse import opened, reduced_by
from creepkit.inverse.warmth import with_arrhenius
from creepkit.language import CreepLaw
from creepkit.plates.alloys import Alloy, check, remarks
from creepkit.plates.answer import AlloyAnswer, Outputs, Weighed
from creepkit.plates.predictors import specimen_behind
from creepkit.records import History, Predictor

if TYPE_CHECKING:
    from creepkit.plates.work import Screening


def screened(work: Screening, alloy: Alloy) -> AlloyAnswer:
    """The answer for one alloy; what is wrong with it is an answer too."""
    began = time.process_time()
    try:
        check(alloy, work.using)
        answer = _identified(work, alloy)
    except CreepkitError as error:
        answer = AlloyAnswer(alloy.name, reason=str(error))
    return replace(answer, seconds=time.process_time() - began)


def _identified(work: Screening, alloy: Alloy) -> AlloyAnswer:
    laws = [with_arrhenius(law, alloy.tests) for law in work.laws]
    ranking = select(laws, alloy.tests, work.using, settings=work.settings, through=_through(work, laws))
    best, found = ranking.best, list(remarks(alloy, work.using))
    dense = sparse = None
    if work.dense is not None:
        dense, sparse = _without_sparsity(work, work.dense, alloy, found)
    confirmation = _confirmed(work, best, alloy, found)
    predictor = work.using if confirmation is None else specimen_behind(work.using)
    return AlloyAnswer(
        alloy.name,
        laws=tuple(Weighed(r.fit, r.excess, r.weight) for r in ranking.laws),
        failed=dict(ranking.failed),
        verdict=ranking.verdict,
        equivalents=tuple(str(pair) for pair in equivalents(ranking)),
        dense=dense,
        sparse=sparse,
        confirmation=confirmation,
        predicted=_predicted(best, alloy.tests, predictor),
        notes=(*found, *best.notes),
    )


def _through(work: Screening, laws: Sequence[CreepLaw]) -> Predictor | None:
    """The surrogate, where a law has several terms: those of one cost no more without it."""
    return work.through if any(len(law.terms) > 1 for law in laws) else None


def _without_sparsity(
    work: Screening, dense: CreepLaw, alloy: Alloy, found: list[str]
) -> tuple[Identification | None, Identification | None]:
    """The dense law, and what a penalty makes of it; a failure of these is a note, for the ranking stands."""
    law, settings = with_arrhenius(dense, alloy.tests), work.settings
    try:
        if work.penalty is None:
            return identify(law, alloy.tests, work.using, settings=settings, through=work.through), None
        whole, reductions = opened(law, alloy.tests, work.using, work.through, settings, None)
        return whole, reduced_by(work.penalty, whole, reductions)
    except CreepkitError as error:
        found.append(f"misfit without sparsity is not known: {error}")
        return None, None


def _confirmed(work: Screening, best: Identification, alloy: Alloy, found: list[str]) -> Confirmation | None:
    """The finite element run of the best law, where it is asked for or in doubt; that it failed is a note."""
    if work.confirm is False or (work.confirm is not True and not doubtful(best)):
        return None
    try:
        return confirm(best, alloy.tests, specimen_behind(work.using))
    except CreepkitError as error:
        found.append(f"not confirmed: {error}")
        return None


def _predicted(best: Identification, tests: Sequence[History], using: Predictor) -> dict[str, Outputs]:
    found = best.predict(tests, using)
    return {
        test.name: {name: found.of(k)[:, found.outputs.index(name)] for name in found.outputs if name in test.outputs}
        for k, test in enumerate(tests)
    }
