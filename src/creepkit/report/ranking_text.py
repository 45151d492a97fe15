"""A ranking of laws as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from creepkit.inverse.selection.discrimination import EquivalentLaws
    from creepkit.inverse.selection.ranking import Ranking


_CRITERION_NAMES = {"bic": "BIC", "aicc": "AICc", "hold-out": "hold-out"}


def ranking_text(ranking: Ranking) -> str:
    """The verdict, then a line for each law."""
    width = max(len(r.fit.law.name) for r in ranking.laws)
    header = f"{'law':{width}}   weight  {_CRITERION_NAMES[ranking.criterion]} - best  chi-square"
    rows = [f"{r.fit.law.name:{width}}   {r.weight:6.3f}  {r.excess:10.1f}  {r.chi_square:10.1f}" for r in ranking.laws]
    failed = [f"{name}: {reason}" for name, reason in ranking.failed.items()]
    equivalent = [] if ranking.decisive else [f"- {pair}" for pair in _equivalents_among_remaining(ranking)]
    return "\n".join([ranking.verdict, *equivalent, "", header, *rows, *failed])


def _equivalents_among_remaining(ranking: Ranking) -> list[EquivalentLaws]:
    names = {r.fit.law.name for r in ranking.credible}
    if any(r.fit.predictor is None or not r.fit.histories for r in ranking.laws):
        return []
    return [pair for pair in ranking.equivalents() if {pair.first, pair.second} <= names]
