"""Derivative-free global searches: particle swarm, as in the paper, and CMA-ES; an iteration is one prediction.

A particle at x (in the unit cube of the bounds) with velocity v is attracted by the best position that it has visited,
p, and by the best that any particle has visited, g:

    v <- K [v + c1 r1 (p - x) + c2 r2 (g - x)],   K = 2 / |2 - c - sqrt(c^2 - 4 c)|,   c = c1 + c2
    x <- x + v,                                   r1, r2 uniform in [0, 1], one for each coordinate

(Kennedy & Eberhart 1995; constriction by Clerc & Kennedy 2002.) CMA-ES adapts the covariance of its samples and
uses only the order of the costs: Hansen (2016), The CMA Evolution Strategy: A Tutorial; restarts with twice the
population: Auger & Hansen (2005), IPOP-CMA-ES. The best candidates that differ are refined by least squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import qmc

from creepkit import limits
from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.global_search import CONVERGED_DECREASE, SearchResult, SearchTrace, refine_candidates
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.limits import Limits, numbers
from creepkit.options import Options, option

if TYPE_CHECKING:
    from cmaes import CMA


STALL_GENERATIONS = 10
"""Generations without a lower cost after which a run has converged: least squares does the rest."""


MOST = limits.SEARCH_STEPS.high
UNIT = numbers(0, 1, above=True)


def _searched(
    problem: LeastSquaresProblem,
    optimiser: _CmaEsRuns | _Swarm,
    rules: ParticleSwarm | CmaEs,
    progress: IterationCallback | None,
) -> SearchResult:
    """The minima that an optimiser finds, refined, best first, and the trace."""
    bounds, costs = problem.bounds, []
    for k in range(rules.iterations):
        points = optimiser.ask()
        costs.append(problem.cost(bounds.lower + points * bounds.width))
        optimiser.tell(points, costs[-1])
        if progress is not None:
            progress("generation", k + 1, rules.iterations)
        if optimiser.has_ended():
            break
    candidates, lowest_costs = optimiser.best()
    trace = SearchTrace.from_costs(rules.description, costs, optimiser.restarts)
    u = bounds.lower + candidates * bounds.width
    return refine_candidates(problem, u, lowest_costs, rules.refined_candidates, trace, progress)


# ---- CMA-ES ----------------------------------------------------------------------------------------------------------


@checked
@dataclass(frozen=True)
class CmaEs(Options, title="CMA-ES", error=FitError, prefix="CMA-ES: "):
    """CMA-ES in the unit cube of the bounds, with restarts.

    iterations : generations of all runs together. population : of the first run, None for 8 + 6 ln(parameters), twice
    the default of the cmaes package, as cost functions of creep laws have several minima. initial_step_size : first
    standard deviation, in widths of the bounds. restarts : further runs at most, each of twice the population.
    refined_candidates : how many of the best that differ are refined by least squares; 0 leaves the best as it is.
    """

    iterations: int = option(200, "Generations of all runs together.", limits.SEARCH_STEPS)
    population: int | None = option(None, "Candidates of a generation of the first run.", Limits(3, MOST))
    initial_step_size: float = option(0.25, "First standard deviation, in widths of the bounds.", UNIT)
    restarts: int = option(1, "Further runs at most, each of twice the population.", Limits(0, MOST))
    refined_candidates: int = option(3, "Candidates that are refined by least squares.", Limits(0, MOST))

    description = "CMA-ES"

    def minima(self, problem: LeastSquaresProblem, progress: IterationCallback | None = None) -> SearchResult:
        """The refined best, best first, and the trace."""
        return _searched(problem, _CmaEsRuns(self, problem.bounds.lower.size, problem.settings.seed), self, progress)

    def initial_population(self, size: int) -> int:
        """How many candidates the first run has in a generation, for so many parameters."""
        return self.population or 8 + int(6 * np.log(size))


class _CmaEsRuns:
    """One run after another, and the best candidate of each generation."""

    def __init__(self, rules: CmaEs, size: int, seed: int) -> None:
        self.rules, self.size, self.rng = rules, size, np.random.default_rng(seed)
        self.best_points: list[Floats] = []
        self.lowest_costs: list[float] = []
        self.restarts: list[int] = []
        self.optimiser = self._new_optimiser(np.full(size, 0.5))

    def ask(self) -> Floats:
        return np.array([self.optimiser.ask() for _ in range(self.optimiser.population_size)])

    def tell(self, points: Floats, costs: Floats) -> None:
        self.optimiser.tell([(x, float(c)) for x, c in zip(points, costs, strict=True)])
        self.lowest_costs.append(float(costs.min()))
        self.best_points.append(points[costs.argmin()])

    def has_ended(self) -> bool:
        """Whether this run has nothing more to gain, and none follows it."""
        of_this_run = self.lowest_costs[self.restarts[-1] if self.restarts else 0 :]
        last = of_this_run[-STALL_GENERATIONS:]
        stalled = len(of_this_run) > STALL_GENERATIONS and np.ptp(last) < CONVERGED_DECREASE
        if not (stalled or self.optimiser.should_stop()):
            return False
        if len(self.restarts) == self.rules.restarts:
            return True
        self.restarts.append(len(self.lowest_costs))
        self.optimiser = self._new_optimiser(self.rng.random(self.size))
        return False

    def best(self) -> tuple[Floats, Floats]:
        return np.array(self.best_points), np.array(self.lowest_costs)

    def _new_optimiser(self, mean: Floats) -> CMA:
        from cmaes import CMA

        population = self.rules.initial_population(mean.size) * 2 ** len(self.restarts)
        bounds, seed = np.tile([0.0, 1.0], (mean.size, 1)), int(self.rng.integers(2**32))
        return CMA(mean, self.rules.initial_step_size, bounds, seed=seed, population_size=population)


# ---- particle swarm --------------------------------------------------------------------------------------------------


@checked
@dataclass(frozen=True)
class ParticleSwarm(Options, title="particle swarm", error=FitError, prefix="particle swarm: "):
    """A particle swarm; numbers of particles and iterations are the paper's.

    cognitive, social : c1, c2; max_velocity : the largest, in widths of the bounds. 2.05, 2.05, 0.15, constriction and
        a start at rest from a Sobol set are the settings of the authors' published code
        (NIMSI-NU/DABI-Property-Extraction). That one is for finite elements in the loop, with 70 particles that learn
        of a new best at once; here an iteration is one prediction, after which all do. The paper states neither its
        settings for 300 x 100 (Table S1) nor what happens at the bounds: here they stop a particle, which suits optima
        on bounds.
    refined_candidates : how many of the best particles that differ are refined; 0 leaves the best as it is.
    Which terms of a sum are needed is the question of a penalty, such as Subsets().
    """

    particles: int = option(300, "Particles.", Limits(2, MOST))
    iterations: int = option(100, "Iterations.", limits.SEARCH_STEPS)
    cognitive: float = option(2.05, "Attraction by a particle's own best.", numbers(0, np.inf))
    social: float = option(2.05, "Attraction by the best of all.", numbers(0, np.inf))
    max_velocity: float = option(0.15, "Largest velocity, in widths of the bounds.", UNIT)
    refined_candidates: int = option(3, "Particles that are refined by least squares.", Limits(0, MOST))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cognitive + self.social <= 4:
            raise FitError(
                f"particle swarm: cognitive and social are {self.cognitive:g} and {self.social:g}; they must be more "
                "than 4 together"
            )

    @property
    def description(self) -> str:
        """What it is, for a trace."""
        return f"particle swarm of {self.particles}"

    def minima(self, problem: LeastSquaresProblem, progress: IterationCallback | None = None) -> SearchResult:
        """The refined best, best first, and the trace."""
        return _searched(problem, _Swarm(self, problem.bounds.lower.size, problem.settings.seed), self, progress)

    def next_velocity(self, velocity: Floats, attraction: Floats) -> Floats:
        """(particles, parameters) velocity after an iteration.

        velocity, attraction : (particles, parameters), the velocity before it and the steps towards the best points.
        """
        acceleration = self.cognitive + self.social
        constriction = 2.0 / abs(2.0 - acceleration - np.sqrt(acceleration * acceleration - 4.0 * acceleration))
        return np.asarray(np.clip(constriction * (velocity + attraction), -self.max_velocity, self.max_velocity))


class _Swarm:
    """Positions of all particles in the unit cube, and the best that each has visited."""

    restarts: tuple[int, ...] = ()

    def __init__(self, rules: ParticleSwarm, size: int, seed: int) -> None:
        self.rules, self.rng, count = rules, np.random.default_rng(seed), rules.particles
        self.x: Floats = qmc.Sobol(size, seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count]
        self.velocity = np.zeros((count, size))
        self.best_position, self.best_cost = self.x.copy(), np.full(count, np.inf)

    def ask(self) -> Floats:
        return self.x

    def tell(self, points: Floats, costs: Floats) -> None:
        """The best are kept, and all particles move; a bound stops them."""
        better = costs < self.best_cost
        self.best_position[better], self.best_cost[better] = points[better], costs[better]
        leader = self.best_position[self.best_cost.argmin()]
        attraction = self.rules.cognitive * self.rng.random(points.shape) * (self.best_position - points)
        attraction += self.rules.social * self.rng.random(points.shape) * (leader - points)
        velocity = self.rules.next_velocity(self.velocity, attraction)
        self.x = np.clip(points + velocity, 0.0, 1.0)
        self.velocity = np.where(self.x == points + velocity, velocity, 0.0)

    def has_ended(self) -> bool:
        return False

    def best(self) -> tuple[Floats, Floats]:
        return self.best_position, self.best_cost
