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
class SingleValueTransform:
    """g(y) = sign ln y of what a test has one of: a creep rate in 1/s, or with sign -1 a rupture time in s.

    So both are larger where a test is faster, as strains are.
    """

    sign: float
    ceiling: float = 0.0
    floor: float = 0.0

    def forward(self, y: Floats) -> Floats:
        """The compared quantity (...,) of values y (...,)."""
        return self.sign * np.log(np.maximum(y, SMALLEST_VALUE))

    def inverse(self, g: Floats) -> Floats:
        """The values (...,) whose compared quantity is g (...,)."""
        return np.exp(self.sign * g)

    def derivative(self, y: Floats) -> Floats:
        """dg/dy (...,) at values y (...,)."""
        return self.sign / np.maximum(y, SMALLEST_VALUE)


SMALLEST_VALUE = 1e-200
"""1/s; a candidate that does not creep at all is compared as if it did at this rate."""


OutputTransform = LogTransform | LinearTransform | SingleValueTransform
