"""Refitted combinations of forms weighed by the tests: BIC under one covariance, and prior odds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.discovery.combining import CREDIBLE, Form, distance
from creepkit.discovery.libraries import Library
from creepkit.discovery.regression import Regression
from creepkit.discovery.trend import Candidate, TemperatureLaw, estimates_of
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection import rank


@dataclass(frozen=True, eq=False)
class Refitted:
    """A combination of forms, its regression on the points, and the identification of its law."""

    libraries: tuple[Library, ...]
    regression: Regression
    fit: Identification


def between(trend: TemperatureLaw, one: Regression, other: Regression) -> float:
    """chi^2 between the curves of two combinations, by the covariances of the points."""
    return distance(one, other, trend.points, trend.combinations.inflation)


def judged(trend: TemperatureLaw, refits: Sequence[Refitted], failed: Mapping[tuple[str, ...], str]) -> TemperatureLaw:
    """The trend as the tests see it; failed : {forms: why they could not be refitted}, which become notes."""
    ranking = rank([one.fit for one in refits])
    excess = {id(entry.fit): entry.excess for entry in ranking.laws}
    odds = np.array([one.regression.odds for one in refits])
    scores = np.array([excess[id(one.fit)] for one in refits]) - 2.0 * np.log(odds)
    weights = np.exp(-0.5 * (scores - scores.min()))
    weights /= weights.sum()
    order = np.argsort(scores, kind="stable")
    candidates = tuple(_candidate(refits[k], float(scores[k] - scores.min()), float(weights[k])) for k in order)
    best = candidates[0]
    assert best.fit is not None
    return replace(
        trend,
        law=best.fit.law,
        estimates=estimates_of(best.fit.law, candidates),
        judged_by="histories",
        sets={name: _set(trend, candidates, name) for name in trend.base.names},
        candidates=candidates,
        fit=best.fit,
        notes=(*trend.notes, *(f"not refitted: {', '.join(key)}: {told}" for key, told in failed.items())),
    )


def _candidate(one: Refitted, excess: float, weight: float) -> Candidate:
    fit, names = one.fit, [name for library in one.libraries for name in library.names]
    theta = dict(zip(fit.law.names, fit.coordinates.theta(fit.u), strict=True))
    jacobian = fit.coordinates.jacobian(fit.u)
    covariance = jacobian @ fit.covariance @ jacobian.T
    places = [fit.law.names.index(name) for name in names]
    internal = {name: float(theta[name]) for name in names}
    return Candidate(one.libraries, internal, covariance[np.ix_(places, places)], fit.freedom, excess, weight, fit)


def _set(trend: TemperatureLaw, candidates: Sequence[Candidate], name: str) -> tuple[Form, ...]:
    """Forms that hold 95 % of the belief, then those not refitted whose nearest neighbour is among them."""
    weights: dict[str, float] = {}
    for one in candidates:
        weights[one.forms[name]] = weights.get(one.forms[name], 0.0) + one.weight
    ranked = sorted(weights, key=lambda form: -weights[form])
    before = np.cumsum([0.0, *(weights[form] for form in ranked)])
    kept = [form for form, held in zip(ranked, before, strict=False) if held < CREDIBLE]
    rest = [form.name for form in trend.sets[name] if form.name not in weights]
    with_form = trend.combinations.with_form

    def nearest(form: str) -> str:
        return min(weights, key=lambda tried: between(trend, with_form(name, form), with_form(name, tried)))

    stood_for = [form for form in rest if nearest(form) in kept]
    return tuple(Form(form, weights.get(form, 0.0), form in stood_for) for form in (*kept, *stood_for))
