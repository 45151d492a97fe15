"""Numbers that an argument, an option or a field of a file may be, and the words that say so.

Those that several places share stand here once, so that `--starts` and IdentificationSettings(starts=...) allow the
same.
"""

from __future__ import annotations

import math
import numbers as kinds_of_numbers
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from creepkit.errors import CreepkitError, quoted_value


@dataclass(frozen=True)
class Limits:
    """The finite numbers from `low` to `high`.

    above : without `low` itself. whole : whole numbers alone. nan, infinite : whether NaN, and an infinity within the
    bounds, are allowed too. As an annotation, Annotated[float, Limits(...)], they are those of an argument.
    """

    low: float
    high: float
    whole: bool = True
    above: bool = False
    nan: bool = False
    infinite: bool = False

    def __contains__(self, value: object) -> bool:
        try:
            number = value if type(value) is float else _as_float(value)
        except OverflowError:
            return False
        if number is None or not math.isfinite(number):
            return number is not None and (self.nan if math.isnan(number) else self.infinite and self._holds(number))
        return self._holds(number) and not (self.whole and number != int(number))

    def _holds(self, number: float) -> bool:
        return self.low <= number <= self.high and not (self.above and number == self.low)

    def __str__(self) -> str:
        kind = "whole number" if self.whole else "number"
        low = "" if self.low == -math.inf else f" {'above' if self.above else 'from'} {self.low:.12g}"
        high = "" if self.high == math.inf else f" {'to' if low and not self.above else 'up to'} {self.high:.12g}"
        finite = "" if (low and high) or self.whole or self.infinite or self.nan else "finite "
        return f"a {finite}{kind}{low}{high}" + " on" * (low != "" and high == "" and not self.above)


def _as_float(value: Any) -> float | None:
    """A number of Python's, sympy's or numpy's; None for anything else, OverflowError beyond every float."""
    of_numpy = getattr(value, "shape", None) == () and getattr(value.dtype, "kind", "") in "fiu"
    is_number = of_numpy or (isinstance(value, kinds_of_numbers.Real) and not isinstance(value, bool))
    return float(value) if is_number else None


def numbers(low: float = -math.inf, high: float = math.inf, *, above: bool = False, **further: bool) -> Limits:
    """Finite numbers from `low` to `high`, whole or not; further : nan, infinite."""
    return Limits(low, high, whole=False, above=above, **further)


FINITE, ANY_NUMBER = numbers(), numbers(nan=True, infinite=True)


def check_fields(record: Any, allowed: Mapping[str, Limits], of: str, error: type[CreepkitError]) -> None:
    """Raise `error`, which begins with `of`, for a field of a record that is not within its limits."""
    for name, limits in allowed.items():
        if (value := getattr(record, name)) not in limits:
            raise error(f"{of}{name} is {quoted_value(value)}; allowed is {limits}")


def check_numbers(name: str, values: Any, limits: Limits, error: type[CreepkitError]) -> None:
    """Raise `error` for a number, or one in an array (...,), that is not within its limits."""
    import numpy as np

    array = np.asarray(values, dtype=float)
    lowest = array > limits.low if limits.above else array >= limits.low
    within = np.isfinite(array) & lowest & (array <= limits.high)
    if not within.all():
        raise error(f"{name} is {float(array[~within].flat[0])!r}; allowed is {limits}")


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
