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
from creepkit.dataset.looks import Looks, mean_ln_rate
from creepkit.errors import DatasetError
from creepkit.kernels.logform import log_form
from creepkit.language import CreepLaw

LARGEST = 690.0
"""ln of a coefficient that is still finite in double precision: what a term that is nowhere above zero gets."""


@dataclass(frozen=True)
class Part:
    """Terms of a law with one coefficient.

    law : these terms alone. positions : of its parameters in the whole law. coefficient : position of the coefficient
        there. slope : power of the coefficient, 1 as a rule.
    """

    law: CreepLaw
    positions: tuple[int, ...]
    coefficient: int
    slope: float

    def ln_rate(self, theta: Floats, looks: Looks, factor: float = 1.0) -> Floats:
        """ln of the part's mean rate over a test, 1/s, (rows, ...).

        theta : (rows, ..., parameters) internal ones of the whole law. factor : on the stresses.
        """
        return mean_ln_rate(self.law, theta[..., list(self.positions)], looks, factor)


@lru_cache(maxsize=64)
def parts_of(law: CreepLaw) -> tuple[Part, ...]:
    """The parts of a law; DatasetError where a term has no coefficient to set its rate with."""
    slopes = slopes_of(law)
    found = []
    for group in _groups(slopes):
        common = set.intersection(*(set(slopes[k]) for k in group))
        others = {p for k, own in enumerate(slopes) if k not in group for p in own}
        mine = sorted(p for p in common - others if len({slopes[k][p] for k in group}) == 1)
        if not mine:
            told = "', '".join(list(law.terms)[k] for k in group)
            raise DatasetError(
                f"law '{law.name}': term '{told}' has no linear rate coefficient (of log scale, with off=0) to set "
                "its rate with; use the paper's box"
            )
        only = law.only(*(list(law.terms)[k] for k in group))
        positions = tuple(law.names.index(name) for name in only.names)
        found.append(Part(only, positions, mine[0], slopes[group[0]][mine[0]]))
    return tuple(found)


def solve(parts: Sequence[Part], theta: Floats, rates: Floats, looks: Looks) -> Floats:
    """Return theta with coefficients that give each part its mean rate over the test.

    theta : (rows, parameters) internal. rates : (rows, parts) ln of the wanted rates, -inf: off.
    """
    solved = np.array(theta)
    solved[:, [part.coefficient for part in parts]] = 0.0
    at_one = [part.ln_rate(solved, looks) for part in parts]
    for part, wanted, found in zip(parts, rates.T, at_one, strict=True):
        solved[:, part.coefficient] = np.minimum((wanted - found) / part.slope, LARGEST)
    return solved


def slopes_of(law: CreepLaw) -> list[dict[int, float]]:
    """For each term {position of a parameter that can switch it off: the power at which it multiplies the term}."""
    form = log_form(law)
    table = list(law.params.values())
    found = []
    for term, positions in zip(form.terms, form.coefficients, strict=True):
        slopes = {k: term.diff(form.theta[k]) for k in positions if table[k].off == 0.0}
        found.append({k: float(slope) for k, slope in slopes.items() if slope.is_number and slope > 0})
    return found


def _groups(slopes: Sequence[dict[int, float]]) -> list[list[int]]:
    """Terms that share a coefficient, directly or through others, together."""
    groups: list[list[int]] = []
    for k, own in enumerate(slopes):
        touching = [g for g in groups if any(set(own) & set(slopes[j]) for j in g)]
        groups = [g for g in groups if g not in touching] + [sorted([k, *(j for g in touching for j in g)])]
    return sorted(groups)
