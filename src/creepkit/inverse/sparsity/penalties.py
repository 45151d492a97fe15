"""Penalties on contributions c of terms (see contributions): what each can do, and what it cannot.

Contributions are shares, so that they add up to about one whatever the law does. That decides what a penalty can do:
only a concave one is smallest where one term has it all. A penalty is added to half the chi-square, strength times its
value: a strength of s makes a change of its value by one cost as much as a chi-square that is 2 s worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol, TypeAlias

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError

Strength: TypeAlias = float | Literal["auto"]
"""A number, or chosen along the path from none to all (see path)."""

DEFAULT_STRENGTH = 24.0
"""Half the 48 frames of a bulge test of 12 h: what the penalty of square roots was tried with."""
MIN_CONTRIBUTION = 1e-9
"""A contribution below this counts as this in a weight."""


class ContributionPenalty(Protocol):
    """A function of contributions, (candidates, terms) to (candidates,), that is added to half the chi-square."""

    @property
    def strength(self) -> Strength:
        """By what its value is multiplied."""
        ...

    @property
    def exponents(self) -> float:
        """Weight of the exponents that can be off (see of_exponents), 0 where they cost nothing."""
        ...

    def value(self, c: Floats) -> Floats:
        """(candidates,) without the strength."""
        ...

    def weights(self, c: Floats) -> Floats:
        """w, (candidates, terms): the parabola w c^2 + const touches the value at c, and lies above a concave one."""
        ...


@dataclass(frozen=True)
class L2:
    """strength x sum c_i^2: the word of the paper, "L2 sparsity", read as the squared norm of contributions.

    It does not select. As the c_i add up to about one, their squares are smallest at *equal* shares: every term is
    kept, and a term that the data leave free is drawn towards the size of the others. It makes the values of a sum
    determinate, no more.
    """

    strength: Strength = DEFAULT_STRENGTH
    exponents: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        check_strength(self.strength)

    def value(self, c: Floats) -> Floats:
        """sum c_i^2."""
        return np.asarray((c**2).sum(axis=-1))

    def weights(self, c: Floats) -> Floats:
        """1: it is a sum of squares."""
        return np.ones_like(c)


@dataclass(frozen=True)
class GroupL2:
    """strength x sum c_i: each c_i is itself the L2 norm of a group, the rates of term i at the points visited.

    The group lasso of regression, where it selects. Here the c_i add up to about one, so that it is nearly the same
    for all laws: it prefers terms that act at different times and stresses no more than that they share, and hardly
    ever drops a term.
    """

    strength: Strength = DEFAULT_STRENGTH
    exponents: ClassVar[float] = 0.0

    def __post_init__(self) -> None:
        check_strength(self.strength)

    def value(self, c: Floats) -> Floats:
        """sum c_i."""
        return np.asarray(c.sum(axis=-1))

    def weights(self, c: Floats) -> Floats:
        """1 / (2 c_i)."""
        return np.asarray(0.5 / np.maximum(c, MIN_CONTRIBUTION))


@dataclass(frozen=True)
class Sqrt:
    """strength x [ sum (c_i + d)^(1/2) + exponents x sum (|m_j| + .02)^(1/2) ], d = .003.

    Concave, hence smallest where one term has it all: this one selects. m_j are the exponents of linear scale that can
    be off within their bounds, such as the strain exponent of strain hardening; they weigh a third, so that a simple
    term is preferred to one with memory. d makes the slope at zero finite: a term of no use still sees where the data
    want it. Being concave it has a minimum at each corner, and asks for many starts.
    """

    strength: Strength = DEFAULT_STRENGTH
    exponents: float = 1.0 / 3.0

    OFFSET: ClassVar[float] = 0.003

    def __post_init__(self) -> None:
        check_strength(self.strength)
        if not (np.isfinite(self.exponents) and self.exponents >= 0):
            raise FitError(f"the weight of exponents is {self.exponents}; it must be a number, 0 or above")

    def value(self, c: Floats) -> Floats:
        """sum (c_i + d)^(1/2)."""
        return np.asarray(np.sqrt(c + self.OFFSET).sum(axis=-1))

    def weights(self, c: Floats) -> Floats:
        """1 / (4 c_i (c_i + d)^(1/2))."""
        return np.asarray(0.25 / (np.maximum(c, MIN_CONTRIBUTION) * np.sqrt(c + self.OFFSET)))


@dataclass(frozen=True)
class Subsets:
    """{0} or its bounds for every coefficient, as Table 1 has it: each set of terms is fitted, the lowest BIC kept.

    No penalty on a sum but a choice among laws: exact up to EVERY terms, forward selection beyond. It shrinks nothing
    and has no strength to choose; each set costs a fit.
    """

    EXHAUSTIVE_LIMIT: ClassVar[int] = 4


def check_penalty(penalty: object) -> None:
    """A penalty is a record, such as L2(), and not its class or name."""
    if isinstance(penalty, (type, str)) or not (isinstance(penalty, Subsets) or hasattr(penalty, "weights")):
        text = penalty.__name__ if isinstance(penalty, type) else repr(penalty)
        raise FitError(f"penalty is {text}; write L2(), GroupL2(), Sqrt() or Subsets()")


def check_strength(strength: Strength) -> None:
    """A strength is a finite number of at least zero, or "auto"."""
    if isinstance(strength, str):
        if strength != "auto":
            raise FitError(f'strength is "{strength}"; allowed are numbers and "auto"')
    elif not (np.isfinite(strength) and strength >= 0):
        raise FitError(f"strength is {strength}; it must be a finite number, 0 or above")


EXPONENT_OFFSET = 0.02


def exponent_penalty(distances: Floats) -> Floats:
    """sum (|m_j| + .02)^(1/2) of distances of exponents from where they are off, (candidates, exponents)."""
    return np.asarray(np.sqrt(distances + EXPONENT_OFFSET).sum(axis=-1))


def exponent_weights(distances: Floats) -> Floats:
    """w, (candidates, exponents): the parabola w m^2 + const touches it at m."""
    return np.asarray(0.25 / (np.maximum(distances, 1e-6) * np.sqrt(distances + EXPONENT_OFFSET)))
