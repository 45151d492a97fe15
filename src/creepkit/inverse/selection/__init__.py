"""Model selection: candidate laws, their ranking, and pairs that the tests cannot separate."""

from creepkit.inverse.evidence import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.inverse.selection.ranking import RankedLaw, Ranking, rank

__all__ = ["CREDIBLE_WEIGHT", "DECISIVE_WEIGHT", "RankedLaw", "Ranking", "rank"]
