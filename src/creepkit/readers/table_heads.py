"""The head of a table: which row names the columns, which hold their units, and what the others say of the tests.

Rows of a head may stand in any order, above the names of the columns or between them and the first frame: names of
tests, units, keys with one value a test, values with units such as `140 MPa` above a pair of columns, titles, notes.
What stands above the columns of a test holds for it. A title, the name of a sheet or that of a file is a weaker source:
it fills in what nothing else states, gives way to an answer of tests.toml, and must agree with all else.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import NUMBERS, float_of, is_missing, is_number, without_uncertainty
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.ends_of_tests import end_said_by, invalidity_said_by
from creepkit.readers.questions import Answer
from creepkit.readers.table import CellTable, SourceText, TableRow, with_commas_of_remarks, without_ignored
from creepkit.readers.vocabulary import (
    HeaderVocabulary,
    Terms,
    in_unit,
    is_symbol,
    split_unit,
    split_written_name,
    unit_behind,
    unit_suffix,
    words_of,
)
from creepkit.readers.weak_sources import conditions_in_text, conditions_of_head
from creepkit.records import known_specimens
from creepkit.records.quantities import TEMPERATURE

_MOST_ROWS, _MOST_BELOW = 60, 6
"""Rows among which the names of the columns are looked for, and rows of a head below them."""

_DIGITS = re.compile(r"[-+]?\d+(?:[\s.,'`´’·]\d+)+")
"""Digits with signs between them, with which a file may write no numbers."""


@dataclass(frozen=True)
class HeadedTable:
    """A table from the names of its columns on, and the rows of its head.

    table : its first row holds the names of the columns, with their units. written : the names without units of a row
    of their own. rows : the others of the head, above the names and below them; whole : the same with the columns that
    are left out. times : positions of the columns of time, but for a clock beside one of numbers.
    """

    table: CellTable
    known: Terms
    written: Sequence[str]
    rows: Sequence[TableRow]
    whole: Sequence[TableRow]
    times: Sequence[int]

    @property
    def names(self) -> Sequence[str]:
        """Of the columns, "" of those without one."""
        return self.table.rows[0].cells

    @property
    def place(self) -> str:
        """Where the names of the columns stand."""
        return self.table.location(self.table.rows[0].line)


_NOT_TESTS = re.compile(
    r"(?<!\S)(?:plastic|elastic|total|creep|true|engineering|logarithmic|inelastic|thermal|primary|axial|diametral|lateral"
    r"|hoop|radial|transverse|local|global|mean|average|max|min|maximum|minimum|rate|sd|corrected|raw|left|right|front|back"
    r"|clock|start|end|cycle|date|loading|hold|ramp|step|rupture|test|no|of|lvdt|extensometer|channel|sensor|upper|lower"
    r"|top|bottom)(?!\S)"
)
"""Words beside a quantity that tell another quantity or another sensor, not another test."""


def test_and_column(cell: str, known: Terms) -> tuple[str, str]:
    """Name of the test and of the column in `A1 strain (%)` or `Strain A1 (%)`; ("", cell) where there are not both."""
    names = (known.column(cell), known.columns.kinds), (known.condition(cell), known.conditions.kinds)
    found = [(one, kinds) for name, kinds in names if (one := split_unit(name, kinds))]
    if any(unit in ("", *kinds[quantity].units) for (quantity, unit), kinds in found) or (
        not found and known.is_condition(cell)
    ):
        return "", cell
    written, unit = split_written_name(cell)
    words = re.sub(r"^([DØ⌀])(?=\d)", r"\1 ", written.replace(":", " ").replace("_", " ")).split()
    for size in range(min(len(words) - 1, 3), 0, -1):
        for first, rest in ((words[:size], words[size:]), (words[-size:], words[:-size])):
            name, column = " ".join(rest).strip("-–, "), " ".join(first) + (f" ({unit})" if unit else "")
            if name and known.quantity(column) and not _NOT_TESTS.search(name.lower()):
                return name, column
    return "", cell


def is_time(cell: str, known: Terms) -> bool:
    """Whether a name of a column is a time, perhaps that of a test, as in `Time A1 (h)`."""
    return bool(cell) and known.quantity(test_and_column(cell, known)[1]) == "time"


def is_frame(row: TableRow, table: CellTable) -> bool:
    """Whether a row holds numbers or times alone, with marks of missing values."""
    if all(map(NUMBERS[table.dialect.decimal].fullmatch, row.cells)):
        return True
    cells = [cell for cell in row.cells if cell]
    numbers = [is_number(without_uncertainty(c).rstrip("% "), table.dialect) or is_clock_time(c) for c in cells]
    return any(numbers) and all(one or is_missing(cell) for one, cell in zip(numbers, cells, strict=True))


def names_time(table: CellTable, vocabulary: HeaderVocabulary) -> bool:
    """Whether some row of a table names a time, as that above frames does."""
    known = vocabulary.terms()
    return any(is_time(cell, known) for cell in table.rows[_row_of_names(table, known)].cells)


def _row_of_names(table: CellTable, known: Terms) -> int:
    """The first row that names a time among texts alone; else that above the first frame, or the first of all."""
    for k, row in enumerate(table.rows[:_MOST_ROWS]):
        cells = [cell for cell in row.cells if cell]
        is_text = not any(is_number(cell, table.dialect) for cell in cells)
        if is_text and any(is_time(cell, known) for cell in cells) and (len(cells) > 1 or k == 0):
            return k
    above = next((k for k, row in enumerate(table.rows[1:_MOST_ROWS]) if is_frame(row, table)), 0)
    is_of_units = above > 0 and all(map(unit_suffix, filter(None, table.rows[above].cells)))
    return above - is_of_units


def headed_table(table: CellTable, vocabulary: HeaderVocabulary) -> HeadedTable:
    """A table taken apart into head and frames; HistoryError for rows of numbers that nothing names."""
    table = _with_stated(table, vocabulary.stated)
    known = vocabulary.terms(table.header["specimen"].text if "specimen" in table.header else "")
    at = _row_of_names(table, known)
    table = _in_units_of_columns(table, at, known)
    line, searched = table.rows[at].line, table.rows[: at + _MOST_BELOW]
    rest = enumerate(table.rows[at + 1 :], at + 1)
    end = next((k for k, row in rest if any(is_number(cell, table.dialect) for cell in row.cells)), len(table.rows))
    frames = with_commas_of_remarks(table, table.rows[end:], max((row.cells for row in table.rows[at:end]), key=len))
    table = replace(table, rows=[*table.rows[:end], *frames])
    numbered = [name for k, name in enumerate(table.rows[at].cells) if _numbers_readings(table, at, k, known)]
    table = table.assuming(*(f"'{quoted(name, 40)}' numbers the readings" for name in numbered))
    table = without_ignored(with_entries_of_comments(table, line, known), at, (*vocabulary.ignored, *numbered))
    at = next((k for k, row in enumerate(table.rows[: at + 1]) if row.line == line), -1)
    if at < 0:
        raise HistoryError(f"{table.location(line)}: every column is left out by ignore; keep those of the test")
    names = table.rows[at]
    if is_frame(names, table):
        what = "the first row holds numbers, and none above it names the columns; write names such as time_h,strain_pct"
        raise HistoryError(f"{table.location(line)}: {what} above it (behind '#' they count, too)")
    times = [k for k, cell in enumerate(names.cells) if is_time(cell, known)]
    body = at + 1
    while body < min(len(table.rows), at + _MOST_BELOW) and _is_of_head(table.rows[body], times, table, known):
        body += 1
    others = [*table.rows[:at], *table.rows[at + 1 : body]]
    units = next((row for row in others if _holds_units(row, names)), None)
    head = [row for row in others if row is not units]
    first = table.rows[body].cells if body < len(table.rows) else ()
    written = list(names.cells)
    _fill_names(written, [row for row in head if row.line > line], first)
    of_units = [cell.strip("()[] ") for cell in units.cells] if units else []
    of_units += [""] * (len(written) - len(of_units))
    with_units = [f"{name} ({unit})" if name and unit else name for name, unit in zip(written, of_units, strict=False)]
    lines = {row.line for row in head}
    whole = [row for row in searched if row.line in lines or row.line < line]
    below = replace(table, rows=[TableRow(line, with_units), *table.rows[body:]])
    times = [k for k, cell in enumerate(with_units) if is_time(cell, known)]
    firsts = {k: first[k] for k in times if k < len(first)}
    if any(is_number(cell, table.dialect) for cell in firsts.values()):
        times = [k for k in times if not is_clock_time(firsts.get(k, ""))]
    return HeadedTable(below, known, written, head, whole, times)


def _in_units_of_columns(table: CellTable, at: int, known: Terms) -> CellTable:
    """The table with cells such as `45 min` and `3 days`, below the row of names, as numbers in one unit of the column.

    Question where others of a column have no unit, and its name neither.
    """
    first = table.rows[at + 1 : at + _MOST_ROWS]
    for k, name in enumerate(table.rows[at].cells):
        kind = known.columns.kinds.get(known.quantity(name) or "") if name else None
        if kind is None or not any(cell[-1:].isalpha() for row in first for cell in row.cells[k : k + 1]):
            continue
        cells = {n: row.cells[k] for n, row in enumerate(table.rows) if n > at and k < len(row.cells)}
        written = {n: cell for n, cell in cells.items() if cell[-1:].isalpha() and unit_behind(cell, kind)}
        if not written or 2 * len(written) < sum(map(bool, cells.values())):
            continue
        own = unit_suffix(split_written_name(name)[1])
        unit = own or unit_behind(next(iter(written.values())), kind)
        bare = next((n for n, cell in cells.items() if is_number(cell, table.dialect)), 0)
        if bare and not own:
            what = f"'{quoted(name, 60)}' is '{cells[bare]}' without the unit of others; which is it?"
            choice: Answer = {name: f"{known.quantity(name)}_{unit}"}
            raise table.question(what, "columns", choice, line=table.rows[bare].line, is_free=True)
        numbers = {n: in_unit(cell, kind, unit, table.dialect.decimal) for n, cell in written.items()}
        numbers[at] = name if own else f"{name} ({unit})"
        rows = [
            TableRow(row.line, [numbers.get(n) or cell if i == k else cell for i, cell in enumerate(row.cells)])
            for n, row in enumerate(table.rows)
        ]
        changed = next((cell for cell in written.values() if unit_behind(cell, kind) != unit), "")
        notes = [f"'{changed}' is {in_unit(changed, kind, unit, '.')} {unit}"] if changed else []
        table = replace(table, rows=rows).assuming(*notes)
    return table


def _numbers_readings(table: CellTable, at: int, column: int, known: Terms) -> bool:
    """Whether a column of no known name, below the row of names, holds whole numbers that rise by one, as of frames."""
    name, rows = table.rows[at].cells[column], table.rows[at + 1 :]
    cells = [row.cells[column] for row in rows if row.cells[column:]]
    if not name or known.quantity(name) or known.is_condition(name) or split_written_name(name)[1]:
        return False
    numbers = [float_of(cell) for cell in cells if is_number(cell, table.dialect)]
    rises = {b - a for a, b in pairwise(numbers)} == {1.0} and numbers[0] == int(numbers[0])
    return rises and len(numbers) > 2 and 2 * len(numbers) > len(cells)


def _with_stated(table: CellTable, stated: Mapping[str, tuple[str, str]]) -> CellTable:
    """The table with what a file of answers states of its tests, {key: text and place}, in its head."""
    header = dict(table.header)
    for key, (text, place) in stated.items():
        if key == "specimen" and key in header and header[key].text.casefold() not in known_specimens():
            header["label specimen"] = header.pop(key)
        elif key in header and header[key].text != text:
            raise HistoryError(f"{place}: {key} is '{quoted(text)}', and {header[key].location} says another one")
    return replace(table, header={**header, **{key: SourceText(*one) for key, one in stated.items()}})


def with_entries_of_comments(table: CellTable, names_line: int, known: Terms) -> CellTable:
    """The table with the entries of comments between its first row and its names.

    A condition in a comment below the names is refused, for it must not go unread; remarks may stand anywhere. What a
    remark or the title of a figure, `# Fig. 4: 650 °C`, states is a weak source.
    """
    header, sources, remarks = dict(table.header), list(table.sources), list[SourceText]()
    for line, key, entry in table.comments:
        if not key:
            remarks += [entry] * (line < names_line)
            continue
        if line > names_line and known.is_condition(key):
            raise HistoryError(f"{entry.location}: '{key}' stands below the names of the columns; move it above them")
        if line < names_line and header.setdefault(key, entry) is not entry:
            raise HistoryError(f"{entry.location}: '{quoted(key, 60)}' was already given; keep one of them")
    titles = [key for key in header if _OF_FIGURE.match(key) and not known.is_condition(key)]
    for title in (replace(entry, text=f"{key}: {entry.text}") for key, entry in ((k, header.pop(k)) for k in titles)):
        header[f"label line {title.location.rpartition(':')[2]}"] = title
        sources += conditions_in_text(title.text.partition(": ")[2], title.location, known)
    stated = {(split_unit(known.condition(key), known.conditions.kinds) or ("",))[0] for key in header}
    stated |= {known.quantity(cell) or "" for row in table.rows[:_MOST_ROWS] for cell in row.cells if cell}
    for remark in remarks:
        found = [one for one in conditions_in_text(remark.text, remark.location, known) if one.key not in stated]
        sources += found
        if found or end_said_by(remark.text) or invalidity_said_by(remark.text):
            header[f"label line {remark.location.rpartition(':')[2]}"] = remark
    return replace(table, header=header, sources=tuple(sources))


_OF_FIGURE = re.compile(
    r"(?:fig|figure|abb|bild|curve|kurve|plot|graph|test|series|data ?set|title|titel)\b", re.IGNORECASE
)
"""Beginning of a key that is a title."""


def _is_of_head(row: TableRow, times: Sequence[int], table: CellTable, known: Terms) -> bool:
    """Whether a row below the names is one of units, names, conditions or notes, and no frame."""
    filled = [cell for cell in row.cells if cell]
    at_times = [row.cells[k] for k in times if k < len(row.cells) and row.cells[k]]
    if any(is_number(cell, table.dialect) or is_clock_time(cell) or _DIGITS.fullmatch(cell) for cell in at_times):
        return False  # of 1'25 as well: a frame whose numbers cannot be read
    if all(map(unit_suffix, filled)) and any(cell != "1" for cell in filled):
        return True
    if any(is_number(cell, table.dialect) for cell in filled):
        return known.is_condition(filled[0].rstrip(": "))
    lost = ("nan", "inf", "-inf", "null", "none")
    return not all(map(is_missing, filled)) and not any(c.casefold() in lost or c.startswith("#") for c in at_times)


def _holds_units(row: TableRow, names: TableRow) -> bool:
    """Whether a row holds the units of the columns; a name that has one already needs none."""
    filled, named = [cell for cell in row.cells if cell], sum(map(bool, names.cells))
    if not all(map(unit_suffix, filled)) or all(cell == "1" for cell in filled):
        return False
    return len(filled) >= 0.5 * named and (len(filled) > 1 or named == 1)


def _fill_names(cells: list[str], below: Sequence[TableRow], first: Sequence[str]) -> None:
    """Give columns below a name for several, `Strain (%)` above the names of tests, that name."""
    for k in range(1, min(len(first), max((len(row.cells) for row in below), default=0))):
        if any(k < len(row.cells) and row.cells[k] for row in below):
            cells.extend([""] * (k + 1 - len(cells)))
            cells[k] = cells[k] or cells[k - 1]


# ---- what the rows of a head say -----------------------------------------------------------------------------------


@dataclass
class HeadOfTest:
    """What a head says of one test: its entries, weaker sources such as titles, and what was assumed."""

    table: CellTable
    known: Terms
    entries: dict[str, SourceText] = field(default_factory=dict)
    sources: list[SourceText] = field(default_factory=list)
    assumptions: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.sources += self.table.sources

    def put(self, key: str, text: str, row: TableRow) -> None:
        """Add an entry under creepkit's name of its key; HistoryError where it is there already."""
        written, place = key.rstrip(": "), self.table.location(row.line)
        key = self.known.condition(written)
        if key in self.entries and key.startswith("label line "):
            text = f"{self.entries[key].text}; {text}"
        elif key in self.entries and self.entries[key].text != text:
            raise HistoryError(f"{place}: '{quoted(written, 60)}' was already given; keep one of them")
        self.entries[key] = SourceText(text, place, self.table.dialect.decimal, written)

    def add_title(self, text: str, row: TableRow) -> None:
        """Keep a title; what it states is a weak source, but for `key: value`."""
        key, colon, value = (part.strip() for part in text.partition(":"))
        if colon and value and self.known.is_condition(key):
            self.put(key, value, row)
        else:
            self.put(f"label line {row.line}", text, row)
            self.sources += conditions_in_text(text, self.table.location(row.line), self.known)

    def read(self, row: TableRow) -> None:
        """Add a row of the only test: keys, each with its value and perhaps a unit behind it, or a title."""
        place, cells, known = self.table.location(row.line), [cell for cell in row.cells if cell], self.known
        if self.table.dialect.delimiter == " ":
            cells = [" ".join(cells)]
        is_text = not any(
            is_number(cell, self.table.dialect) or known.is_condition(cell.rstrip(": ")) for cell in cells
        )
        if self.table.dialect.delimiter == "," and is_text and any(conditions_in_text(c, "", known) for c in cells):
            cells = [", ".join(cells)]  # a title with commas
        while len(cells) > 1 and cells[0] == cells[1] and not known.is_condition(cells[0].rstrip(": ")):
            cells = cells[1:]  # a title in merged cells
        while len(cells) > 2 and cells[0].endswith(":") and cells[1].endswith(":"):
            cells = cells[1:]  # "Data header:", a title of a line of keys
        key, colon, value = (part.strip() for part in "".join(cells[:1]).partition(":"))
        is_program = known.condition(key).endswith(("_steps", "_program"))  # whose pairs a delimiter may have parted
        if colon and known.is_condition(key) and (len(cells) == 1 or is_program):
            cells = [key, "; ".join([value, *cells[1:]])]
        while cells:
            key, *cells = cells
            plain = key.rstrip(": ")
            if re.fullmatch(r"\[[^\[\]]*\]|<[^<>]*>", key) and not cells:
                continue  # of a section
            if is_number(key, self.table.dialect):
                what = f"the number {quoted(key)} stands above the names of the columns and has no key before it"
                raise HistoryError(f"{place}: {what}; name every column of the table, or the condition")
            if "=" in key and conditions_in_text(key, place, known):
                self.add_title(key, row)
            elif measured := conditions_of_head(key, known):
                for quantity, text in measured:
                    self.put(quantity, text, row)
            elif cells:
                value, *cells = cells
                is_label = not (known.is_condition(plain) or known.misspelt(plain))  # nor nearly a condition
                if cells and is_number(value, self.table.dialect) and unit_suffix(cells[0]):
                    with_value = is_label or known.condition(plain).startswith("modulus_at ")
                    unit, *cells = cells
                    key, value = (key, f"{value} {unit}") if with_value else (_with_unit(key, unit, place), value)
                self.put(f"label {plain}" if is_label else key, value, row)
            elif known.is_condition(key):
                raise HistoryError(f"{place}: '{quoted(key)}' stands above the names of the columns without a value")
            else:
                self.add_title(key, row)


