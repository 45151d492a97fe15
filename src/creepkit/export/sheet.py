"""What a sheet about a law tells its reader, whatever the markup: values in the units asked for, and small print."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy

from creepkit.export.conversion import ConvertedValues
from creepkit.export.heading import printable_text
from creepkit.language.symbols import GAS_CONSTANT, temperature
from creepkit.records import LawWithValues


@dataclass(frozen=True)
class ParameterRow:
    """One line of the table: a parameter, or the start of an internal variable."""

    symbol: sympy.Symbol
    meaning: str
    value: float
    unit: str
    is_initial: bool = False


def parameter_rows(source: LawWithValues, converted_values: ConvertedValues) -> Iterator[ParameterRow]:
    """Parameters in the author's order, then internal variables at time zero; no unit is told as an empty text."""
    for symbol, param in source.law.params.items():
        unit = converted_values.units[symbol.name]
        yield ParameterRow(symbol, param.meaning, converted_values.values[symbol.name], "" if unit == "1" else unit)
    for symbol, state in source.law.states.items():
        yield ParameterRow(symbol, state.meaning, state.initial, "" if state.unit == "1" else state.unit, is_initial=True)


def remarks(source: LawWithValues, converted_values: ConvertedValues) -> Iterator[str]:
    """Sentences on units, temperature and failure."""
    yield f"Here {converted_values.reference_sentence}."
    if source.law.uses(temperature):
        yield f"Temperature in K, R = {GAS_CONSTANT} J/(mol K)."
    for symbol, state in source.law.states.items():
        if state.limit is not None:
            yield f"The material has failed when {symbol} reaches {state.limit:g}."


def note_lines(source: LawWithValues) -> list[str]:
    """The notes, a line each."""
    lines = (printable_text(line).strip() for note in source.notes for line in note.splitlines())
    return [line for line in lines if line]
