"""Laws of some terms of a sum, fitted to the same data with the same covariance.

All laws are compared under the covariance of the sum fitted without penalty, so that chi-squares can be subtracted.
That covariance contains the correlation between frames; each frame then counts as one in BIC. Exponents that can be off
are switched off where BIC does not rise by it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.identification import Identification
from creepkit.inverse.information_criteria import bic_penalty, determined_parameters
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import Minimum, Penalty, Tolerances
from creepkit.inverse.search.multistart import unequal_fractions
from creepkit.inverse.sparsity.contributions import TermContributions
from creepkit.inverse.sparsity.penalties import switchable_exponents
from creepkit.inverse.sparsity.result import LEAST_CONTRIBUTION, TermNames
from creepkit.language import CreepLaw
from creepkit.records import Predictor

TOLERANCES = Tolerances(max_steps=40, tolerance=1e-7)
"""Of the fits of reduced laws."""


IDLE_SAMPLES = 64
"""Draws of the parameters of a term that is to be absent, besides its rate."""


@dataclass(frozen=True, eq=False)
class TermProblem:
    """The least-squares problem of a sum, or of some of its terms, and a point from which it is known to fit well.

    start : (unknowns,) x = (u, e).
    """

    problem: LeastSquaresProblem
    start: Floats

    @classmethod
    def from_identification(cls, fit: Identification, screening_predictor: Predictor | None = None) -> TermProblem:
        """The problem of an identification, under the covariance that it found.

        screening_predictor : a cheaper predictor by which terms are chosen.
        """
        problem = fit.least_squares_problem
        return cls(problem if screening_predictor is None else problem.with_predictor(screening_predictor), fit.x)

    @property
    def law(self) -> CreepLaw:
        """The law of the problem."""
        return self.problem.law

    @property
    def parameter_count(self) -> int:
        """Number of parameters of the law; x continues with the nuisance parameters."""
        return self.problem.parameter_count

    @cached_property
    def contributions(self) -> TermContributions:
        """Contributions of the terms over the evaluation points of the tests."""
        return TermContributions.from_problem(self.problem)

    def contributions_at(self, x: Floats) -> dict[str, float]:
        """{term: contribution} at x (unknowns,)."""
        return self.contributions.by_term(x[: self.parameter_count])

    # ---- fits -------------------------------------------------------------------------------------------------------

    def minimise(self, start: Floats, penalty: Penalty | None = None, max_steps: int | None = None) -> Minimum:
        """Least squares from `start` (unknowns,), penalty included."""
        tolerances = TOLERANCES if max_steps is None else replace(TOLERANCES, max_steps=max_steps)
        return replace(self.problem, penalty=penalty).minimise(start, tolerances=tolerances)

    def lowest_minimum(self, starts: Sequence[Floats]) -> Minimum:
        """The lowest of the minima from several starts (unknowns,), without penalty."""
        return min((self.minimise(x) for x in starts), key=lambda minimum: minimum.cost)

    def cost(self, x: Floats, penalty: Penalty) -> float:
        """Half the chi-square at x (unknowns,), penalty included."""
        return 0.5 * self.problem.chi_square(x) + float(penalty.values(x[None])[0])

    # ---- other laws of the same sum --------------------------------------------------------------------------------

    def with_law(self, law: CreepLaw) -> TermProblem:
        """A law of some of this one's parameters, by name, on the same data and covariance."""
        reduced = TermProblem(self.problem.with_law(law), self.start[self._positions(law)])
        return replace(reduced, start=reduced.with_log_total_rate(reduced.start, self.log_total_rate(self.start)))

    def embedded(self, law: CreepLaw, x: Floats) -> Floats:
        """x of a law of some of the terms as one of this law, (unknowns,): the other rates at their lower bounds.

        Exponents of the other terms that can be off are; the rest of their parameters is drawn so that they contribute
        least, within the bound penalties. x : (unknowns of that law,).
        """
        rates, positions, bounds = list(self.problem.coordinates.term_rates), self._positions(law), self.problem.bounds
        exponents_off = dict(switchable_exponents(self.law))
        unused = [k for k in range(self.parameter_count) if k not in (*positions, *rates, *exponents_off)]
        candidates = np.tile(
            np.concatenate([bounds.centre[: self.parameter_count], self.start[self.parameter_count :]]),
            (IDLE_SAMPLES, 1),
        )
        random = np.random.default_rng(0).random((IDLE_SAMPLES - 1, len(unused)))
        candidates[1:, unused] = bounds.lower[unused] + random * bounds.width[unused]
        candidates[:, list(exponents_off)] = list(exponents_off.values())
        candidates[:, rates] = bounds.lower[rates]
        candidates[:, positions] = x
        other_terms = [k for k, label in enumerate(self.law.terms) if label not in law.terms]
        contribution = self.contributions.values(candidates[:, : self.parameter_count])[:, other_terms].sum(axis=1)
        penalties = [(self.problem.bound_penalties.residuals(one) ** 2).sum() for one in candidates]
        return np.asarray(candidates[(contribution + np.array(penalties)).argmin()])

    def _positions(self, law: CreepLaw) -> list[int]:
        positions = [self.law.names.index(name) for name in law.names]
        return [*positions, *range(self.parameter_count, self.start.size)]

    # ---- starts ------------------------------------------------------------------------------------------------------

    def log_total_rate(self, x: Floats) -> float:
        """ln of the rate of all terms at the reference point, in 1/s; x : (unknowns,)."""
        rates = list(self.problem.coordinates.term_rates)
        return float(np.logaddexp.reduce(x[rates])) if rates else 0.0

    def with_log_total_rate(self, x: Floats, log_total: float) -> Floats:
        """x (unknowns,) with all rates multiplied by one factor, so that they add up to exp(log_total) 1/s."""
        shifted, rates = np.array(x), list(self.problem.coordinates.term_rates)
        shifted[rates] += log_total - self.log_total_rate(x)
        return self.problem.bounds.clip(shifted)

    def fraction_permutations(self) -> list[Floats]:
        """(unknowns,) each: the start with unequal fractions of its rate, each term leading once.

        Equal ones are a stationary point.
        """
        rates, permutations = list(self.problem.coordinates.term_rates), []
        for k in range(len(rates) if len(rates) > 1 else 0):
            x = np.array(self.start)
            x[rates] = self.log_total_rate(x) + np.log(np.roll(unequal_fractions(len(rates)), k))
            permutations.append(self.problem.bounds.clip(x))
        return permutations

    def with_nuisances(self, u: Floats) -> Floats:
        """(unknowns,) x of conditioned coordinates u (parameters,), nuisance parameters as at the start."""
        return np.concatenate([u, self.start[self.parameter_count :]])

    def search_problem(self, penalty: Penalty | None = None) -> LeastSquaresProblem:
        """What a global search minimises: the same covariance, nuisance parameters fixed as they are at the start."""
        return replace(self.problem.with_fixed_nuisances(self.start[self.parameter_count :]), penalty=penalty)


