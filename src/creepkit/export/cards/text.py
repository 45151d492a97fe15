"""What the cards of every code share: the comments at the top, numbers within a double's range, moduli."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import sympy

from creepkit.errors import ExportError
from creepkit.export.conversion import reference_of
from creepkit.export.heading import comments, heading
from creepkit.language.elastic import Elastic
from creepkit.records import ValuedLaw

_WIDTH = 110


def top(source: ValuedLaw, mark: str, lines: Iterable[str]) -> list[str]:
    """Comments: the law, its values and notes, the units of the numbers below, then `lines` on the target's form."""
    units = source.units
    told = f"Numbers below are in {units.stress} and {units.time}, temperatures in K: {reference_of(units)}."
    return comments([*heading(source.reduced(), units=told), "", *lines], mark, _WIDTH)


def number(logarithm: float, what: str, source: ValuedLaw) -> float:
    """exp(logarithm); ExportError where that is no double."""
    if not -700.0 < logarithm < 700.0:
        raise ExportError(
            f"law '{source.law.name}': {what} would be 1e{logarithm / math.log(10):.0f}, beyond the range of a double; "
            "give the temperature of the analysis, export(..., temperature=1073)"
        )
    return math.exp(logarithm)


def figure(value: float) -> str:
    """A number of 13 digits: more than the logarithm of a coefficient keeps, and short enough for every code."""
    return f"{value:.13g}"


def warmth(source: ValuedLaw, low: float, high: float) -> tuple[float, float]:
    """Ends of tables against temperature, K: what the tests covered and 25 K to each side, else `low` and `high`."""
    covered = source.ranges.get("temperature")
    return (low, high) if covered is None else (covered[0] - 25.0, covered[1] + 25.0)


def grid(low: float, high: float, step: float) -> list[float]:
    """From low in steps to high, and high itself."""
    return [*(low + step * k for k in range(math.ceil((high - low) / step - 1e-9))), high]


@dataclass(frozen=True)
class Moduli:
    """Young's modulus in the text's unit of stress, and Poisson's ratio; T in K, None where it does not matter."""

    T: float | None
    E: float
    nu: float


def moduli(source: ValuedLaw, temperatures: Sequence[float] = ()) -> list[Moduli]:
    """The moduli at each temperature, or once where they do not depend on it; none where they are not given.

    temperatures : of a table; ExportError where one is needed and there are none.
    """
    elastic = source.elastic
    if elastic is None:
        return []
    if not any(isinstance(value, sympy.Expr) and value.free_symbols for value in (elastic.E, elastic.nu)):
        return [_moduli(source, elastic, None)]
    if not temperatures:
        raise ExportError(
            f"law '{source.law.name}': the elastic moduli depend on temperature, and this text takes numbers; "
            "give elastic.at(1073)"
        )
    return [_moduli(source, elastic.at(T), T) for T in temperatures]


def _moduli(source: ValuedLaw, elastic: Elastic, T: float | None) -> Moduli:
    return Moduli(T, float(elastic.E) / source.units.megapascals, float(elastic.nu))
