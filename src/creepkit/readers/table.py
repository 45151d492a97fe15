"""One table: cells with where they stand (file, sheet, row, column), whatever they come from.

`text_files.read_text_table` reads a text of any dialect and `spreadsheets.read_sheets` the sheets of an .xlsx into a
`CellTable`. Its `rows` are then all rows that hold something, in which names, units and titles stand anywhere;
`named_columns` makes the table whose `columns` are named by the first of them. Cells stay text, with their place, until
`CellTable.numbers` makes numbers of a column; `vocabulary` knows what names and units mean.

    table = read_table(Path("alloys.csv"))
    thickness = table.numbers("thickness (mm)")
    table.location(table.rows[0].line)  # alloys.csv:2
"""

from __future__ import annotations

import math
import operator
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import (
    ERROR_VALUES,
    AmbiguousNumber,
    Dialect,
    detect_dialect,
    float_of,
    is_missing,
    is_number,
    parse_number,
    parse_numbers,
    two_readings,
    without_uncertainty,
)
from creepkit.files.time_stamps import DAYS
from creepkit.readers.ends_of_tests import end_said_by, kind_of_column
from creepkit.readers.questions import Answer, Question
from creepkit.readers.vocabulary import plain_name, split_written_name, unit_suffix

MAXIMUM_CELL = 10_000
"""Characters of a cell, in which units are looked for."""


POINT_OF_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}\.\d{3}", re.ASCII)
"""Beside decimal commas 1.234 may be 1234."""


@dataclass(frozen=True)
class SourceText:
    """One piece of text and its place, 'file:line'.

    decimal : the decimal sign of the table that it stands beside; a decimal point is understood in any case.
    key : the key or column as it was written, where it is known by another name; "" else.
    """

    text: str
    location: str
    decimal: str = "."
    key: str = ""

    def says_the_same(self, other: SourceText) -> bool:
        """Whether both are one text, or one number."""
        numbers = [float_of(one.text) for one in (self, other) if is_number(one.text.replace(",", "."), Dialect())]
        return self.text.casefold() == other.text.casefold() or (len(numbers) == 2 and numbers[0] == numbers[1])

    def number(self, name: str) -> float:
        """The text as a finite number, without its uncertainty; `name` says in the error what it was meant to be."""
        dialect, text = Dialect(decimal=self.decimal), without_uncertainty(self.text)
        if self.decimal == "," and not is_number(text, dialect) and not POINT_OF_THOUSANDS.fullmatch(text):
            dialect = Dialect()
        return parse_number(text, dialect, self.location, name)


class TableRow(NamedTuple):
    """The cells of one line of a table; a tuple, for a table has up to millions."""

    line: int
    cells: Sequence[str]


def with_columns(rows: Sequence[TableRow], kept: Sequence[int]) -> list[TableRow]:
    """The rows with some of their columns."""
    return [TableRow(row.line, [row.cells[k] for k in kept if k < len(row.cells)]) for row in rows]


def cells_of(rows: Sequence[TableRow], column: int) -> Iterator[str]:
    """The cells of one column."""
    return (row.cells[column] for row in rows)


def grouped(rows: Sequence[TableRow], column: int) -> dict[str, list[TableRow]]:
    """{cell of a column: the rows that have it}, in the order of the first ones."""
    found: dict[str, list[TableRow]] = {}
    for row in rows:
        found.setdefault(row.cells[column], []).append(row)
    return found


def some_of(names: Sequence[str], count: int = 12) -> str:
    """Names as messages list them: the first ones, each not longer than 40, and how many there are."""
    shown = ", ".join(quoted(name, 40) for name in names[:count])
    return shown if len(names) <= count else f"{shown} and {len(names) - count} more"


def refuse_long_cells(place: str, cells: Sequence[str]) -> None:
    """Refuse a cell that is no name, number or remark."""
    if len(longest := max(cells, key=len, default="")) > MAXIMUM_CELL:
        what = f"a cell of {len(longest)} characters, more than {MAXIMUM_CELL}"
        raise HistoryError(f"{place}: {what}; is a quote or a line missing?")


