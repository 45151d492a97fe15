"""What every exported text says of its law at the top, as lines to be made comments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import sympy

from creepkit.export.conversion import reference_of
from creepkit.kernels.logform import FLOOR, TIME_FLOOR
from creepkit.language.law import CreepLaw
from creepkit.language.printing import text_of_expression
from creepkit.language.symbols import GAS_CONSTANT, temperature
from creepkit.records import ValuedLaw


def heading(source: ValuedLaw, *, units: str = "", floors: bool = False) -> Iterator[str]:
    """Title, equation, parameters with values and units, where the law holds, its notes and references.

    units : the sentence on units; by default that of `source.units`, for texts that convert on entry.
    floors : whether to say what bases of powers act as below their floors.
    """
    law = source.law
    yield f"{law.name}: {law.title}" if law.title else law.name
    yield ""
    yield from equations(law)
    yield ""
    yield units or units_of(source)
    yield "Parameters, for stress as a ratio to 1 MPa and time to 1 s:"
    yield from table(law, source.values)
    if floors:
        yield (
            f"Stress, strain and internal variables that are bases of powers act as {FLOOR:g} below it, "
            f"time as {TIME_FLOOR:g}."
        )
    yield from (f"Valid where {sympy.sstr(relation)}." for relation in law.constraints)
    yield from (f"Note: {note}" for note in source.notes)
    yield from (f"Source: {reference}" for reference in law.references)


def units_of(source: ValuedLaw) -> str:
    """The units of a text that converts stress and time on entry, and rates on exit."""
    text = f"Stress in {source.units.stress}, time in {source.units.time}, rates in 1/{source.units.time}"
    if source.law.uses(temperature):
        text += f", temperature in K (R = {GAS_CONSTANT} J/(mol K))"
    return f"{text}. {'' if source.units.native else 'Converted on entry: '}{reference_of(type(source.units)())}."


def equations(law: CreepLaw) -> Iterator[str]:
    """The rate, a term a line under its name, and the rates of internal variables."""
    leads = ["rate =", *["     +"] * (len(law.terms) - 1)]
    for lead, (label, term) in zip(leads, law.terms.items(), strict=True):
        yield f"{lead} {text_of_expression(term)}    [{label}]"
    for symbol, state in law.states.items():
        until = "" if state.limit is None else f" to failure at {state.limit:g}"
        yield f"d{symbol}/dt = {text_of_expression(state.rate)}, from {state.initial:g}{until}    [{state.meaning}]"


def table(law: CreepLaw, values: Mapping[str, float]) -> Iterator[str]:
    """One line a parameter: name, value, unit, meaning."""
    for name, param in law.table.items():
        unit = "" if param.unit == "1" else f" {param.unit}"
        yield f"  {name} = {values[name]!r}{unit}, {param.meaning}"


def comments(lines: Iterable[str], mark: str, width: int = 0) -> list[str]:
    """Each line after a comment mark; whatever could end a comment, or carry it on to the next line, is taken out.

    width : 0, or the longest line allowed; longer ones are broken between words.
    """
    parts = [printable(part) for line in lines for part in (line.splitlines() or [""])]
    return [f"{mark} {piece}".rstrip("\\ ") for part in parts for piece in _broken(part, width - len(mark) - 1)]


def printable(text: str) -> str:
    """Text with every character that is no letter, digit, sign or blank made a blank."""
    return "".join(c if c.isprintable() else " " for c in text)


def _broken(text: str, width: int) -> list[str]:
    if width <= 0 or len(text) <= width:
        return [text]
    import textwrap

    indent = " " * (len(text) - len(text.lstrip()) + 4)
    return textwrap.wrap(text, width, subsequent_indent=indent, drop_whitespace=True) or [text]
