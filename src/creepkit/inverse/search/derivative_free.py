"""Derivative-free global searches: particle swarm, as in the paper, and CMA-ES; an iteration is one prediction.

A particle at x (in the unit cube of the bounds) with velocity v is attracted by the best position that it has visited,
p, and by the best that any particle has visited, g:

    v <- K [v + c1 r1 (p - x) + c2 r2 (g - x)],   K = 2 / |2 - c - sqrt(c^2 - 4 c)|,   c = c1 + c2    "constriction"
    v <- w v + c1 r1 (p - x) + c2 r2 (g - x),     w falling linearly over the iterations               "inertia"
    x <- x + v,                                   r1, r2 uniform in [0, 1], one for each coordinate

(Kennedy & Eberhart 1995; Shi & Eberhart 1999; Clerc & Kennedy 2002.) CMA-ES adapts the covariance of its samples and
uses only the order of the costs: Hansen (2016), The CMA Evolution Strategy: A Tutorial; restarts with twice the
population: Auger & Hansen (2005), IPOP-CMA-ES. The best candidates that differ are refined by least squares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.stats import qmc

from creepkit import limits
from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.global_search import SearchResult, SearchTrace
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum

if TYPE_CHECKING:
    from cmaes import CMA


STALL_GENERATIONS = 10
"""Generations without a lower cost after which a run has converged: least squares does the rest."""


@checked
@dataclass(frozen=True)
class CmaEs:
    """CMA-ES in the unit cube of the bounds, with restarts.

    iterations : generations of all runs together. population : of the first run, None for 8 + 6 ln(parameters), twice
    the default of the cmaes package, as cost functions of creep laws have several minima. initial_step_size : first
    standard deviation, in widths of the bounds. restarts : further runs at most, each of twice the population.
    refined_candidates : how many of the best that differ are refined by least squares; 0 leaves the best as it is.
    """

    iterations: int = 200
    population: int | None = None
    initial_step_size: float = 0.25
    restarts: int = 1
    refined_candidates: int = 3

    def __post_init__(self) -> None:
        minimum_values = {"iterations": 1, "restarts": 0, "refined_candidates": 0} | (
            {} if self.population is None else {"population": 3}
        )
        check_whole_numbers("CMA-ES", {name: getattr(self, name) for name in minimum_values}, minimum_values)
        if not 0 < self.initial_step_size <= 1:
            raise FitError(
                f"CMA-ES: initial_step_size is {self.initial_step_size:g} of the width of the bounds; allowed are "
                "0 (not itself) to 1"
            )

    def minima(self, problem: LeastSquaresProblem, progress: IterationCallback | None = None) -> SearchResult:
        """The refined best, best first, and the trace."""
        runs = _CmaEsRuns(self, problem)
        for k in range(self.iterations):
            runs.generation()
            if progress is not None:
                progress("generation", k + 1, self.iterations)
            if runs.has_converged() and not runs.restart():
                break
        trace = SearchTrace.from_costs("CMA-ES", runs.costs, runs.restarts)
        return refine_candidates(problem, runs.candidates(), self.refined_candidates, trace, progress)

    def initial_population(self, size: int) -> int:
        """How many candidates the first run has in a generation, for so many parameters."""
        return self.population or 8 + int(6 * np.log(size))


class _CmaEsRuns:
    """One run after another, and the best candidate of each generation."""

    def __init__(self, rules: CmaEs, problem: LeastSquaresProblem) -> None:
        self.rules, self.problem = rules, problem
        self.rng = np.random.default_rng(problem.settings.seed)
        self.costs: list[Floats] = []
        self.best_points: list[Floats] = []
        self.restarts: list[int] = []
        self.optimiser = self._new_optimiser(np.full(problem.bounds.lower.size, 0.5))

    def generation(self) -> None:
        """One generation: propose candidates, evaluate all at once, update the distribution."""
        bounds = self.problem.bounds
        points = np.array([self.optimiser.ask() for _ in range(self.optimiser.population_size)])
        cost = self.problem.cost(bounds.lower + points * bounds.width)
        self.optimiser.tell([(x, float(c)) for x, c in zip(points, cost, strict=True)])
        self.costs.append(cost)
        self.best_points.append(points[cost.argmin()])

    def has_converged(self) -> bool:
        """Whether this run has nothing more to gain."""
        lowest_costs = [float(cost.min()) for cost in self.costs[self.restarts[-1] if self.restarts else 0 :]]
        stalled = (
            len(lowest_costs) > STALL_GENERATIONS and np.ptp(lowest_costs[-STALL_GENERATIONS:]) < CONVERGED_DECREASE
        )
        return bool(stalled or self.optimiser.should_stop())

    def restart(self) -> bool:
        """Begin anew with twice the population, if that is allowed once more."""
        if len(self.restarts) == self.rules.restarts:
            return False
        self.restarts.append(len(self.costs))
        self.optimiser = self._new_optimiser(self.rng.random(self.problem.bounds.lower.size))
        return True

    def candidates(self) -> SearchCandidates:
        """The best of each generation."""
        bounds = self.problem.bounds
        return SearchCandidates(
            bounds.lower + np.array(self.best_points) * bounds.width, np.array([cost.min() for cost in self.costs])
        )

    def _new_optimiser(self, mean: Floats) -> CMA:
        from cmaes import CMA

        population = self.rules.initial_population(mean.size) * 2 ** len(self.restarts)
        bounds, seed = np.tile([0.0, 1.0], (mean.size, 1)), int(self.rng.integers(2**32))
        return CMA(mean, self.rules.initial_step_size, bounds, seed=seed, population_size=population)


@checked
@dataclass(frozen=True)
class ParticleSwarm:
    """A particle swarm; numbers of particles and iterations are the paper's.

    cognitive, social : c1, c2; max_velocity : the largest, in widths of the bounds. 2.05, 2.05, 0.15,
        form="constriction" and a start at rest from a Sobol set are the settings of the authors' published code
        (NIMSI-NU/DABI-Property-Extraction). That one is for finite elements in the loop, with 70 particles that learn
        of a new best at once; here an iteration is one prediction, after which all do. The paper states neither its
        settings for 300 x 100 (Table S1) nor what happens at the bounds.
    inertia : w of the first and of the last iteration, for form="inertia" (Shi & Eberhart 1999).
    boundary : "absorb" stops a particle there, which suits optima on bounds; "reflect" sends it back.
    refined_candidates : how many of the best particles that differ are refined; 0 leaves the best as it is.
    patience : end after so many iterations in which the best cost fell by less than 1e-3 (half of chi-square), or None.
    """

    particles: int = 300
    iterations: int = 100
    form: Literal["constriction", "inertia"] = "constriction"
    cognitive: float = 2.05
    social: float = 2.05
    inertia: tuple[float, float] = (0.9, 0.4)
    max_velocity: float = 0.15
    boundary: Literal["absorb", "reflect"] = "absorb"
    refined_candidates: int = 3
    patience: int | None = None

    def __post_init__(self) -> None:
        minimum_values = {"particles": 2, "iterations": 1, "refined_candidates": 0} | (
            {} if self.patience is None else {"patience": 1}
        )
        check_whole_numbers("particle swarm", {name: getattr(self, name) for name in minimum_values}, minimum_values)
        for name, allowed in (("form", ("constriction", "inertia")), ("boundary", ("absorb", "reflect"))):
            value = getattr(self, name)
            if value not in allowed:
                raise FitError(f"particle swarm: {name} is {value!r}; allowed are {' and '.join(allowed)}")
        if not 0 < self.max_velocity <= 1:
            raise FitError(
                f"particle swarm: max_velocity is {self.max_velocity:g} of the width of the bounds; allowed are 0 (not "
                "itself) to 1"
            )
        if not all(0 <= w <= 1 for w in self.inertia):
            raise FitError(f"particle swarm: inertia is {self.inertia}; both are from 0 to 1")
        if min(self.cognitive, self.social) < 0 or (self.form == "constriction" and self.cognitive + self.social <= 4):
            raise FitError(
                f"particle swarm: cognitive and social are {self.cognitive:g} and {self.social:g}; they must not be "
                "below zero and, with form='constriction', must be more than 4 together"
            )

    def minima(self, problem: LeastSquaresProblem, progress: IterationCallback | None = None) -> SearchResult:
        """The refined best, best first, and the trace."""
        swarm, costs = _Swarm(self, problem), []
        for k in range(self.iterations):
            costs.append(swarm.evaluate())
            if progress is not None:
                progress("swarm", k + 1, self.iterations)
            if self._has_converged(swarm.lowest_costs):
                break
            swarm.move(k)
        trace = SearchTrace.from_costs(f"particle swarm of {self.particles}, {self.form} form", costs)
        return refine_candidates(problem, swarm.candidates(), self.refined_candidates, trace, progress)

    def next_velocity(self, velocity: Floats, attraction: Floats, iteration: int) -> Floats:
        """(particles, parameters) velocity after an iteration.

        velocity, attraction : (particles, parameters), the velocity before it and the steps towards the best points.
        """
        if self.form == "constriction":
            acceleration = self.cognitive + self.social
            updated = (
                2.0
                / abs(2.0 - acceleration - np.sqrt(acceleration * acceleration - 4.0 * acceleration))
                * (velocity + attraction)
            )
        else:
            first, last = self.inertia
            updated = (first + (last - first) * iteration / max(self.iterations - 1, 1)) * velocity + attraction
        return np.asarray(np.clip(updated, -self.max_velocity, self.max_velocity))

    def _has_converged(self, lowest_costs: Sequence[float]) -> bool:
        if self.patience is None or len(lowest_costs) <= self.patience:
            return False
        return lowest_costs[-1 - self.patience] - lowest_costs[-1] < CONVERGED_DECREASE


class _Swarm:
    """Positions of all particles in the unit cube, and the best that each has evaluated."""

    def __init__(self, rules: ParticleSwarm, problem: LeastSquaresProblem) -> None:
        self.rules, self.problem, seed = rules, problem, problem.settings.seed
        self.rng = np.random.default_rng(seed)
        count, size = rules.particles, problem.bounds.lower.size
        self.x, self.velocity = _sobol_points(count, size, seed), np.zeros((count, size))
        self.best_position, self.best_cost = self.x.copy(), np.full(count, np.inf)
        self.lowest_costs: list[float] = []

    def evaluate(self) -> Floats:
        """(particles,) - costs at their positions, in one prediction; the best are kept."""
        cost = self.problem.cost(self._coordinates(self.x))
        better = cost < self.best_cost
        self.best_position[better], self.best_cost[better] = self.x[better], cost[better]
        self.lowest_costs.append(float(self.best_cost.min()))
        return cost

    def move(self, iteration: int) -> None:
        """One step of all."""
        shape, rules, leader = self.x.shape, self.rules, self.best_position[self.best_cost.argmin()]
        attraction = rules.cognitive * self.rng.random(shape) * (self.best_position - self.x)
        attraction += rules.social * self.rng.random(shape) * (leader - self.x)
        self.velocity = rules.next_velocity(self.velocity, attraction, iteration)
        self._apply_boundary(self.x + self.velocity)

    def candidates(self) -> SearchCandidates:
        """The best of each particle."""
        return SearchCandidates(self._coordinates(self.best_position), self.best_cost)

    def _coordinates(self, positions: Floats) -> Floats:
        return self.problem.bounds.lower + positions * self.problem.bounds.width

    def _apply_boundary(self, x: Floats) -> None:
        inside = np.clip(x, 0.0, 1.0)
        if self.rules.boundary == "absorb":
            self.velocity = np.where(x == inside, self.velocity, 0.0)
            self.x = inside
        else:
            self.velocity = np.where(x == inside, self.velocity, -self.velocity)
            self.x = np.clip(2.0 * inside - x, 0.0, 1.0)


def _sobol_points(count: int, size: int, seed: int) -> Floats:
    """(count, size) the first points of a scrambled Sobol set, which is balanced in powers of two."""
    return np.asarray(qmc.Sobol(size, seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count])


SAME_BASIN = 0.1
"""Of the width of the bounds: candidates closer than that in every coordinate lead to the same minimum, as a rule."""


CONVERGED_DECREASE = 1e-3
"""A decrease of the cost, half of chi-square, below which a search has converged."""


@dataclass(frozen=True)
class SearchCandidates:
    """Candidates of a search that may be refined.

    u : (candidates, parameters); cost : (candidates,) -.
    """

    u: Floats
    cost: Floats

    def most_different(self, width: Floats, max_count: int) -> list[int]:
        """The best that differ, at most max_count; width : (parameters,) of the bounds."""
        selected: list[int] = []
        for k in np.argsort(self.cost, kind="stable"):
            if all((np.abs(self.u[k] - self.u[other]) > SAME_BASIN * width).any() for other in selected):
                selected.append(int(k))
            if len(selected) == max_count:
                break
        return selected


def refine_candidates(
    problem: LeastSquaresProblem,
    candidates: SearchCandidates,
    max_count: int,
    trace: SearchTrace,
    progress: IterationCallback | None = None,
) -> SearchResult:
    """The best different candidates refined, best first; with max_count=0 the best one as it is."""
    selected = candidates.most_different(problem.bounds.width, max(max_count, 1))
    problem.check_predicted(candidates.u[selected])
    if max_count == 0:
        best = Minimum(candidates.u[selected[0]], float(candidates.cost[selected[0]]), converged=False, evaluations=0)
        return SearchResult((best,), trace)
    minima = []
    for done, k in enumerate(selected):
        minima.append(problem.minimise(candidates.u[k]))
        if progress is not None:
            progress("refinement", done + 1, len(selected))
    minima.sort(key=lambda minimum: minimum.cost)
    evaluations = sum(minimum.evaluations for minimum in minima)
    refined = replace(trace, refined_cost=minima[0].cost, refinement_evaluations=evaluations)
    return SearchResult(tuple(minima), refined)


def check_whole_numbers(search: str, values: Mapping[str, float], minimum_values: Mapping[str, int]) -> None:
    """Refuse settings of a search that must be whole numbers of at least so many, and of SEARCH_STEPS at most."""
    for name, value in values.items():
        allowed = limits.Limits(minimum_values[name], limits.SEARCH_STEPS.high)
        limits.check_number(f"{search}: {name}", value, allowed, FitError)