@dataclass(frozen=True)
class CellTable:
    """Cells with where they stand; all still text.

    rows : those that hold something and are no comment. sheet : of a spreadsheet, "" of a text. header : the
    entries of `# key: value` lines. comments : line, key and entry of those below the first row; of remarks above
    it without key. columns : their names, in `columns_line`, where they are known. positions : the column of the
    file, from 0, in which each column stands, where errors must tell it. written : the columns as they were
    written, where they were given creepkit's names. assumptions : what was assumed of the table, for the label
    "assumed". sources : what titles and names of sheets and files state of its test, which must agree with what
    else does. merged : row and column, from 0, of cells that are merged with one above them.
    """

    path: Path
    rows: Sequence[TableRow]
    sheet: str = ""
    dialect: Dialect = field(default_factory=Dialect)
    header: Mapping[str, SourceText] = field(default_factory=dict)
    comments: Sequence[tuple[int, str, SourceText]] = ()
    columns: Sequence[str] = ()
    columns_line: int = 0
    positions: Sequence[int] = ()
    written: Sequence[str] = ()
    assumptions: tuple[str, ...] = ()
    sources: tuple[SourceText, ...] = ()
    merged: frozenset[tuple[int, int]] = frozenset()

    @property
    def place(self) -> str:
        """The file, and the sheet in it."""
        return f"{self.path}, sheet '{self.sheet}'" if self.sheet else str(self.path)

    def location(self, line: int, column: int | None = None) -> str:
        """Where a line stands, 'file:line', or 'file, sheet 'creep', row 3' in a spreadsheet; or a cell of it."""
        place = f"{self.place}, row {line}" if self.sheet else f"{self.path}:{line}"
        return place if column is None or not self.positions else f"{place}, column {self._column_label(column)}"

    def column(self, name: str) -> int:
        """The number of a column that must be there."""
        if name not in self.columns:
            result = some_of(self.columns)
            raise HistoryError(f"{self.location(self.columns_line)}: missing column '{name}'; found: {result}")
        return self.columns.index(name)

    def question(self, what: str, key: str, *choices: Answer, line: int = 0, is_free: bool = False) -> Question:
        """The question of a line, else of the names of the columns, which the key of tests.toml answers."""
        return Question(self.path, self.location(line or self.columns_line), what, key, choices, is_free=is_free)

    def as_written(self, column: int) -> str:
        """The name of a column as the file has it."""
        return (self.written or self.columns)[column]

    def numbers(self, name: str) -> Floats:
        """(rows,) One column as numbers."""
        k = self.column(name)
        cells = [without_uncertainty(cell) for cell in cells_of(self.rows, k)]
        return parse_numbers(cells, self.dialect, lambda row: self.location(self.rows[row].line, k), self.as_written(k))

    @property
    def lines(self) -> Ints:
        """(rows,) The line of the file in which each row stands."""
        return np.array([row.line for row in self.rows], dtype=int)

    def entries(self, row: TableRow) -> dict[str, SourceText]:
        """The cells of one row by column, those left empty excepted."""
        place, cells = self.location(row.line), zip(self.columns, row.cells, strict=True)
        return {name: SourceText(cell, place, self.dialect.decimal) for name, cell in cells if not is_missing(cell)}

    def empty_columns(self, row: TableRow) -> list[str]:
        """The columns whose cell in one row is empty: what they would say of it is unknown."""
        return [name for name, cell in zip(self.columns, row.cells, strict=True) if is_missing(cell)]

    def renamed(self, columns: Sequence[str]) -> CellTable:
        """The table with other names of its columns, which keeps those that were written."""
        return replace(self, columns=columns, written=self.written or self.columns)

    def keeping(self, kept: Sequence[int]) -> CellTable:
        """The table with some of its columns."""
        places = [(self.positions or range(len(self.columns)))[k] for k in kept]
        columns = [self.columns[k] for k in kept]
        return replace(self, columns=columns, rows=with_columns(self.rows, kept), positions=places)

    def with_cells(self, column: int, name: str, texts: Sequence[str]) -> CellTable:
        """The table with other cells (rows,) and another name in a column."""
        parts = zip(self.rows, texts, strict=True)
        rows = [TableRow(r.line, [text if k == column else c for k, c in enumerate(r.cells)]) for r, text in parts]
        return replace(self, rows=rows, columns=[name if k == column else c for k, c in enumerate(self.columns)])

    def with_comments(self, comments: Iterable[tuple[int, Sequence[str]]], first: int) -> CellTable:
        """The table with the entries of comments, line and cells, the value of a key perhaps in the second of these.

        Those above the first row stand in the header; one without a colon or a value is a remark, without a key.
        """
        header, late = dict[str, SourceText](), list[tuple[int, str, SourceText]]()
        for line, cells in comments:
            (key, colon, text), place = entry_of(cells[0]), self.location(line)
            beside = [cell for cell in cells[1:] if cell]
            if len(beside) > (not text):
                raise HistoryError(f"{place}: '{quoted(cells[0])}' is given with several values; keep one")
            if key in header and line < first:
                where = header[key].location.removeprefix(f"{self.place}, ").rpartition(":")[2]
                what = f"'{key}' was already given in {'line ' * where.isdigit()}{where}"
                raise HistoryError(f"{place}: {what}; keep one of them")
            entry = SourceText(text or "".join(beside), place, self.dialect.decimal)
            if not (colon or beside) and line < first and key:
                late.append((line, "", replace(entry, text=key)))
            if (colon or beside) and line >= first:
                late.append((line, key, entry))
            elif (colon or beside) and plain_name(key) != "decimal":
                header[key] = entry
        return replace(self, header=header, comments=late)

    def assuming(self, *assumptions: str) -> CellTable:
        """The table with more that was assumed of it."""
        return replace(self, assumptions=(*self.assumptions, *assumptions))

    def _column_label(self, column: int) -> str:
        """The letters of a spreadsheet's column, elsewhere its number from 1."""
        number, letters = self.positions[column] + 1, ""
        if not self.sheet:
            return str(number)
        while number:
            number, digit = divmod(number - 1, 26)
            letters = chr(ord("A") + digit) + letters
        return letters


