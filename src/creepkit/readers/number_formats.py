"""What the number format of a cell of a spreadsheet says of the number: whether it is shown in per cent."""

from __future__ import annotations

import re
from decimal import Decimal

_LITERAL = re.compile(r'"([^"]*)"?|\\(.)|_.|\*.|\[[^\]]*\]?', re.DOTALL)
"""Parts of a format that are shown as they stand, the first two, and those of width, filling, colour and condition."""


_CONDITION = re.compile(r"\[(<=|>=|<>|<|>|=)\s*(-?\d+(?:[.,]\d+)?(?:E[+-]?\d+)?)\]", re.IGNORECASE)


def number_text(value: float, number_format: str) -> str:
    """A number as text, with the sign % where it is shown in per cent, as the number that is shown.

    Only a sign that is neither quoted nor escaped multiplies by 100: `0.00%` shows 0.005 as 0.50%, and `0.00" %"` shows
    0.5 as 0.50 %. Both are 0.5 %.
    """
    text = repr(value)
    if "%" not in number_format:
        return text
    section = _section(number_format, value)
    if "%" in _LITERAL.sub("", section):
        return f"{Decimal(text).scaleb(2).normalize():f}%"
    shown = "".join((match[1] or match[2] or "") for match in _LITERAL.finditer(section))
    return f"{text}%" if shown.strip() == "%" else text


def _section(number_format: str, value: float) -> str:
    """The section of a format that applies to a number: positive; negative; zero, unless they have conditions."""
    sections = _sections(number_format)[:3]
    conditions = [_CONDITION.search(_without_quoted(section)) for section in sections]
    if not any(conditions):
        if len(sections) == 1 or value > 0 or (value == 0 and len(sections) < 3):
            return sections[0]
        return sections[1] if value < 0 else sections[2]
    for section, condition in zip(sections, conditions, strict=True):
        if condition is None or _holds(value, condition[1], float(condition[2].replace(",", "."))):
            return section
    return sections[-1]


def _sections(number_format: str) -> list[str]:
    """The parts between semicolons that are neither quoted nor escaped."""
    sections, start = list[str](), 0
    for match in re.finditer(r'"[^"]*"?|\\.|;', number_format, re.DOTALL):
        if match[0] == ";":
            sections.append(number_format[start : match.start()])
            start = match.end()
    return [*sections, number_format[start:]]


def _without_quoted(section: str) -> str:
    return re.sub(r'"[^"]*"?|\\.', "", section, flags=re.DOTALL)


def _holds(value: float, sign: str, bound: float) -> bool:
    return {
        "<": value < bound,
        "<=": value <= bound,
        ">": value > bound,
        ">=": value >= bound,
        "=": value == bound,
        "<>": value != bound,
    }[sign]
