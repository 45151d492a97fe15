"""What the cards of every code share: the comments at the top, numbers within a double's range, moduli."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import sympy

from creepkit.errors import ExportError
from creepkit.export.conversion import reference_sentence
from creepkit.export.heading import comment_lines, heading
from creepkit.language.elastic import Elastic
from creepkit.records import LawWithValues

_LINE_LENGTH = 110


def card_heading(source: LawWithValues, marker: str, lines: Iterable[str]) -> list[str]:
    """Comments: the law, its values and notes, the units of the numbers below, then `lines` on the target's form."""
    units = source.units
    units_sentence = f"Numbers below are in {units.stress} and {units.time}, temperatures in K: {reference_sentence(units)}."
    return comment_lines([*heading(source.without_inactive_terms(), units=units_sentence), "", *lines], marker, _LINE_LENGTH)


def exp_in_range(logarithm: float, quantity: str, source: LawWithValues) -> float:
    """exp(logarithm); ExportError where that is no double."""
    if not -700.0 < logarithm < 700.0:
        raise ExportError(
            f"law '{source.law.name}': {quantity} would be 1e{logarithm / math.log(10):.0f}, beyond the range of a double; "
            "give the temperature of the analysis, export(..., temperature=1073)"
        )
    return math.exp(logarithm)


def format_number(value: float) -> str:
    """A number of 13 digits: more than the logarithm of a coefficient keeps, and short enough for every code."""
    return f"{value:.13g}"


def temperature_span(source: LawWithValues, low: float, high: float) -> tuple[float, float]:
    """Ends of tables against temperature, K: what the tests covered and 25 K to each side, else `low` and `high`."""
    tested_range = source.ranges.get("temperature")
    return (low, high) if tested_range is None else (tested_range[0] - 25.0, tested_range[1] + 25.0)


def temperature_grid(low: float, high: float, step: float) -> list[float]:
    """From low in steps to high, and high itself."""
    return [*(low + step * k for k in range(math.ceil((high - low) / step - 1e-9))), high]


@dataclass(frozen=True)
class ElasticConstants:
    """Young's modulus in the text's unit of stress, and Poisson's ratio; T in K, None where it does not matter."""

    T: float | None
    E: float
    nu: float


def elastic_constants(source: LawWithValues, temperatures: Sequence[float] = ()) -> list[ElasticConstants]:
    """The moduli at each temperature, or once where they do not depend on it; none where they are not given.

    temperatures : of a table; ExportError where one is needed and there are none.
    """
    elastic = source.elastic
    if elastic is None:
        return []
    if not any(isinstance(value, sympy.Expr) and value.free_symbols for value in (elastic.E, elastic.nu)):
        return [_elastic_constants_at(source, elastic, None)]
    if not temperatures:
        raise ExportError(
            f"law '{source.law.name}': the elastic moduli depend on temperature, and this text takes numbers; "
            "give elastic.at(1073)"
        )
    return [_elastic_constants_at(source, elastic.at(T), T) for T in temperatures]


def _elastic_constants_at(source: LawWithValues, elastic: Elastic, T: float | None) -> ElasticConstants:
    return ElasticConstants(T, float(elastic.E) / source.units.megapascals, float(elastic.nu))