# ---- commas --------------------------------------------------------------------------------------------------------


def dialect_of(lines: Iterable[str], path: Path, place: str, decimal: str | None) -> Dialect:
    """The dialect of the lines of a table; Question where a comma may be decimal or between thousands.

    decimal : the decimal sign, where it is stated.
    """
    try:
        return detect_dialect(lines, place, decimal)
    except AmbiguousNumber as error:
        raise Question(path, place, two_readings(error.number), "decimal", ("comma", "point")) from None


_THOUSANDS, _WITH_SIGN = (
    {sign: re.compile(rf"[<>≥(\[]*\s*[+-]?{digits.format(sign)}\s*[+*†)\]h→]*") for sign in (",", ".")}
    for digits in (r"[1-9]\d{{0,2}}(?:[{}]\d{{3}})+", r"\d*[{}]\d+")
)
"""By a sign, numbers with it, perhaps marked as a time of a run-out is: between thousands, and of any kind."""


_WITH_BOTH = re.compile(r"[<>≥(\[]*\s*\d{1,3}(?:(?:\.\d{3})+,|(?:,\d{3})+\.)\d+")
"""A number that tells which sign stands between thousands, `1.234,5`."""


def _without_thousands(table: CellTable, *, is_stated: bool) -> CellTable:
    """The table without the signs between thousands of its numbers, a comma where its decimal sign is a point.

    They are if the decimal sign is stated (is_stated), if another number has both signs, or if several numbers have a
    comma, each before three digits; a single one is asked about.
    """
    both = next((cell for row in table.rows for cell in row.cells if _WITH_BOTH.fullmatch(cell)), "")
    if both and not table.sheet:  # in which cells of numbers have points
        table = replace(table, dialect=replace(table.dialect, decimal=max(".,", key=both.rfind)))
    sign = "," if table.dialect.decimal == "." else "."
    signed = [(row, cell) for row in table.rows for cell in row.cells if sign in cell]
    found = [(row, cell) for row, cell in signed if _THOUSANDS[sign].fullmatch(cell)]
    others = [c for _, c in signed if _WITH_SIGN[sign].fullmatch(c) and not _THOUSANDS[sign].fullmatch(c)]
    others = [c for c in others if not _WITH_BOTH.fullmatch(c)]
    is_stated |= bool(both)
    if not found or others or (sign == "." and not is_stated):
        return table
    row, cell = found[0]
    if len(found) == 1 and cell.count(",") == 1 and not is_stated:
        raise table.question(two_readings(cell), "decimal", "point", line=row.line)
    plain = {one: one.replace(sign, "") for _, one in found}
    rows = [TableRow(row.line, [plain.get(one, one) for one in row.cells]) for row in table.rows]
    return replace(table, rows=rows).assuming(
        f"{'commas' if sign == ',' else 'points'} stand between thousands ({plain[cell]})"
    )