INITIAL_FRACTION = 0.05
"""Share of the rate with which a second term begins beside a fitted one."""


@dataclass(frozen=True, eq=False)
class ReducedLaw:
    """A law of some of the terms, and its fit without penalty; exponents_off : its exponents that were switched off."""

    problem: TermProblem
    minimum: Minimum
    exponents_off: tuple[str, ...] = ()

    @property
    def law(self) -> CreepLaw:
        """The reduced law."""
        return self.problem.law

    @property
    def kept_terms(self) -> TermNames:
        """Its terms, in the order of the sum."""
        return tuple(self.law.terms)

    @property
    def x(self) -> Floats:
        """(unknowns,) where it fits best."""
        return self.minimum.x

    @property
    def chi_square(self) -> float:
        """Sum of squared white residuals, priors included."""
        return 2.0 * self.minimum.cost

    @cached_property
    def parameter_count(self) -> int:
        """Number of parameters of the law that change anything that was measured."""
        return determined_parameters(self.problem.problem.residuals(self.x), self.problem.parameter_count)

    @property
    def bic(self) -> float:
        """BIC; its deviance is the chi-square."""
        return self.chi_square + bic_penalty(self.parameter_count, self.problem.problem.observations.count)


class ReducedLaws:
    """The laws of some of the terms of a sum, each fitted once."""

    def __init__(self, problem: TermProblem) -> None:
        self.problem, self.terms = problem, tuple(problem.law.terms)
        self._fitted_laws: dict[TermNames, ReducedLaw] = {}
        self._full: ReducedLaw | None = None

    def with_terms(self, names: Sequence[str]) -> ReducedLaw:
        """The law of these terms."""
        terms = tuple(label for label in self.terms if label in names)
        if terms not in self._fitted_laws:
            self._fitted_laws[terms] = with_exponents_off(self._fitted_problem(terms))
        return self._fitted_laws[terms]

    def full(self, lower_bound: ReducedLaw | None = None) -> ReducedLaw:
        """The whole sum with all its exponents; it starts from a reduced law too, below which it must not end."""
        starts = [] if self._full else [self.problem.start]
        if lower_bound is not None and (self._full is None or lower_bound.minimum.cost < self._full.minimum.cost):
            starts.append(_start_in_larger_law(self.problem, lower_bound))
        if starts:
            minima = [self.problem.lowest_minimum(starts), *([self._full.minimum] if self._full else [])]
            minimum = min(minima, key=lambda end: end.cost)
            self._full = ReducedLaw(self.problem, minimum)
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
            fitted = [
                self.with_terms(terms)
                for terms in larger_sets
                if self._bic_lower_bound(terms, least_chi_square) < best.bic
            ]
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
        parameters = len(law.params) - len(switchable_exponents(law))
        return least_chi_square + bic_penalty(parameters, self.problem.problem.observations.count)

    def _fitted_problem(self, terms: TermNames) -> TermProblem:
        """The problem of these terms, which starts at their optimum."""
        law = self.problem.law if terms == self.terms else self.problem.law.only(*terms)
        problem = self.problem.with_law(law)
        return replace(problem, start=problem.lowest_minimum(self._starts(problem, terms)).x)

    def _starts(self, problem: TermProblem, terms: TermNames) -> list[Floats]:
        """What the whole law says of these terms; for one term the middle of its bounds, for more their own optima."""
        if len(terms) > 1:
            return [problem.start, *(_start_in_larger_law(problem, self.with_terms((label,))) for label in terms)]
        centre = problem.problem.bounds.centre
        centre[problem.parameter_count :] = problem.start[problem.parameter_count :]
        return [problem.start, problem.with_log_total_rate(centre, self.problem.log_total_rate(self.problem.start))]


