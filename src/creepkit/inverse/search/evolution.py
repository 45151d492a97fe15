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
from creepkit.inverse.search.polishing import SETTLED, Candidates, check_counts, polished
from creepkit.inverse.search.trace import Trace

if TYPE_CHECKING:
    from cmaes import CMA

    from creepkit.inverse.search.landscape import Found, Landscape
    from creepkit.inverse.search.refining import Progress

RECENT = 10
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
    step: float = 0.25
    restarts: int = 1
    polish: int = 3

    def __post_init__(self) -> None:
        least = {"iterations": 1, "restarts": 0, "polish": 0} | ({} if self.population is None else {"population": 3})
        check_counts("CMA-ES", {name: getattr(self, name) for name in least}, least)
        if not 0 < self.step <= 1:
            raise FitError(f"CMA-ES: step is {self.step:g} of the box; allowed are 0 (not itself) to 1")

    def minima(self, landscape: Landscape, progress: Progress | None = None) -> Found:
        """The refined best, best first, and the trace."""
        run = _Runs(self, landscape)
        for k in range(self.iterations):
            run.generation()
            if progress is not None:
                progress("generation", k + 1, self.iterations)
            if run.arrived() and not run.restart():
                break
        trace = Trace.of("CMA-ES", run.costs, run.restarts)
        return polished(landscape, run.seen(), self.polish, trace, progress)

    def first_population(self, size: int) -> int:
        """How many candidates the first run has in a generation, for so many parameters."""
        return self.population or 8 + int(6 * np.log(size))


class _Runs:
    """One run after another, and the best candidate of each generation."""

    def __init__(self, rules: CmaEs, landscape: Landscape) -> None:
        self.rules, self.landscape = rules, landscape
        self.rng = np.random.default_rng(landscape.settings.seed)
        self.costs: list[Floats] = []
        self.best: list[Floats] = []
        self.restarts: list[int] = []
        self.optimiser = self._new(np.full(landscape.box.low.size, 0.5))

    def generation(self) -> None:
        """Ask, evaluate all at once, and tell."""
        box = self.landscape.box
        asked = np.array([self.optimiser.ask() for _ in range(self.optimiser.population_size)])
        cost = self.landscape.cost(box.low + asked * box.width)
        self.optimiser.tell([(x, float(c)) for x, c in zip(asked, cost, strict=True)])
        self.costs.append(cost)
        self.best.append(asked[cost.argmin()])

    def arrived(self) -> bool:
        """Whether this run has nothing more to gain."""
        mine = [float(cost.min()) for cost in self.costs[self.restarts[-1] if self.restarts else 0 :]]
        settled = len(mine) > RECENT and np.ptp(mine[-RECENT:]) < SETTLED
        return bool(settled or self.optimiser.should_stop())

    def restart(self) -> bool:
        """Begin anew with twice the population, if that is allowed once more."""
        if len(self.restarts) == self.rules.restarts:
            return False
        self.restarts.append(len(self.costs))
        self.optimiser = self._new(self.rng.random(self.landscape.box.low.size))
        return True

    def seen(self) -> Candidates:
        """The best of each generation."""
        box = self.landscape.box
        return Candidates(box.low + np.array(self.best) * box.width, np.array([cost.min() for cost in self.costs]))

    def _new(self, mean: Floats) -> CMA:
        from cmaes import CMA

        population = self.rules.first_population(mean.size) * 2 ** len(self.restarts)
        bounds, seed = np.tile([0.0, 1.0], (mean.size, 1)), int(self.rng.integers(2**32))
        return CMA(mean, self.rules.step, bounds, seed=seed, population_size=population)