# ---- footnotes and powers of ten -----------------------------------------------------------------------------------


_POWER = re.compile(r"(?<=[\d.,])\s*[x×·*∙]\s*10\s*\^?\s*\(?([+\-−]?\d+|[⁻⁺⁰¹²³⁴-⁹]+)\)?")
"""A power of ten, written as such."""


_MARK = r"\*{1,3}|[†‡§¶]+|[¹²³]\)|(?<![\w(])[1-9]\)|(?<![^\W\d_])(?<!\()[a-h]\)|\([a-h]\)"
_FOOTNOTE, _MARKED = re.compile(rf"({_MARK})[:=]?\s*(\S.*)"), re.compile(rf"(.*?\S)\s*({_MARK})(\s*[(\[].*)?")
_IN_UNIT = re.compile(r"(?:(?:values )?(?:in|en) )?(.{1,8}?)(?:[,;.].*)?", re.IGNORECASE)
"""A footnote, a cell that is marked by one, and a footnote that is a unit."""


def in_plain_numbers(table: CellTable, *, is_stated: bool) -> CellTable:
    """The table without powers of ten, days before hours, footnote marks, signs between thousands, and logarithms.

    is_stated : whether the decimal sign is stated.
    """
    rows = list(table.rows)
    for k, row in enumerate(rows):
        if any(":" in cell and DAYS.fullmatch(cell) for cell in row.cells):
            rows[k] = row = TableRow(row.line, [DAYS.sub(_hours, cell) for cell in row.cells])
        if any("10" in cell and _POWER.search(cell) for cell in row.cells):
            rows[k] = TableRow(row.line, [_POWER.sub(_exponent, cell) for cell in row.cells])
    table = _without_footnotes(replace(table, rows=rows))
    return _with_plain_columns(_without_thousands(table, is_stated=is_stated))


def _hours(found: re.Match[str]) -> str:
    return f"{24 * int(found[1]) + int(found[2])}{found[3]}"


def _exponent(power: re.Match[str]) -> str:
    return f"e{unicodedata.normalize('NFKC', power[1]).replace('−', '-')}"


def _without_footnotes(table: CellTable) -> CellTable:
    """The table without footnotes below it and their marks; its header tells the texts, a unit takes the place of one.

    A text on how a test ended stays where it is, with its marks.
    """
    rows, notes, marked = list(table.rows), dict[str, TableRow](), dict[str, list[str]]()
    while rows and (note := _FOOTNOTE.fullmatch(", ".join(filter(None, rows[-1].cells)))):
        notes[note[1]] = TableRow(rows.pop().line, [note[2]])
    marks = {sign.strip("()"): sign for sign in notes} | {sign: sign for sign in notes}

    def unmarked(cell: str) -> str:
        found = _MARKED.fullmatch(cell)
        sign = (marks.get(found[2]) or marks.get(found[2].strip("()"), "")) if found else ""
        is_unit = found and unit_suffix(found[2]) and not is_number(found[1], table.dialect)
        if not found or not sign or is_unit or end_said_by(notes[sign].cells[0]):
            return cell
        marked.setdefault(sign, []).append(found[1])
        unit = _IN_UNIT.fullmatch(notes[sign].cells[0])
        return f"{found[1]} ({unit[1]})" if unit and unit_suffix(unit[1]) else f"{found[1]}{found[3] or ''}"

    rows = [TableRow(row.line, [*map(unmarked, row.cells)]) for row in rows] if notes else rows
    texts = {sign: (f"{notes[sign].cells[0]} (of {'; '.join(of)})", notes[sign].line) for sign, of in marked.items()}
    told = {f"label footnote {sign}": SourceText(text, table.location(n)) for sign, (text, n) in texts.items()}
    below = [row for row in table.rows[len(rows) :] if row.line not in {line for _, line in texts.values()}]
    return replace(table, rows=[*rows, *below], header={**table.header, **told})


