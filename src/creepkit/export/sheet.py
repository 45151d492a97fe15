"""What a sheet about a law tells its reader, whatever the markup: values in the units asked for, and small print."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy

from creepkit.export.conversion import Converted
from creepkit.export.heading import printable
from creepkit.language.symbols import GAS_CONSTANT, temperature
from creepkit.records import ValuedLaw


@dataclass(frozen=True)
class Row:
    """One line of the table: a parameter, or the start of an internal variable."""

    symbol: sympy.Symbol
    meaning: str
    value: float
    unit: str
    start: bool = False


def rows(source: ValuedLaw, numbers: Converted) -> Iterator[Row]:
    """Parameters in the author's order, then internal variables at time zero; no unit is told as an empty text."""
    for symbol, param in source.law.params.items():
        unit = numbers.units[symbol.name]
        yield Row(symbol, param.meaning, numbers.values[symbol.name], "" if unit == "1" else unit)
    for symbol, state in source.law.states.items():
        yield Row(symbol, state.meaning, state.initial, "" if state.unit == "1" else state.unit, start=True)


def small_print(source: ValuedLaw, numbers: Converted) -> Iterator[str]:
    """Sentences on units, temperature and failure."""
    yield f"Here {numbers.reference}."
    if source.law.uses(temperature):
        yield f"Temperature in K, R = {GAS_CONSTANT} J/(mol K)."
    for symbol, state in source.law.states.items():
        if state.limit is not None:
            yield f"The material has failed when {symbol} reaches {state.limit:g}."


def notes(source: ValuedLaw) -> list[str]:
    """The notes, a line each."""
    lines = (printable(line).strip() for note in source.notes for line in note.splitlines())
    return [line for line in lines if line]
