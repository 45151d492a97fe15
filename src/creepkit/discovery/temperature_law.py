"""TemperatureLaw: a law with temperature-dependent parameters, its plausible forms, validity and JSON file.

Regression on estimates inherits how badly single temperatures determine them; the tests together do not. They are
linearised again about the curves of the best combination, with one simulation of each test and its derivatives, which
gives estimates that are near to one another where the first ones were at the ends of flat valleys, and all combinations
are ranked anew. The credible ones and the simplest one, Arrhenius with every other parameter constant, are identified
from all tests as ordinary laws and ranked by their evidence; one represents those that cannot be distinguished from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
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
    INFINITE_FREEDOM,
    FormCombination,
    IsothermalEstimates,
    WhitenedSystem,
    check_temperatures,
    isothermal_groups,
    regress,
    whitened_system,
)
from creepkit.errors import FitError, nearest
from creepkit.files.json_documents import DocumentFormat, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, ValueCodec
from creepkit.inverse.adequacy import Adequacy
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.evidence import evidence_weights
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import LAW_CODEC, identification_from_json, identification_to_json
from creepkit.inverse.identify import identify
from creepkit.inverse.iterative_estimation import starting_point
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.search.multistart import StartingEstimate
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.ranking import Ranking
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.laplace_approximation import Estimate, interval_ends, verdict_of_interval
from creepkit.inverse.uncertainty.mixture_distribution import MixtureDistribution
from creepkit.language import CreepLaw
from creepkit.records import History, LawWithValues, Predictor
from creepkit.records.presentable import Plotted, Presentable

TEMPERATURE_LAW = DocumentFormat(
    "creepkit-temperature-law",
    2,
    FileKind("a temperature law", FitError, "give a file that TemperatureLaw.save wrote"),
    remedy="run discover again",
)


FIELDS_WRITTEN: tuple[str, ...] = ("law", "isothermal_law", "T_ref", "temperature_range", "criterion_data")
FIELDS_WRITTEN += ("estimates", "plausible_forms", "fit", "notes")


MAX_COMBINATIONS_WRITTEN = 20
"""Combinations that are written, best first."""


def temperature_law_to_json(temperature_law: TemperatureLaw) -> dict[str, Any]:
    """The result as JSON-able data."""
    estimates = temperature_law.isothermal_estimates
    content: dict[str, Any] = {
        "creepkit": version("creepkit"),
        **{name: getattr(temperature_law, name) for name in FIELDS_WRITTEN},
        "candidates": [
            {
                "forms": candidate.forms,
                "internal_values": candidate.values,
                "covariance": candidate.covariance,
                "criterion_difference": candidate.criterion_difference,
                "weight": candidate.weight,
            }
            for candidate in temperature_law.candidates[:MAX_COMBINATIONS_WRITTEN]
        ],
        "isothermal_estimates": {
            "temperatures": estimates.temperatures,
            "theta": estimates.theta,
            "covariance": estimates.covariance,
            "overdispersion": temperature_law.combinations.overdispersion,
        },
        "reference": estimates.reference,
    }
    return {**TEMPERATURE_LAW.heading, **CODEC.to_json(content)}


CODEC = RecordCodec(
    values={CreepLaw: LAW_CODEC, Identification: ValueCodec(identification_to_json, identification_from_json)}
)


NOTED_OVERDISPERSION = 1.5
"""Inflation of covariances from which a note is made."""


@dataclass(frozen=True, eq=False)
class TemperatureLaw(Presentable, Plotted):
    """The result of discover() and of refit().

    law : an ordinary law with temperature in it, printed and exported like any other; `valued` has its numbers.
    isothermal_law : the law without temperature. T_ref : K, where its parameters have the values stated.
    estimates : its numbers with 95 % intervals, over all candidates that share the form they belong to.
    temperature_range : K, the temperatures it was found from. criterion_data : "points" when regression on isothermal
        estimates chose the forms, "histories" when the tests themselves did.
    plausible_forms : {parameter: forms that remain, best first}. candidates : combinations of forms, best first.
    fit : the identification of `law` from all tests, once refitted.
    """

    law: CreepLaw
    isothermal_law: CreepLaw
    T_ref: float
    estimates: tuple[Estimate, ...]
    temperature_range: tuple[float, float]
    criterion_data: Literal["points", "histories"]
    plausible_forms: Mapping[str, tuple[FormWeight, ...]]
    candidates: tuple[FormCombination, ...]
    isothermal_estimates: IsothermalEstimates
    combinations: RankedCombinations
    fit: Identification | None = None
    notes: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """{parameter: value} of `law`, in the author's units."""
        return {e.name: e.value for e in self.estimates}

    @property
    def system(self) -> WhitenedSystem:
        """The linear system of all candidate forms on the isothermal estimates, for regressions of one's own."""
        return whitened_system(self.isothermal_estimates, self.combinations.candidates)

    @property
    def adequacy(self) -> Adequacy | None:
        """Whether the law explains all tests to their noise, once it was refitted to them."""
        return None if self.fit is None else self.fit.adequacy

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its best form}."""
        return self.candidates[0].forms

    @property
    def valued(self) -> LawWithValues:
        """The law with its numbers, intervals and range of validity: what every exporter takes."""
        return LawWithValues(self.law, self.values, tuple(export_notes(self)), ranges=self.isothermal_estimates.ranges)

    def estimate(self, name: str) -> Estimate:
        """One number of the law, such as Q, with its interval."""
        if name in self.values:
            return next(one for one in self.estimates if one.name == name)
        raise FitError(f"law '{self.law.name}' has no parameter '{name}': {nearest(name, self.law.names)}")

    def parameters_at(self, T: ArrayLike) -> dict[str, Floats]:
        """{parameter of `isothermal_law`: (temperatures,) its values}; FitError outside the range.

        T : a number or (temperatures,) K.
        """
        temperatures = np.atleast_1d(np.asarray(T, float))
        low, high = self.temperature_range
        if ((temperatures < low - 1e-6) | (temperatures > high + 1e-6)).any():
            raise FitError(f"law '{self.law.name}' holds between {low:.0f} and {high:.0f} K; it was evaluated outside")
        theta = self.candidates[0].theta(temperatures)
        scale = [p.scale for p in self.isothermal_law.params.values()]
        values = np.where([s == "log" for s in scale], np.exp(np.minimum(theta, 700.0)), theta)
        return dict(zip(self.isothermal_law.names, values.T, strict=True))

    def save(self, path: str | Path) -> Path:
        """Write the result as JSON (to a temporary name, then renamed)."""
        return write_json(temperature_law_to_json(self), Path(path), TEMPERATURE_LAW.kind)

    drawn_by = "temperature_law.temperature_law_figure", "temperature_law.draw_parameter"

    shown_by = "temperature_law.temperature_law_text"


def temperature_law_from_combinations(
    estimates: IsothermalEstimates, combinations: RankedCombinations
) -> TemperatureLaw:
    """The temperature law that the isothermal estimates alone give."""
    c = combinations.overdispersion
    candidates = tuple(
        replace(
            one,
            covariance=one.covariance * c,
            degrees_of_freedom=INFINITE_FREEDOM if c == 1.0 else float(max(one.rows - one.parameter_count, 1)),
        )
        for one in combinations.combinations
    )
    law, notes = combinations.law, failure_notes(combinations.failed)
    if c > NOTED_OVERDISPERSION:
        notes.append(f"no form follows the points within their errors, which were taken {np.sqrt(c):.2g} times wider")
    return TemperatureLaw(
        law=law,
        isothermal_law=estimates.law,
        T_ref=estimates.reference.temperature,
        estimates=averaged_estimates(law, candidates),
        temperature_range=(float(estimates.temperatures.min()), float(estimates.temperatures.max())),
        criterion_data="points",
        plausible_forms=combinations.plausible_forms,
        candidates=candidates,
        isothermal_estimates=estimates,
        combinations=combinations,
        notes=tuple(notes),
    )


def failure_notes(failed: Mapping[tuple[str, ...], str]) -> list[str]:
    """How many combinations of forms failed, with the first of them and its reason, in one sentence; or none."""
    first = next(iter(failed), ())
    count = f"{len(failed)} combination{'s' * (len(failed) > 1)} of forms failed"
    return [f"{count}; the first, {', '.join(first)}, with: {failed[first]}"] if failed else []


def averaged_estimates(law: CreepLaw, candidates: Sequence[FormCombination]) -> tuple[Estimate, ...]:
    """The best candidate's numbers; intervals over all that have the same form of the parameter concerned."""
    best, estimates = candidates[0], {}
    for form in best.candidate_forms:
        same_form = [candidate for candidate in candidates if candidate.forms[form.parameter] == form.name]
        for name in form.parameter_names:
            estimates[name] = _estimate(name, form, same_form)
    return tuple(estimates[name] for name in law.names)


