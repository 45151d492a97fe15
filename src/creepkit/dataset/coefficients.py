"""The linear rate coefficients of a law, and their values for wanted rates.

Each part of a law (a term, or terms that share a coefficient) has one parameter of log scale that can be switched off,
multiplies all of it and nothing else: with all else given, ln f = ln A + ln g, so that ln A of a wanted rate follows at
once, without overflow whatever the exponents are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.looks import RateEvaluationPoints, mean_ln_rate
from creepkit.errors import DatasetError
from creepkit.kernels.logform import log_form
from creepkit.language import CreepLaw

LARGEST_LN_COEFFICIENT = 690.0
"""ln of a coefficient that is still finite in double precision: what a term that is nowhere above zero gets."""


@dataclass(frozen=True)
class TermGroup:
    """Terms of a law with one coefficient.

    law : these terms alone. positions : of its parameters in the whole law. coefficient : position of the coefficient
        there. slope : power of the coefficient, 1 as a rule.
    """

    law: CreepLaw
    positions: tuple[int, ...]
    coefficient: int
    exponent: float

    def ln_mean_rate(self, theta: Floats, points: RateEvaluationPoints, stress_factor: float = 1.0) -> Floats:
        """ln of the part's mean rate over a test, 1/s, (rows, ...).

        theta : (rows, ..., parameters) internal ones of the whole law. factor : on the stresses.
        """
        return mean_ln_rate(self.law, theta[..., list(self.positions)], points, stress_factor)


@lru_cache(maxsize=64)
def term_groups(law: CreepLaw) -> tuple[TermGroup, ...]:
    """The parts of a law; DatasetError where a term has no coefficient to set its rate with."""
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
                "its rate with; use the paper's box"
            )
        group_law = law.only(*(list(law.terms)[k] for k in term_numbers))
        positions = tuple(law.names.index(name) for name in group_law.names)
        groups.append(TermGroup(group_law, positions, exclusive[0], exponents[term_numbers[0]][exclusive[0]]))
    return tuple(groups)


def solve_coefficients(groups: Sequence[TermGroup], theta: Floats, ln_rates: Floats, points: RateEvaluationPoints) -> Floats:
    """Return theta with coefficients that give each part its mean rate over the test.

    theta : (rows, parameters) internal. rates : (rows, parts) ln of the wanted rates, -inf: off.
    """
    solved = np.array(theta)
    solved[:, [group.coefficient for group in groups]] = 0.0
    ln_unit_rates = [part.ln_mean_rate(solved, points) for part in groups]
    for part, ln_rate, ln_unit_rate in zip(groups, ln_rates.T, ln_unit_rates, strict=True):
        solved[:, part.coefficient] = np.minimum((ln_rate - ln_unit_rate) / part.exponent, LARGEST_LN_COEFFICIENT)
    return solved


def coefficient_exponents(law: CreepLaw) -> list[dict[int, float]]:
    """For each term {position of a parameter that can switch it off: the power at which it multiplies the term}."""
    form = log_form(law)
    parameters = list(law.params.values())
    exponents = []
    for term, positions in zip(form.terms, form.coefficients, strict=True):
        derivatives = {k: term.diff(form.theta[k]) for k in positions if parameters[k].off == 0.0}
        exponents.append({k: float(derivative) for k, derivative in derivatives.items() if derivative.is_number and derivative > 0})
    return exponents


def _connected_terms(exponents: Sequence[dict[int, float]]) -> list[list[int]]:
    """Terms that share a coefficient, directly or through others, together."""
    groups: list[list[int]] = []
    for k, term_exponents in enumerate(exponents):
        connected = [g for g in groups if any(set(term_exponents) & set(exponents[j]) for j in g)]
        groups = [g for g in groups if g not in connected] + [sorted([k, *(j for g in connected for j in g)])]
    return sorted(groups)
