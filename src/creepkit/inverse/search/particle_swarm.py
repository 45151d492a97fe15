"""The paper's global search, a particle swarm; an iteration is one prediction of all particles.

A particle at x (in the unit cube of the bounds) with velocity v is attracted by the best position that it has visited,
p, and by the best that any particle has visited, g:

    v <- K [v + c1 r1 (p - x) + c2 r2 (g - x)],   K = 2 / |2 - c - sqrt(c^2 - 4 c)|,   c = c1 + c2
    x <- x + v,                                   r1, r2 uniform in [0, 1], one for each coordinate

(Kennedy & Eberhart 1995; constriction by Clerc & Kennedy 2002.) The best particles that differ are refined by least
squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from creepkit import limits
from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.global_search import SearchResult, SearchTrace, refine_candidates
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.limits import Limits, numbers
from creepkit.options import Options, option

MOST = limits.SEARCH_STEPS.high


@checked
@dataclass(frozen=True)
class ParticleSwarm(Options, title="particle swarm"):
    """A particle swarm; numbers of particles and iterations are the paper's.

    cognitive, social : c1, c2; max_velocity : the largest, in widths of the bounds. 2.05, 2.05, 0.15, constriction and
        a start at rest from a Sobol set are the settings of the authors' published code
        (NIMSI-NU/DABI-Property-Extraction). That one is for finite elements in the loop, with 70 particles that learn
        of a new best at once; here an iteration is one prediction, after which all do. The paper states neither its
        settings for 300 x 100 (Table S1) nor what happens at the bounds: here they stop a particle, which suits optima
        on bounds.
    refined_candidates : how many of the best particles that differ are refined; 0 leaves the best as it is.
    Which terms of a sum are needed is the question of penalty="subsets".
    """

    particles: int = option(300, "Particles.", Limits(2, MOST))
    iterations: int = option(100, "Iterations.", limits.SEARCH_STEPS)
    cognitive: float = option(2.05, "Attraction by a particle's own best.", numbers(0, np.inf))
    social: float = option(2.05, "Attraction by the best of all.", numbers(0, np.inf))
    max_velocity: float = option(0.15, "Largest velocity, in widths of the bounds.", numbers(0, 1, above=True))
    refined_candidates: int = option(3, "Particles that are refined by least squares.", Limits(0, MOST))

    def __post_init__(self) -> None:
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
        bounds, swarm, costs = problem.bounds, _Swarm(self, problem.bounds.lower.size, problem.settings.seed), []
        for k in range(self.iterations):
            costs.append(problem.cost(bounds.lower + swarm.x * bounds.width))
            swarm.move(costs[-1])
            if progress is not None:
                progress("generation", k + 1, self.iterations)
        lowest, counts = np.minimum.accumulate([each.min() for each in costs]), np.cumsum([len(each) for each in costs])
        trace, u = SearchTrace(self.description, lowest, counts), bounds.lower + swarm.best_position * bounds.width
        return refine_candidates(problem, u, swarm.best_cost, self.refined_candidates, trace)

    def next_velocity(self, velocity: Floats, attraction: Floats) -> Floats:
        """(particles, parameters) velocity after an iteration.

        velocity, attraction : (particles, parameters), the velocity before it and the steps towards the best points.
        """
        acceleration = self.cognitive + self.social
        constriction = 2.0 / abs(2.0 - acceleration - np.sqrt(acceleration * acceleration - 4.0 * acceleration))
        return np.asarray(np.clip(constriction * (velocity + attraction), -self.max_velocity, self.max_velocity))


class _Swarm:
    """Positions of all particles in the unit cube, and the best that each has visited."""

    def __init__(self, rules: ParticleSwarm, size: int, seed: int) -> None:
        self.rules, self.rng, count = rules, np.random.default_rng(seed), rules.particles
        self.x: Floats = qmc.Sobol(size, seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count]
        self.velocity = np.zeros((count, size))
        self.best_position, self.best_cost = self.x.copy(), np.full(count, np.inf)

    def move(self, costs: Floats) -> None:
        """The best are kept, and all particles move; a bound stops them. costs : (particles,) where they are."""
        better = costs < self.best_cost
        self.best_position[better], self.best_cost[better] = self.x[better], costs[better]
        leader = self.best_position[self.best_cost.argmin()]
        attraction = self.rules.cognitive * self.rng.random(self.x.shape) * (self.best_position - self.x)
        attraction += self.rules.social * self.rng.random(self.x.shape) * (leader - self.x)
        velocity = self.rules.next_velocity(self.velocity, attraction)
        moved = self.x + velocity
        self.x = np.clip(moved, 0.0, 1.0)
        self.velocity = np.where(self.x == moved, velocity, 0.0)
