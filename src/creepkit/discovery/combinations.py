"""Combinations of forms, one for each parameter: Akaike weights, and which forms the estimates cannot distinguish.

The score of a combination is the quasi AICc (Burnham and Anderson (2002), Model Selection and Multimodel Inference,
sec. 2.5),

    chi^2 / c + 2 k + 2 k (k + 1)/(N - k - 1) - 2 ln(prior odds),

with k numbers, N rows and c = max(1, least chi^2/(N - k)), which widens covariances that are too small for every form.
Few combinations are all tried; many are searched greedily, one parameter at a time with the others fixed. One that
fails is recorded with its reason, and the others go on.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.forms import ARRHENIUS, CandidateForm, law_with_forms
from creepkit.discovery.regression import FormCombination, IsothermalEstimates, regress
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.evidence import evidence_weights
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.jobs.progress import duration_text
from creepkit.language import CreepLaw

MAX_EXHAUSTIVE = 150
"""Up to so many combinations are all tried."""


MAX_SWEEPS = 4


CREDIBLE_MASS = 0.95


FAILURES = (CreepkitError, ArithmeticError, TypeError, ValueError)
"""What one combination may end with: a law that is too large or impossible, a form that is no number, a regression that
does not converge."""


CHI_SQUARE_95 = 3.84
"""chi^2 of one degree of freedom at 95 %: curves closer than that, by the points' own covariances, are equivalent."""


@dataclass(frozen=True)
class FormWeight:
    """A form of one parameter: its weight, and whether the estimates cannot distinguish it from the best one."""

    name: str
    weight: float
    equivalent: bool


@dataclass(frozen=True, eq=False)
class RankedCombinations:
    """All combinations that were tried, best first.

    overdispersion : c, by which the covariances of the estimates are too small.
    plausible_forms : {parameter: forms that remain, best first}: those that have 95 % of the weight, and those
        equivalent to the best with no more numbers.
    candidates : {parameter: the forms it may take}. law : the law with the best forms.
    failed : {forms, in the order of the parameters: why nothing came of them}.
    """

    combinations: tuple[FormCombination, ...]
    overdispersion: float
    plausible_forms: Mapping[str, tuple[FormWeight, ...]]
    candidates: Mapping[str, Sequence[CandidateForm]]
    law: CreepLaw
    failed: Mapping[tuple[str, ...], str]
    optimizer: Any = None

    @property
    def best(self) -> FormCombination:
        """The combination of the highest weight."""
        return self.combinations[0]

    def with_form(self, parameter: str, form: str) -> FormCombination:
        """The best combination that has this form of a parameter."""
        return next(one for one in self.combinations if one.forms[parameter] == form)


def rank_combinations(
    points: IsothermalEstimates,
    candidates: Mapping[str, Sequence[CandidateForm]],
    progress: IterationCallback | None = None,
    optimizer: Any = None,
) -> RankedCombinations:
    """Fit combinations of one library for each parameter, and weigh them; optimizer : see regress()."""
    names, combination_count = list(candidates), int(np.prod([len(forms) for forms in candidates.values()]))
    cache = _RegressionCache(
        points,
        min(combination_count, MAX_SWEEPS * sum(len(own) for own in candidates.values())),
        None if progress is None else progress_with_duration("combinations of forms", progress),
        optimizer,
    )
    if combination_count <= MAX_EXHAUSTIVE:
        cache.total = combination_count
        for forms_of_combination in product(*candidates.values()):
            cache(forms_of_combination)
    else:
        _coordinate_search(cache, candidates)
    distinct = {tuple(one.forms.values()): one for one in cache.regressions.values()}  # terms may have been dropped
    admissible = [
        regression
        for regression in distinct.values()
        if regression.parameter_count < regression.rows - 1 and regression.within_bounds()
    ]
    while admissible:
        overdispersion = max(1.0, min(one.chi_square / (one.rows - one.parameter_count) for one in admissible))
        scores = np.array([_quasi_aicc(one, overdispersion) for one in admissible])
        order = np.argsort(scores, kind="stable")
        best = admissible[order[0]]
        try:
            law = law_with_forms(points.law, best.candidate_forms)
            break
        except FAILURES as error:  # as of a law with so many numbers that its derivatives are too large
            cache.failed[tuple(best.forms.values())] = str(error)
            admissible.remove(best)
    else:
        reason = next(iter(cache.failed.values()), "none within its bounds has fewer numbers than these points allow")
        raise FitError(f"no combination of forms of {', '.join(names)} is possible: {reason}")
    excess, weights = evidence_weights(scores)
    combinations = [
        replace(admissible[k], criterion_difference=float(excess[k]), weight=float(weights[k])) for k in order
    ]
    plausible_forms = {name: _plausible_forms(name, combinations, points, overdispersion) for name in names}
    return RankedCombinations(
        tuple(combinations), overdispersion, plausible_forms, candidates, law, cache.failed, optimizer
    )


