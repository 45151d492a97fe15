"""What one law says of one test: draws of its curves, the curve at the identified values, and its derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.forecasts.draws import (
    Dimension,
    LawDraws,
    dimension_draws,
    dimensions_of,
    factor_variances,
    log_factor_draws,
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
from creepkit.records import History, Predictor


@dataclass(frozen=True, eq=False)
class DrawnLaw:
    """What one law says of one test.

    drawn : draws of its curves, at its times and up to rupture; central : at the identified values.
    factor_variances : {level: variance of ln of the test's own factor on the rate}.
    numerical : {output: standard deviation}, in its unit.
    """

    draws: LawDraws
    weight: float
    drawn: TestCurves
    central: TestCurves
    dimensions: Sequence[Dimension]
    factor_variances: Mapping[str, float]
    sensitivities: TestSensitivities
    numerical: Mapping[str, float]


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
    dimensions = dimensions_of(fit, history, predictor, tolerances)
    centre = {d.kind: d.mean for d in dimensions}
    followed, own = followed_history(history, predictor), predictor_for(predictor, history)
    central, numerical = central_curves(fit, predictor, followed, centre)
    cheaper = drawing_predictor(fit, predictor, history, [*centre])
    factors = log_factor_draws(draws, history, rng)
    nuisances = dimension_draws(dimensions, draws, rng)
    drawn = curves(fit, cheaper, followed, drawn_theta(fit, draws.u), np.sum([*factors.values()], axis=0), nuisances)
    if cheaper is not own or numerical:
        values, fixed = fit.coordinates.theta(fit.u)[None], {kind: np.array([[v]]) for kind, v in centre.items()}
        drawn = corrected(drawn, curves(fit, cheaper, followed, values, np.zeros(1), fixed), central)
    return DrawnLaw(
        draws,
        weight,
        drawn,
        central,
        dimensions,
        factor_variances(draws, history),
        sensitivities_at_values(fit, own, history, centre),
        numerical,
    )
