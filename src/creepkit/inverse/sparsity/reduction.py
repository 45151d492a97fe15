"""Laws of some terms of a sum, fitted on its stage; exponents that can be off are, where BIC does not rise by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.search.refining import Minimum
from creepkit.inverse.sparsity.penalised import switchable_exponents
from creepkit.inverse.sparsity.stage import TermProblem
from creepkit.language import CreepLaw

LEAST_CONTRIBUTION = 0.05
"""A term that contributes less than this is dropped."""
INITIAL_FRACTION = 0.05
"""Share of the rate with which a second term begins beside a fitted one."""

TermNames = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ReducedLaw:
    """A law of some of the terms, and its fit without penalty.

    kept : its terms, in the order of the sum; off : its exponents that were switched off; criterion : BIC.
    """

    problem: TermProblem
    minimum: Minimum
    kept_terms: TermNames
    exponents_off: tuple[str, ...]
    bic: float

    @property
    def law(self) -> CreepLaw:
        """The reduced law."""
        return self.problem.law

    @property
    def x(self) -> Floats:
        """Where it fits best."""
        return self.minimum.u

    @property
    def chi_square(self) -> float:
        """Sum of squared white residuals, priors included."""
        return 2.0 * self.minimum.cost

    @property
    def parameter_count(self) -> int:
        """Number of parameters of the law that were fitted."""
        return self.problem.determined_parameter_count(self.x)


class ReducedLaws:
    """The laws of some of the terms of a stage's law, each fitted once.

    before : the same laws fitted on another stage of the same law, whose optima are then the only starts.
    """

    def __init__(self, problem: TermProblem, previous: ReducedLaws | None = None) -> None:
        self.problem, self.terms, self.previous = problem, tuple(problem.law.terms), previous
        self._fitted_laws: dict[TermNames, ReducedLaw] = {}
        self._full: ReducedLaw | None = None

    def with_terms(self, names: Sequence[str]) -> ReducedLaw:
        """The law of these terms."""
        terms = tuple(label for label in self.terms if label in names)
        if terms not in self._fitted_laws:
            self._fitted_laws[terms] = with_exponents_off(self._fitted_problem(terms), terms)
        return self._fitted_laws[terms]

    def full(self, lower_bound: ReducedLaw | None = None) -> ReducedLaw:
        """The whole sum with all its exponents; it starts from a reduced law too, below which it must not end."""
        starts = [] if self._full else [self.problem.start]
        if lower_bound is not None and (self._full is None or lower_bound.minimum.cost < self._full.minimum.cost):
            starts.append(_start_in_larger_law(self.problem, lower_bound))
        if starts:
            minima = [self.problem.lowest_minimum(starts), *([self._full.minimum] if self._full else [])]
            minimum = min(minima, key=lambda end: end.cost)
            self._full = ReducedLaw(self.problem, minimum, self.terms, (), self.problem.bic(minimum))
        assert self._full is not None
        return self._full

    def single_terms(self) -> list[ReducedLaw]:
        """Each term alone."""
        return [self.with_terms((label,)) for label in self.terms]

    def lowest_bic(self, exhaustive_limit: int) -> ReducedLaw:
        """The set of terms of lowest BIC: of all sets for up to `every` terms, by forward selection for longer sums."""
        best = min(self.single_terms(), key=lambda one: one.bic)
        least_chi_square = self.full(best).chi_square
        while True:
            larger_sets = self._larger_sets(best, exhaustive_limit)
            fitted = [self.with_terms(terms) for terms in larger_sets if self._bic_lower_bound(terms, least_chi_square) < best.bic]
            lowest = min(fitted, key=lambda one: one.bic, default=best)
            if lowest.bic >= best.bic:
                return best
            best = lowest

    def _larger_sets(self, best: ReducedLaw, exhaustive_limit: int) -> list[TermNames]:
        if len(self.terms) <= exhaustive_limit:
            return [s for k in range(2, len(self.terms) + 1) for s in combinations(self.terms, k)]
        return [(*best.kept_terms, label) for label in self.terms if label not in best.kept_terms]

    def _bic_lower_bound(self, terms: TermNames, least_chi_square: float) -> float:
        """What BIC a set of terms has at least: no part of a sum fits better than the sum."""
        law = self.problem.law.only(*terms)
        return least_chi_square + (len(law.params) - len(switchable_exponents(law))) * float(np.log(self.problem.observation_count))

    def _fitted_problem(self, terms: TermNames) -> TermProblem:
        """The stage of these terms, which starts at their optimum."""
        law = self.problem.law if terms == self.terms else self.problem.law.only(*terms)
        problem = self.problem.with_law(law)
        return problem.with_start(problem.lowest_minimum(self._starts(problem, terms)).u)

    def _starts(self, problem: TermProblem, terms: TermNames) -> list[Floats]:
        """What the whole law says of these terms; for one term the middle of its bounds, for more their own optima."""
        if self.previous is not None:
            fitted = self.previous.with_terms(terms)
            return [problem.embedded(fitted.law, fitted.x)]
        if len(terms) > 1:
            return [problem.start, *(_start_in_larger_law(problem, self.with_terms((label,))) for label in terms)]
        centre = problem.bounds.centre
        centre[problem.parameter_count :] = problem.start[problem.parameter_count :]
        return [problem.start, problem.with_log_total_rate(centre, self.problem.log_total_rate(self.problem.start))]


def _start_in_larger_law(problem: TermProblem, reduced: ReducedLaw) -> Floats:
    """x of a wider law at a reduced one, its other terms with a small share."""
    x = problem.embedded(reduced.law, reduced.x)
    for k in problem.objective.coordinates.term_rates:
        if problem.law.names[k] not in reduced.law.names:
            x[k] = problem.log_total_rate(x) + np.log(INITIAL_FRACTION)
    return problem.bounds.clip(x)


def with_exponents_off(problem: TermProblem, terms: TermNames) -> ReducedLaw:
    """The law with as many exponents off as BIC allows, one after the other."""
    minimum = problem.minimise(problem.start)
    best = ReducedLaw(problem, minimum, terms, (), problem.bic(minimum))
    while True:
        simpler = [_without_exponent(best, best.law.names[k], off) for k, off in switchable_exponents(best.law)]
        lowest = min(simpler, key=lambda one: one.bic, default=best)
        if lowest is best or lowest.bic > best.bic:
            return best
        best = lowest


def _without_exponent(reduced: ReducedLaw, exponent: str, off: float) -> ReducedLaw:
    problem = reduced.problem.with_start(reduced.x).with_law(reduced.law.fix(**{exponent: off}))
    minimum = problem.minimise(problem.start)
    return ReducedLaw(problem, minimum, reduced.kept_terms, (*reduced.exponents_off, exponent), problem.bic(minimum))


def terms_above(contributions: Mapping[str, float], threshold: float = LEAST_CONTRIBUTION) -> TermNames:
    """The terms whose share is not below `least`; the largest anyhow."""
    kept = tuple(label for label, contribution in contributions.items() if contribution >= threshold)
    return kept or (max(contributions, key=lambda label: contributions[label]),)
