"""identify() and select() as users call them: names resolved, tests checked, and notes of what was left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal, Unpack

from creepkit.checked_arguments import checked
from creepkit.inverse.composite_predictor import through_for_law
from creepkit.inverse.history_checks import length_notes, loading_notes, rig_notes, sound_tests
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify as identify_law
from creepkit.inverse.identify import sampled_where_needed
from creepkit.inverse.nuisance_parameters import check_nuisance_tests
from creepkit.inverse.selection import Ranking
from creepkit.inverse.selection.select import select as select_law
from creepkit.inverse.selection.select import with_hold_tried
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.term_selection import identify_sparse
from creepkit.language import CreepLaw
from creepkit.options import takes_options
from creepkit.records import History, Predictor
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictors

if TYPE_CHECKING:
    from creepkit.option_keywords import IdentificationSettingsKeywords

Through = Annotated[Predictor, "a predictor such as ck.surrogate('dimple')"] | Literal["auto"] | None


@takes_options(IdentificationSettings)
@checked
def identify(
    law: CreepLaw | str,
    histories: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    penalty: Literal["l2", "subsets"] | None = None,
    through: Through = "auto",
    settings: IdentificationSettings | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    **changes: Unpack[IdentificationSettingsKeywords],
) -> Identification:
    """Identify the parameters of a law from all histories at once, with 95 % intervals.

    law : a law or its name; using : a specimen (or its name) or any predictor, or {specimen: predictor}; by default
        the specimens that the histories name.
    penalty : which terms of a sum are kept: "subsets", the set of most evidence, or "l2", the paper's norm of their
        contributions. Those left out stand in `sparsity` of the result, and its law is the one that remains.
    through : a cheaper predictor in which the minima of the search are refined before `using` (finite elements) gives
        values and intervals; "auto" takes the reduced-order model of `using` where that states its own error.
        A surrogate that does not know the class of the law is replaced by its specimen, and a note says so.
    settings : what is minimised, nuisance parameters, starts, seed, frames, and whether suspect frames
        are left out. changes : single fields of it, see IdentificationSettings:
        starts=4, nuisances=["offset", Nuisance("rate", sd=0.1)], weights="likelihood".
    """
    law, predictor = resolve_law(law), resolve_predictors(using, histories)
    settings = (settings or IdentificationSettings()).changed(changes, predictor)
    histories, notes = _checked_tests(histories, predictor, settings)
    surrogate = _resolve_through(through, predictor)
    if through == "auto":
        surrogate = through_for_law(surrogate, law)
    how: dict[str, Any] = {"settings": settings, "through": surrogate, "progress": progress}
    if penalty is None:
        fit = identify_law(law, histories, predictor, **how)
    else:
        fit = identify_sparse(law, histories, predictor, penalty=penalty, **how)
    fit = with_hold_tried(sampled_where_needed(fit, surrogate))
    return replace(fit, notes=(*fit.notes, *notes))


@takes_options(IdentificationSettings)
@checked
def select(
    laws: Sequence[CreepLaw | str],
    histories: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    through: Through = "auto",
    sums: bool | None = None,
    settings: IdentificationSettings | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    **changes: Unpack[IdentificationSettingsKeywords],
) -> Ranking:
    """Identify several laws from the same histories by likelihood, and rank them by how well they explain these.

    laws : candidates; sums : also sums of two of them: True, False, or None, with which sums of the best law and then
        richer registered laws are tried where none explains the tests to their noise, at most `further_laws` of them.
    The result is a set of laws with weights, and a verdict: "decisive" only where one law of those asked for explains
    the tests, has 95 % of the weight, and nothing that the tests allow stands against it.
    using, through, settings, changes : as for identify(); weights are "automatic" or "likelihood".
    """
    predictor = resolve_predictors(using, histories)
    settings = (settings or IdentificationSettings()).changed(changes, predictor)
    settings.check_by_likelihood("select()")
    histories, notes = _checked_tests(histories, predictor, settings)
    ranking = select_law(
        [resolve_law(law) for law in ((laws,) if isinstance(laws, str) else laws)],
        histories,
        predictor,
        settings=settings,
        through=_resolve_through(through, predictor),
        sums=sums,
        progress=progress,
    )
    noted = (replace(one, fit=replace(one.fit, notes=(*one.fit.notes, *notes))) for one in ranking.laws)
    return replace(ranking, laws=tuple(noted))


def _checked_tests(
    histories: Sequence[History], predictor: Predictor | Mapping[str, Predictor], settings: IdentificationSettings
) -> tuple[list[History], tuple[str, ...]]:
    """The tests that count, and notes on them; FitError where a nuisance names another test."""
    tests, left_out = sound_tests(list(histories), settings)
    check_nuisance_tests(settings.nuisances, [h.name for h in tests])
    notes = (*left_out, *length_notes(tests, predictor), *loading_notes(tests), *rig_notes(tests, settings))
    return tests, notes


def _resolve_through(through: Through, predictor: Predictor | Mapping[str, Predictor]) -> Predictor | None:
    """The predictor given; or the reduced-order model of the specimen, where it states how accurate it is."""
    if not isinstance(through, str):
        return through
    reduced = None if isinstance(predictor, Mapping) else predictor.reduced_order_model()
    return reduced if reduced is not None and reduced.error else None
