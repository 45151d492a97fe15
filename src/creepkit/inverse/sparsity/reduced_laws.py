"""Laws of some terms of a sum, fitted to the same data with the same covariance.

All laws are compared under the covariance of the sum fitted without penalty, so that chi-squares can be subtracted. That
covariance contains the correlation between frames; each frame then counts as one in BIC. Exponents that can be off are,
where BIC does not rise by it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.bound_penalties import BoundPenalties
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.problem import least_squares_problem
from creepkit.inverse.residuals import ResidualFunction
from creepkit.inverse.search.cost_function import CostFunction
from creepkit.inverse.search.local_refinement import AdditionalResiduals, Bounds, Minimum, bounded_least_squares
from creepkit.inverse.search.multistart import unequal_fractions
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.contributions import TermContributions
from creepkit.inverse.sparsity.penalties import PenalisedTerms, switchable_exponents
from creepkit.inverse.sparsity.result import LEAST_CONTRIBUTION, TermNames
from creepkit.language import CreepLaw
from creepkit.records import Predictor

MAX_STEPS = 40


COST_TOLERANCE = 1e-7


IDLE_SAMPLES = 64
"""Of what a term that is to be absent depends on, besides its rate."""


@dataclass(frozen=True, eq=False)
class TermProblem:
    """A law, its data and their covariance; unknowns are x = (u, e), e those of the tests.

    factor : (tests, entries, entries) Cholesky factors of the covariance.
    start : x from which it is known to fit well.
    """

    objective: ResidualFunction
    bounds: Bounds
    covariance_factor: Floats
    start: Floats
    settings: IdentificationSettings

    @classmethod
    def from_identification(cls, fit: Identification, screening_predictor: Predictor | None = None) -> TermProblem:
        """The problem of an identification, opened again with the covariance that it found.

        through : a cheaper predictor by which terms are chosen.
        """
        problem = least_squares_problem(fit)
        original = problem.residual_function
        objective = ResidualFunction(
            original.law,
            original.histories,
            screening_predictor or original.predictor,
            original.coordinates,
            original.observations,
            original.nuisance_parameters,
        )
        return cls(objective, problem.bounds, problem.covariance_factor, problem.x, fit.settings)

    # ---- what it is ----------------------------------------------------------------------------------------------

    @property
    def law(self) -> CreepLaw:
        """The law of the objective."""
        return self.objective.law

    @property
    def parameter_count(self) -> int:
        """Number of parameters of the law; x goes on with the unknowns of tests."""
        return len(self.law.params)

    @property
    def observation_count(self) -> int:
        """Number of measured values."""
        return int(self.objective.observations.present.sum())

    @cached_property
    def contributions(self) -> TermContributions:
        """Of the terms, over what the tests visit."""
        return TermContributions.from_objective(self.objective)

    def contributions_at(self, x: Floats) -> dict[str, float]:
        """{term: contribution} at x."""
        return self.contributions.by_term(x[: self.parameter_count])

    # ---- fits -------------------------------------------------------------------------------------------------------

    def minimise(
        self, start: Floats, penalty: AdditionalResiduals | None = None, max_steps: int = MAX_STEPS
    ) -> Minimum:
        """Least squares from x, penalty included."""
        return bounded_least_squares(
            self.objective,
            self.bounds,
            self.covariance_factor,
            start,
            max_steps=max_steps,
            tolerance=COST_TOLERANCE,
            additional=penalty,
        )

    def lowest_minimum(self, starts: Sequence[Floats]) -> Minimum:
        """The lowest of the minima from several x, without penalty."""
        return min((self.minimise(x) for x in starts), key=lambda minimum: minimum.cost)

    def half_chi_square(self, x: Floats) -> float:
        """Half the chi-square at x, priors and walls included."""
        whitened = np.linalg.solve(self.covariance_factor, self.objective.evaluate(x).values[..., None])[..., 0]
        penalty_residuals = BoundPenalties(self.objective).residuals(x)
        return 0.5 * float((whitened[self.objective.observations.present] ** 2).sum() + (penalty_residuals**2).sum())

    def bic(self, minimum: Minimum) -> float:
        """BIC of a fit without penalty: chi-square, priors included, + K ln N."""
        return 2.0 * minimum.cost + self.determined_parameter_count(minimum.u) * float(np.log(self.observation_count))

    def determined_parameter_count(self, x: Floats) -> int:
        """How many parameters of the law move anything that was measured."""
        jacobian = self.objective.evaluate(x).jacobian
        assert jacobian is not None
        return int((jacobian[self.objective.observations.present][:, : self.parameter_count] != 0).any(axis=0).sum())

    # ---- other laws on the same stage --------------------------------------------------------------------------------

    def with_law(self, law: CreepLaw) -> TermProblem:
        """A law of some of this one's parameters, by name, on the same data and covariance."""
        o, positions = self.objective, self._positions(law)
        objective = ResidualFunction(
            law,
            o.histories,
            o.predictor,
            Coordinates(law, o.coordinates.reference),
            o.observations,
            o.nuisance_parameters,
        )
        bounds = Bounds(self.bounds.lower[positions], self.bounds.upper[positions])
        problem = replace(self, objective=objective, bounds=bounds, start=self.start[positions])
        return replace(problem, start=problem.with_log_total_rate(problem.start, self.log_total_rate(self.start)))

    def with_start(self, x: Floats) -> TermProblem:
        """The same, known to fit well at x."""
        return replace(self, start=x)

    def embedded(self, law: CreepLaw, x: Floats) -> Floats:
        """x of a law of some of the terms as one of this law: the other terms as slow as the box allows.

        Their exponents that can be off are; all else of theirs is drawn so that they matter least, within the fences.
        """
        rates, positions = list(self.objective.coordinates.term_rates), self._positions(law)
        exponents_off = dict(switchable_exponents(self.law))
        unused = [k for k in range(self.parameter_count) if k not in (*positions, *rates, *exponents_off)]
        candidates = np.tile(
            np.concatenate([self.bounds.centre[: self.parameter_count], self.start[self.parameter_count :]]),
            (IDLE_SAMPLES, 1),
        )
        random = np.random.default_rng(0).random((IDLE_SAMPLES - 1, len(unused)))
        candidates[1:, unused] = self.bounds.lower[unused] + random * self.bounds.width[unused]
        candidates[:, list(exponents_off)] = list(exponents_off.values())
        candidates[:, rates] = self.bounds.lower[rates]
        candidates[:, positions] = x
        other_terms = [k for k, label in enumerate(self.law.terms) if label not in law.terms]
        contribution = self.contributions.values(candidates[:, : self.parameter_count])[:, other_terms].sum(axis=1)
        bound_penalties = BoundPenalties(self.objective)
        penalty_costs = np.array([(bound_penalties.residuals(one) ** 2).sum() for one in candidates])
        return np.asarray(candidates[(contribution + penalty_costs).argmin()])

    def _positions(self, law: CreepLaw) -> list[int]:
        positions = [self.law.names.index(name) for name in law.names]
        return [*positions, *range(self.parameter_count, self.start.size)]

    # ---- starts ------------------------------------------------------------------------------------------------------

    def log_total_rate(self, x: Floats) -> float:
        """ln of the rate of all terms at the reference point."""
        rates = list(self.objective.coordinates.term_rates)
        return float(np.logaddexp.reduce(x[rates])) if rates else 0.0

    def with_log_total_rate(self, x: Floats, log_total: float) -> Floats:
        """x with all rates moved by one factor, so that they add up to exp(level)."""
        shifted, rates = np.array(x), list(self.objective.coordinates.term_rates)
        shifted[rates] += log_total - self.log_total_rate(x)
        return self.bounds.clip(shifted)

    def with_fractions(self, x: Floats, fractions: Sequence[float] | Floats) -> Floats:
        """x with these shares of its rate at the reference point, in the order of coordinates.rates."""
        shifted, rates = np.array(x), list(self.objective.coordinates.term_rates)
        shifted[rates] = self.log_total_rate(x) + np.log(fractions)
        return self.bounds.clip(shifted)

    def fraction_permutations(self, x: Floats) -> list[Floats]:
        """x with shares .7, .2, .1 and so on, each term leading once: equal shares are a stationary point."""
        count = len(self.objective.coordinates.term_rates)
        if count < 2:
            return []
        return [self.with_fractions(x, np.roll(unequal_fractions(count), k)) for k in range(count)]

    def with_nuisances(self, u: Floats) -> Floats:
        """x of conditioned coordinates, unknowns of tests as at the start."""
        return np.concatenate([u, self.start[self.parameter_count :]])

    def cost_function(self, penalty: PenalisedTerms | None = None) -> CostFunction:
        """What a global search sees: the same covariance, unknowns of tests as they are at the start."""
        o = self.objective
        fixed_nuisances = replace(o.nuisance_parameters, mean=self.start[self.parameter_count :], fixed=True)
        objective = ResidualFunction(self.law, o.histories, o.predictor, o.coordinates, o.observations, fixed_nuisances)
        bounds = Bounds(self.bounds.lower[: self.parameter_count], self.bounds.upper[: self.parameter_count])
        return CostFunction(objective, bounds, self.covariance_factor, self.settings, penalty)


INITIAL_FRACTION = 0.05
"""Share of the rate with which a second term begins beside a fitted one."""


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
        return least_chi_square + (len(law.params) - len(switchable_exponents(law))) * float(
            np.log(self.problem.observation_count)
        )

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
