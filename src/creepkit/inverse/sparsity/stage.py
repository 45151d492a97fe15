"""A sum of terms before its data: one objective and one covariance, on which laws of some of its terms are compared.

All laws are judged by the covariance of the sum fitted without penalty, so that chi-squares can be subtracted. That
covariance knows how frames move together; each frame then counts as one in BIC.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.fences import BoundPenalties
from creepkit.inverse.identification import Identification
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.problem import least_squares_problem
from creepkit.inverse.search.box import Bounds
from creepkit.inverse.search.landscape import CostFunction
from creepkit.inverse.search.multistart import unequal_fractions
from creepkit.inverse.search.refining import AdditionalResiduals, Minimum, bounded_least_squares
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.contributions import TermContributions
from creepkit.inverse.sparsity.penalised import PenalisedTerms, switchable_exponents
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
        objective = ResidualFunction(original.law, original.histories, screening_predictor or original.predictor, original.coordinates, original.observations, original.nuisance_parameters)
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

    def minimise(self, start: Floats, penalty: AdditionalResiduals | None = None, max_steps: int = MAX_STEPS) -> Minimum:
        """Least squares from x, penalty included."""
        return bounded_least_squares(self.objective, self.bounds, self.covariance_factor, start, max_steps=max_steps, tolerance=COST_TOLERANCE, additional=penalty)

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
            law, o.histories, o.predictor, Coordinates(law, o.coordinates.reference), o.observations, o.nuisance_parameters
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
        candidates = np.tile(np.concatenate([self.bounds.centre[: self.parameter_count], self.start[self.parameter_count :]]), (IDLE_SAMPLES, 1))
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