# ---- comments ------------------------------------------------------------------------------------------------------


def is_comment(line: str) -> bool:
    """Whether a line, or the first cell of a row, is a comment."""
    text = line.lstrip(' \t"\ufeff')
    return text.startswith(("#", "//")) and not text.startswith(ERROR_VALUES)


def entry_of(line: str) -> tuple[str, bool, str]:
    """Key, whether there is a colon, and text of a comment, which a spreadsheet may have put in quotes."""
    text = line.strip().strip("\ufeff")
    if text.startswith('"') and text.endswith('"'):
        text = text[1:-1].replace('""', '"')
    key, colon, value = text.lstrip("#/").partition(":")
    return key.strip(), bool(colon), value.strip()


# ---- columns -------------------------------------------------------------------------------------------------------


_LOGARITHM = re.compile(
    r"(?:log|lg)[ _]?(?:10|₁₀)?(?:[ _]+|(?=[(\[]))[(\[]?(?P<of>[^()\[\]]+(?:\([^()]+\))?)[)\]]?"
    r"(?:\s*[(\[](?P<unit>[^()\[\]]+)[)\]])?"
)
_MAY_BE_LOGARITHM = re.compile(
    r"t(?: ?[rfbu])?|(?:time|temps|[σε])(?: .*)?|.*(?:rate|stress|life|zeit|spannung|vitesse|contrainte)", re.IGNORECASE
)
_LARGEST_LOGARITHM = 20.0


_PART_OF_UNIT = re.compile(r"(?P<name>.+?)\s*[(\[]\s*(?P<part>0[.,]0*1)\s*(?P<unit>[^\W\d]+)\s*[)\]]")
"""Name of a column in parts of a unit, as a dial gauge has them: `Gauge 1 (0.01 mm)`."""


_RECIPROCAL = re.compile(
    r"(1(?:0{3,4}|e[34])?|10(?:\^|\*\*)[34])\s*/\s*T(?:\s*[,(\[]?\s*(?:1/K|K\^?[-−]1|/K)\s*[)\]]?)?"
)
"""Name of a column of an Arrhenius plot, `10^4/T (1/K)`."""


def _divided(dividend: float, divisor: float) -> float:
    return dividend / divisor if divisor else math.inf


def _with_plain_columns(table: CellTable) -> CellTable:
    """The table with numbers in the place of decimal logarithms, reciprocal temperatures and parts of a unit."""
    rows, names, of = list(table.rows), dict[int, tuple[str, str]](), dict[int, Callable[[float], float]]()
    patterns = _LOGARITHM, _PART_OF_UNIT, _RECIPROCAL
    heads = (r for r, row in enumerate(rows[:60]) if any(p.fullmatch(cell) for p in patterns for cell in row.cells))
    at = next(heads, len(rows))
    for k, cell in enumerate(rows[at].cells if at < len(rows) else ()):
        if match := _PART_OF_UNIT.fullmatch(cell):
            names[k] = f"{match['name']} ({match['unit']})", f"'{cell}' in whole {match['unit']}"
            of[k] = partial(operator.mul, float(match["part"].replace(",", ".")))
        elif match := _RECIPROCAL.fullmatch(cell):
            names[k] = "T (K)", f"'{cell}' is a reciprocal temperature"
            of[k] = partial(_divided, float(match[1].replace("10^", "1e").replace("10**", "1e")))
        elif name := _name_of_logarithm(cell, [row.cells[k] for row in rows[at:] if _is_number_at(row, k, table)]):
            names[k], of[k] = (name, f"'{cell}' is a decimal logarithm"), partial(pow, 10.0)
    for r in range(at, len(rows) if of else at):
        changed = {k: f"{of[k](float_of(rows[r].cells[k])):.12g}" for k in of if _is_number_at(rows[r], k, table)}
        changed = {k: text.replace(".", table.dialect.decimal) for k, text in changed.items()}
        changed |= {k: name for k, (name, _) in names.items() if r == at}
        rows[r] = TableRow(rows[r].line, [changed.get(k, cell) for k, cell in enumerate(rows[r].cells)])
    return replace(table, rows=rows).assuming(*(note for _, note in names.values()))


