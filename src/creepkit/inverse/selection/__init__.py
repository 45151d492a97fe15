"""Which laws: candidates, their ranking under one covariance, what cannot be told apart, and what would tell it."""

from creepkit.inverse.selection.ranking import CREDIBLE_WEIGHT, CRITERIA, DECISIVE_WEIGHT, RankedLaw, Ranking, rank

__all__ = ["CREDIBLE_WEIGHT", "CRITERIA", "DECISIVE_WEIGHT", "RankedLaw", "Ranking", "rank"]
