"""Multi-start bounded least squares: screen many draws cheaply, refine the best and the centre of the bounds.

Screening and starts follow what was measured on this problem: a handful of screened starts with exact Jacobians
finds the best misfit at a hundredth of the cost of a swarm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.fences import Fences
from creepkit.inverse.objective import Objective
from creepkit.language import CreepLaw

RATE_WINDOW = (-12.0, 6.0)
"""Bounds of the log rate of a term, or of an internal variable, about the measured one: at 1e-5 of the data it is
absent, at 400 times it is wrong."""

GROWTH_WINDOW = (-4.0, 0.0)
"""Where the rate of an internal variable is drawn: ln of its rate times the life of a test."""

ANCHOR = 1e-4
"""How hard each unknown is drawn to the middle of its bounds, in standard deviations of data per width of the bounds.

Far too weak to bias a value. Without it one unknown that moves nothing, as the share of the largest principal stress
in tension, leaves the Jacobian short of its rank, and scipy's steps are then always as long as the trust region.
"""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Box:
    """Bounds of the unknowns of a search, (unknowns,) each, and the scale on which it steps."""

    low: Floats
    high: Floats

    @classmethod
    def of(cls, law: CreepLaw, coordinates: Coordinates, log_rate: float, log_pace: float) -> Box:
        """The law's bounds, with rates within RATE_WINDOW of the measured ones.

        log_rate : of strain; log_pace : ln of one over the life of a test, that of internal variables.
        """
        low, high = (np.array([p.to_internal(p.bounds[end]) for p in law.params.values()], float) for end in (0, 1))
        for k in coordinates.rates:
            low[k], high[k] = log_rate + RATE_WINDOW[0], log_rate + RATE_WINDOW[1]
        for k in coordinates.growths:
            low[k], high[k] = log_pace + RATE_WINDOW[0], log_pace + RATE_WINDOW[1]
        return cls(low, high)

    def beside(self, unknowns: Unknowns) -> Box:
        """The box of x = (u, e), with the limits of the unknowns of tests."""
        n = unknowns.size
        return Box(np.concatenate([self.low, unknowns.low[:n]]), np.concatenate([self.high, unknowns.high[:n]]))

    def clip(self, u: Floats) -> Floats:
        """The nearest point inside."""
        return np.clip(u, self.low, self.high)

    @property
    def width(self) -> Floats:
        """high - low."""
        return self.high - self.low


@dataclass(frozen=True)
class Minimum:
    """Where a search ended: coordinates, cost (half the sum of squares), and whether it converged."""

    u: Floats
    cost: float
    converged: bool
    evaluations: int


def multistart(
    objective: Objective, box: Box, factor: Floats, *, starts: int, draws: int, seed: int,
    loss: str, progress: Progress | None = None, extra: Sequence[Floats] = (),
) -> list[Minimum]:  # fmt: skip
    """Minima from the screened best of `draws` Sobol points, the centre of the bounds and `extra`, best first."""
    seeds = [*extra, *_screened(objective, box, starts=starts, draws=draws, seed=seed)]
    found = []
    for k, u in enumerate(seeds):
        found.append(refine(objective, box, factor, u, loss=loss, steps=30, tolerance=1e-5))
        if progress is not None:
            progress("start", k + 1, len(seeds))
    return sorted(found, key=lambda minimum: minimum.cost)


def from_single_terms(
    objective: Objective, box: Box, factor: Floats, *, starts: int, draws: int, seed: int, loss: str
) -> list[Floats]:
    """For a sum of terms, one start for each: its own optimum, the others at a 20th of its rate; best first.

    A sum is never worse than its terms, but a search from the whole box rarely finds that.
    """
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
        inner = Box(box.low[own], box.high[own])
        minimum = multistart(part, inner, factor, starts=starts, draws=draws, seed=seed, loss=loss)[0]
        objective.evaluations += part.evaluations
        u = 0.5 * (box.low + box.high)
        u[own] = minimum.u
        rates = objective.coordinates.rates
        level = [u[k] for k in rates if k in own] or [0.5 * (box.low + box.high)[k] for k in rates]
        for k in rates:
            u[k] = u[k] if k in own else max(level) - np.log(20.0)
        found.append((minimum.cost, box.clip(u)))
    return [u for _, u in sorted(found, key=lambda pair: pair[0])]


def refine(
    objective: Objective, box: Box, factor: Floats, start: Floats, *, loss: str = "linear",
    steps: int = 80, tolerance: float = 1e-10,
) -> Minimum:  # fmt: skip
    """Bounded least squares (scipy's trust region reflective) from one start, with analytic Jacobian.

    factor : (tests, entries, entries) Cholesky factors of the covariance, which stay as they are during the search.
    """
    fences, hold, middle = Fences(objective), ANCHOR / box.width, 0.5 * (box.low + box.high)
    memory: dict[bytes, tuple[Floats, Floats]] = {}

    def evaluate(u: Floats) -> tuple[Floats, Floats]:
        key = u.tobytes()
        if key not in memory:
            memory.clear()
            residuals = objective.at(u)
            assert residuals.jacobian is not None
            both = np.concatenate([residuals.values[..., None], residuals.jacobian], axis=-1)
            white = np.linalg.solve(factor, both)[objective.entries.present]
            memory[key] = (
                np.concatenate([white[:, 0], fences.values(u), hold * (u - middle)]),
                np.concatenate([white[:, 1:], fences.jacobian(u), np.diag(hold)]),
            )
        return memory[key]

    scale, own = 0.1 * box.width, objective.unknowns.size
    if own:
        scale[-own:] = np.minimum(objective.unknowns.sd, box.width[-own:])
    room = 1e-9 * box.width
    result = least_squares(
        lambda u: evaluate(u)[0],
        np.clip(start, box.low + room, box.high - room),
        jac=lambda u: evaluate(u)[1],
        bounds=(box.low, box.high),
        x_scale=scale,
        loss=loss,
        max_nfev=steps,
        ftol=tolerance,
        xtol=10 * tolerance,
        gtol=tolerance,
    )
    return Minimum(np.asarray(result.x), float(result.cost), bool(result.status > 0), int(result.nfev))


def _screened(objective: Objective, box: Box, *, starts: int, draws: int, seed: int) -> list[Floats]:
    """The centre, and the best draws after a shift of all rates to the level of the data."""
    unit = qmc.Sobol(box.low.size, seed=seed).random(draws)
    points = box.low + unit * box.width
    rates = list(objective.coordinates.rates)
    points = np.concatenate([(0.5 * (box.low + box.high))[None], points])
    if rates:
        level = 0.5 * (box.low + box.high)[rates[0]] - 0.5 * sum(RATE_WINDOW)
        rng = np.random.default_rng(seed)
        shares = rng.dirichlet(np.full(len(rates), 0.7), size=len(points))
        shares[0] = _unequal(len(rates))
        points[:, rates] = level + np.log(np.maximum(shares, 1e-4))
        growths = list(objective.coordinates.growths)
        pace = (0.5 * (box.low + box.high) - 0.5 * sum(RATE_WINDOW))[growths]
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


def _unequal(count: int) -> Floats:
    """Shares .7, .2, .1 and so on: equal shares are a stationary point from which no search escapes."""
    shares = np.array([0.7, *(0.3 * 0.67**k for k in range(1, count))])
    return np.asarray(shares / shares.sum())
