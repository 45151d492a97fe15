"""Bounds of numbers that a person gives: options of the command line and arguments that set an amount of work.

Those that several places share stand here once, so that `--starts` and IdentificationSettings(starts=...) allow the
same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from creepkit.errors import CreepkitError, quoted


@dataclass(frozen=True)
class Limits:
    """The finite numbers from `low` to `high`; above : without `low` itself; whole : whole numbers alone."""

    low: float
    high: float
    whole: bool = True
    above: bool = False

    def __contains__(self, value: object) -> bool:
        if isinstance(value, bool) or not hasattr(value, "__float__"):
            return False
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            return False
        inside = math.isfinite(number) and self.low <= number <= self.high
        return inside and not (self.whole and number != int(number)) and not (self.above and number == self.low)

    def __str__(self) -> str:
        if self.above:
            return f"numbers above {self.low:.12g} up to {self.high:.12g}"
        return f"{'whole ' if self.whole else ''}numbers from {self.low:.12g} to {self.high:.12g}"


def numbers(low: float, high: float, *, above: bool = False) -> Limits:
    """Finite numbers from `low` to `high`, whole or not."""
    return Limits(low, high, whole=False, above=above)


def check_number(name: str, value: Any, limits: Limits, error: type[CreepkitError]) -> None:
    """Raise `error` for a number that is not within its limits."""
    if value not in limits:
        try:
            text = repr(value)
        except ValueError:  # Python writes no integers of more than some thousand digits
            text = "an integer of thousands of digits"
        raise error(f"{name} is {quoted(text, 40)}; allowed are {limits}")


def check_numbers(name: str, values: Any, limits: Limits, error: type[CreepkitError]) -> None:
    """The same for a number or an array of numbers (...,)."""
    import numpy as np

    array = np.asarray(values, dtype=float)
    lowest = array > limits.low if limits.above else array >= limits.low
    within = np.isfinite(array) & lowest & (array <= limits.high)
    if not within.all():
        check_number(name, float(array[~within].flat[0]), limits, error)


STARTS = Limits(1, 10_000)
SOBOL_POINTS = Limits(1, 2**20)
SEED = Limits(0, 2**63 - 1)
SIMULATED_FRAMES = Limits(2, 1_000_000)
"""Of one test, as its history and its file are to fit into memory."""


SAMPLES = Limits(1, 100_000_000)
"""Of a data set."""


BAND_DRAWS = Limits(50, 100_000)
"""Of a forecast."""


DRAWS_OF_POSTERIOR = Limits(10, 2_000)
WORKERS = Limits(1, 1024)
EPOCHS, BATCH = Limits(1, 1_000_000), Limits(1, 1_000_000)
HIDDEN, LAYERS = Limits(1, 4096), Limits(1, 32)
LEARNING_RATE, LARGEST_GRADIENT = numbers(0, 1, above=True), numbers(0, 1e12, above=True)
SEARCH_STEPS = Limits(1, 1_000_000)


HOURS = numbers(1e-9, 1e9)
"""Of a test, or of an oven; from a few microseconds on."""


SECONDS = numbers(0, 1e12, above=True)
RAMP = numbers(0, 1e12)
PROBABILITY = numbers(0.5, 0.999999)
SIGNIFICANCE = 0.003
"""p-value below which a hypothesis is rejected: three standard deviations of a normal one."""


HOTTEST = 4500.0
"""K, above which nothing is solid: hafnium carbonitride, which melts last, does so at about 4300 K."""


KELVIN = numbers(0, HOTTEST, above=True)
"""Of a state of a material."""


MEGAPASCAL_OF_STATE = numbers(0, 1e5, above=True)
CELSIUS = numbers(-273.15, HOTTEST - 273.15, above=True)
GIGAPASCAL = numbers(0, 1e6, above=True)
MEGAPASCAL = numbers(0, 1e6)
MILLIMETRE = numbers(0, 1e6)
STRAIN = numbers(0, 100, above=True)
POISSON = numbers(-1, 0.5, above=True)
ENERGY = numbers(0, 1e9)
"""J/mol."""
