"""Searches and penalties by their names on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from creepkit.inverse.search.landscape import GlobalSearch
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets

SEARCHES = ("multi-start", "swarm", "cma-es")


def search_named(name: str) -> GlobalSearch | None:
    """The search of this name; None for the default."""
    from creepkit.errors import FitError
    from creepkit.inverse.search.evolution import CmaEs
    from creepkit.inverse.search.swarm import ParticleSwarm

    if name not in SEARCHES:
        raise FitError(f"--search {name} is not known; allowed are {', '.join(SEARCHES)}")
    return {"multi-start": None, "swarm": ParticleSwarm(), "cma-es": CmaEs()}[name]


def penalty_named(name: str | None) -> ContributionPenalty | Subsets | None:
    """The penalty of this name, its strength chosen automatically; None for none."""
    from creepkit.errors import FitError
    from creepkit.inverse.sparsity.penalties import L2, GroupL2, Sqrt, Subsets

    penalties: dict[str, Callable[[], ContributionPenalty | Subsets]] = {
        "l2": L2, "group-l2": GroupL2, "sqrt": Sqrt, "subsets": Subsets,
    }  # fmt: skip
    if name is not None and name not in penalties:
        raise FitError(f"--penalty {name} is not known; allowed are {', '.join(penalties)}")
    return None if name is None else penalties[name]()
