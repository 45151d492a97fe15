"""Parameters of a law from prescribed mean rates: rate coefficients, stress scales, and rate coefficients of damage.

Terms that share a rate coefficient A form a group whose rate is proportional to it: ln f = ln A + ln g, so that ln A
follows from the prescribed rate. A parameter B in MPa is drawn through the ratio of the reference stress to it, 0.05 to
4, where the local stress exponent is above 0 and at most 12. The rate coefficient of an internal variable with a limit
follows from the ratio of test duration to life.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import sympy
from scipy.special import logsumexp

from creepkit.arrays import Bools, Floats
from creepkit.errors import DatasetError, LawError
from creepkit.kernels.log_form import log_form
from creepkit.language import CreepLaw, Param, State
from creepkit.sampling.rates import RateEvaluationPoints, ln_rate, mean_ln_rate

LARGEST_LN_COEFFICIENT = 690.0
"""ln of a coefficient that is still finite in double precision: what a term that is nowhere above zero gets."""


@dataclass(frozen=True)
class TermGroup:
    """Terms of a law with one rate coefficient.

    law : these terms alone. positions : of its parameters in the whole law. coefficient : position of the coefficient
        there. exponent : power of the coefficient, 1 as a rule.
    """

    law: CreepLaw
    positions: tuple[int, ...]
    coefficient: int
    exponent: float

    def ln_mean_rate(self, theta: Floats, points: RateEvaluationPoints, stress_factor: float = 1.0) -> Floats:
        """ln of the group's mean rate over a test, (rows, ...), the rate in 1/s.

        theta : (rows, ..., parameters) internal values of the whole law. stress_factor : multiplies the stresses.
        """
        return mean_ln_rate(self.law, theta[..., list(self.positions)], points, stress_factor)


@lru_cache(maxsize=64)
def term_groups(law: CreepLaw) -> tuple[TermGroup, ...]:
    """The groups of a law; DatasetError where a term has no coefficient to set its rate with."""
    exponents = coefficient_exponents(law)
    groups = []
    for term_numbers in _connected_terms(exponents):
        common = set.intersection(*(set(exponents[k]) for k in term_numbers))
        others = {p for k, term_exponents in enumerate(exponents) if k not in term_numbers for p in term_exponents}
        exclusive = sorted(p for p in common - others if len({exponents[k][p] for k in term_numbers}) == 1)
        if not exclusive:
            labels = "', '".join(list(law.terms)[k] for k in term_numbers)
            raise DatasetError(
                f"law '{law.name}': term '{labels}' has no linear rate coefficient (of log scale, with off=0) to set "
                "its rate with; use the paper's sampling domain"
            )
        group_law = law.only(*(list(law.terms)[k] for k in term_numbers))
        positions = tuple(law.names.index(name) for name in group_law.names)
        groups.append(TermGroup(group_law, positions, exclusive[0], exponents[term_numbers[0]][exclusive[0]]))
    return tuple(groups)


def solve_coefficients(
    groups: Sequence[TermGroup], theta: Floats, ln_rates: Floats, points: RateEvaluationPoints
) -> Floats:
    """Return theta, (rows, parameters), with coefficients that give each group its mean rate over the test.

    theta : (rows, parameters) internal values. ln_rates : (rows, groups) ln of the wanted rates in 1/s, -inf: off.
    """
    solved = np.array(theta)
    solved[:, [group.coefficient for group in groups]] = 0.0
    ln_unit_rates = [part.ln_mean_rate(solved, points) for part in groups]
    for part, wanted, ln_unit_rate in zip(groups, ln_rates.T, ln_unit_rates, strict=True):
        solved[:, part.coefficient] = np.minimum((wanted - ln_unit_rate) / part.exponent, LARGEST_LN_COEFFICIENT)
    return solved


def coefficient_exponents(law: CreepLaw) -> list[dict[int, float]]:
    """For each term {position of a parameter that can switch it off: the power at which it multiplies the term}."""
    form = log_form(law)
    parameters = list(law.params.values())
    exponents = []
    for term, positions in zip(form.terms, form.coefficients, strict=True):
        derivatives = {k: term.diff(form.theta[k]) for k in positions if parameters[k].off == 0.0}
        exponents.append(
            {k: float(derivative) for k, derivative in derivatives.items() if derivative.is_number and derivative > 0}
        )
    return exponents


def _connected_terms(exponents: Sequence[dict[int, float]]) -> list[list[int]]:
    """Terms that share a coefficient, directly or through others, together."""
    groups: list[list[int]] = []
    for k, term_exponents in enumerate(exponents):
        connected = [g for g in groups if any(set(term_exponents) & set(exponents[j]) for j in g)]
        groups = [g for g in groups if g not in connected] + [sorted([k, *(j for g in connected for j in g)])]
    return sorted(groups)


LIFE_FRACTIONS = (0.03, 0.7)
"""Fraction of the life of the material that a test takes: damage is hardly seen, or soon breaks it."""


QUADRATURE_POINTS = 64
"""Points of the integral over an internal variable, in the middle of equal intervals."""


@dataclass(frozen=True)
class DamageRateScaling:
    """The rate coefficient of one internal variable, from the fraction of life that a test takes.

    group : the rate of the variable as a law. state_index : of the variable among the law's states. initial : its
        value before the test; range : from there to its limit.
    """

    group: TermGroup
    state_index: int
    initial: float
    range: float

    def ln_initial_rate(self, theta: Floats, life_fraction: Floats, points: RateEvaluationPoints) -> Floats:
        """ln of the initial rate in 1/s, (rows,), for which a test takes life_fraction (rows,) of its life.

        theta : (rows, parameters) internal values.
        """
        return np.asarray(
            np.log(life_fraction * abs(self.range) / points.end_times) + self._ln_life_factor(theta, points)
        )

    def _ln_life_factor(self, theta: Floats, points: RateEvaluationPoints) -> Floats:
        """ln of life times the initial rate over the range, (rows,): 0 where the rate stays as it begins."""
        law = self.group.law
        states: list[float | Floats] = [state.initial for state in law.states.values()]
        group_theta, arguments = theta[:, None, list(self.group.positions)], points.midpoint_arguments(axes=1)
        ln_initial_rate = ln_rate(law, group_theta, arguments, states)
        states[self.state_index] = self.initial + self.range * (np.arange(QUADRATURE_POINTS) + 0.5) / QUADRATURE_POINTS
        return np.asarray(
            logsumexp(ln_initial_rate - ln_rate(law, group_theta, arguments, states), axis=1)
            - np.log(QUADRATURE_POINTS)
        )


@lru_cache(maxsize=64)
def damage_rate_scalings(law: CreepLaw) -> tuple[DamageRateScaling, ...]:
    """The internal variables of a law that have a limit, and a coefficient of their own."""
    scalings = []
    for state_index, (symbol, state) in enumerate(law.states.items()):
        group = None if state.limit is None else _rate_group(law, symbol, state)
        if group is not None and state.limit is not None:
            scalings.append(DamageRateScaling(group, state_index, state.initial, state.limit - state.initial))
    return tuple(scalings)


def solve_damage_coefficients(
    law: CreepLaw, theta: Floats, unit_coordinates: Floats, points: RateEvaluationPoints
) -> Floats:
    """Return theta, (rows, parameters), with coefficients that make tests take a fraction of the life.

    theta : (rows, parameters) internal values. unit_coordinates : (rows, parameters) from 0 to 1.
    """
    solved, (low, high) = np.array(theta), np.log(LIFE_FRACTIONS)
    for scaling in damage_rate_scalings(law):
        k, group = scaling.group.coefficient, scaling.group
        solved[:, k] = 0.0
        life_fraction = np.exp(low + unit_coordinates[:, k] * (high - low))
        ln_coefficient = (
            scaling.ln_initial_rate(solved, life_fraction, points) - group.ln_mean_rate(solved, points)
        ) / group.exponent
        solved[:, k] = np.minimum(ln_coefficient, LARGEST_LN_COEFFICIENT)
    return solved


def _rate_group(law: CreepLaw, symbol: sympy.Symbol, state: State) -> TermGroup | None:
    """The rate of an internal variable as a law with one coefficient, None where there is none."""
    sign = 1 if state.limit is None or state.limit > state.initial else -1
    rate_parameters = {
        p: param for p, param in law.params.items() if any(p in z.rate.free_symbols for z in law.states.values())
    }
    if symbol in law.back_stresses:
        return None
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


STRESS_RATIOS = (0.05, 4.0)


LARGEST_STRESS_EXPONENT = 12.0
"""Largest local stress exponent."""


RATIO_INTERVALS = 32
"""Intervals into which the range of a ratio is divided to find where it may lie."""


def stress_scale_positions(law: CreepLaw) -> tuple[int, ...]:
    """Positions of the parameters in MPa."""
    return tuple(k for k, param in enumerate(law.params.values()) if param.unit == "MPa")


def draw_stress_scales(
    law: CreepLaw,
    groups: Sequence[TermGroup],
    theta: Floats,
    unit_coordinates: Floats,
    ln_rates: Floats,
    points: RateEvaluationPoints,
) -> Floats:
    """Return theta, (rows, parameters), with its stress scales drawn, one after another.

    theta : (rows, parameters) internal values. unit_coordinates : (rows, scales) from 0 to 1.
    ln_rates : (rows, groups) ln of the wanted rates in 1/s, -inf: off.
    """
    result, parameters = np.array(theta), list(law.params.values())
    ratio_ranges = {k: _RatioRange.from_bounds(parameters[k], points.mean_stress) for k in stress_scale_positions(law)}
    for (k, ratio_range), coordinates in zip(ratio_ranges.items(), unit_coordinates.T, strict=True):
        result[:, k] = ratio_range.internal_value(coordinates[:, None])[:, 0]
    for (k, ratio_range), coordinates in zip(ratio_ranges.items(), unit_coordinates.T, strict=True):
        allowed = np.ones((len(coordinates), RATIO_INTERVALS), bool)
        for group, wanted in zip(groups, ln_rates.T, strict=True):
            if k in group.positions:
                trial_theta = np.repeat(result[:, None, :], RATIO_INTERVALS, axis=1)
                trial_theta[..., k] = ratio_range.internal_value((np.arange(RATIO_INTERVALS) + 0.5) / RATIO_INTERVALS)
                allowed &= _allowed(law, group, trial_theta, wanted, points) | np.isneginf(wanted)[:, None]
        result[:, k] = ratio_range.internal_value(_uniform_over_allowed(allowed, coordinates)[:, None])[:, 0]
    return result


@dataclass(frozen=True, eq=False)
class _RatioRange:
    """The range of stress over one parameter that keeps it within its bounds.

    stress : (rows, 1) MPa. low, high : (rows, 1) ends of the ratio.
    """

    param: Param
    stress: Floats
    low: Floats
    high: Floats

    @classmethod
    def from_bounds(cls, param: Param, stress: Floats) -> _RatioRange:
        lowest_ratio, highest_ratio = stress / param.bounds[1], stress / max(param.bounds[0], 1e-30)
        low = np.clip(STRESS_RATIOS[0], lowest_ratio, highest_ratio)
        high = np.maximum(low, np.minimum(STRESS_RATIOS[1], highest_ratio))
        return cls(param, stress[:, None], low[:, None], high[:, None])

    def internal_value(self, unit_coordinates: Floats) -> Floats:
        """The internal value, (rows, n), at coordinates (rows, n) from 0 to 1 of the range."""
        value = np.clip(self.stress / (self.low + unit_coordinates * (self.high - self.low)), *self.param.bounds)
        return np.asarray(np.log(value) if self.param.scale == "log" else value)


def _allowed(law: CreepLaw, group: TermGroup, theta: Floats, ln_rate: Floats, points: RateEvaluationPoints) -> Bools:
    """Where a group has an allowed stress exponent and coefficient, (rows, intervals)."""
    theta[..., group.coefficient] = 0.0
    ln_coefficient = (ln_rate[:, None] - group.ln_mean_rate(theta, points)) / group.exponent
    low, high = np.log(list(law.params.values())[group.coefficient].bounds)
    exponent = local_stress_exponent(group, theta, points)
    return np.asarray(
        (exponent > 0) & (exponent <= LARGEST_STRESS_EXPONENT) & (ln_coefficient >= low) & (ln_coefficient <= high)
    )


def local_stress_exponent(group: TermGroup, theta: Floats, points: RateEvaluationPoints) -> Floats:
    """d ln f / d ln stress of a group, (rows, ...), by a difference of 2 %.

    theta : (rows, ..., parameters) internal values of the whole law.
    """
    ln_rate_above, ln_rate_below = (group.ln_mean_rate(theta, points, factor) for factor in (1.01, 1 / 1.01))
    return np.asarray((ln_rate_above - ln_rate_below) / (2 * np.log(1.01)))


def _uniform_over_allowed(allowed: Bools, coordinates: Floats) -> Floats:
    """Coordinates from 0 to 1 that are uniform over the allowed intervals; over all where none is."""
    weights = np.where(allowed.any(axis=1, keepdims=True), allowed, True).astype(float)
    sums = np.cumsum(weights, axis=1)
    target = coordinates * sums[:, -1]
    interval = np.minimum((sums <= target[:, None]).sum(axis=1), RATIO_INTERVALS - 1)
    fraction = np.clip(target - (np.take_along_axis(sums, interval[:, None], axis=1)[:, 0] - 1.0), 0.0, 1.0)
    return np.asarray((interval + fraction) / RATIO_INTERVALS)
