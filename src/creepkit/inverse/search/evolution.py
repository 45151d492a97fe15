"""Evolution with an adapted covariance (CMA-ES), by the package cmaes; a generation is one prediction.

It learns the shape of the valley that it descends, and sees only the order of costs: the better of the two global
searches here where coordinates are tied to each other. Hansen (2016), The CMA Evolution Strategy: A Tutorial; restarts
with twice the population each, from points at random: Auger & Hansen (2005), IPOP-CMA-ES.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.search.polishing import CONVERGED_DECREASE, SearchCandidates, check_whole_numbers, refine_candidates
from creepkit.inverse.search.trace import SearchTrace

if TYPE_CHECKING:
    from cmaes import CMA

    from creepkit.inverse.search.landscape import SearchResult, CostFunction
    from creepkit.inverse.search.refining import IterationCallback

STALL_GENERATIONS = 10
"""Generations whose lowest costs no longer differ when a run has arrived: least squares does the rest."""


@dataclass(frozen=True)
class CmaEs:
    """CMA-ES in the unit cube of the box, with restarts.

    iterations : generations of all runs together. population : of the first run, None for 8 + 6 ln(parameters), twice
    the package's own, as landscapes of creep have valleys beside the right one. step : first standard deviation, in
    widths of the box. restarts : further runs at most, each of twice the population. polish : how many of the best
    candidates, different ones, are refined by least squares; 0 leaves the best as it is.
    """

    iterations: int = 200
    population: int | None = None
    initial_step_size: float = 0.25
    restarts: int = 1
    refined_candidates: int = 3

    def __post_init__(self) -> None:
        minimum_values = {"iterations": 1, "restarts": 0, "polish": 0} | ({} if self.population is None else {"population": 3})
        check_whole_numbers("CMA-ES", {name: getattr(self, name) for name in minimum_values}, minimum_values)
        if not 0 < self.initial_step_size <= 1:
            raise FitError(f"CMA-ES: step is {self.initial_step_size:g} of the box; allowed are 0 (not itself) to 1")

    def minima(self, cost_function: CostFunction, progress: IterationCallback | None = None) -> SearchResult:
        """The refined best, best first, and the trace."""
        runs = _CmaEsRuns(self, cost_function)
        for k in range(self.iterations):
            runs.generation()
            if progress is not None:
                progress("generation", k + 1, self.iterations)
            if runs.has_converged() and not runs.restart():
                break
        trace = SearchTrace.from_costs("CMA-ES", runs.costs, runs.restarts)
        return refine_candidates(cost_function, runs.candidates(), self.refined_candidates, trace, progress)

    def initial_population(self, size: int) -> int:
        """How many candidates the first run has in a generation, for so many parameters."""
        return self.population or 8 + int(6 * np.log(size))


class _CmaEsRuns:
    """One run after another, and the best candidate of each generation."""

    def __init__(self, rules: CmaEs, cost_function: CostFunction) -> None:
        self.rules, self.cost_function = rules, cost_function
        self.rng = np.random.default_rng(cost_function.settings.seed)
        self.costs: list[Floats] = []
        self.best_points: list[Floats] = []
        self.restarts: list[int] = []
        self.optimiser = self._new_optimiser(np.full(cost_function.bounds.lower.size, 0.5))

    def generation(self) -> None:
        """Ask, evaluate all at once, and tell."""
        bounds = self.cost_function.bounds
        points = np.array([self.optimiser.ask() for _ in range(self.optimiser.population_size)])
        cost = self.cost_function.cost(bounds.lower + points * bounds.width)
        self.optimiser.tell([(x, float(c)) for x, c in zip(points, cost, strict=True)])
        self.costs.append(cost)
        self.best_points.append(points[cost.argmin()])

    def has_converged(self) -> bool:
        """Whether this run has nothing more to gain."""
        lowest_costs = [float(cost.min()) for cost in self.costs[self.restarts[-1] if self.restarts else 0 :]]
        stalled = len(lowest_costs) > STALL_GENERATIONS and np.ptp(lowest_costs[-STALL_GENERATIONS:]) < CONVERGED_DECREASE
        return bool(stalled or self.optimiser.should_stop())

    def restart(self) -> bool:
        """Begin anew with twice the population, if that is allowed once more."""
        if len(self.restarts) == self.rules.restarts:
            return False
        self.restarts.append(len(self.costs))
        self.optimiser = self._new_optimiser(self.rng.random(self.cost_function.bounds.lower.size))
        return True

    def candidates(self) -> SearchCandidates:
        """The best of each generation."""
        bounds = self.cost_function.bounds
        return SearchCandidates(bounds.lower + np.array(self.best_points) * bounds.width, np.array([cost.min() for cost in self.costs]))

    def _new_optimiser(self, mean: Floats) -> CMA:
        from cmaes import CMA

        population = self.rules.initial_population(mean.size) * 2 ** len(self.restarts)
        bounds, seed = np.tile([0.0, 1.0], (mean.size, 1)), int(self.rng.integers(2**32))
        return CMA(mean, self.rules.initial_step_size, bounds, seed=seed, population_size=population)
