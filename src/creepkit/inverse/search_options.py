"""SearchOptions: how laws are sought and compared, by the names that commands and study files have for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from creepkit.checked_arguments import checked
from creepkit.options import Options, option

if TYPE_CHECKING:
    from creepkit.inverse.search.global_search import GlobalSearch


@checked
@dataclass(frozen=True)
class SearchOptions(Options, title="options of a search"):
    """What identify() and select() take as objects or arguments of their own.

    search : how to begin. penalty : on the terms of a sum. sums : whether sums of
    two laws are tried; None where no candidate explains the tests. criterion : of a comparison.
    """

    search: Literal["multi-start", "swarm"] = option("multi-start", "How to begin.", flag="begin")
    penalty: Literal["l2", "subsets"] | None = option(None, "Keep those terms of a sum that the tests need.")
    sums: bool | None = option(None, "Whether sums of two laws are tried; by default where no law explains the tests.")
    criterion: Literal["bic", "aicc"] = option("bic", "Of a comparison of laws.")

    @property
    def global_search(self) -> GlobalSearch | None:
        """The search as identify() takes it; None for the default."""
        from creepkit.inverse.search.particle_swarm import ParticleSwarm

        return ParticleSwarm() if self.search == "swarm" else None
