"""Candidate laws fitted to tests and ranked, as commands and studies ask for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.inverse.candidate_laws import SearchOptions
    from creepkit.inverse.selection import Ranking
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw
    from creepkit.records import History


def by_likelihood(asked: SearchOptions, settings: IdentificationSettings) -> bool:
    """Whether laws are compared by their likelihood: no penalty or weights ask for something else."""
    return asked.penalty is None and settings.by_likelihood


def ranked_candidates(
    laws: Sequence[CreepLaw],
    tests: Sequence[History],
    using: Any,
    asked: SearchOptions,
    settings: IdentificationSettings,
    *,
    compared: bool,
    progress: Callable[[str, int, int], None],
    **options: Any,
) -> Ranking:
    """Several laws compared as by select(), where likelihood compares them; else each as by identify(), and ranked.

    compared : whether a single law is compared, with sums or others. options : further ones of both verbs, such as
    `through`.
    """
    import creepkit as ck
    from creepkit.inverse.compared_tests import common_rupture_times

    if by_likelihood(asked, settings) and (len(laws) > 1 or compared):
        return ck.select(laws, tests, using, sums=asked.sums, settings=settings, progress=progress, **options)
    options |= {"settings": common_rupture_times(laws, settings), "penalty": asked.penalty}
    fits = []
    for k, law in enumerate(laws, start=1):
        place = f"law {k} of {len(laws)}: {law.title or law.name}"

        def of_law(task: str, done: int, total: int, place: str = place) -> None:
            progress(f"{place}, {task}", done, total)

        fits.append(ck.identify(law, tests, using, progress=of_law, **options))
    return ck.rank(fits)