def _start_in_larger_law(problem: TermProblem, reduced: ReducedLaw) -> Floats:
    """x of a wider law at a reduced one, its other terms with a small share."""
    x = problem.embedded(reduced.law, reduced.x)
    for k in problem.problem.coordinates.term_rates:
        if problem.law.names[k] not in reduced.law.names:
            x[k] = problem.log_total_rate(x) + np.log(INITIAL_FRACTION)
    return problem.problem.bounds.clip(x)


def with_exponents_off(problem: TermProblem) -> ReducedLaw:
    """The law with as many exponents off as BIC allows, one after the other."""
    best = ReducedLaw(problem, problem.minimise(problem.start))
    while True:
        simpler = [_without_exponent(best, best.law.names[k], off) for k, off in switchable_exponents(best.law)]
        lowest = min(simpler, key=lambda one: one.bic, default=best)
        if lowest is best or lowest.bic > best.bic:
            return best
        best = lowest


def _without_exponent(reduced: ReducedLaw, exponent: str, off: float) -> ReducedLaw:
    problem = replace(reduced.problem, start=reduced.x).with_law(reduced.law.fix(**{exponent: off}))
    return ReducedLaw(problem, problem.minimise(problem.start), (*reduced.exponents_off, exponent))


def terms_above(contributions: Mapping[str, float], threshold: float = LEAST_CONTRIBUTION) -> TermNames:
    """The terms whose share is not below `least`; the largest anyhow."""
    kept = tuple(label for label, contribution in contributions.items() if contribution >= threshold)
    return kept or (max(contributions, key=lambda label: contributions[label]),)
