"""Internal variables with a limit, such as damage: their rate coefficients, from the share of life that a test takes.

Uniform in bounds of sixty decades, a coefficient lets nearly every bar break at once or never be damaged. With
dw/dt = B g(w) at the reference stress life is the integral of dw/(B g), so that B follows from the duration of the test
over life, which is drawn uniform in its logarithm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import sympy
from scipy.special import logsumexp

from creepkit.arrays import Floats
from creepkit.dataset.coefficients import LARGEST, Part, slopes_of
from creepkit.dataset.looks import Looks
from creepkit.dataset.term_rates import ln_rate
from creepkit.errors import LawError
from creepkit.language import CreepLaw, State

LIFE_SHARES = (0.03, 0.7)
"""Of the life of the material that a test takes: damage is hardly seen, or soon breaks it."""

STEPS = 64
"""Of the integral over an internal variable, in the middle of equal spans."""


@dataclass(frozen=True)
class Growth:
    """One internal variable: part is its rate as a law; initial, reach : where it starts, and from there to its limit.

    place : of the variable among the law's states.
    """

    part: Part
    place: int
    initial: float
    reach: float

    def wanted(self, theta: Floats, share: Floats, looks: Looks) -> Floats:
        """ln of the virgin variable's rate, 1/s, for which a test takes `share` of life, (rows,)."""
        return np.asarray(np.log(share * abs(self.reach) / looks.ends) + self._ln_slowness(theta, looks))

    def _ln_slowness(self, theta: Floats, looks: Looks) -> Floats:
        """ln of life times the virgin rate over the reach: 0 where the rate stays as it begins, (rows,)."""
        law = self.part.law
        states: list[float | Floats] = [state.initial for state in law.states.values()]
        own, point = theta[:, None, list(self.part.positions)], looks.middle_point(axes=1)
        virgin = ln_rate(law, own, point, states)
        states[self.place] = self.initial + self.reach * (np.arange(STEPS) + 0.5) / STEPS
        return np.asarray(logsumexp(virgin - ln_rate(law, own, point, states), axis=1) - np.log(STEPS))


@lru_cache(maxsize=64)
def growths_of(law: CreepLaw) -> tuple[Growth, ...]:
    """The internal variables of a law that have a limit, and a coefficient of their own."""
    found = []
    for place, (symbol, state) in enumerate(law.states.items()):
        if state.limit is not None:
            part = _part(law, symbol, state)
            found += [] if part is None else [Growth(part, place, state.initial, state.limit - state.initial)]
    return tuple(found)


def solve_growths(law: CreepLaw, theta: Floats, unit: Floats, looks: Looks) -> Floats:
    """Return theta with coefficients that make tests take a share of life; unit : (rows, parameters), their own."""
    solved, (low, high) = np.array(theta), np.log(LIFE_SHARES)
    for growth in growths_of(law):
        k, part = growth.part.coefficient, growth.part
        solved[:, k] = 0.0
        share = np.exp(low + unit[:, k] * (high - low))
        ln_coefficient = (growth.wanted(solved, share, looks) - part.ln_rate(solved, looks)) / part.slope
        solved[:, k] = np.minimum(ln_coefficient, LARGEST)
    return solved


def _part(law: CreepLaw, symbol: sympy.Symbol, state: State) -> Part | None:
    """The rate of an internal variable as a law with one coefficient, None where there is none."""
    sign = 1 if state.limit is None or state.limit > state.initial else -1
    own = {p: param for p, param in law.params.items() if any(p in z.rate.free_symbols for z in law.states.values())}
    grown = replace(law, terms={f"rate of {symbol}": sign * state.rate}, params=own, constraints=())
    others = [*law.terms.values(), *(z.rate for s, z in law.states.items() if s != symbol)]
    shared = {name for name in grown.names if any(law.symbol(name) in e.free_symbols for e in others)}
    try:
        (slopes,) = slopes_of(grown)
    except LawError:
        return None
    mine = [k for k in slopes if grown.names[k] not in shared]
    if not mine:
        return None
    positions = tuple(law.names.index(name) for name in grown.names)
    return Part(grown, positions, positions[mine[0]], slopes[mine[0]])
