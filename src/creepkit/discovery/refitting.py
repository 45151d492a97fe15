"""Forms put back into the law, refitted to the tests themselves, and weighed by BIC and prior odds.

Regression on estimates inherits how badly single temperatures determine them; the tests together do not. The tests of
each temperature are linearised again about the curves of the best combination, with one simulation of each test and its
derivatives, which gives estimates that are near to one another where the first ones were at the ends of flat valleys.
On them all combinations are ranked anew. The credible ones and the simplest one, Arrhenius with every other parameter
constant, become ordinary laws that are identified from all tests, beginning where the regression ended, and ranked by
BIC under one covariance; one represents those that the estimates cannot distinguish from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.combinations import (
    CREDIBLE_MASS,
    FAILURES,
    FormWeight,
    RankedCombinations,
    progress_with_duration,
    rank_combinations,
    squared_mahalanobis,
    weight_of_better_forms,
    weights_of_forms,
)
from creepkit.discovery.forms import ARRHENIUS, CONSTANT, CandidateForm, evaluate_forms, law_with_forms
from creepkit.discovery.regression import (
    FormCombination,
    IsothermalEstimates,
    check_temperatures,
    isothermal_groups,
    regress,
)
from creepkit.discovery.temperature_law import TemperatureLaw, averaged_estimates
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify, identify_values
from creepkit.inverse.information_criteria import criterion_weights
from creepkit.inverse.initial_search import StartingEstimate
from creepkit.inverse.iterative_estimation import linearised, starting_point
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.ranking import Ranking
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor


def weigh_refits(
    temperature_law: TemperatureLaw,
    refits: Sequence[FormCombination],
    failed: Mapping[tuple[str, ...], str],
    points: IsothermalEstimates,
) -> TemperatureLaw:
    """The temperature law with forms weighed by the tests.

    failed : {forms: why they could not be refitted}, which become notes. points : those that combinations were ranked
        on last.
    """
    bic_differences = {id(entry.fit): entry.excess for entry in _ranked(refits).laws}
    scores = np.array([bic_differences[id(one.fit)] - 2.0 * np.log(one.prior_odds) for one in refits])
    excess, weights = criterion_weights(scores)
    order = np.argsort(scores, kind="stable")
    candidates = tuple(_with_numbers_of_fit(refits[k], float(excess[k]), float(weights[k])) for k in order)
    best = _identified(candidates[0].fit)
    return replace(
        temperature_law,
        law=best.law,
        estimates=averaged_estimates(best.law, candidates),
        criterion_data="histories",
        plausible_forms={
            name: _plausible_forms_of_refits(temperature_law.combinations, points, candidates, name)
            for name in temperature_law.isothermal_law.names
        },
        candidates=candidates,
        fit=best,
        notes=(
            *temperature_law.notes,
            *(f"not refitted: {', '.join(key)}: {reason}" for key, reason in failed.items()),
        ),
    )


def _identified(fit: Identification | None) -> Identification:
    assert fit is not None  # of a combination that was refitted
    return fit


def _with_numbers_of_fit(refit: FormCombination, criterion_difference: float, weight: float) -> FormCombination:
    """A refitted combination with the numbers that the tests give."""
    fit, names = _identified(refit.fit), [name for form in refit.candidate_forms for name in form.parameter_names]
    jacobian, indices = fit.coordinates.jacobian(fit.u), [fit.law.names.index(name) for name in names]
    covariance = (jacobian @ fit.covariance @ jacobian.T)[np.ix_(indices, indices)]
    values = _internal_values(fit)
    return replace(
        refit,
        values={name: values[name] for name in names},
        covariance=covariance,
        degrees_of_freedom=fit.freedom,
        criterion_difference=criterion_difference,
        weight=weight,
    )


def _internal_values(fit: Identification) -> dict[str, float]:
    return dict(zip(fit.law.names, fit.coordinates.theta(fit.u).tolist(), strict=True))


def _plausible_forms_of_refits(
    combinations: RankedCombinations, points: IsothermalEstimates, candidates: Sequence[FormCombination], name: str
) -> tuple[FormWeight, ...]:
    """Forms that have 95 % of the weight, then those not refitted whose nearest neighbour is among them."""
    weights = weights_of_forms(candidates, name)
    retained = [form for form, weight in weight_of_better_forms(weights).items() if weight < CREDIBLE_MASS]
    known = {combination.forms[name] for combination in combinations.combinations}
    tried = [form for form in weights if form in known]

    def nearest(form: str) -> str:
        curve = combinations.with_form(name, form)
        distances = [
            squared_mahalanobis(curve, combinations.with_form(name, one), points, combinations.overdispersion)
            for one in tried
        ]
        return tried[int(np.argmin(distances))]

    not_refitted = [form.name for form in combinations.plausible_forms[name] if form.name not in weights]
    represented = [form for form in not_refitted if tried and nearest(form) in retained]
    return tuple(FormWeight(form, weights.get(form, 0.0), form in represented) for form in (*retained, *represented))


MAX_REFITS = 6
"""Combinations that are refitted to all tests."""


MAX_ROUNDS = 4
"""How often the tests are linearised about the curves of the best forms, and combinations are ranked again."""


REFITS_PER_ROUND = 2


ENOUGH_CHI_SQUARE = 12.0
"""Rise of chi^2 from the best combination up to which a simpler one is refitted."""


NEAR_BIC = 6.0
"""BIC less the best up to which a combination is refitted with simpler forms."""


SIMILAR_CHI_SQUARE = 1.0
"""chi^2 between the curves of two combinations below which the one of more numbers is not refitted beside the other."""


def refit(
    temperature_law: TemperatureLaw,
    histories: Sequence[History],
    using: Predictor,
    *,
    max_refits: int = MAX_REFITS,
    settings: IdentificationSettings | None = None,
    joint_fit: Identification | None = None,
    progress: IterationCallback | None = None,
) -> TemperatureLaw:
    """Refit the combinations that remain to the tests, and weigh them by how well they follow these.

    settings : of every identification; combinations are compared under one covariance, with scatter between tests and
        autocorrelation in it.
    max_refits : combinations that are refitted at most; the simplest law, Arrhenius with every other parameter
        constant, is always among them.
    joint_fit : an identification of that law from all tests, where to begin.
    """
    check_temperatures([h.mean_temperature for h in histories])
    cache = _RefitCache(
        temperature_law.isothermal_estimates,
        list(histories),
        using,
        settings or IdentificationSettings(),
        None if progress is None else progress_with_duration("refits of forms", progress),
        max_refits,
    )
    combinations, points, notes = temperature_law.combinations, temperature_law.isothermal_estimates, []
    cache(combinations.best.candidate_forms, points, joint_fit)
    cache(_baseline(combinations), points, joint_fit)
    every, last = combinations.candidates, None
    linear = {name: [one for one in own if not one.nonlinear_parameters] or own for name, own in every.items()}
    try:
        for _ in range(MAX_ROUNDS):
            if not cache.fitted or cache.best is last:
                break
            last = cache.best
            points = cache.linearised_about(last)
            cache.refit_credible(rank_combinations(points, linear, optimizer=combinations.optimizer), points)
        combinations = rank_combinations(points, every, optimizer=combinations.optimizer)
        cache.refit_credible(combinations, points)
        cache.refit_simpler(_baseline(combinations), points)
    except FAILURES as error:
        notes.append(f"the search of forms by all tests ended early: {error}")
    if not cache.fitted:
        notes.append(f"no form could be refitted to the tests: {next(iter(cache.failed.values()))}")
        return replace(temperature_law, notes=(*temperature_law.notes, *notes))
    cache.finish()
    return weigh_refits(
        replace(temperature_law, combinations=combinations, notes=(*temperature_law.notes, *notes)),
        list(cache.fitted.values()),
        cache.failed,
        points,
    )


def _baseline(combinations: RankedCombinations) -> list[CandidateForm]:
    """Arrhenius of a rate, else the constant, else the best."""
    best = {form.parameter: form for form in combinations.best.candidate_forms}
    by_name = {name: {form.name: form for form in forms} for name, forms in combinations.candidates.items()}
    return [own.get(ARRHENIUS) or own.get(CONSTANT) or best[name] for name, own in by_name.items()]


@dataclass(eq=False)
class _RefitCache:
    """Identifications of combinations from all tests, each made once."""

    estimates: IsothermalEstimates
    histories: list[History]
    predictor: Predictor
    settings: IdentificationSettings
    progress: IterationCallback | None
    max_refits: int
    fitted: dict[tuple[str, ...], FormCombination] = field(default_factory=dict)
    failed: dict[tuple[str, ...], str] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Combinations that were refitted, or could not be."""
        return len(self.fitted) + len(self.failed)

    def __call__(
        self, forms: Sequence[CandidateForm], points: IsothermalEstimates, joint_fit: Identification | None = None
    ) -> None:
        """Refit a combination, beginning at its regression on points, or at a fit of the same law."""
        key = tuple(form.name for form in forms)
        if key in self.fitted or key in self.failed:
            return
        try:
            regression = regress(points, forms)
            law = law_with_forms(self.estimates.law, forms)
            fits = [self._identify(law, start) for start in self._starts(law, regression, joint_fit)]
        except FAILURES as error:
            self.failed[key] = str(error)
        else:
            fit = max(fits, key=lambda end: end.log_likelihood)
            self.fitted[key] = replace(regression, fit=fit)
        if self.progress is not None:
            self.progress("", self.count, self.max_refits)

    def refit_credible(self, combinations: RankedCombinations, points: IsothermalEstimates) -> None:
        """Refit the combinations that have 95 % of the weight, but those that another represents."""
        weight, before = 0.0, self.count
        tried = [one for one in combinations.combinations if tuple(one.forms.values()) in self.fitted]
        for one in combinations.combinations:
            represented = any(
                other.parameter_count <= one.parameter_count
                and squared_mahalanobis(one, other, points, 1.0) < SIMILAR_CHI_SQUARE
                for other in tried
            )
            if weight > CREDIBLE_MASS or self.count >= min(self.max_refits, before + REFITS_PER_ROUND):
                return
            weight += one.weight
            if not represented:
                self(one.candidate_forms, points)
                tried.append(one)

    def refit_simpler(self, baseline: Sequence[CandidateForm], points: IsothermalEstimates) -> None:
        """Refit what remains with one parameter at a time in its simplest form, where that may be enough.

        Two parameters that both have a wrong form make up for each other, so that combinations near the best count too.
        """
        near = {id(one.fit) for one in _ranked(self.fitted.values()).laws if one.excess < NEAR_BIC}
        for refit in [one for one in self.fitted.values() if id(one.fit) in near]:
            forms = list(refit.candidate_forms)
            enough = regress(points, forms).chi_square + ENOUGH_CHI_SQUARE
            for k, simple in enumerate(baseline):
                simpler = [*forms[:k], simple, *forms[k + 1 :]]
                if simple.name != forms[k].name and regress(points, simpler).chi_square < enough:
                    self(simpler, points)

    def linearised_about(self, refit: FormCombination) -> IsothermalEstimates:
        """Estimates at each temperature by one step of Gauss and Newton from the curves of a refit.

        Each temperature keeps the noise that its identification found; that of the refit holds what its forms miss.
        """
        points, law = self.estimates, self.estimates.law
        fit_of_all = _identified(refit.fit)
        curves = evaluate_forms(refit.candidate_forms, _internal_values(fit_of_all), points.temperatures)
        curves = np.clip(curves, *law.internal_bounds)
        nuisances = {(n.key, n.owner): n.value for n in fit_of_all.nuisances}
        groups = isothermal_groups([h.mean_temperature for h in self.histories])
        theta, covariance = [], []
        for fit, curve in zip(points.fits, curves, strict=True):
            T = fit.reference.temperature
            tests = min(
                ([self.histories[k] for k in group] for group in groups),
                key=lambda own: abs(float(np.median([h.mean_temperature for h in own])) - T),
            )
            problem = LeastSquaresProblem.from_histories(law, tests, self.predictor, self.settings, points.reference)
            u = problem.coordinates.u(curve)
            x = starting_point(problem.nuisance_parameters, u, nuisances)
            residuals = problem.residuals(x)
            linear, factor = (
                linearised(problem, x, residuals),
                CovarianceFactor.of_residuals(residuals, fit.noise_model),
            )
            solution = replace(linear, free=np.ones_like(linear.free)).solve(factor)
            to_theta = problem.coordinates.jacobian(u)
            theta.append(curve + to_theta @ solution.step[: u.size])
            covariance.append(to_theta @ solution.covariance[: u.size, : u.size] @ to_theta.T)
        return replace(points, theta=np.stack(theta), covariance=np.stack(covariance))

    def finish(self) -> None:
        """The best law with all that an identification says."""
        best = self.best
        fit = _identified(best.fit)
        start = StartingEstimate.from_identification(fit)
        fit = identify(fit.law, self.histories, self.predictor, settings=self.settings, start=start)
        self.fitted[tuple(best.forms.values())] = replace(best, fit=fit)

    def _identify(self, law: CreepLaw, start: Floats | None) -> Identification:
        estimate = StartingEstimate(start, reference=self.estimates.reference)
        return identify_values(law, self.histories, self.predictor, settings=self.settings, start=estimate)

    def _starts(
        self, law: CreepLaw, regression: FormCombination, joint_fit: Identification | None
    ) -> list[Floats | None]:
        """Where a fit of this law ended, or else the regression.

        None stands for a search of the whole bounds: where the first law begins without a fit of it and points leave
        parameters open, or where a start has no conditioned coordinates.
        """
        values, undetermined = regression.values, self.estimates.has_undetermined_parameters()
        is_known = joint_fit is not None and set(joint_fit.law.names) == set(law.names)
        if joint_fit is not None and is_known:
            values = _internal_values(joint_fit)
        theta = np.clip([values[name] for name in law.names], *law.internal_bounds)
        start = Coordinates(law, self.estimates.reference).u(theta)
        starts = [start if np.isfinite(start).all() else None]
        return [*starts, None] if undetermined and not is_known and not self.fitted else starts

    @property
    def best(self) -> FormCombination:
        """The combination of lowest BIC so far; odds of forms count at the end."""
        best = _ranked(self.fitted.values()).best
        return next(one for one in self.fitted.values() if one.fit is best)


def _ranked(refits: Iterable[FormCombination]) -> Ranking:
    """The identifications of refits by BIC."""
    return rank([_identified(one.fit) for one in refits], challenge=False)
