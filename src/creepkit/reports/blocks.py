"""What a result says, as blocks: paragraphs, lists, tables, figures, equations, files.

Each kind of result makes its blocks once; a terminal, the page and a notebook render the same. Blocks hold plain text:
numbers as programs write them (4.2e-05), laws by the names that commands know. The page writes powers of ten and the
titles of laws (creepkit.reports.html.page).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from textwrap import TextWrapper, wrap
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from markupsafe import Markup

from creepkit.reports.words import ALL_DIGITS, OVER_ALL_TESTS

if TYPE_CHECKING:
    from creepkit.arrays import Floats

LONGEST_TEXT = 4000
"""Characters of a cell or paragraph; an error message may hold a name of any length."""


MOST_LINES, WIDTH, LEAST_FOLDED = 12, 100, 30
"""Of an answer in a terminal; characters of a line; and of the last column of a table, at the least."""


@dataclass(frozen=True)
class Rich:
    """A text that is set otherwise on a page, such as the symbol of a parameter. html : safe markup."""

    text: str
    html: str

    def __str__(self) -> str:
        return self.text

    def __html__(self) -> str:
        """For templates."""
        return self.html


Cell: TypeAlias = str | Rich


@dataclass(frozen=True)
class Paragraph:
    """A paragraph. role : "", "lead" for what is to be read first, "note" for remarks, "warning"."""

    kind: ClassVar[str] = "paragraph"
    text: str
    role: str = ""


@dataclass(frozen=True)
class Items:
    """A list of sentences below what they are, which says nothing where there are none."""

    kind: ClassVar[str] = "items"
    items: Sequence[str]
    title: str = ""


_NUMBERS = re.compile(r"([-−+>\d.,%\[\]–×⁻⁰¹²³⁴⁵⁶⁷⁸⁹∞\s]|\de[-+]\d|to|inf|none|\+-|\(search bound\))*")
"""A cell with numbers alone, with their intervals, or one that says that there is none."""


@dataclass(frozen=True)
class Table:
    """A table with a caption; the first cell of each row is its head."""

    kind: ClassVar[str] = "table"
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    @classmethod
    def of(cls, caption: str, rows: Sequence[Mapping[str, Cell]]) -> Table:
        """Of rows {column: cell}, all with the same columns."""
        return cls(caption, [*rows[0]] if rows else (), [[*row.values()] for row in rows])

    @property
    def numeric(self) -> list[int]:
        """Columns of numbers, which stand right: not that of the heads of rows, unless it is one of numbers alone."""
        columns = enumerate(zip(*self.rows, strict=True))
        return [k for k, cells in columns if all(map(_NUMBERS.fullmatch, map(str, cells))) and any(map(str, cells))]

    @property
    def filled(self) -> Table:
        """The same without columns in which no cell says anything."""
        kept = [k for k in range(len(self.columns)) if k == 0 or any(str(row[k]) not in ("", "–") for row in self.rows)]
        return Table(self.caption, [self.columns[k] for k in kept], [[row[k] for k in kept] for row in self.rows])

    def folded(self, width: int) -> Table:
        """The same with the last column on several lines where it would go beyond a width, or LEAST_FOLDED."""
        before = [max(len(str(row[k])) for row in (self.columns, *self.rows)) for k in range(len(self.columns) - 1)]
        room, rows = max(width - sum(before) - 2 * len(before), LEAST_FOLDED), list[list[Cell]]()
        for row in self.rows:
            first, *more = wrap(str(row[-1]), room) or [""]
            rows.append([*row[:-1], first])
            rows += [[*[""] * len(before), part] for part in more]
        return Table(self.caption, self.columns, rows)


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
    """An equation, with MathML for pages."""

    kind: ClassVar[str] = "formula"
    equation: Rich


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

    tests : how many, under which conditions. remarks : on the choice of the law. values : (symbol, "= 2.8" or that it
    is not determined, ends of its interval, unit) of the parameters. role : how serious the headline is, "" of a law
    that the tests do not reject, "caution", "warning".
    picture : a Picture, or the Paragraph that says why there is none.
    more : what shows the rest. units : of the values. brackets : what the intervals of figures hold. codes : how finite
    element codes take the law.
    figures : (name, where it holds, value with interval, remark).
    """

    kind: ClassVar[str] = "answer"
    headline: str
    tests: str
    law: Cell = ""
    equations: Sequence[Rich] = ()
    values: Sequence[Sequence[Any]] = ()
    figures: Sequence[Sequence[str]] = ()
    cautions: Sequence[str] = ()
    next_step: str = ""
    remarks: Sequence[str] = ()
    picture: Any = None
    files: Sequence[tuple[str, str, str]] = ()
    more: str = ".details()"
    units: str = "true stress/MPa, time/s, strain as a fraction"
    brackets: str = ""
    codes: str = ""
    role: str = ""

    def __str__(self) -> str:
        """The lines of a terminal."""
        return "\n".join(_answer_lines(self))


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


