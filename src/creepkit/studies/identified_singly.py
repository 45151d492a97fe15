"""Identification of several laws otherwise than by their likelihood, and the searches and penalties that files name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.inverse.search_options import SearchOptions
from creepkit.studies.model import IdentificationPart

if TYPE_CHECKING:
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw
    from creepkit.records import History, Predictor


def search_of(part: IdentificationPart) -> tuple[Any, Any]:
    """The search and the penalty of an identification, None for the default and for none."""
    how = SearchOptions(part.search, part.penalty)
    return how.global_search, how.term_penalty


def identified_laws(
    laws: Sequence[CreepLaw],
    tests: list[History],
    using: Predictor | None,
    settings: IdentificationSettings,
    how: tuple[Any, Any],
    tick: Callable[[str, int, int], None],
) -> Ranking:
    """Each law identified by itself, and all ranked. how : search and penalty."""
    import creepkit as ck
    from creepkit.inverse.rupture_use import common_rupture_times

    fits, (search, penalty) = [], how
    settings = common_rupture_times(laws, settings)
    for k, law in enumerate(laws, start=1):

        def of_law(
            task: str, done: int, total: int, named: str = f"{k} of {len(laws)}: {law.title or law.name}"
        ) -> None:
            tick(f"law {named}, {task}", done, total)

        fits.append(ck.identify(law, tests, using, search=search, penalty=penalty, settings=settings, progress=of_law))
    return ck.rank(fits)