def _estimate(name: str, form: CandidateForm, candidates: Sequence[FormCombination]) -> Estimate:
    param, value = form.table[name], candidates[0].values[name]
    weights = np.array([one.weight for one in candidates])
    values = np.array([one.values[name] for one in candidates])
    standard_deviations = np.array([one.standard_deviation(name) for one in candidates])
    mixture = MixtureDistribution(
        weights / weights.sum(),
        np.maximum([one.degrees_of_freedom for one in candidates], 1.0),
        values,
        np.maximum(standard_deviations, 1e-300),
    )
    _, low, high = (float(end) for end in mixture.interval())
    lower_bound, upper_bound = (param.to_internal(b) for b in param.bounds)
    value, low, high = (float(np.clip(v, lower_bound, upper_bound)) for v in (value, low, high))
    verdict = verdict_of_interval(param, value, (low, high))
    from_internal = param.from_internal
    return Estimate(name, from_internal(value), from_internal(low), from_internal(high), param.unit, verdict)


def export_notes(temperature_law: TemperatureLaw) -> list[str]:
    """Validity, intervals and forms of a law, as comments of an export."""
    low, high = temperature_law.temperature_range
    parameter_lines = [
        f"{e.name} = {e.value:.8g} [{', '.join(interval_ends(temperature_law.law, e))}] {e.unit}: {e.verdict}"
        for e in temperature_law.estimates
    ]
    forms = [
        f"{name}: {', '.join(form.name for form in form_weights)}"
        for name, form_weights in temperature_law.plausible_forms.items()
    ]
    return [
        f"valid between {low:.0f} and {high:.0f} K; 95 % intervals in brackets",
        *parameter_lines,
        *(f"forms of temperature that remain for {line}" for line in forms),
    ]


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
    differences = {id(entry.fit): entry.excess for entry in _ranked(refits).laws}
    scores = np.array([differences[id(one.fit)] - 2.0 * np.log(one.prior_odds) for one in refits])
    excess, weights = evidence_weights(scores)
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
        degrees_of_freedom=INFINITE_FREEDOM,
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