# ---- numbers and words -----------------------------------------------------------------------------------------------


def printable(text: object, longest: int = LONGEST_TEXT) -> str:
    """A text on one line of bounded length, without characters that are invisible or turn the direction of writing."""
    shown = "".join(c if c.isprintable() else " " if c.isspace() else "\ufffd" for c in str(text))
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def printable_lines(text: str) -> str:
    """The same of a text of several lines, of any length."""
    return "\n".join(printable(line, len(line) + 1).rstrip() for line in text.expandtabs(4).splitlines())


def sentence(text: str) -> str:
    """A text with a capital and a full stop; names stay as they are. Clauses of a long one are sentences themselves."""
    said: list[str] = []
    for clause in _CLAUSES.split(printable(text).strip()):
        joined = "; ".join([*said[-1:], clause])
        fits = max(len(one.split()) for one in _ENDS.split(joined)) <= MOST_WORDS
        said[-1:] = [joined] if fits or not said else [said[-1], clause]
    return " ".join(map(_with_ends, said))


def _with_ends(text: str) -> str:
    first = text[:1] if _NAME.match(text) else text[:1].upper()
    return f"{first}{text[1:]}{'' if text.endswith(('.', '!', '?', ':', '…')) else '.'}"


MOST_WORDS = 25
"""Of a sentence that need not have more."""


_CLAUSES, _ENDS = re.compile(r"; (?![^(\[{]*[)\]}])"), re.compile(r"(?<=[.!?:])\s+")
"""Before a clause that is not in brackets; and where a sentence ends, or what it says first."""


def plural(count: int, noun: str) -> str:
    """A number of things in words: '1 test', '3 tests'."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def plural_of(name: str) -> str:
    """Several of a thing by its name in a file: 'rupture times', 'stresses', 'laboratories'."""
    word = name.replace("_", " ")
    return f"{word[:-1]}ies" if word.endswith("y") else f"{word}es" if word.endswith("s") else f"{word}s"


def listed(words: Sequence[str]) -> str:
    """Words with commas, and 'and' before the last."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else words[0] if words else "none"


def first_of(names: Sequence[str], most: int, more: str = "") -> str:
    """The first names, and how many more there are."""
    others = len(names) - most
    return ", ".join(names[:most]) + (f" and {others} more{more}" if others > 0 else "")


MOST_NAMED = 4
"""Parameters, tests or laws in a sentence."""


def named(names: Sequence[str], noun: str) -> str:
    """Some names, those of tests in quotes, and how many more there are."""
    marks = "'" if noun == "test" else ""
    more = [f"{plural(len(names) - MOST_NAMED, f'more {noun}')}"] if len(names) > MOST_NAMED else []
    return listed([*(f"{marks}{name}{marks}" for name in names[:MOST_NAMED]), *more])


def ends(values: Sequence[float] | Floats, digits: int = 4) -> str:
    """The least and the largest of values (numbers,), '140 to 230'; one where they are the same."""
    return " to ".join(dict.fromkeys(number(end, digits) for end in (min(values), max(values))))


def number(value: float, digits: int = 4) -> str:
    """A number as programs write it, such as 4.2e-05; NaN as a dash."""
    return "–" if math.isnan(value) else f"{value:.{digits}g}"


_NAME = re.compile(r"(?![aA] )(?:[^\W\d_](?![^\W_]))|[\w-]*[_*0-9]\w*")
"""The name of a parameter, a test or a law at the beginning of a sentence, which stays as it is written."""


def typeset(text: str) -> str:
    """The same with powers of ten, signs and infinity as they are printed: 4.2e-05 as 4.2 × 10⁻⁵, -3 with a minus.

    No line ends between a number and its unit.
    """
    text = _POWER.sub(_with_power, _P_VALUE.sub("\u00a0\\1\u00a0", text.replace(" +- ", " ± ")))
    return _UNIT.sub("\u00a0", _INFINITE.sub("∞", _MINUS.sub("−", text)))


_POWER = re.compile(r"(?<![\w.+-])(-?\d+(?:\.\d+)?)e([+-]\d\d+)(?!\w|\.\d)", re.ASCII)
"""A number as programs print it, such as 4.2e-05."""


_P_VALUE = re.compile(r"(?<=\bp) ([=<]) (?=\d)")
"""Within "p = 0.28", where no line ends."""


_MINUS, _INFINITE = re.compile(r"(?:^|(?<=[\[( ]))-(?=[\d∞]|inf\b)"), re.compile(r"(?:^|(?<=[\[( −]))inf\b")
"""Before a number, and what programs print of one that has no end."""


