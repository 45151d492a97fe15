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
from creepkit.dataset.coefficients import LARGEST_LN_COEFFICIENT, TermGroup, coefficient_exponents
from creepkit.dataset.looks import RateEvaluationPoints
from creepkit.dataset.term_rates import ln_rate
from creepkit.errors import LawError
from creepkit.language import CreepLaw, State

LIFE_FRACTIONS = (0.03, 0.7)
"""Of the life of the material that a test takes: damage is hardly seen, or soon breaks it."""

QUADRATURE_POINTS = 64
"""Of the integral over an internal variable, in the middle of equal spans."""


@dataclass(frozen=True)
class DamageRateScaling:
    """One internal variable: part is its rate as a law; initial, reach : where it starts, and from there to its limit.

    place : of the variable among the law's states.
    """

    group: TermGroup
    state_index: int
    initial: float
    range: float

    def ln_initial_rate(self, theta: Floats, life_fraction: Floats, points: RateEvaluationPoints) -> Floats:
        """ln of the virgin variable's rate, 1/s, for which a test takes `share` of life, (rows,)."""
        return np.asarray(np.log(life_fraction * abs(self.range) / points.end_times) + self._ln_life_factor(theta, points))

    def _ln_life_factor(self, theta: Floats, points: RateEvaluationPoints) -> Floats:
        """ln of life times the virgin rate over the reach: 0 where the rate stays as it begins, (rows,)."""
        law = self.group.law
        states: list[float | Floats] = [state.initial for state in law.states.values()]
        group_theta, arguments = theta[:, None, list(self.group.positions)], points.midpoint_arguments(axes=1)
        ln_initial_rate = ln_rate(law, group_theta, arguments, states)
        states[self.state_index] = self.initial + self.range * (np.arange(QUADRATURE_POINTS) + 0.5) / QUADRATURE_POINTS
        return np.asarray(logsumexp(ln_initial_rate - ln_rate(law, group_theta, arguments, states), axis=1) - np.log(QUADRATURE_POINTS))


@lru_cache(maxsize=64)
def damage_rate_scalings(law: CreepLaw) -> tuple[DamageRateScaling, ...]:
    """The internal variables of a law that have a limit, and a coefficient of their own."""
    scalings = []
    for state_index, (symbol, state) in enumerate(law.states.items()):
        if state.limit is not None:
            group = _rate_group(law, symbol, state)
            scalings += [] if group is None else [DamageRateScaling(group, state_index, state.initial, state.limit - state.initial)]
    return tuple(scalings)


def solve_damage_coefficients(law: CreepLaw, theta: Floats, unit_coordinates: Floats, points: RateEvaluationPoints) -> Floats:
    """Return theta with coefficients that make tests take a share of life; unit : (rows, parameters), their own."""
    solved, (low, high) = np.array(theta), np.log(LIFE_FRACTIONS)
    for scaling in damage_rate_scalings(law):
        k, group = scaling.group.coefficient, scaling.group
        solved[:, k] = 0.0
        life_fraction = np.exp(low + unit_coordinates[:, k] * (high - low))
        ln_coefficient = (scaling.ln_initial_rate(solved, life_fraction, points) - group.ln_mean_rate(solved, points)) / group.exponent
        solved[:, k] = np.minimum(ln_coefficient, LARGEST_LN_COEFFICIENT)
    return solved


def _rate_group(law: CreepLaw, symbol: sympy.Symbol, state: State) -> TermGroup | None:
    """The rate of an internal variable as a law with one coefficient, None where there is none."""
    sign = 1 if state.limit is None or state.limit > state.initial else -1
    rate_parameters = {p: param for p, param in law.params.items() if any(p in z.rate.free_symbols for z in law.states.values())}
    rate_law = replace(law, terms={f"rate of {symbol}": sign * state.rate}, params=rate_parameters, constraints=())
    other_expressions = [*law.terms.values(), *(z.rate for s, z in law.states.items() if s != symbol)]
    shared = {name for name in rate_law.names if any(law.symbol(name) in e.free_symbols for e in other_expressions)}
    try:
        (exponents,) = coefficient_exponents(rate_law)
    except LawError:
        return None
    exclusive = [k for k in exponents if rate_law.names[k] not in shared]
    if not exclusive:
        return None
    positions = tuple(law.names.index(name) for name in rate_law.names)
    return TermGroup(rate_law, positions, positions[exclusive[0]], exponents[exclusive[0]])
