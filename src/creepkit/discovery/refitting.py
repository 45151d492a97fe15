"""Forms put back into the law and refitted to the tests themselves: n(T), tau(T), A(T) judged by displacement.

Regression on estimates inherits how badly single temperatures determine them; the tests together do not. Each
combination of forms makes an ordinary law, which is identified from all tests at once, beginning where the regression
ended, and ranked by BIC. Where more forms of a parameter remain than are to be tried, one stands for those that the
points cannot tell from it. One parameter's form is changed at a time, the others as they are best so far; the winner
is then searched for anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.combining import CREDIBLE, Form, distance
from creepkit.discovery.libraries import ARRHENIUS, Library, law_with
from creepkit.discovery.points import Points, check_temperatures
from creepkit.discovery.regression import Regression, regress
from creepkit.discovery.trend import Candidate, TemperatureLaw, estimates_of
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.selection import rank
from creepkit.inverse.settings import Settings
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

Progress = Callable[[str, int, int], None]

MOST = 6
"""Forms of one parameter that are refitted."""
ALIKE = 0.5
"""chi^2 between the curves of two forms below which other forms are tried first."""


def refit(
    trend: TemperatureLaw,
    histories: Sequence[History],
    using: Predictor,
    *,
    most: int = MOST,
    settings: Settings | None = None,
    confirm: bool = True,
    progress: Progress | None = None,
) -> TemperatureLaw:
    """Refit the forms that remain to the tests, and weigh them by how well they follow these.

    most : forms of one parameter that are tried; where every identification is dear, 3 will do. The plain law,
        Arrhenius with every other parameter constant, is always among the combinations.
    confirm : whether the best law is searched for anew from the whole of its bounds.
    """
    check_temperatures([float(np.mean(h.temperature_program().values)) for h in histories])
    work = _Work(trend.points, list(histories), using, settings or Settings(), progress)
    choices = {name: _representatives(trend, name, most) for name in trend.base.names}
    now = {one.parameter: one for one in trend.candidates[0].libraries}
    plain = {name: _plain(trend, name) for name in trend.base.names}
    work.total = 2 + sum(len(own) - 1 for own in choices.values())
    work(list(plain.values()))
    work(list(now.values()))
    for name in sorted(choices, key=lambda n: -len(choices[n])):
        for library in choices[name]:
            work(list({**now, name: library}.values()))
        best = work.best.libraries
        now = {one.parameter: one for one in best}
    if not work.fitted:
        raise FitError(f"no form could be refitted; the first said: {next(iter(work.failed.values()))}")
    if confirm:
        work.confirm()
    return _judged(trend, work)


@dataclass(frozen=True, eq=False)
class _Refitted:
    """A combination of forms, its regression on the points, and the identification of its law."""

    libraries: tuple[Library, ...]
    regression: Regression
    fit: Identification


@dataclass(eq=False)
class _Work:
    """Identifications of combinations from all tests, each made once."""

    points: Points
    histories: list[History]
    using: Predictor
    settings: Settings
    progress: Progress | None
    fitted: dict[tuple[str, ...], _Refitted] = field(default_factory=dict)
    failed: dict[tuple[str, ...], str] = field(default_factory=dict)
    total: int = 0

    def __call__(self, libraries: Sequence[Library]) -> None:
        key = tuple(one.name for one in libraries)
        if key in self.fitted or key in self.failed:
            return
        regression = regress(self.points, libraries)
        law = law_with(self.points.law, libraries)
        ends, told = [], ""
        for start in self._starts(law, regression):
            try:
                ends.append(self._identified(law, start))
            except CreepkitError as error:
                told = str(error)
        if ends:
            fit = max(ends, key=lambda end: end.log_likelihood)
            self.fitted[key] = _Refitted(tuple(libraries), regression, fit)
        else:
            self.failed[key] = told
        if self.progress is not None:
            self.progress("form of temperature", min(len(self.fitted) + len(self.failed), self.total), self.total)

    def _identified(self, law: CreepLaw, start: Floats | None) -> Identification:
        return identify(
            law, self.histories, self.using, settings=self.settings, start=start, reference=self.points.reference
        )

    def _starts(self, law: CreepLaw, regression: Regression) -> list[Floats | None]:
        """Where the regression ended; where points leave parameters open also the best so far, with idle forms.

        None stands for a search of the whole bounds, with which the first law begins then.
        """
        starts: list[Floats | None] = [_inside(law, regression.values, self.points)]
        if self.points.leaves_open() and not self.fitted:
            starts.append(None)
        elif self.points.leaves_open():
            fit = self.best.fit
            known = dict(zip(fit.law.names, fit.coordinates.theta(fit.u), strict=True))
            idle = {name: p.to_internal(p.center if p.off is None else p.off) for name, p in law.table.items()}
            starts.append(_inside(law, {**idle, **known}, self.points))
        return starts

    @property
    def best(self) -> _Refitted:
        """The combination of lowest BIC so far; odds of forms count at the end."""
        ranking = rank([one.fit for one in self.fitted.values()])
        return next(one for one in self.fitted.values() if one.fit is ranking.best)

    def confirm(self) -> None:
        """Search the best law anew, and keep the better of the two answers."""
        one = self.best
        anew = self._identified(one.fit.law, None)
        if anew.log_likelihood > one.fit.log_likelihood:
            key = tuple(library.name for library in one.libraries)
            self.fitted[key] = replace(one, fit=anew)


def _inside(law: CreepLaw, values: Mapping[str, float], points: Points) -> Floats:
    """Conditioned coordinates of internal values, within the bounds."""
    ends = [[p.to_internal(b) for b in p.bounds] for p in law.params.values()]
    low, high = np.array(ends).T
    theta = np.clip([values[name] for name in law.names], low, high)
    return Coordinates(law, points.reference).u(theta)


def _representatives(trend: TemperatureLaw, name: str, most: int) -> list[Library]:
    """The forms of one parameter to try: first those that the points can tell apart, then their neighbours."""
    taken: list[Regression] = []
    remaining = [trend.combinations.with_form(name, form.name) for form in trend.sets[name]]
    for one in remaining:
        if all(_between(trend, one, other) > ALIKE for other in taken):
            taken.append(one)
    taken += [one for one in remaining if one not in taken]
    return [_library(one, name) for one in taken[:most]]


def _between(trend: TemperatureLaw, one: Regression, other: Regression) -> float:
    return distance(one, other, trend.points, trend.combinations.inflation)


def _plain(trend: TemperatureLaw, name: str) -> Library:
    """Arrhenius of a rate, else the constant, else the best."""
    known = {one.forms[name]: one.regression for one in reversed(trend.combinations.tried)}
    for form in (ARRHENIUS, "constant"):
        if form in known:
            return _library(known[form], name)
    return next(one for one in trend.candidates[0].libraries if one.parameter == name)


def _library(regression: Regression, name: str) -> Library:
    return next(one for one in regression.libraries if one.parameter == name)


def _judged(trend: TemperatureLaw, work: _Work) -> TemperatureLaw:
    """The trend as the tests see it."""
    refits = list(work.fitted.values())
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
        notes=(*trend.notes, *(f"not refitted: {', '.join(key)}: {told}" for key, told in work.failed.items())),
    )


def _candidate(one: _Refitted, excess: float, weight: float) -> Candidate:
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
        return min(weights, key=lambda tried: _between(trend, with_form(name, form), with_form(name, tried)))

    stood_for = [form for form in rest if nearest(form) in kept]
    return tuple(Form(form, weights.get(form, 0.0), form in stood_for) for form in (*kept, *stood_for))