def progress_with_duration(what: str, progress: IterationCallback) -> IterationCallback:
    """Progress of work of many like parts, named with the time that all will take, measured on the first of them.

    what : the parts, in the plural.
    """
    names: list[str] = []
    start = time.monotonic()

    def tick(part: str, done: int, total: int) -> None:
        if not names:
            names.append(f"{total} {what} at most, about {duration_text(total / done * (time.monotonic() - start))}")
        progress(names[0], done, total)

    return tick


class _RegressionCache:
    """Regressions of combinations, each made once; total : how many there may be; failed : why of those that end."""

    def __init__(
        self, points: IsothermalEstimates, total: int, progress: IterationCallback | None, optimizer: Any
    ) -> None:
        self.points, self.total, self.progress, self.optimizer = points, total, progress, optimizer
        self.regressions: dict[tuple[str, ...], FormCombination] = {}
        self.failed: dict[tuple[str, ...], str] = {}

    def __call__(self, forms: Sequence[CandidateForm]) -> FormCombination | None:
        key = tuple(form.name for form in forms)
        if key not in self.regressions and key not in self.failed:
            try:
                self.regressions[key] = regress(self.points, forms, self.optimizer)
            except FAILURES as error:
                self.failed[key] = str(error)
            if self.progress is not None:
                self.progress("", len(self.regressions) + len(self.failed), self.total)
        return self.regressions.get(key)

    def score(self, forms: Sequence[CandidateForm]) -> float:
        """The quasi AICc of a combination; infinite where it fails."""
        regression = self(forms)
        return np.inf if regression is None else _quasi_aicc(regression, 1.0)


def _coordinate_search(cache: _RegressionCache, candidates: Mapping[str, Sequence[CandidateForm]]) -> None:
    """From Arrhenius and constants, change one parameter's form at a time for the better until none is."""
    current = [next((form for form in forms if form.name == ARRHENIUS), forms[0]) for forms in candidates.values()]
    for _ in range(MAX_SWEEPS):
        previous = [one.name for one in current]
        for k, own in enumerate(candidates.values()):
            current = min(([*current[:k], one, *current[k + 1 :]] for one in own), key=cache.score)
        if [one.name for one in current] == previous:
            return


def _quasi_aicc(regression: FormCombination, overdispersion: float) -> float:
    k, rows = regression.parameter_count, regression.rows
    if rows - k - 1 <= 0:
        return np.inf
    small_sample_correction = 2.0 * k * (k + 1) / (rows - k - 1)
    return float(
        regression.chi_square / overdispersion + 2.0 * k + small_sample_correction - 2.0 * np.log(regression.prior_odds)
    )


def squared_mahalanobis(
    first: FormCombination, second: FormCombination, points: IsothermalEstimates, overdispersion: float
) -> float:
    """chi^2 between the curves of two combinations, by the covariances of the points.

    It is by how much chi^2 would rise on average if one were true and the other fitted.
    """
    whitened: Floats = np.einsum("kij,kj->ki", points.whitening, first.fitted_theta - second.fitted_theta)
    return float((whitened**2).sum() / overdispersion)


def weight_of_better_forms(weights: Mapping[str, float]) -> dict[str, float]:
    """{form: weight of all forms before it}, best first; below CREDIBLE_MASS a form belongs to the credible set."""
    ranked = sorted(weights, key=lambda form: -weights[form])
    cumulative = np.cumsum([0.0, *(weights[form] for form in ranked)])
    return dict(zip(ranked, cumulative[:-1].tolist(), strict=True))


def weights_of_forms(combinations: Sequence[FormCombination], parameter: str) -> dict[str, float]:
    """{form of a parameter: weight of all combinations that have it}."""
    weights: dict[str, float] = {}
    for one in combinations:
        weights[one.forms[parameter]] = weights.get(one.forms[parameter], 0.0) + one.weight
    return weights


def _plausible_forms(
    name: str, combinations: Sequence[FormCombination], points: IsothermalEstimates, overdispersion: float
) -> tuple[FormWeight, ...]:
    weights = weights_of_forms(combinations, name)
    of_form = {one.forms[name]: one for one in reversed(combinations)}
    weight_before = weight_of_better_forms(weights)
    first, *_ = weight_before
    plausible = []
    for form, before in weight_before.items():
        distance = squared_mahalanobis(of_form[form], of_form[first], points, overdispersion)
        no_larger = _parameter_count(of_form[form], name) <= _parameter_count(of_form[first], name)
        if before < CREDIBLE_MASS or (distance < CHI_SQUARE_95 and no_larger):
            plausible.append(FormWeight(form, weights[form], distance < CHI_SQUARE_95))
    return tuple(plausible)


def _parameter_count(regression: FormCombination, parameter: str) -> int:
    return next(library.parameter_count for library in regression.candidate_forms if library.parameter == parameter)