def named_values(rows: Sequence[TableRow], table: CellTable, known: Terms) -> list[TableRow]:
    """The rows of a head, those of numbers below names, `Width (mm);L0 (mm)` above `6;40`, as pairs of both."""
    found = list[TableRow]()
    for row in rows:
        above = found[-1].cells if found and row.line - found[-1].line == 1 else ()
        numbers = [k for k, cell in enumerate(row.cells) if cell and is_number(cell, table.dialect)]
        named = [k for k, cell in enumerate(row.cells) if cell and above[k : k + 1] and above[k]]
        is_pair = any(known.is_condition(cell.rstrip(": ")) for cell in row.cells if cell)
        is_named = all(k in named or k == 0 for k in numbers) and not any(
            is_number(c, table.dialect) for c in above if c
        )
        of_test = [k for k in numbers if k in named and known.is_condition(above[k])]
        if is_named and not is_pair and (of_test or len({*numbers} & {*named}) > 1):
            found[-1:] = [TableRow(row.line, [above[k], row.cells[k]]) for k in named]
        else:
            found.append(row)
    return found


def _with_unit(key: str, unit: str, place: str) -> str:
    """A key with the unit that stands behind its value; HistoryError where the key has another one."""
    name, stated = split_written_name(key.rstrip(": "))
    if is_symbol(key, stated) and unit_suffix(unit) not in TEMPERATURE.units:
        return f"{name} ({unit})"
    if stated and unit_suffix(stated) != unit_suffix(unit):
        what = f"'{quoted(key, 60)}' has the unit '{quoted(unit, 20)}' behind its value"
        raise HistoryError(f"{place}: {what}; keep one of the two units")
    return key if stated else f"{key.rstrip(': ')} ({unit})"


