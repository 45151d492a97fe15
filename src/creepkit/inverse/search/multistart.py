"""Multi-start least squares: screen many draws cheaply, refine the best and the centre of the bounds side by side.

Screening and starts follow what was measured on this problem: a handful of screened starts with exact Jacobians
finds the best misfit at a hundredth of the cost of a swarm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.search.box import RATE_WINDOW, Box
from creepkit.inverse.search.landscape import Found, Landscape
from creepkit.inverse.search.refining import Minimum, Progress
from creepkit.inverse.search.side_by_side import refined_side_by_side
from creepkit.inverse.search.trace import Trace

GROWTH_WINDOW = (-4.0, 0.0)
"""Where the rate of an internal variable is drawn: ln of its rate times the life of a test."""


@dataclass(frozen=True)
class MultiStart:
    """Least squares from the centre of the bounds and the best of screened Sobol draws.

    starts, draws : None for those of the settings. For a sum of terms each term's own optimum is a start too.
    """

    starts: int | None = None
    draws: int | None = None

    def minima(self, landscape: Landscape, progress: Progress | None = None) -> Found:
        """The minima of all starts, best first; a sum's best single term stands behind the best."""
        starts, draws = self.starts or landscape.settings.starts, self.draws or landscape.settings.draws
        singles = from_single_terms(landscape, starts=max(2, starts // 3), draws=draws // 2)
        seeds = [*singles, *screened(landscape, starts=starts, draws=draws)]
        costs: list[Floats] = []
        found = refined_side_by_side(landscape, seeds, progress=progress, costs=costs)
        return Found(tuple(found), Trace.of("multi-start", costs) if costs else None)


def from_single_terms(landscape: Landscape, *, starts: int, draws: int) -> list[Floats]:
    """For a sum of terms, one start for each: its own optimum, the others at a 20th of its rate; best first.

    A sum is never worse than its terms, but a search from the whole box rarely finds that.
    """
    objective, box = landscape.objective, landscape.box
    law = objective.law
    found: list[tuple[float, Floats]] = []
    if len(law.terms) < 2:
        return []
    for label in law.terms:
        single = law.only(label)
        if not single.params:
            continue
        coordinates = Coordinates(single, objective.coordinates.reference)
        part = objective.asking(objective.using, single, coordinates)
        own = [law.names.index(name) for name in single.names]
        inner = replace(landscape, objective=part, box=Box(box.low[own], box.high[own]), penalty=None)
        minimum = refined_side_by_side(inner, screened(inner, starts=starts, draws=draws))[0]
        objective.evaluations += part.evaluations
        u = box.middle
        u[own] = minimum.u
        rates = objective.coordinates.rates
        level = [u[k] for k in rates if k in own] or [box.middle[k] for k in rates]
        for k in rates:
            u[k] = u[k] if k in own else max(level) - np.log(20.0)
        found.append((minimum.cost, box.clip(u)))
    return [u for _, u in sorted(found, key=lambda pair: pair[0])]


def screened(landscape: Landscape, *, starts: int, draws: int) -> list[Floats]:
    """The centre, and the best draws after a shift of all rates to the level of the data."""
    objective, box, seed = landscape.objective, landscape.box, landscape.settings.seed
    unit = qmc.Sobol(box.low.size, seed=seed).random(draws)
    points = box.low + unit * box.width
    rates = list(objective.coordinates.rates)
    points = np.concatenate([box.middle[None], points])
    points = _exponents_drawn(landscape, points, np.concatenate([np.full((1, box.low.size), 0.5), unit]))
    if rates:
        level = box.middle[rates[0]] - 0.5 * sum(RATE_WINDOW)
        rng = np.random.default_rng(seed)
        shares = rng.dirichlet(np.full(len(rates), 0.7), size=len(points))
        shares[0] = unequal(len(rates))
        points[:, rates] = level + np.log(np.maximum(shares, 1e-4))
        growths = list(objective.coordinates.growths)
        pace = (box.middle - 0.5 * sum(RATE_WINDOW))[growths]
        points[1:, growths] = pace + GROWTH_WINDOW[0] + unit[:, growths] * (GROWTH_WINDOW[1] - GROWTH_WINDOW[0])
        points[0, growths] = pace + 0.5 * sum(GROWTH_WINDOW)
        for _ in range(3 + 2 * min(len(growths), 1)):
            misfit = objective.screen(box.clip(points))
            points[:, rates] -= np.clip(objective.excess(misfit), -6, 6)[:, None]
            points[:, growths] -= np.clip(objective.early(misfit), -6, 6)[:, None]
    points = box.clip(points)
    misfit = objective.screen(points)
    score = np.array([np.mean(np.arcsinh(m[objective.entries.present]) ** 2) for m in misfit])
    if not np.isfinite(score).any():
        raise FitError(f"law '{objective.law.name}': no point within its bounds can be simulated; widen the bounds")
    order = [int(k) for k in np.argsort(score) if k != 0][: max(starts - 1, 0)]
    return [points[0], *(points[k] for k in order)]


def _exponents_drawn(landscape: Landscape, points: Floats, unit: Floats) -> Floats:
    """Local exponents of parameters that are drawn within their bounds, and not beyond them."""
    coordinates, law = landscape.objective.coordinates, landscape.objective.law
    if not coordinates.exponents:
        return points
    drawn = points.copy()
    for local in coordinates.exponents:
        param = law.table[law.names[local.p]]
        low, high = (param.to_internal(b) for b in param.bounds)
        drawn[:, local.p] = low + unit[:, local.p] * (high - low)
    found = coordinates.u(drawn)
    for local in coordinates.exponents:
        points[:, local.p] = found[:, local.p]
    return landscape.box.clip(points)


ALIKE, ALIKE_BY_STAND_IN = 1e-5, 5e-3
"""Root mean square difference of predictions, over the spread of what was measured, below which two minima are one. A
stand-in is not better than the latter, and along a valley one start is enough for the predictor behind it."""
GUESSED = 0.3
"""How wrong frames are in a search, over that spread (see inverse.scatter.working_guess)."""


def distinct(
    minima: Sequence[Minimum], box: Box, *, alike: float = ALIKE, most: int = 2, near: float = 0.02
) -> list[Minimum]:
    """The best minima that differ by more than 2 % of the box in some coordinate, and in what they predict."""
    kept: list[Minimum] = []
    for minimum in minima:
        if not any(_same(minimum, other, box, alike, near) for other in kept):
            kept.append(minimum)
    return kept[:most]


def _same(a: Minimum, b: Minimum, box: Box, alike: float, near: float) -> bool:
    if (np.abs(a.u - b.u) <= near * box.width).all():
        return True
    if a.white is None or b.white is None:
        return False
    return bool(np.mean((a.white - b.white) ** 2) < (alike / GUESSED) ** 2)


def unequal(count: int) -> Floats:
    """Shares .7, .2, .1 and so on: equal shares are a stationary point from which no search escapes."""
    shares = np.array([0.7, *(0.3 * 0.67**k for k in range(1, count))])
    return np.asarray(shares / shares.sum())
