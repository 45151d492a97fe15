"""Candidate laws fitted to tests and ranked, as commands and studies ask for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.inverse.search_options import SearchOptions
    from creepkit.inverse.selection import Ranking
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw
    from creepkit.records import History


def by_likelihood(asked: SearchOptions, changes: Mapping[str, Any]) -> bool:
    """Whether laws are compared by their likelihood: no search, penalty or weights ask for something else.

    changes : fields of the settings that are stated.
    """
    from creepkit.inverse.settings import IdentificationSettings

    weights = IdentificationSettings().changed({"weights": changes.get("weights")})
    return asked.global_search is None and asked.penalty is None and weights.by_likelihood


def ranked_candidates(
    laws: Sequence[CreepLaw],
    tests: Sequence[History],
    using: Any,
    asked: SearchOptions,
    changes: Mapping[str, Any],
    *,
    compared: bool,
    progress: Callable[[str, int, int], None],
    settings: IdentificationSettings | None = None,
    **options: Any,
) -> Ranking:
    """Several laws compared as by select(), where likelihood compares them; else each as by identify(), and ranked.

    changes : fields of the settings that are stated. compared : whether a single law is compared, with sums or others.
    options : further ones of both verbs, such as `through`.
    """
    import creepkit as ck
    from creepkit.inverse.compared_tests import common_rupture_times

    if by_likelihood(asked, changes) and (len(laws) > 1 or compared):
        return ck.select(
            laws, tests, using, sums=asked.sums, by=asked.by, settings=settings, progress=progress, **options, **changes
        )
    base = settings or ck.IdentificationSettings()
    ends = common_rupture_times(laws, base.changed({"rupture_times": changes.get("rupture_times")})).rupture_times
    options |= {**changes, "rupture_times": ends, "search": asked.global_search, "penalty": asked.penalty}
    fits = []
    for k, law in enumerate(laws, start=1):
        place = f"law {k} of {len(laws)}: {law.title or law.name}"

        def of_law(task: str, done: int, total: int, place: str = place) -> None:
            progress(f"{place}, {task}", done, total)

        fits.append(ck.identify(law, tests, using, settings=settings, progress=of_law, **options))
    return ck.rank(fits)