def heads_of_tests(
    headed: HeadedTable, tests: Sequence[Collection[int]], key_columns: Collection[int]
) -> list[HeadOfTest]:
    """What the rows of a head say of each test.

    tests : positions of the columns of each. key_columns : positions before those of the first test, in which keys
    stand. A row holds a key and one value a test, pairs of key and value, values with units, or names of tests.
    """
    table, known = headed.table, headed.known
    results = [HeadOfTest(table, known) for _ in tests]
    own = [sorted(set(columns) - set(key_columns)) for columns in tests]
    last = max(max(columns) for columns in own)
    for row in headed.rows:
        filled = {k: cell for k, cell in enumerate(row.cells) if cell}
        margin = [k for k, cell in filled.items() if k > last + 1 and not is_number(cell, table.dialect)]
        if margin and len(margin) < len(filled):
            text = "; ".join(filled.pop(k) for k in margin)
            for result in results:
                result.put(f"label line {row.line}", text, row)
        first = filled[min(filled)]
        key = first if known.is_condition(first.rstrip(": ")) else ""
        if (
            words_of(key) == "specimen"
            and len(filled) > 2
            and not {*map(str.casefold, filled.values())} & {*known.outputs}
        ):
            key = "name"
        measured = {} if key else {k: conditions_of_head(cell, known) for k, cell in filled.items()}
        is_measured = bool(measured) and all(measured.values())
        if len(set(filled.values())) == 1 and not key and not (is_measured and len(tests) == 1):
            for result in results:
                result.add_title(first, row)
            continue
        for result, columns in zip(results, own, strict=True):
            if not is_measured:
                _add_row(result, columns, row, filled, key, key_columns, is_only=len(tests) == 1)
            elif (k := _covering(filled, columns)) is not None:
                for quantity, text in measured[k]:
                    result.put(quantity, text, row)
                if k < columns[0] and k not in key_columns:
                    what = f"{filled[k]} in line {row.line} holds for the columns right of it"
                    result.assumptions.append(what)
    return results


