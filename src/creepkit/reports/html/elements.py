"""What a section of the page is made of: paragraphs, lists, tables, figures, formulas, texts and files to download.

Strings are text, which the template escapes; Markup is what is HTML already.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from markupsafe import Markup

LONGEST_TEXT = 4000
"""Characters of a cell or paragraph; an error message may hold a name of any length."""


MOST_DIGITS = 7
"""Of a value, however narrow its interval is."""


@dataclass(frozen=True)
class Paragraph:
    """A paragraph. role : "", "lead" for what is to be read first, "note" for remarks, "warning"."""

    kind: ClassVar[str] = "paragraph"
    text: str
    role: str = ""


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    kind: ClassVar[str] = "items"
    items: Sequence[str]


@dataclass(frozen=True)
class Table:
    """A table with a caption; the first cell of each row is its head. numeric : columns that stand right."""

    kind: ClassVar[str] = "table"
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Sequence[int] = ()


@dataclass(frozen=True)
class Picture:
    """A figure: <svg> with its own title and description, and what the caption says below it.

    shows_values : whether its colours stand for values, so that they are the same on a dark page.
    """

    kind: ClassVar[str] = "picture"
    svg: Markup
    caption: str
    shows_values: bool = False


@dataclass(frozen=True)
class Formula:
    """An equation as MathML."""

    kind: ClassVar[str] = "formula"
    mathml: Markup


@dataclass(frozen=True)
class Verbatim:
    """Text with its line ends, to be copied: a program, commands, a paragraph for a paper."""

    kind: ClassVar[str] = "verbatim"
    caption: str
    text: str
    prose: bool = False


@dataclass(frozen=True)
class Downloads:
    """Files within the page. files : (name, address, what it is) with the content in the address."""

    kind: ClassVar[str] = "downloads"
    files: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Answer:
    """The first screen: headline, picture, and a card with the law, its key figures, cautions and files.

    figures : (name, where it holds, value with interval, remark). values : of the parameters, on a line.
    """

    kind: ClassVar[str] = "answer"
    headline: str
    picture: Picture | Paragraph | None
    law: str
    equations: Sequence[Markup]
    values: Markup
    figures: Sequence[tuple[str, str, str, str]]
    cautions: Sequence[str]
    next_step: str
    files: Sequence[tuple[str, str, str]] = ()


Block: TypeAlias = Answer | Paragraph | Items | Table | Picture | Formula | Verbatim | Downloads


@dataclass(frozen=True)
class PageSection:
    """A part of the page with its heading; identifier : letters, digits and hyphens, of its own in the page.

    result : what it says, on the line of its heading, behind which it is folded; "" for a section that stands open.
    """

    identifier: str
    title: str
    blocks: Sequence[Block] = ()
    sections: Sequence[PageSection] = field(default=())
    result: str = ""

    @property
    def empty(self) -> bool:
        """Whether there is nothing under the heading."""
        return not self.blocks and not self.sections


def printable(text: object, longest: int = LONGEST_TEXT) -> str:
    """A text on one line of bounded length, without characters that are invisible or turn the direction of writing."""
    shown = "".join(c if c.isprintable() else " " if c.isspace() else "\ufffd" for c in str(text))
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def printable_lines(text: str) -> str:
    """The same of a text of several lines, of any length."""
    return "\n".join(printable(line, len(line) + 1).rstrip() for line in text.expandtabs(4).splitlines())


def sentence(text: str) -> str:
    """A text with a capital and a full stop, powers of ten and signs as they are printed; names stay as they are."""
    text = _POWER.sub(lambda found: _with_power(found[1], found[2]), printable(text).strip()).replace(" +- ", " ± ")
    first = text[:1] if _NAME.match(text) else text[:1].upper()
    return f"{first}{text[1:]}{'' if text.endswith(('.', '!', '?', ':', '…')) else '.'}"


def plural(count: int, noun: str) -> str:
    """A number of things in words: '1 test', '3 tests'."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def number(value: float, digits: int = 4) -> str:
    """A number as people write it: 4.2e-05 as 4.2 × 10⁻⁵, NaN as a dash, a true minus."""
    if value != value:
        return "–"
    if value in (float("inf"), float("-inf")):
        return "∞" if value > 0 else "−∞"
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    return _with_power(mantissa, exponent) if exponent else mantissa.replace("-", "−")


def with_interval(value: float, low: float, high: float, marks: tuple[str, str] = ("", "")) -> tuple[str, str]:
    """A value, and 'low to high': two significant digits of the distance between them, and two digits at least.

    marks : what stands behind the ends.
    """
    distances = [abs(value - end) if end != value else math.nan for end in (low, high)]
    if not any(map(math.isfinite, distances)):
        return number(value, 5), f"{number(low)}{marks[0]} to {number(high)}{marks[1]}"
    nearest = min(one for one in distances if math.isfinite(one))
    ends = [
        _to_place(end, one if math.isfinite(one) else nearest) for end, one in zip((low, high), distances, strict=True)
    ]
    return _to_place(value, nearest), " to ".join(f"{end}{mark}" for end, mark in zip(ends, marks, strict=True))


def _to_place(value: float, distance: float) -> str:
    """A number with its digits down to the second one of a distance, two of its own at least, zeros among them."""
    if value == 0.0 or not math.isfinite(value):
        return number(value)
    place = math.floor(math.log10(float(f"{distance:.1e}"))) - 1
    digits = min(max(math.floor(math.log10(abs(value))) - place + 1, 2), MOST_DIGITS)
    mantissa, _, exponent = f"{value:#.{digits}g}".partition("e")
    mantissa = mantissa.removesuffix(".")
    return _with_power(mantissa, exponent) if exponent else mantissa.replace("-", "−")


_NAME = re.compile(r"(?![aA] )(?:[^\W\d_](?![^\W_]))|[\w-]*[_*0-9]\w*")
"""The name of a parameter, a test or a law at the beginning of a sentence, which stays as it is written."""


_POWER = re.compile(r"(?<![\w.+-])(-?\d+(?:\.\d+)?)e([+-]\d\d+)(?![\w.])", re.ASCII)
"""A number as programs print it, such as 4.2e-05."""


def _with_power(mantissa: str, exponent: str) -> str:
    mantissa = mantissa.replace("-", "−")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"10{power}" if mantissa == "1" else f"{mantissa} × 10{power}"
