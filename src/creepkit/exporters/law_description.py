"""What exported texts state about their law: heading, table of parameters, remarks on units and failure."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import sympy

from creepkit.errors import ExportError
from creepkit.exporters.unit_conversion import ConvertedValues, coefficient_unit, reference_sentence
from creepkit.kernels.log_form import FLOOR, TIME_FLOOR
from creepkit.language.law import CreepLaw
from creepkit.language.printing import rate_lines
from creepkit.language.symbols import GAS_CONSTANT, temperature
from creepkit.records import LawWithValues, Units


def heading(source: LawWithValues, *, units: str = "", mentions_floors: bool = False) -> Iterator[str]:
    """Title, equation, parameters with values and units, where the law holds, its notes and references.

    units : the sentence on units; by default that of `source.units`, for texts that convert on entry.
    mentions_floors : whether to say what bases of powers act as below their floors.
    """
    law = source.law
    yield f"{law.name}: {law.title}" if law.title else law.name
    yield ""
    yield from rate_lines(law)
    yield ""
    yield units or units_sentence(source)
    yield "Parameters, for stress as a ratio to 1 MPa and time to 1 s:"
    yield from parameter_lines(law, source.values)
    if mentions_floors:
        yield (
            f"Stress, strain and internal variables that are bases of powers act as {FLOOR:g} below it, "
            f"time as {TIME_FLOOR:g}."
        )
    yield from (f"Valid where {sympy.sstr(relation)}." for relation in law.constraints)
    yield from (f"Note: {note}" for note in source.notes)
    yield from (f"Source: {reference}" for reference in law.references)


def refuse_conditions(law: CreepLaw, target: str) -> None:
    """ExportError, with what to do, where a law still has conditions of the material and a target no place for them."""
    if names := [one.name for one in law.conditions]:
        raise ExportError(
            f"{target} has no place for conditions of law '{law.name}'; give {', '.join(names)} a value as "
            f"well, in the law's unit: in a command --set {names[0]}=0.05"
        )


def refuse_back_stress(law: CreepLaw) -> None:
    """ExportError, with what to do, where a law has a back stress: finite element codes have a scalar for a state."""
    if law.back_stresses:
        raise ExportError(
            f"law '{law.name}' has a back stress, which has a direction, and this target takes scalars; export it as "
            "'latex', 'markdown', 'mathml' or 'python', or a law without one"
        )


def units_sentence(source: LawWithValues) -> str:
    """The units of a text that converts stress and time on entry, and rates on exit."""
    sentence = f"Stress in {source.units.stress}, time in {source.units.time}, rates in 1/{source.units.time}"
    if source.law.uses(temperature):
        sentence += f", temperature in K (R = {GAS_CONSTANT} J/(mol K))"
    conversion = "" if source.units.is_native else "Converted on entry: "
    return f"{sentence}. {conversion}{reference_sentence(Units())}."


def parameter_lines(law: CreepLaw, values: Mapping[str, float]) -> Iterator[str]:
    """One line a parameter: name, value, unit, meaning."""
    for name, param in law.table.items():
        unit = "" if param.unit == "1" else f" {param.unit}"
        absolute = coefficient_unit(law, name)
        absolute = f" ({absolute} for stress in MPa and time in s)" if absolute else ""
        yield f"  {name} = {values[name]!r}{unit}, {param.meaning}{absolute}"
    yield from (f"  {one.name} in {one.unit}, a condition of the material" for one in law.conditions)


def comment_lines(lines: Iterable[str], marker: str, width: int = 100) -> list[str]:
    """Each line after a marker; whatever could end a comment, or carry it on to the next line, is taken out.

    width : of a line, 0 for any; longer ones are broken between words.
    """
    pieces = [printable_text(piece_text) for line in lines for piece_text in (line.splitlines() or [""])]
    return [
        f"{marker} {wrapped}".rstrip("\\ ") for part in pieces for wrapped in _wrapped(part, width - len(marker) - 1)
    ]


def printable_text(text: str) -> str:
    """Text with every character that is no letter, digit, sign or blank made a blank."""
    return "".join(c if c.isprintable() else " " for c in text)


def comment_safe(text: str) -> str:
    """Text in which no comment of C ends or starts, nor a trigraph."""
    return re.sub(r"\?(?=\?)", "? ", text.replace("*/", "* /").replace("/*", "/ *"))


def _wrapped(text: str, width: int) -> list[str]:
    if width <= 0 or len(text) <= width:
        return [text]
    indent = " " * (len(text) - len(text.lstrip()) + 4)
    return textwrap.wrap(text, width, subsequent_indent=indent, drop_whitespace=True) or [text]


@dataclass(frozen=True)
class ParameterRow:
    """One line of the table: a parameter, or the start of an internal variable."""

    symbol: sympy.Symbol
    meaning: str
    value: float
    unit: str
    is_initial: bool = False


def parameter_rows(source: LawWithValues, converted_values: ConvertedValues) -> Iterator[ParameterRow]:
    """Parameters in the author's order, then internal variables at time zero; "" is the unit of pure numbers."""
    for symbol, param in source.law.params.items():
        unit = converted_values.units[symbol.name]
        yield ParameterRow(symbol, param.meaning, converted_values.values[symbol.name], "" if unit == "1" else unit)
    for symbol, state in source.law.states.items():
        yield ParameterRow(
            symbol, state.meaning, state.initial, "" if state.unit == "1" else state.unit, is_initial=True
        )


def remarks(source: LawWithValues, converted_values: ConvertedValues) -> Iterator[str]:
    """Sentences on units, temperature and failure."""
    yield f"Here {converted_values.reference_sentence}."
    if source.law.uses(temperature):
        yield f"Temperature in K, R = {GAS_CONSTANT} J/(mol K)."
    yield from (f"{one.name} in {one.unit}." for one in source.law.conditions)
    for symbol, state in source.law.states.items():
        if state.limit is not None:
            yield f"The material has failed when {symbol} reaches {state.limit:g}."


def note_lines(source: LawWithValues) -> list[str]:
    """The notes, a line each."""
    lines = (printable_text(line).strip() for note in source.notes for line in note.splitlines())
    return [line for line in lines if line]
