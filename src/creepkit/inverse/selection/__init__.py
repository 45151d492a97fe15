"""Which laws: candidates, their ranking under one covariance, what cannot be told apart, and what would tell it."""

from creepkit.inverse.selection.ranking import CREDIBLE, CRITERIA, DECISIVE, Ranked, Ranking, rank

__all__ = ["CREDIBLE", "CRITERIA", "DECISIVE", "Ranked", "Ranking", "rank"]
