"""One explanation of what the rates of tests leave of a law, with its size; a test beside all others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from creepkit.records.presentable import Presentable

Kind = Literal["stress exponent", "activation energy", "life exponent", "one test", "two groups"]


MENTIONED_ODDS, VERDICT_ODDS = float(np.log(6.0)), float(np.log(50.0))
"""ln of the odds against the law as it is, from which on an explanation is mentioned, and from which on it alone
contradicts a law that the readings do not: 6 are reached by 0.5 to 1.5 % of right laws whose rates scatter by 5 to
15 %, 50 by 0 to 0.5 % (400 draws each)."""


@dataclass(frozen=True)
class Explanation(Presentable):
    """One explanation of what the rates of tests leave of a law.

    kind : what changes. tests : names of the tests that it concerns; of two groups those of the smaller.
    size, sd : of ln of the factor on their rates, or what the stress exponent, or the activation energy in J/mol,
        changes by over the tests, or by how much the exponent of their lives is larger than the law's, and its standard
        deviation. odds : ln of the odds against the law as it is; 0 of a test that stands out and is no explanation.
    ends : the exponent at the lowest and the highest stress, or the energy in J/mol at the lowest and the highest
        temperature; at : these stresses, MPa, or temperatures, K. Where both are one, ends are the exponent by the
        shape of curves and by the rates of tests.
    errors : of one test, errors of what is stated of it, any one of which would make it: {"load", "strain", "time":
        true value over that stated, "temperature": true less stated, K}.
    factors : on the rates of the single tests. near : others that explain nearly as much as the last of them.
    condition, temperature : of the one test, in words and in K. label, beside : of groups that the tests state, what
        the tests of the one are, such as "heat B", and those of the other, such as "heat A", "" where of several.
    without : {parameter: (value, low, high)}, 95 % intervals in the law's units of the tests without the one.
    """

    kind: Kind
    tests: tuple[str, ...]
    size: float
    sd: float
    odds: float
    ends: tuple[float, float] = (0.0, 0.0)
    at: tuple[float, float] = (0.0, 0.0)
    errors: Mapping[str, float] = field(default_factory=dict)
    factors: tuple[float, ...] = ()
    near: tuple[str, ...] = ()
    condition: str = ""
    temperature: float = 0.0
    label: str = ""
    beside: str = ""
    without: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)

    @property
    def is_of_law(self) -> bool:
        """Whether it is the law that misses what the tests show."""
        return self.kind in ("stress exponent", "activation energy", "life exponent")

    @property
    def is_of_curves(self) -> bool:
        """Whether it is what the shape of curves and the rates of tests say apart of the exponent at one stress."""
        return self.at[0] == self.at[1] > 0.0

    shown_by = "verdicts.cause_sentence"


@dataclass(frozen=True)
class LeftOut:
    """One test beside all others: what they say of it, and what they would say without it.

    log_factor, sd : ln of its rate over what the others say, and its standard deviation, from both.
    exponent : the stress exponent amid the tests, without it.
    """

    test: str
    log_factor: float
    sd: float
    exponent: float
