"""Particle swarm, as in the paper: 300 particles, 100 iterations, all of them and all histories one prediction.

A particle at x (in the unit cube of the box) with velocity v is drawn to the best place it has seen, p, and to the best
that any has seen, g:

    v <- K [v + c1 r1 (p - x) + c2 r2 (g - x)],   K = 2 / |2 - c - sqrt(c^2 - 4 c)|,   c = c1 + c2    "constriction"
    v <- w v + c1 r1 (p - x) + c2 r2 (g - x),     w falling linearly over the iterations               "inertia"
    x <- x + v,                                   r1, r2 uniform in [0, 1], one for each coordinate

(Kennedy & Eberhart 1995; Shi & Eberhart 1999; Clerc & Kennedy 2002.) The best that differ are refined by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.search.polishing import SETTLED, Candidates, check_counts, polished
from creepkit.inverse.search.subsets import Switches
from creepkit.inverse.search.trace import Trace

if TYPE_CHECKING:
    from creepkit.inverse.search.landscape import Found, Landscape
    from creepkit.inverse.search.refining import Progress


@dataclass(frozen=True)
class ParticleSwarm:
    """A swarm and its rules; numbers of particles and iterations are the paper's.

    own, common : c1, c2; velocity : the largest, in widths of the box. 2.05, 2.05, .15, form="constriction" and a start
        at rest from a Sobol set are the settings of the authors' published code (NIMSI-NU/DABI-Property-Extraction).
        That one is for finite elements in the loop: 70 particles, each told of a new best at once; here an iteration is
        one prediction, so that all hear of it together. The table of the paper's 300 x 100 (S1) is not at hand, nor is
        it said what happens at the walls.
    inertia : w of the first and of the last iteration, for form="inertia" (Shi & Eberhart 1999).
    walls : "absorb" stops a particle there, which suits optima on bounds; "reflect" sends it back.
    off : names of terms of a sum, or "any", that a particle may switch off: a coefficient in {0} U [bounds]. A particle
        has a mask beside its position, inherited from its own best and the common best by the toss of a coin, with a
        flip now and then, and follows the best of its subset. This makes zero possible, not preferred: more terms never
        fit worse, so that it takes a penalty to choose among subsets. The minima are the best of each of the best
        subsets, and say which terms are off.
    polish : how many of the best particles, different ones, are refined; 0 leaves the best as it is.
    patience : end after so many iterations in which the best cost fell by less than 1e-3 (half of chi-square), or None.
    """

    particles: int = 300
    iterations: int = 100
    form: Literal["constriction", "inertia"] = "constriction"
    own: float = 2.05
    common: float = 2.05
    inertia: tuple[float, float] = (0.9, 0.4)
    velocity: float = 0.15
    walls: Literal["absorb", "reflect"] = "absorb"
    off: str | Sequence[str] = ()
    polish: int = 3
    patience: int | None = None

    def __post_init__(self) -> None:
        least = {"particles": 2, "iterations": 1, "polish": 0} | ({} if self.patience is None else {"patience": 1})
        check_counts("particle swarm", {name: getattr(self, name) for name in least}, least)
        for name, allowed in (("form", ("constriction", "inertia")), ("walls", ("absorb", "reflect"))):
            found = getattr(self, name)
            if found not in allowed:
                raise FitError(f"particle swarm: {name} is {found!r}; allowed are {' and '.join(allowed)}")
        if not 0 < self.velocity <= 1:
            raise FitError(f"particle swarm: velocity is {self.velocity:g} of the box; allowed are 0 (not itself) to 1")
        if not all(0 <= w <= 1 for w in self.inertia):
            raise FitError(f"particle swarm: inertia is {self.inertia}; both are from 0 to 1")
        if min(self.own, self.common) < 0 or (self.form == "constriction" and self.own + self.common <= 4):
            raise FitError(
                f"particle swarm: own and common pull with {self.own:g} and {self.common:g}; they must not be below "
                "zero and, with form='constriction', must be more than 4 together"
            )

    def minima(self, landscape: Landscape, progress: Progress | None = None) -> Found:
        """The refined best, best first, and the trace."""
        flight, costs = _Flight(self, landscape), []
        for k in range(self.iterations):
            costs.append(flight.look())
            if progress is not None:
                progress("swarm", k + 1, self.iterations)
            if self._settled(flight.lowest):
                break
            flight.move(k)
        trace = Trace.of(f"particle swarm of {self.particles}, {self.form} form", costs)
        return polished(landscape, flight.seen(), self.polish, trace, progress)

    def carried(self, velocity: Floats, pull: Floats, k: int) -> Floats:
        """The velocity after iteration k, from the one before and the pull of the best places, within its limit."""
        if self.form == "constriction":
            c = self.own + self.common
            moved = 2.0 / abs(2.0 - c - np.sqrt(c * c - 4.0 * c)) * (velocity + pull)
        else:
            first, last = self.inertia
            moved = (first + (last - first) * k / max(self.iterations - 1, 1)) * velocity + pull
        return np.asarray(np.clip(moved, -self.velocity, self.velocity))

    def _settled(self, lowest: Sequence[float]) -> bool:
        if self.patience is None or len(lowest) <= self.patience:
            return False
        return lowest[-1 - self.patience] - lowest[-1] < SETTLED


class _Flight:
    """Where all particles are, in the unit cube, and the best that each has seen."""

    def __init__(self, rules: ParticleSwarm, landscape: Landscape) -> None:
        self.rules, self.landscape, seed = rules, landscape, landscape.settings.seed
        self.rng, self.switches = np.random.default_rng(seed), Switches.of(landscape, rules.off)
        count, size = rules.particles, landscape.box.low.size
        self.x, self.velocity = _sobol(count, size, seed), np.zeros((count, size))
        self.on = self.switches.drawn(count, self.rng)
        self.best, self.best_on, self.cost = self.x.copy(), self.on.copy(), np.full(count, np.inf)
        self.lowest: list[float] = []
        self.subsets: dict[bytes, tuple[float, Floats, Bools]] = {}

    def look(self) -> Floats:
        """(particles,) costs where they are, in one prediction; the best are remembered."""
        cost = self.landscape.cost(self._u(self.x, self.on))
        better = cost < self.cost
        self.best[better], self.best_on[better], self.cost[better] = self.x[better], self.on[better], cost[better]
        self.lowest.append(float(self.cost.min()))
        for k in np.flatnonzero(better) if self.switches.terms else ():
            self._keep(self.on[k], float(cost[k]), self.x[k])
        return cost

    def _keep(self, on: Bools, cost: float, x: Floats) -> None:
        """The best of each subset."""
        key = on.tobytes()
        if key not in self.subsets or cost < self.subsets[key][0]:
            self.subsets[key] = cost, x.copy(), on.copy()

    def move(self, k: int) -> None:
        """One step of all; what a better one does not have, draws nobody."""
        shape, rules = self.x.shape, self.rules
        self.on = self.switches.inherited(self.best_on, self.best_on[self.cost.argmin()], self.rng)
        leaders, masks = self._leaders()
        own = np.where(self.switches.live(self.best_on), self.best - self.x, 0.0)
        common = np.where(self.switches.live(masks), leaders - self.x, 0.0)
        pull = rules.own * self.rng.random(shape) * own + rules.common * self.rng.random(shape) * common
        self.velocity = rules.carried(self.velocity, pull, k)
        self._at_walls(self.x + self.velocity)

    def _leaders(self) -> tuple[Floats, Bools]:
        """Whom each particle follows, and with which terms: the best of its subset, or of all if it is the first."""
        k = int(self.cost.argmin())
        if not self.switches.terms:
            return self.best[k], self.best_on[k]
        of_all = (0.0, self.best[k], self.best_on[k])
        _, places, masks = zip(*(self.subsets.get(on.tobytes(), of_all) for on in self.on), strict=True)
        return np.array(places), np.array(masks)

    def seen(self) -> Candidates:
        """The best that each particle has seen; where terms may be off, the best of each subset."""
        if self.switches.terms:
            costs, places, masks = (np.array(each) for each in zip(*self.subsets.values(), strict=True))
            return Candidates(self._u(places, masks), costs, self.switches, masks)
        return Candidates(self._u(self.best, self.best_on), self.cost)

    def _u(self, x: Floats, on: Bools) -> Floats:
        box = self.landscape.box
        return self.switches.sent(box.low + x * box.width, on)

    def _at_walls(self, x: Floats) -> None:
        inside = np.clip(x, 0.0, 1.0)
        if self.rules.walls == "absorb":
            self.velocity = np.where(x == inside, self.velocity, 0.0)
            self.x = inside
        else:
            self.velocity = np.where(x == inside, self.velocity, -self.velocity)
            self.x = np.clip(2.0 * inside - x, 0.0, 1.0)


def _sobol(count: int, size: int, seed: int) -> Floats:
    """(count, size) the first points of a scrambled Sobol set, which is balanced in powers of two."""
    return np.asarray(qmc.Sobol(size, seed=seed).random_base2(int(np.ceil(np.log2(count))))[:count])