def _name_of_logarithm(cell: str, numbers: Sequence[str]) -> str:
    """The name of what a column of decimal logarithms holds; "" of any other column."""
    match = _LOGARITHM.fullmatch(cell)
    name, unit = split_written_name(match["of"]) if match else ("", "")
    unit = (match and match["unit"]) or unit
    is_quantity = unit_suffix(unit) or _MAY_BE_LOGARITHM.fullmatch(plain_name(name).replace("_", " "))
    if not (match and is_quantity and numbers and max(map(abs, map(float_of, numbers))) <= _LARGEST_LOGARITHM):
        return ""
    return f"{name} ({unit})" if unit else name


def _is_number_at(row: TableRow, column: int, table: CellTable) -> bool:
    return column < len(row.cells) and is_number(row.cells[column], table.dialect)


def without_ignored(table: CellTable, names_at: int, ignored: Collection[str]) -> CellTable:
    """The table without the columns that its key `ignore` names, all of which must be there, and those in `ignored`.

    names_at : the row of the names. A name is told as it is written; else but for capitals and its unit.
    """
    key = next((key for key in table.header if plain_name(key) == "ignore"), None)
    cells = table.rows[names_at].cells
    left_out = {k for name in ignored for k in _columns_called(name, cells)}
    if key is not None:
        entry = table.header[key]
        names = [name.strip() for name in entry.text.split(";" if ";" in entry.text else ",")]
        for name in [entry.text] if entry.text in cells else names:
            found = _columns_called(name, cells)
            if not found:
                columns = some_of(list(filter(None, cells)))
                what = f"ignore names '{quoted(name)}', which is no column; the columns are: {columns}"
                raise HistoryError(f"{entry.location}: {what}")
            left_out.update(found)
    header = {name: entry for name, entry in table.header.items() if name != key}
    if not left_out:
        return replace(table, header=header)
    kept = [k for k in range(max(len(row.cells) for row in table.rows)) if k not in left_out]
    rows = [row for row in with_columns(table.rows, kept) if any(row.cells)]
    places = table.positions or range(kept[-1] + 1 if kept else 0)
    return replace(table, header=header, rows=rows, positions=[places[k] for k in kept])


def _columns_called(name: str, cells: Sequence[str]) -> list[int]:
    """The columns of a name as it is written, else of one that differs in capitals, or lacks the unit."""
    plain = plain_name(name)
    filled = [k for k, cell in enumerate(cells) if cell]
    exact = [k for k in filled if cells[k] == name]
    alike = exact or [k for k in filled if plain_name(cells[k]) == plain]
    bare = plain_name(split_written_name(name)[0])  # of a name whose unit stands in a row of its own
    return alike or [
        k for k in filled if plain_name(split_written_name(cells[k])[0]) == plain or plain_name(cells[k]) == bare
    ]


def check_columns(location: str, columns: Sequence[str]) -> None:
    """Refuse a column without a name, and a name that stands there twice."""
    if "" in columns:
        raise HistoryError(f"{location}: a column has no name; name every column, such as time_s,strain_pct")
    twice = next((name for k, name in enumerate(columns) if name in columns[:k]), None)
    if twice is not None:
        raise HistoryError(f"{location}: the column '{twice}' stands there twice; keep one of them")


