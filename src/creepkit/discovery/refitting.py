"""Forms put back into the law, refitted to the tests themselves, and weighed by BIC and prior odds.

Regression on estimates inherits how badly single temperatures determine them; the tests together do not. Each
combination of forms makes an ordinary law, which is identified from all tests at once, starting where the regression
ended, and ranked by BIC under one covariance. Where more forms of a parameter are plausible than are to be tried, one
represents those that the estimates cannot distinguish from it. One parameter's form is changed at a time with the
others as they are best so far; then each is reset to the simplest one, to see whether it was needed; the best law is
searched for again over the whole of its bounds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.combinations import (
    CREDIBLE_MASS,
    FAILURES,
    FormWeight,
    squared_mahalanobis,
    weight_of_better_forms,
)
from creepkit.discovery.forms import ARRHENIUS, CandidateForm, law_with_forms
from creepkit.discovery.regression import IsothermalEstimates, Regression, check_temperatures, regress
from creepkit.discovery.temperature_law import CandidateLaw, TemperatureLaw, averaged_estimates
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.information_criteria import criterion_weights
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.selection import rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.starting_estimate import StartingEstimate
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor


@dataclass(frozen=True, eq=False)
class RefittedCombination:
    """A combination of forms, its regression on the points, and the identification of its law."""

    forms: tuple[CandidateForm, ...]
    regression: Regression
    fit: Identification


def curve_distance(temperature_law: TemperatureLaw, first: Regression, second: Regression) -> float:
    """chi^2 between the curves of two combinations, by the covariances of the points."""
    return squared_mahalanobis(
        first, second, temperature_law.isothermal_estimates, temperature_law.combinations.overdispersion
    )


def weigh_refits(
    temperature_law: TemperatureLaw, refits: Sequence[RefittedCombination], failed: Mapping[tuple[str, ...], str]
) -> TemperatureLaw:
    """The temperature law with forms weighed by the tests.

    failed : {forms: why they could not be refitted}, which become notes.
    """
    ranking = rank([refit.fit for refit in refits])
    bic_differences = {id(entry.fit): entry.excess for entry in ranking.laws}
    odds = np.array([one.regression.prior_odds for one in refits])
    scores = np.array([bic_differences[id(one.fit)] for one in refits]) - 2.0 * np.log(odds)
    excess, weights = criterion_weights(scores)
    order = np.argsort(scores, kind="stable")
    candidates = tuple(_candidate_law(refits[k], float(excess[k]), float(weights[k])) for k in order)
    best = candidates[0]
    assert best.fit is not None
    return replace(
        temperature_law,
        law=best.fit.law,
        estimates=averaged_estimates(best.fit.law, candidates),
        criterion_data="histories",
        plausible_forms={
            name: _plausible_forms_of_refits(temperature_law, candidates, name)
            for name in temperature_law.isothermal_law.names
        },
        candidates=candidates,
        fit=best.fit,
        notes=(
            *temperature_law.notes,
            *(f"not refitted: {', '.join(key)}: {reason}" for key, reason in failed.items()),
        ),
    )


def _candidate_law(refit: RefittedCombination, criterion_difference: float, weight: float) -> CandidateLaw:
    fit, names = refit.fit, [name for library in refit.forms for name in library.parameter_names]
    theta = dict(zip(fit.law.names, fit.coordinates.theta(fit.u), strict=True))
    jacobian = fit.coordinates.jacobian(fit.u)
    covariance = jacobian @ fit.covariance @ jacobian.T
    indices = [fit.law.names.index(name) for name in names]
    internal = {name: float(theta[name]) for name in names}
    return CandidateLaw(
        refit.forms, internal, covariance[np.ix_(indices, indices)], fit.freedom, criterion_difference, weight, fit
    )


def _plausible_forms_of_refits(
    temperature_law: TemperatureLaw, candidates: Sequence[CandidateLaw], name: str
) -> tuple[FormWeight, ...]:
    """Forms that have 95 % of the weight, then those not refitted whose nearest neighbour is among them."""
    weights: dict[str, float] = {}
    for candidate in candidates:
        weights[candidate.forms[name]] = weights.get(candidate.forms[name], 0.0) + candidate.weight
    retained = [form for form, weight in weight_of_better_forms(weights).items() if weight < CREDIBLE_MASS]
    not_refitted = [form.name for form in temperature_law.plausible_forms[name] if form.name not in weights]
    with_form = temperature_law.combinations.with_form

    def nearest(form: str) -> str:
        return min(
            weights, key=lambda tried: curve_distance(temperature_law, with_form(name, form), with_form(name, tried))
        )

    represented = [form for form in not_refitted if nearest(form) in retained]
    return tuple(FormWeight(form, weights.get(form, 0.0), form in represented) for form in (*retained, *represented))


MAX_FORMS = 6
"""Forms of one parameter that are refitted."""


SIMILAR_CHI_SQUARE = 0.5
"""chi^2 between the curves of two forms below which other forms are tried first."""


def refit(
    temperature_law: TemperatureLaw,
    histories: Sequence[History],
    using: Predictor,
    *,
    max_forms: int = MAX_FORMS,
    settings: IdentificationSettings | None = None,
    search_again: bool = True,
    progress: IterationCallback | None = None,
) -> TemperatureLaw:
    """Refit the forms that remain to the tests, and weigh them by how well they follow these.

    settings : where values are to come from frames of equal weight ("noise", the default) the likelihood takes its
        place: combinations must be compared under one covariance, with scatter between tests and autocorrelation in it.
    max_forms : forms of one parameter that are tried; where an identification is expensive, 3 are enough. The simplest
        law, Arrhenius with every other parameter constant, is always among the combinations.
    search_again : whether the best law is searched for again over the whole of its bounds.
    """
    check_temperatures([h.mean_temperature for h in histories])
    cache = _RefitCache(
        temperature_law.isothermal_estimates,
        list(histories),
        using,
        _likelihood_settings(settings or IdentificationSettings()),
        progress,
    )
    forms_to_try = {
        name: _forms_to_try(temperature_law, name, max_forms) for name in temperature_law.isothermal_law.names
    }
    current = {form.parameter: form for form in temperature_law.candidates[0].candidate_forms}
    baseline = {name: _baseline_form(temperature_law, name) for name in temperature_law.isothermal_law.names}
    cache.total = 2 + sum(len(forms) for forms in forms_to_try.values())
    cache(list(baseline.values()))
    cache(list(current.values()))
    for name in sorted(forms_to_try, key=lambda n: -len(forms_to_try[n])):
        current = cache.try_forms(current, name, forms_to_try[name])
    for name in [n for n in current if current[n].name != baseline[n].name]:
        current = cache.try_forms(current, name, [baseline[name]])
    if not cache.fitted:
        note = f"no form could be refitted to the tests: {next(iter(cache.failed.values()))}"
        return replace(temperature_law, notes=(*temperature_law.notes, note))
    if search_again:
        cache.search_again()
    return weigh_refits(temperature_law, list(cache.fitted.values()), cache.failed)


def _likelihood_settings(settings: IdentificationSettings) -> IdentificationSettings:
    return replace(settings, weights="likelihood") if settings.weights == "noise" else settings


@dataclass(eq=False)
class _RefitCache:
    """Identifications of combinations from all tests, each made once."""

    estimates: IsothermalEstimates
    histories: list[History]
    predictor: Predictor
    settings: IdentificationSettings
    progress: IterationCallback | None
    fitted: dict[tuple[str, ...], RefittedCombination] = field(default_factory=dict)
    failed: dict[tuple[str, ...], str] = field(default_factory=dict)
    total: int = 0

    def __call__(self, forms: Sequence[CandidateForm]) -> None:
        key = tuple(form.name for form in forms)
        if key in self.fitted or key in self.failed:
            return
        fits, failure = [], ""
        try:
            regression = regress(self.estimates, forms)
            law = law_with_forms(self.estimates.law, forms)
            starts = self._starts(law, regression)
        except FAILURES as error:
            starts, failure = [], str(error)
        for start_values in starts:
            try:
                fits.append(self._identify(law, start_values))
            except FAILURES as error:
                failure = str(error)
        if fits:
            fit = max(fits, key=lambda end: end.log_likelihood)
            self.fitted[key] = RefittedCombination(tuple(forms), regression, fit)
        else:
            self.failed[key] = failure
        if self.progress is not None:
            self.progress("form of temperature", min(len(self.fitted) + len(self.failed), self.total), self.total)

    def try_forms(
        self, current: Mapping[str, CandidateForm], name: str, forms: Sequence[CandidateForm]
    ) -> dict[str, CandidateForm]:
        """Other forms of one parameter put in the place of its form now; returns the best combination so far."""
        for form in forms:
            self(list({**current, name: form}.values()))
        return {best_form.parameter: best_form for best_form in self.best.forms} if self.fitted else dict(current)

    def _identify(self, law: CreepLaw, start: Floats | None) -> Identification:
        estimate = StartingEstimate(start, reference=self.estimates.reference)
        return identify(law, self.histories, self.predictor, settings=self.settings, start=estimate)

    def _starts(self, law: CreepLaw, regression: Regression) -> list[Floats | None]:
        """Where the regression ended; where points leave parameters open also the best so far, with idle forms.

        None stands for a search of the whole bounds: where the first law begins then, or where a start has no
        conditioned coordinates.
        """
        starts: list[Floats | None] = [_coordinates_within_bounds(law, regression.values, self.estimates)]
        if self.estimates.has_undetermined_parameters() and not self.fitted:
            starts.append(None)
        elif self.estimates.has_undetermined_parameters():
            fit = self.best.fit
            best_values = dict(zip(fit.law.names, fit.coordinates.theta(fit.u), strict=True))
            inactive_values = {
                name: p.to_internal(p.center if p.off is None else p.off) for name, p in law.table.items()
            }
            starts.append(_coordinates_within_bounds(law, {**inactive_values, **best_values}, self.estimates))
        return [start if start is not None and np.isfinite(start).all() else None for start in starts]

    @property
    def best(self) -> RefittedCombination:
        """The combination of lowest BIC so far; odds of forms count at the end."""
        ranking = rank([refit.fit for refit in self.fitted.values()])
        return next(one for one in self.fitted.values() if one.fit is ranking.best)

    def search_again(self) -> None:
        """Search the best law anew, and keep the better of the two results."""
        best_refit = self.best
        new_fit = self._identify(best_refit.fit.law, None)
        if new_fit.log_likelihood > best_refit.fit.log_likelihood:
            key = tuple(library.name for library in best_refit.forms)
            self.fitted[key] = replace(best_refit, fit=new_fit)


def _coordinates_within_bounds(law: CreepLaw, values: Mapping[str, float], estimates: IsothermalEstimates) -> Floats:
    """Conditioned coordinates, (parameters,), of internal values, within the bounds."""
    theta = np.clip([values[name] for name in law.names], *law.internal_bounds)
    return Coordinates(law, estimates.reference).u(theta)


def _forms_to_try(temperature_law: TemperatureLaw, name: str, max_forms: int) -> list[CandidateForm]:
    """The forms of one parameter to try: first those that the estimates can distinguish, then their neighbours.

    Where points leave parameters open, they do not rule out a form that the tests may well ask for.
    """
    chosen: list[Regression] = []
    forms = [form.name for form in temperature_law.plausible_forms[name]]
    if temperature_law.isothermal_estimates.has_undetermined_parameters():
        forms += dict.fromkeys(
            regression.forms[name]
            for regression in temperature_law.combinations.combinations
            if regression.forms[name] not in forms
        )
    regressions = [temperature_law.combinations.with_form(name, form) for form in forms]
    for one in regressions:
        if all(curve_distance(temperature_law, one, other) > SIMILAR_CHI_SQUARE for other in chosen):
            chosen.append(one)
    chosen += [one for one in regressions if one not in chosen]
    return [_form_of(one, name) for one in chosen[:max_forms]]


def _baseline_form(temperature_law: TemperatureLaw, name: str) -> CandidateForm:
    """Arrhenius of a rate, else the constant, else the best."""
    regressions = {one.forms[name]: one.regression for one in reversed(temperature_law.combinations.combinations)}
    for form in (ARRHENIUS, "constant"):
        if form in regressions:
            return _form_of(regressions[form], name)
    return next(one for one in temperature_law.candidates[0].candidate_forms if one.parameter == name)


def _form_of(regression: Regression, name: str) -> CandidateForm:
    return next(candidate for candidate in regression.candidate_forms if candidate.parameter == name)
