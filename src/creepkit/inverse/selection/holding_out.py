"""Hold-out: the end of every history predicted from a fit to its beginning."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.problem import Problem
from creepkit.inverse.selection.common import judged
from creepkit.records import History, Predictor

KEPT = 0.7
"""Share of each history's duration that the fit sees."""


def hold_out_scores(fits: Sequence[Identification], kept: float = KEPT) -> list[float]:
    """-2 ln of the predictive likelihood of the frames after `kept` of each history, under the covariance of the best.

    Residuals of the end are taken relative to a refit to the beginning, with the noise that all laws share.
    """
    scatter = fits[judged(fits).chosen].scatter
    scores = []
    for fit in fits:
        histories = list(fit.histories)
        partial = refit(fit, [_beginning(h, kept) for h in histories])
        problem = Problem.of(fit.law, histories, _known(fit.using), fit.settings, fit.reference)
        entries = problem.objective.entries
        late = entries.present & (entries.times > kept * np.array([[h.times[-1]] for h in histories]))
        x = np.concatenate([partial.u, [n.value for n in partial.nuisances]])
        residuals = problem.objective.at(x)
        size = np.hypot(scatter.at(entries.output, "noise") * residuals.slopes, scatter.at(entries.output, "drift"))
        scores.append(float(((residuals.values / np.maximum(size, 1e-300))[late] ** 2).sum()))
    return scores


def _beginning(history: History, kept: float) -> History:
    return history.replace(used=history.used & (history.times <= kept * float(history.times[-1])))


def _known(using: Predictor | None) -> Predictor:
    assert using is not None
    return using
