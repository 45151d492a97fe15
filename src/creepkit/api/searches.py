"""Names of searches and penalties, as the command line and study files have them, and what they stand for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

if TYPE_CHECKING:
    from creepkit.inverse.search.global_search import GlobalSearch
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets

SearchName: TypeAlias = Literal["multi-start", "swarm", "cma-es"]


PenaltyName: TypeAlias = Literal["l2", "group-l2", "sqrt", "subsets"]


SEARCHES: tuple[SearchName, ...] = get_args(SearchName)


PENALTIES: tuple[PenaltyName, ...] = get_args(PenaltyName)


def search_of_name(name: SearchName) -> GlobalSearch | None:
    """The search of a name of SEARCHES; None for the default."""
    from creepkit.inverse.search.derivative_free import CmaEs, ParticleSwarm

    searches: dict[SearchName, GlobalSearch | None] = {"multi-start": None, "swarm": ParticleSwarm(), "cma-es": CmaEs()}
    return searches[name]


def penalty_of_name(name: PenaltyName) -> ContributionPenalty | Subsets:
    """The penalty of a name of PENALTIES, its strength chosen automatically."""
    from creepkit.inverse.sparsity.penalties import L2, GroupL2, Sqrt, Subsets

    if name == "subsets":
        return Subsets()
    penalties: dict[PenaltyName, ContributionPenalty] = {"l2": L2(), "group-l2": GroupL2(), "sqrt": Sqrt()}
    return penalties[name]
