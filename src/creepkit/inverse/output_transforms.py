"""Output transforms: the quantities in which outputs are compared, logarithmic for strains and linear for others.

A transform is a monotone map g from an output to the quantity in which it is compared; arrays keep their shape, (...,).
floor : the size, in the output's unit, below which a difference is nothing. ceiling : the compared quantity from which
a prediction is continued after rupture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats


@dataclass(frozen=True)
class LogTransform:
    """g(y) = asinh(y / 2 floor): ln(y / floor) well above the floor, linear below it, finite for y <= 0."""

    floor: float

    @property
    def ceiling(self) -> float:
        """The transformed strain of one."""
        return float(np.arcsinh(1.0 / (2.0 * self.floor)))

    def forward(self, y: Floats) -> Floats:
        """The compared quantity (...,) of outputs y (...,)."""
        return np.arcsinh(y / (2.0 * self.floor))

    def inverse(self, g: Floats) -> Floats:
        """The outputs (...,) whose compared quantity is g (...,)."""
        return 2.0 * self.floor * np.sinh(g)

    def derivative(self, y: Floats) -> Floats:
        """dg/dy (...,) at outputs y (...,); 1/y well above the floor."""
        return 1.0 / np.hypot(y, 2.0 * self.floor)


@dataclass(frozen=True)
class LinearTransform:
    """g(y) = y / scale, the scale being the standard deviation of what was measured.

    scale, largest : in the output's unit; the largest measured value.
    """

    scale: float
    largest: float

    @property
    def floor(self) -> float:
        """One per cent of the scale."""
        return 0.01 * self.scale

    @property
    def ceiling(self) -> float:
        """The transformed largest measured value."""
        return self.largest / self.scale

    def forward(self, y: Floats) -> Floats:
        """The compared quantity (...,) of outputs y (...,)."""
        return y / self.scale

    def inverse(self, g: Floats) -> Floats:
        """The outputs (...,) whose compared quantity is g (...,)."""
        return g * self.scale

    def derivative(self, y: Floats) -> Floats:
        """dg/dy (...,) at outputs y (...,)."""
        return np.full(np.shape(y), 1.0 / self.scale)


@dataclass(frozen=True)
class NegativeLogTransform:
    """g(t) = -ln t of a rupture time t in s: larger where a test breaks earlier, as strains are where it is faster."""

    floor: float = 0.0
    ceiling: float = 0.0

    def forward(self, y: Floats) -> Floats:
        """The compared quantity (...,) of outputs y (...,)."""
        return -np.log(y)

    def inverse(self, g: Floats) -> Floats:
        """The rupture times (...,) s whose compared quantity is g (...,)."""
        return np.exp(-g)

    def derivative(self, y: Floats) -> Floats:
        """dg/dy (...,) at outputs y (...,)."""
        return -1.0 / y


@dataclass(frozen=True)
class RateTransform:
    """g(r) = ln r of a creep rate r in 1/s. largest : of the measured rates, 1/s."""

    largest: float
    floor: float = 0.0

    @property
    def ceiling(self) -> float:
        """The transformed rate of a test that breaks at once: e times the largest that was measured."""
        return float(np.log(self.largest)) + 1.0

    def forward(self, y: Floats) -> Floats:
        """The compared quantity (...,) of rates y (...,)."""
        return np.log(np.maximum(y, SMALLEST_RATE))

    def inverse(self, g: Floats) -> Floats:
        """The rates (...,) 1/s whose compared quantity is g (...,)."""
        return np.exp(g)

    def derivative(self, y: Floats) -> Floats:
        """dg/dy (...,) at rates y (...,)."""
        return 1.0 / np.maximum(y, SMALLEST_RATE)


SMALLEST_RATE = 1e-200
"""1/s; a candidate that does not creep at all is compared as if it did at this rate."""


OutputTransform = LogTransform | LinearTransform | NegativeLogTransform | RateTransform