NEAR = 6.0
"""-2 ln of the evidence over that of the best, up to which a combination is refitted with simpler forms."""


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
    joint_fit : an identification of that law from all tests, where to begin: where single temperatures leave
        parameters open, other combinations begin at the tests made linear about it.
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
    cache(_baseline(combinations), points, joint_fit)
    if not (cache.fitted and points.has_undetermined_parameters):  # by which nothing is best
        cache(combinations.best.candidate_forms, points)
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
        near = {id(one.fit) for one in _ranked(self.fitted.values()).laws if one.excess < NEAR}
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
                problem.linearised(x, residuals),
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
        estimate = StartingEstimate(start, reference=self.estimates.reference, values_only=True)
        return identify(law, self.histories, self.predictor, settings=self.settings, start=estimate)

    def _starts(
        self, law: CreepLaw, regression: FormCombination, joint_fit: Identification | None
    ) -> list[Floats | None]:
        """Where a fit of this law ended, or else the regression.

        None stands for a search of the whole bounds: where the first law begins without a fit of it and points leave
        parameters open, or where a start has no conditioned coordinates.
        """
        values, undetermined = regression.values, self.estimates.has_undetermined_parameters
        is_known = joint_fit is not None and set(joint_fit.law.names) == set(law.names)
        if joint_fit is not None and is_known:
            values = _internal_values(joint_fit)
        theta = np.clip([values[name] for name in law.names], *law.internal_bounds)
        start = Coordinates(law, self.estimates.reference).u(theta)
        starts = [start if np.isfinite(start).all() else None]
        return [*starts, None] if undetermined and not is_known and not self.fitted else starts

    @property
    def best(self) -> FormCombination:
        """The combination of most evidence so far; odds of forms count at the end."""
        best = _ranked(self.fitted.values()).best
        return next(one for one in self.fitted.values() if one.fit is best)


def _ranked(refits: Iterable[FormCombination]) -> Ranking:
    """The identifications of refits by their evidence."""
    return rank([_identified(one.fit) for one in refits], challenge=False)