def named_columns(table: CellTable) -> CellTable:
    """The table whose first row names its columns."""
    names, rows = table.rows[0], table.rows[1:]
    if not names.cells[0] and [row.cells[0] for row in rows] == [str(k) for k in range(len(rows))]:  # as of pandas
        kept = range(1, max(len(row.cells) for row in table.rows))
        return named_columns(replace(table, rows=with_columns(table.rows, kept), positions=kept))
    width = max((k for k, cell in enumerate(names.cells, 1) if cell), default=0)
    place = table.location(names.line)
    check_columns(place, names.cells[:width])
    rows = [TableRow(row.line, cells_of_width(table, row, width)) for row in rows]
    if not rows:
        raise HistoryError(f"{place}: no rows below the line of columns; a table needs at least one")
    return replace(table, columns=names.cells[:width], columns_line=names.line, rows=rows)


def cells_of_width(table: CellTable, row: TableRow, width: int, *, beside: bool = False) -> Sequence[str]:
    """As many cells of a row as there are columns; empty ones behind them are none, in a sheet also those that lack.

    beside : whether more cells may stand behind the columns.
    """
    cells = row.cells
    if len(cells) > width and not beside and not any(cells[width:]):
        cells = cells[:width]
    if len(cells) < width and table.sheet:  # empty cells at the end of a sheet's row are not stored
        cells = [*cells, *[""] * (width - len(cells))]
    if len(cells) == width or (beside and len(cells) > width):
        return cells
    if table.sheet:
        foreign = quoted(next(filter(None, cells[width:])))
        what = f"'{foreign}' stands in a column without a name; name it or remove it"
        raise HistoryError(f"{table.location(row.line)}: {what}")
    raise _another_width(table, row, width)


def _another_width(table: CellTable, row: TableRow, width: int) -> HistoryError:
    """The error of a line of text with more or fewer cells than there are columns: those behind one are moved."""
    delimiter = str(table.dialect).partition(",")[0]
    advice = ", empty ones too" * (len(row.cells) < width)
    advice += "; a decimal comma needs semicolons, or quotes, or write a point" * (table.dialect.delimiter == ",")
    what = f"number of cells {len(row.cells)}, of columns {width}; write one cell a column"
    return HistoryError(f"{table.location(row.line)}: {what}, separated by {delimiter}{advice}")


def with_commas_of_remarks(table: CellTable, rows: Sequence[TableRow], names: Sequence[str]) -> list[TableRow]:
    """The rows below names; of a text with commas none is longer, for a decimal comma moves what is behind it.

    HistoryError for a longer row, unless its last column is of remarks, whose commas these are: a text begins there,
    and no number stands before it in a column that has mostly none.
    """
    width, found = len(names), list[TableRow]()
    if table.sheet or table.dialect.delimiter != "," or all(len(row.cells) <= width for row in rows):
        return [*rows]
    whole = [row.cells for row in rows if len(row.cells) == width]
    numeric = [2 * sum(is_number(one[k], table.dialect) for one in whole) >= len(whole) for k in range(width)]
    for row in rows:
        before, remark = row.cells[: width - 1], row.cells[width - 1 :]
        if len(remark) > 1 and any(remark[1:]):
            is_moved = any(is_number(cell, table.dialect) and not numeric[k] for k, cell in enumerate(before))
            is_text = bool(remark[0]) and not is_number(remark[0], table.dialect)
            if kind_of_column(names[-1]) != "remark" or not (whole and is_text) or is_moved:
                raise _another_width(table, row, width)
            row = TableRow(row.line, [*before, ", ".join(filter(None, remark))])
        found.append(row)
    return found


_PAGE = re.compile(r"\b(?:page|seite|blatt)\b", re.IGNORECASE)


def without_page_heads(table: CellTable) -> CellTable:
    """The table without the lines at the beginning of further pages, which repeat that of the first one."""
    seen, rows = set[str](), list[TableRow]()
    for row in table.rows:
        text = " ".join(row.cells)
        plain = re.sub(r"\d+", "", text) if _PAGE.search(text) else ""
        if plain not in seen:
            rows.append(row)
            seen |= {plain} if plain else set()
    return replace(table, rows=rows)
