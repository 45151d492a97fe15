"""Forms put back into the law and refitted to the tests themselves: n(T), tau(T), A(T) judged by displacement.

Regression on estimates inherits how badly single temperatures determine them; the tests together do not. Each
combination of forms makes an ordinary law, which is identified from all tests at once, beginning where the regression
ended, and ranked by BIC. Where more forms of a parameter remain than are to be tried, one stands for those that the
points cannot tell from it. One parameter's form is changed at a time, the others as they are best so far; then each is
put back to the plain one, to see whether it was needed; the winner is searched for anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.judging import Refitted, between, judged
from creepkit.discovery.libraries import ARRHENIUS, Library, law_with
from creepkit.discovery.points import Points, check_temperatures
from creepkit.discovery.regression import Regression, regress
from creepkit.discovery.trend import TemperatureLaw
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

    settings : where values are to come from frames of equal weight ("noise", the default) the likelihood takes its
        place: combinations must be judged under one covariance, with scatter between tests and autocorrelation in it.
    most : forms of one parameter that are tried; where every identification is dear, 3 will do. The plain law,
        Arrhenius with every other parameter constant, is always among the combinations.
    confirm : whether the best law is searched for anew from the whole of its bounds.
    """
    check_temperatures([float(np.mean(h.temperature_program().values)) for h in histories])
    work = _Work(trend.points, list(histories), using, _by_likelihood(settings or Settings()), progress)
    choices = {name: _representatives(trend, name, most) for name in trend.base.names}
    now = {one.parameter: one for one in trend.candidates[0].libraries}
    plain = {name: _plain(trend, name) for name in trend.base.names}
    work.total = 2 + sum(len(own) for own in choices.values())
    work(list(plain.values()))
    work(list(now.values()))
    for name in sorted(choices, key=lambda n: -len(choices[n])):
        now = work.tried(now, name, choices[name])
    for name in [n for n in now if now[n].name != plain[n].name]:
        now = work.tried(now, name, [plain[name]])
    if not work.fitted:
        raise FitError(f"no form could be refitted; the first said: {next(iter(work.failed.values()))}")
    if confirm:
        work.confirm()
    return judged(trend, list(work.fitted.values()), work.failed)


def _by_likelihood(settings: Settings) -> Settings:
    return replace(settings, weights="likelihood") if settings.weights == "noise" else settings


@dataclass(eq=False)
class _Work:
    """Identifications of combinations from all tests, each made once."""

    points: Points
    histories: list[History]
    using: Predictor
    settings: Settings
    progress: Progress | None
    fitted: dict[tuple[str, ...], Refitted] = field(default_factory=dict)
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
            self.fitted[key] = Refitted(tuple(libraries), regression, fit)
        else:
            self.failed[key] = told
        if self.progress is not None:
            self.progress("form of temperature", min(len(self.fitted) + len(self.failed), self.total), self.total)

    def tried(self, now: Mapping[str, Library], name: str, libraries: Sequence[Library]) -> dict[str, Library]:
        """Other forms of one parameter put in the place of its form now; returns the best combination so far."""
        for library in libraries:
            self(list({**now, name: library}.values()))
        return {one.parameter: one for one in self.best.libraries} if self.fitted else dict(now)

    def _identified(self, law: CreepLaw, start: Floats | None) -> Identification:
        return identify(
            law, self.histories, self.using, settings=self.settings, start=start, reference=self.points.reference
        )

    def _starts(self, law: CreepLaw, regression: Regression) -> list[Floats | None]:
        """Where the regression ended; where points leave parameters open also the best so far, with idle forms.

        None stands for a search of the whole bounds: where the first law begins then, or where a start has no
        conditioned coordinates.
        """
        starts: list[Floats | None] = [_inside(law, regression.values, self.points)]
        if self.points.leaves_open() and not self.fitted:
            starts.append(None)
        elif self.points.leaves_open():
            fit = self.best.fit
            known = dict(zip(fit.law.names, fit.coordinates.theta(fit.u), strict=True))
            idle = {name: p.to_internal(p.center if p.off is None else p.off) for name, p in law.table.items()}
            starts.append(_inside(law, {**idle, **known}, self.points))
        return [one if one is not None and np.isfinite(one).all() else None for one in starts]

    @property
    def best(self) -> Refitted:
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
    """The forms of one parameter to try: first those that the points can tell apart, then their neighbours.

    Where points leave parameters open, they do not rule out a form that the tests may well ask for.
    """
    taken: list[Regression] = []
    forms = [form.name for form in trend.sets[name]]
    if trend.points.leaves_open():
        forms += dict.fromkeys(one.forms[name] for one in trend.combinations.tried if one.forms[name] not in forms)
    remaining = [trend.combinations.with_form(name, form) for form in forms]
    for one in remaining:
        if all(between(trend, one, other) > ALIKE for other in taken):
            taken.append(one)
    taken += [one for one in remaining if one not in taken]
    return [_library(one, name) for one in taken[:most]]


def _plain(trend: TemperatureLaw, name: str) -> Library:
    """Arrhenius of a rate, else the constant, else the best."""
    known = {one.forms[name]: one.regression for one in reversed(trend.combinations.tried)}
    for form in (ARRHENIUS, "constant"):
        if form in known:
            return _library(known[form], name)
    return next(one for one in trend.candidates[0].libraries if one.parameter == name)


def _library(regression: Regression, name: str) -> Library:
    return next(one for one in regression.libraries if one.parameter == name)