def _covering(filled: Collection[int], columns: Sequence[int]) -> int | None:
    """The cell that stands above columns: within them, else the last one left of them."""
    within = [k for k in filled if columns[0] <= k <= columns[-1]]
    return within[0] if within else max((k for k in filled if k < columns[0]), default=None)


def _add_row(
    result: HeadOfTest,
    columns: Sequence[int],
    row: TableRow,
    filled: Mapping[int, str],
    key: str,
    key_columns: Collection[int],
    *,
    is_only: bool,
) -> None:
    """Add what a row of a key and values, of pairs of key and value, or of names says of one test."""
    first, known, dialect, place = min(filled), result.known, result.table.dialect, result.table.location(row.line)
    others = [k for k in filled if k != first]
    values = [filled[k] for k in range(columns[0], columns[-1] + 1) if k in filled]
    if len(values) > 1 and known.is_condition(values[0].rstrip(": ")):
        result.put(values[0], values[1], row)
    elif key:
        one_for_all = len(others) == 1 and not is_only
        k = others[0] if one_for_all else _covering(others, columns)
        if k is not None:
            result.put(key, filled[k], row)
            result.sources += conditions_in_text(filled[k], place, known) if known.condition(key) == "name" else []
            if one_for_all:
                result.assumptions.append(f"{key} in line {row.line} holds for all tests")
            elif k < columns[0]:
                result.assumptions.append(f"{key} in line {row.line} holds from '{quoted(filled[k], 20)}' on")
    elif values and is_number(values[0], dialect):
        what = f"'{quoted(values[0])}' stands above the names of the columns, and '{quoted(filled[first])}' is no known"
        raise HistoryError(f"{place}: {what} condition; write one such as 'Stress (MPa)' before it")
    elif values:
        is_label = first in key_columns and len(set(filled.values())) < len(filled)
        result.put(f"label {filled[first].rstrip(': ')}" if is_label else "name", values[0], row)
        result.sources += conditions_in_text(values[0], place, known)
