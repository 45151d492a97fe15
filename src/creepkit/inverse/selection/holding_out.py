"""Hold-out: the end of every history predicted from a fit to its beginning.

The beginning tells more of the end than the values of a law: a drift goes on, a test that creeps faster than its twins
stays so. With the covariance C of all entries, that of the best law, and C_1 its part of the beginning,

    -2 ln p(end | beginning) = (r' C^-1 r + ln|C|) - (r_1' C_1^-1 r_1 + ln|C_1|)

but for a constant, r the residuals at the values that the beginning alone gave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.problem import Problem
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import inverses_of
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.selection.judging import judged
from creepkit.records import History, Predictor

KEPT = 0.7
"""Share of each history's duration that the fit sees."""


def hold_out_scores(fits: Sequence[Identification], kept: float = KEPT) -> list[float]:
    """-2 ln of the predictive likelihood of what comes after `kept` of each history, for each law."""
    scatter = fits[judged(fits).chosen].scatter
    scores = []
    for fit in fits:
        histories = list(fit.histories)
        partial = refit(fit, [_beginning(h, kept) for h in histories])
        problem = Problem.of(fit.law, histories, _known(fit.using), fit.settings, fit.reference)
        residuals = problem.objective.at(np.concatenate([partial.u, [n.value for n in partial.nuisances]]))
        early = problem.objective.entries.times <= kept * np.array([[h.times[-1]] for h in histories])
        beginning = replace(residuals, present=residuals.present & early, values=np.where(early, residuals.values, 0.0))
        scores.append(_surprise(residuals, scatter) - _surprise(beginning, scatter))
    return scores


def _surprise(residuals: Residuals, scatter: Scatter) -> float:
    """r' C^-1 r + ln|C|."""
    inverses, log_det = inverses_of(residuals, scatter)
    return float(np.einsum("te,tef,tf->", residuals.values, inverses, residuals.values) + log_det)


def _beginning(history: History, kept: float) -> History:
    """The first part of a history, which does not know how the test will end."""
    used = history.used & (history.times <= kept * float(history.times[-1]))
    return history.replace(used=used, rupture_time=None, unruptured=False)


def _known(using: Predictor | None) -> Predictor:
    assert using is not None
    return using