_UNIT = re.compile(r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:°C|%|[GMk]?Pa|1/s|k?J/mol|[hsKN]|kN|[mµn]?m)(?![^\W\d_]))")
"""The space between a number and its unit."""


MOST_WRITTEN_OUT = 5
"""Power of ten up to which a number stands in full, such as 2930 and 100000 h."""


def _with_power(found: re.Match[str]) -> str:
    if 0 <= int(found[2]) <= MOST_WRITTEN_OUT:
        return f"{float(found[0]):.0f}"
    power = str(int(found[2])).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"10{power}" if found[1] == "1" else f"{found[1]}\u00a0×\u00a010{power}"


# ---- as text ---------------------------------------------------------------------------------------------------------


def aligned(columns: Sequence[str], rows: Sequence[Sequence[Cell]], numeric: Sequence[int] = ()) -> list[str]:
    """Lines of a table for a terminal, the first of which are its heads; numeric : columns that stand right."""
    cells = [list(map(str, row)) for row in (columns, *rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [
        "  ".join(
            cell.rjust(width) if k in numeric else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    ]


def as_text(blocks: Sequence[Block]) -> str:
    """Blocks for a terminal: a line a paragraph, tables without rules; figures and files are for pages alone."""
    return "\n".join(line for block in blocks for line in _lines(block))


def _lines(block: Block) -> list[str]:
    if isinstance(block, Answer):
        return _answer_lines(block)
    if isinstance(block, Paragraph):
        return _indented(f"warning: {block.text}" if block.role == "warning" else block.text, "")
    if isinstance(block, Items):
        title = _indented(block.title, "") if block.title and block.items else []
        return [*title, *(line for item in block.items for line in _indented(f"- {item}", ""))]
    if isinstance(block, Table):
        table = block.filled.folded(WIDTH - 2)
        lines = [f"  {line}" for line in aligned(table.columns, table.rows, table.numeric)]
        return ["", *(_indented(f"{table.caption}:", "") if table.caption else []), *lines, ""]
    if isinstance(block, Formula):
        return [f"  {block.equation}"]
    if isinstance(block, Verbatim):
        return ["", f"{block.caption}:", *block.text.splitlines()]
    return []


def _answer_lines(answer: Answer) -> list[str]:
    """MOST_LINES lines, none longer than WIDTH; cautions, figures and remarks without room stand in the details.

    So do mean misfits, and then the intervals of values, where they would leave no room for one figure and one remark.
    """
    end, lines = _indented(f"next: {answer.next_step}; more: {answer.more}"), list[str]()
    end = end if len(end) == 1 else [*_indented(f"next: {answer.next_step}"), f"  more: {answer.more}"]
    tests, _, misfits = answer.tests.partition("; ")
    for intervals, said_of_tests, notes, kept, fewest in (
        *(((True, answer.tests, True, 1, 1),) if misfits else ()),
        *((one, tests, True, 1, 1) for one in (True, False)),
        *((False, tests, False, *least) for least in ((1, 1), (0, 1), (1, 0), (0, 0))),
    ):
        head = _indented(f"{answer.headline} ({said_of_tests})" if said_of_tests else answer.headline, "")
        pieces = [
            " ".join([f"{name} {value}", *[f"[{', '.join(ends)}]"] * intervals, unit]).strip().replace(" ", "\u00a0")
            for name, value, ends, unit in answer.values
        ]
        elsewhere = ALL_DIGITS.format(more="" if intervals else " and intervals")
        pieces += [f"({answer.units}; {elsewhere})"] if pieces else []
        law = [line for text in (*map(str, answer.equations), "   ".join(pieces)) for line in _indented(text)]
        said = [
            _indented(f"{name}{at and (' ' if at.startswith(OVER_ALL_TESTS) else ' at ')}{at}: {value}{note}")
            for name, at, value, remark in answer.figures
            for note in [f", {remark}" if remark and notes else ""]
        ]
        warned = [_indented(f"- {text}") for text in answer.cautions]
        remarks = [*map(_indented, answer.remarks)]
        for parts, least in ((warned, 1), (said, 1), (remarks, kept), (said, fewest)):
            while len(parts) > least and sum(map(len, (head, *remarks, law, *said, *warned, end))) > MOST_LINES:
                parts.pop()
        lines = [*head, *chain(*remarks), *law, *chain(*said, *warned), *end]
        if len(lines) <= MOST_LINES:
            break
    return lines


def _indented(text: str, first: str = "  ") -> list[str]:
    """Lines of a text, indented by two and four; blanks that do not break hold the pieces of a value together."""
    text = _UNIT.sub("\u00a0", text)
    fill = TextWrapper(WIDTH, first, 2 * first, break_long_words=False, break_on_hyphens=False)  # names of laws
    lines = fill.wrap(text)
    return [line.replace("\u00a0", " ") for line in lines]
