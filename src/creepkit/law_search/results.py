"""LawSearch: what a search of laws found, with the front of accuracy against complexity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import Ranking
from creepkit.language import CreepLaw
from creepkit.law_search.grammar import operations
from creepkit.records.presentable import Plotted, Presentable, Tabulated


@dataclass(frozen=True, eq=False)
class SearchedLaw:
    """A law that was tried.

    misfit : root mean square of ln strain. excess : criterion of its identification above the least of those tried.
    registered : whether it is a law of the registry, or made of one by its algebra of primary creep and temperature.
    """

    law: CreepLaw
    misfit: float
    excess: float
    registered: bool = False

    @property
    def parameters(self) -> int:
        """Free parameters."""
        return len(self.law.params)

    @property
    def complexity(self) -> int:
        """Free parameters and operations of the rate."""
        return self.parameters + operations(self.law)


@dataclass(frozen=True, eq=False, repr=False)
class LawSearch(Presentable, Plotted, Tabulated):
    """Laws that a search found, ranked beside registered ones.

    ranking : of the best sentences and the registered laws, as of select(). tried : sentences that were identified from
    the curves with few starts, the lowest criterion first. budget, seconds : CPU time given, and used with the ranking.
    untried : sentences of the last beam whose neighbours were not tried, for the budget was spent; 0 where the search
    came to its end.
    """

    ranking: Ranking
    tried: tuple[SearchedLaw, ...] = field(repr=False)
    budget: float
    seconds: float
    untried: int = 0

    @property
    def best(self) -> Identification:
        """The law of lowest criterion."""
        return self.ranking.best

    @property
    def front(self) -> tuple[SearchedLaw, ...]:
        """The laws tried of which none simpler has a smaller misfit, simplest first."""
        return front_of(self.tried)

    drawn_by = "ranking.front_figure", "ranking.draw_front"

    def __repr__(self) -> str:
        return f"<LawSearch: {len(self.tried)} sentences, best {self.best.law.name}>"

    shown_by = "ranking.law_search_text"


def front_of(laws: Sequence[SearchedLaw]) -> tuple[SearchedLaw, ...]:
    """Those of which none at most as complex has a smaller misfit, the simplest first."""
    front: list[SearchedLaw] = []
    for one in sorted(laws, key=lambda law: (law.complexity, law.misfit)):
        if not front or one.misfit < front[-1].misfit:
            front.append(one)
    return tuple(front)
