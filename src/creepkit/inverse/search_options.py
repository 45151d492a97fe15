"""SearchOptions: how laws are sought and compared, by the names that commands and study files have for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from creepkit.errors import FitError
from creepkit.options import Options, option

if TYPE_CHECKING:
    from creepkit.inverse.search.global_search import GlobalSearch
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets


@dataclass(frozen=True)
class SearchOptions(Options, title="options of a search", error=FitError):
    """What identify() and select() take as objects or arguments of their own.

    search : how to begin. penalty : on the terms of a sum, its strength chosen automatically. sums : whether sums of
    two laws are tried; None where no candidate explains the tests. by : the criterion of a comparison.
    """

    search: Literal["multi-start", "swarm", "cma-es"] = option("multi-start", "How to begin.")
    penalty: Literal["l2", "group-l2", "sqrt", "subsets"] | None = option(None, "Reduce a sum of terms.")
    sums: bool | None = option(None, "Whether sums of two laws are tried; by default where no law explains the tests.")
    by: Literal["bic", "aicc", "hold-out"] = option("bic", "Of a comparison of laws.", flag="criterion")

    @property
    def global_search(self) -> GlobalSearch | None:
        """The search as identify() takes it; None for the default."""
        from creepkit.inverse.search.derivative_free import CmaEs, ParticleSwarm

        searches: dict[str, GlobalSearch] = {"swarm": ParticleSwarm(), "cma-es": CmaEs()}
        return searches.get(self.search)

    @property
    def term_penalty(self) -> ContributionPenalty | Subsets | None:
        """The penalty as identify() takes it."""
        from creepkit.inverse.sparsity.penalties import L2, GroupL2, Sqrt, Subsets

        penalties: dict[str, ContributionPenalty | Subsets] = {
            "l2": L2(), "group-l2": GroupL2(), "sqrt": Sqrt(), "subsets": Subsets()
        }  # fmt: skip
        return None if self.penalty is None else penalties[self.penalty]
