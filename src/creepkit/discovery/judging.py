"""Refitted combinations of forms weighed by the tests: BIC under one covariance, and prior odds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.discovery.combining import CREDIBLE_MASS, FormWeight, squared_mahalanobis
from creepkit.discovery.libraries import CandidateForm
from creepkit.discovery.regression import Regression
from creepkit.discovery.trend import CandidateLaw, TemperatureLaw, averaged_estimates
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection import rank


@dataclass(frozen=True, eq=False)
class RefittedCombination:
    """A combination of forms, its regression on the points, and the identification of its law."""

    forms: tuple[CandidateForm, ...]
    regression: Regression
    fit: Identification


def curve_distance(temperature_law: TemperatureLaw, first: Regression, second: Regression) -> float:
    """chi^2 between the curves of two combinations, by the covariances of the points."""
    return squared_mahalanobis(first, second, temperature_law.isothermal_estimates, temperature_law.combinations.overdispersion)


def weigh_refits(temperature_law: TemperatureLaw, refits: Sequence[RefittedCombination], failed: Mapping[tuple[str, ...], str]) -> TemperatureLaw:
    """The trend as the tests see it; failed : {forms: why they could not be refitted}, which become notes."""
    ranking = rank([refit.fit for refit in refits])
    bic_differences = {id(entry.fit): entry.excess for entry in ranking.laws}
    odds = np.array([one.regression.prior_odds for one in refits])
    scores = np.array([bic_differences[id(one.fit)] for one in refits]) - 2.0 * np.log(odds)
    weights = np.exp(-0.5 * (scores - scores.min()))
    weights /= weights.sum()
    order = np.argsort(scores, kind="stable")
    candidates = tuple(_candidate_law(refits[k], float(scores[k] - scores.min()), float(weights[k])) for k in order)
    best = candidates[0]
    assert best.fit is not None
    return replace(
        temperature_law,
        law=best.fit.law,
        estimates=averaged_estimates(best.fit.law, candidates),
        criterion_data="histories",
        plausible_forms={name: _plausible_forms_of_refits(temperature_law, candidates, name) for name in temperature_law.isothermal_law.names},
        candidates=candidates,
        fit=best.fit,
        notes=(*temperature_law.notes, *(f"not refitted: {', '.join(key)}: {reason}" for key, reason in failed.items())),
    )


def _candidate_law(refit: RefittedCombination, criterion_difference: float, weight: float) -> CandidateLaw:
    fit, names = refit.fit, [name for library in refit.forms for name in library.parameter_names]
    theta = dict(zip(fit.law.names, fit.coordinates.theta(fit.u), strict=True))
    jacobian = fit.coordinates.jacobian(fit.u)
    covariance = jacobian @ fit.covariance @ jacobian.T
    indices = [fit.law.names.index(name) for name in names]
    internal = {name: float(theta[name]) for name in names}
    return CandidateLaw(refit.forms, internal, covariance[np.ix_(indices, indices)], fit.freedom, criterion_difference, weight, fit)


def _plausible_forms_of_refits(temperature_law: TemperatureLaw, candidates: Sequence[CandidateLaw], name: str) -> tuple[FormWeight, ...]:
    """Forms that hold 95 % of the belief, then those not refitted whose nearest neighbour is among them."""
    weights: dict[str, float] = {}
    for candidate in candidates:
        weights[candidate.forms[name]] = weights.get(candidate.forms[name], 0.0) + candidate.weight
    ranked = sorted(weights, key=lambda form: -weights[form])
    cumulative_weight = np.cumsum([0.0, *(weights[form] for form in ranked)])
    retained = [form for form, mass_before in zip(ranked, cumulative_weight, strict=False) if mass_before < CREDIBLE_MASS]
    not_refitted = [form.name for form in temperature_law.plausible_forms[name] if form.name not in weights]
    with_form = temperature_law.combinations.with_form

    def nearest(form: str) -> str:
        return min(weights, key=lambda tried: curve_distance(temperature_law, with_form(name, form), with_form(name, tried)))

    represented = [form for form in not_refitted if nearest(form) in retained]
    return tuple(FormWeight(form, weights.get(form, 0.0), form in represented) for form in (*retained, *represented))
