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
from creepkit.inverse.problem import IdentificationProblem
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import inverse_covariances
from creepkit.inverse.scatter import NoiseModel
from creepkit.inverse.selection.judging import under_common_covariance
from creepkit.records import History, Predictor

FITTED_FRACTION = 0.7
"""Share of each history's duration that the fit sees."""


def hold_out_scores(fits: Sequence[Identification], fitted_fraction: float = FITTED_FRACTION) -> list[float]:
    """-2 ln of the predictive likelihood of what comes after `kept` of each history, for each law."""
    noise_model = fits[under_common_covariance(fits).reference_law].noise_model
    scores = []
    for fit in fits:
        histories = list(fit.histories)
        partial = refit(fit, [_first_part(h, fitted_fraction) for h in histories])
        problem = IdentificationProblem.from_histories(fit.law, histories, _required_predictor(fit.predictor), fit.settings, fit.reference)
        residuals = problem.residual_function.evaluate(np.concatenate([partial.u, [n.value for n in partial.nuisances]]))
        is_early = problem.residual_function.observations.times <= fitted_fraction * np.array([[h.times[-1]] for h in histories])
        beginning = replace(residuals, present=residuals.present & is_early, values=np.where(is_early, residuals.values, 0.0))
        scores.append(_negative_log_likelihood(residuals, noise_model) - _negative_log_likelihood(beginning, noise_model))
    return scores


def _negative_log_likelihood(residuals: Residuals, noise_model: NoiseModel) -> float:
    """r' C^-1 r + ln|C|."""
    inverses, log_det = inverse_covariances(residuals, noise_model)
    return float(np.einsum("te,tef,tf->", residuals.values, inverses, residuals.values) + log_det)


def _first_part(history: History, fitted_fraction: float) -> History:
    """The first part of a history, which does not know how the test will end."""
    used = history.used & (history.times <= fitted_fraction * float(history.times[-1]))
    return history.replace(used=used, rupture_time=None, unruptured=False)


def _required_predictor(using: Predictor | None) -> Predictor:
    assert using is not None
    return using
