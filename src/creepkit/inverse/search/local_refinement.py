"""Local refinement: bounded least squares from one start, a robust loss, and the record of a minimum.

Gauss and Newton's method within a trust region, which is a box as the bounds are: Nocedal & Wright, Numerical
Optimization (2006), chapters 4 and 10; its radius is theirs. A step knows the limits that it would come to
lie beyond, by their linear models: with those alone that are exceeded already it would be one to and fro.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.bounds import Bounds
from creepkit.inverse.variance_components import least_within

IterationCallback = Callable[[str, int, int], None]
"""Reports the progress of a search: (name of the step, how many are done, how many there are)."""


System = Callable[[Floats], tuple[Floats, Floats]]
"""x (unknowns,) to residuals (rows,) and their derivatives (rows, unknowns)."""


@dataclass(frozen=True)
class Minimum:
    """The end of a search.

    x : (unknowns,) where it ended; cost : half the sum of squares there; converged : whether it met its tolerance.
    promised : cost at the end of a further step of Gauss and Newton.
    whitened_residuals : (data,) -, whitened residuals of the data there; none where they were not kept.
    """

    x: Floats
    cost: float
    converged: bool
    promised: float = np.inf
    whitened_residuals: Floats = field(default_factory=lambda: np.zeros(0), repr=False)


@dataclass(frozen=True)
class Tolerances:
    """When a local refinement ends.

    After so many points, at this relative change of the cost, or where a step of Gauss and Newton promises less than
    the relative gain, or no cost as low as is wanted, which is judged before the step is simulated.
    """

    max_steps: int = 30
    tolerance: float = 1e-5
    gain: float = 0.0
    wanted: float = np.inf


FIRST_RADIUS = 3.0
"""Of the trust region, in scales of a step."""


def bounded_least_squares(
    system: System,
    start: Floats,
    bounds: Bounds,
    scale: Floats,
    tolerances: Tolerances,
    limits: System,
    *,
    robust: bool = False,
) -> Minimum:
    """Bounded least squares; an unknown whose bounds are equal keeps its value.

    system : the residuals, of which a robust loss is taken. start : (unknowns,) within the bounds. scale : (unknowns,)
    of a step in each unknown. limits : further residuals, which count where they are above zero.
    """

    def best_within(x: Floats, rows: Floats, radius: float) -> tuple[Floats, float]:
        """The least point of the model about x within a radius, and how much lower than at x it is there."""
        low, high = (np.clip(end - x, -radius * scale, radius * scale) for end in (bounds.lower, bounds.upper))
        beyond, slopes = limits(x)
        linear_limits, counts = np.column_stack([slopes, beyond]), beyond > 0.0
        at_x = float((rows[:, -1] ** 2).sum()) + _squares_above(beyond)
        for k in range(MOST_CHANGES):  # which limits count, in turn with the step
            step = least_within(np.concatenate([rows, linear_limits[counts]]), low, high)
            left, before = beyond + slopes @ step, counts
            counts = (left > 0.0) | (counts & (k > MOST_CHANGES // 2))
            if (counts == before).all():
                break

        missed = float(((rows[:, :-1] @ step + rows[:, -1]) ** 2).sum()) + _squares_above(left)
        return x + step, 0.5 * (at_x - missed)

    def evaluated(x: Floats) -> tuple[Floats, float, Floats, Floats]:
        """The point, its cost, its residuals, and the rows of its linear model."""
        values, jacobian = system(x)
        weights = (1.0 + values**2) ** -0.25 if robust else np.ones_like(values)
        rows = np.column_stack([jacobian, values]) * weights[:, None]
        if not np.isfinite(rows).all():
            return x, np.inf, values, rows
        cost = 0.5 * (float((robust_loss(values**2) if robust else values**2).sum()) + _squares_above(limits(x)[0]))
        return x, cost, values, np.asarray(np.linalg.qr(rows, mode="r"))

    here, radius, settled = evaluated(start), FIRST_RADIUS, False
    for further in reversed(range(tolerances.max_steps)):
        (x, least, values, rows), tolerance = here, tolerances.tolerance
        end, gain = best_within(x, rows, np.inf)
        promised = least - gain
        settled = settled or gain <= tolerances.gain * least or promised > tolerances.wanted
        if settled or not further:
            break
        if (np.abs(end - x) > radius * scale).any():
            end, gain = best_within(x, rows, radius)
        there = evaluated(end)
        fall, size = least - there[1], float((np.abs(end - x) / scale).max())
        radius = 0.25 * size if not fall > 0.25 * gain else max(radius, 2.0 * size) if fall > 0.75 * gain else radius
        settled = size <= 10.0 * tolerance or (0.25 * gain < fall <= tolerance * least)
        here = there if fall > 0.0 else here
    return Minimum(x, least, settled, promised, values)


MOST_CHANGES = 20
"""Of which limits count at the end of a step; in the second half none ceases to."""


def _squares_above(limits: Floats) -> float:
    return float((np.maximum(limits, 0.0) ** 2).sum())


def robust_loss(squared: Floats) -> Floats:
    """(...,) - the loss "soft_l1" of scipy; squared : (...,) squares of whitened residuals."""
    return np.asarray(2.0 * (np.sqrt(1.0 + squared) - 1.0))
