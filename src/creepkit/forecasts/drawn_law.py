"""What one law says of one test: draws of its curves, the curve at the identified values, and its derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.errors import FitError
from creepkit.forecasts.draws import (
    LawDraws,
    UncertainQuantity,
    dimension_draws,
    has_sampled_draws,
    log_factor_draws,
    own_variances,
    uncertain_quantities,
)
from creepkit.forecasts.simulation import (
    TestCurves,
    TestSensitivities,
    central_curves,
    corrected,
    curves,
    drawing_predictor,
    drawn_theta,
    followed_history,
    sensitivities_at_values,
)
from creepkit.inverse.composite_predictor import predictor_for
from creepkit.inverse.reference_conditions import reference_condition
from creepkit.inverse.uncertainty.law_misfit import LawMisfit
from creepkit.inverse.uncertainty.quantities import log_rate
from creepkit.records import History, Predictor

LEAST_SOLVED = 0.8
"""Share of the draws that the solver must finish."""


@dataclass(frozen=True, eq=False)
class DrawnLaw:
    """What one law says of one test.

    drawn : draws of its curves, at its times and up to rupture; central : at the identified values.
    own_variances : {source: variance of ln of what is new in the factor of the test on the rate}. misfit : what the law
    misses at its stress and temperature, where bands hold that.
    numerical : {output: standard deviation}, in its unit. failed : draws that the solver did not finish, left out.
    """

    draws: LawDraws
    weight: float
    drawn: TestCurves
    central: TestCurves
    dimensions: Sequence[UncertainQuantity]
    own_variances: Mapping[str, float]
    sensitivities: TestSensitivities
    numerical: Mapping[str, float]
    failed: int
    misfit: LawMisfit | None = None


def drawn_law(
    draws: LawDraws,
    weight: float,
    history: History,
    predictor: Predictor,
    tolerances: Mapping[str, float],
    rng: np.random.Generator,
) -> DrawnLaw:
    """What one law says of one test; weight : of the law. tolerances : {kind: standard deviation}."""
    fit = draws.fit
    dimensions = uncertain_quantities(fit, history, predictor, tolerances)
    centre = {d.kind: d.mean for d in dimensions}
    followed, own = followed_history(history, predictor, [*centre]), predictor_for(predictor, history)
    mean, _ = fit.scatter_of_rates.mean_joint
    condition = reference_condition(history, predictor)
    misfit = fit.misfit_at(*condition)
    of_rate = 0.0 if misfit is None else misfit.sd
    if has_sampled_draws(fit):  # samples are those of the tests alone
        of_rate = float(np.hypot(of_rate, fit.error_sd(log_rate(fit.coordinates, *condition))))
    test = fit.scatter_of_rates.new_test(history, of_rate)
    known = float(mean[[*test.known.values()]].sum())
    central, numerical = central_curves(fit, predictor, followed, centre, known)
    cheaper = drawing_predictor(fit, predictor, history, [*centre])
    factors = log_factor_draws(draws, test, rng)
    nuisances = dimension_draws(dimensions, draws, rng)
    drawn = curves(fit, cheaper, followed, drawn_theta(fit, draws.u), factors, nuisances)
    if cheaper is not own or numerical:
        values, fixed = fit.coordinates.theta(fit.u)[None], {kind: np.array([[v]]) for kind, v in centre.items()}
        drawn = corrected(drawn, curves(fit, cheaper, followed, values, np.array([known]), fixed), central)
    solved = ~np.isnan(drawn.end_times)
    if solved.mean() < LEAST_SOLVED:
        raise FitError(
            f"test '{history.name}': the solver finishes {100 * solved.mean():.0f} % of the draws of law "
            f"'{fit.law.name}' alone, too few for a band; shorten the test, or narrow the bounds of the law"
        )
    failed = int((~solved).sum())
    drawn = replace(drawn, values=drawn.values[solved], end_times=drawn.end_times[solved])
    return DrawnLaw(
        draws,
        weight,
        drawn,
        central,
        dimensions,
        own_variances(fit, test),
        sensitivities_at_values(fit, own, history, centre),
        numerical,
        failed,
        misfit,
    )
