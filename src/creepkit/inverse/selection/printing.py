"""A ranking as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from creepkit.inverse.selection.equivalence import Equivalence
    from creepkit.inverse.selection.ranking import Ranking

_NAMES = {"bic": "BIC", "aicc": "AICc", "hold-out": "hold-out"}


def text_of(ranking: Ranking) -> str:
    """The verdict, then a line for each law."""
    width = max(len(r.fit.law.name) for r in ranking.laws)
    head = f"{'law':{width}}   weight  {_NAMES[ranking.by]} - best  chi-square"
    rows = [f"{r.fit.law.name:{width}}   {r.weight:6.3f}  {r.excess:10.1f}  {r.chi_square:10.1f}" for r in ranking.laws]
    lost = [f"{name}: {reason}" for name, reason in ranking.failed.items()]
    alike = [] if ranking.decisive else [f"- {pair}" for pair in _among_remaining(ranking)]
    return "\n".join([ranking.verdict, *alike, "", head, *rows, *lost])


def _among_remaining(ranking: Ranking) -> list[Equivalence]:
    names = {r.fit.law.name for r in ranking.remaining}
    if any(r.fit.using is None or not r.fit.histories for r in ranking.laws):
        return []
    return [pair for pair in ranking.equivalents() if {pair.first, pair.second} <= names]
