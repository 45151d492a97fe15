"""The head of a table: which row names the columns, which hold their units, and what the others say of the tests.

Rows of a head may stand in any order, above the names of the columns or between them and the first frame: names of
tests, units, keys with one value a test, values with units such as `140 MPa` above a pair of columns, titles, notes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_missing, is_number
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.column_names import split_written_name, unit_suffix
from creepkit.readers.condition_texts import conditions_in_text, conditions_of_head
from creepkit.readers.table import CellTable, SourceText, TableRow
from creepkit.readers.vocabulary import Terms

_MAXIMUM_HEAD_ROWS, MAXIMUM_ROWS_BELOW = 60, 6
"""Rows among which the names of the columns are looked for, and rows of a head below them."""


@dataclass(frozen=True)
class Head:
    """The head of a grid.

    names : of the columns, with their units. written : the same without units of a row of their own. line : that the
    names stand in. rows : the others, above the names and below them. body : the first row of frames.
    """

    names: Sequence[str]
    written: Sequence[str]
    line: int
    rows: tuple[TableRow, ...]
    body: int


@dataclass
class HeadOfTest:
    """What a head says of one test: its entries, weaker sources such as titles, and what was assumed."""

    entries: dict[str, SourceText] = field(default_factory=dict)
    sources: list[SourceText] = field(default_factory=list)
    assumptions: tuple[str, ...] = ()


_NOT_TESTS = frozenset(
    (
        *("plastic", "elastic", "total", "creep", "true", "engineering", "logarithmic", "inelastic", "thermal"),
        *("primary", "axial", "diametral", "lateral", "hoop", "radial", "transverse", "local", "global", "mean"),
        *("average", "max", "min", "maximum", "minimum", "rate", "sd", "corrected", "raw", "left", "right", "front"),
        *("clock", "start", "end", "cycle", "date", "loading", "hold", "ramp", "step", "rupture", "test", "no", "of"),
        *("back", "lvdt", "extensometer", "channel", "sensor", "upper", "lower", "top", "bottom"),
    )
)
"""Words beside a quantity that tell another quantity or another sensor, not another test."""


def test_and_column(cell: str, known: Terms) -> tuple[str, str]:
    """Name of the test and of the column in `A1 strain (%)` or `Strain A1 (%)`; ("", cell) where there are not both."""
    if known.quantity(cell) or known.is_condition(cell):
        return "", cell
    written, unit = split_written_name(cell)
    words = written.replace(":", " ").replace("_", " ").split()
    for size in range(min(len(words) - 1, 3), 0, -1):
        for first, rest in ((words[:size], words[size:]), (words[-size:], words[:-size])):
            name, column = " ".join(rest).strip("-–, "), " ".join(first)
            if name and known.quantity(column) and not _NOT_TESTS.intersection(name.lower().split()):
                return name, f"{column} ({unit})" if unit else column
    return "", cell


def is_time(cell: str, known: Terms) -> bool:
    """Whether a name of a column is a time, perhaps that of a test, as in `Time A1 (h)`."""
    return known.quantity(test_and_column(cell, known)[1]) == "time"


def row_of_names(grid: CellTable, known: Terms) -> int:
    """The first row that names a time among texts alone; the first of all where there is none."""
    for k, row in enumerate(grid.rows[:_MAXIMUM_HEAD_ROWS]):
        cells = [cell for cell in row.cells if cell]
        if any(is_number(cell, grid.dialect) for cell in cells):
            continue
        if any(is_time(cell, known) for cell in cells) and (len(cells) > 1 or k == 0):
            return k
    return 0


def head_of(grid: CellTable, known: Terms) -> Head:
    """The head of a grid; HistoryError for rows of numbers that nothing names."""
    at = row_of_names(grid, known)
    rows = list(grid.rows[: at + MAXIMUM_ROWS_BELOW])
    names, above, below = rows[at], rows[:at], rows[at + 1 :]
    if is_frame(names, grid):
        raise HistoryError(
            f"{grid.location(names.line)}: the first row holds numbers, and none above it names the columns; write a "
            "row of names such as time_h,strain_pct above it (behind '#' it is one, too)"
        )
    times = [k for k, cell in enumerate(names.cells) if cell and is_time(cell, known)]
    count = next((k for k, row in enumerate(below) if not _belongs_to_head(row, times, grid, known)), len(below))
    others = [*above, *below[:count]]
    cells, units = list(names.cells), next((row for row in others if _holds_units(row, names, grid)), None)
    first = below[count].cells if count < len(below) else ()
    _fill_names(cells, [row for row in others if row is not units and row.line > names.line], first)
    written = list(cells)
    if units is not None:
        padded = [*units.cells, *[""] * (len(cells) - len(units.cells))]
        cells = [f"{c} ({u.strip('()[] ')})" if u and c else c for c, u in zip(cells, padded, strict=False)]
    return Head(cells, written, names.line, tuple(row for row in others if row is not units), at + 1 + count)


def is_frame(row: TableRow, grid: CellTable) -> bool:
    """Whether a row holds numbers or times alone, with marks of missing values."""
    cells = [cell for cell in row.cells if cell]
    numbers = [is_number(cell.rstrip("% "), grid.dialect) or is_clock_time(cell) for cell in cells]
    return any(numbers) and all(one or is_missing(cell) for one, cell in zip(numbers, cells, strict=True))


def _belongs_to_head(row: TableRow, times: Sequence[int], grid: CellTable, known: Terms) -> bool:
    """Whether a row below the names is one of units, names, conditions or notes, and no frame."""
    filled = [cell for cell in row.cells if cell]
    at_times = [row.cells[k] for k in times if k < len(row.cells) and row.cells[k]]
    if any(is_number(cell, grid.dialect) or is_clock_time(cell) for cell in at_times):
        return False
    if all(map(unit_suffix, filled)) and any(cell != "1" for cell in filled):
        return True
    if not any(is_number(cell, grid.dialect) for cell in filled):
        return not all(map(is_missing, filled)) and not any(map(_is_lost, at_times))
    return known.is_condition(filled[0].rstrip(": "))


def _is_lost(cell: str) -> bool:
    return cell.casefold() in ("nan", "inf", "-inf", "null", "none") or cell.startswith("#")


def _holds_units(row: TableRow, names: TableRow, grid: CellTable) -> bool:
    """Whether a row holds the units of the columns; a name that has one already needs none."""
    filled = [k for k, cell in enumerate(row.cells) if cell]
    named = [k for k, cell in enumerate(names.cells) if cell]
    if not all(unit_suffix(row.cells[k]) for k in filled) or all(row.cells[k] == "1" for k in filled):
        return False
    return len(filled) >= 0.5 * len(named) and (len(filled) > 1 or len(named) == 1)


def _fill_names(cells: list[str], below: Sequence[TableRow], first: Sequence[str]) -> None:
    """Give columns below a name for several, `Strain (%)` above the names of tests, that name."""
    for k in range(1, min(len(first), max((len(row.cells) for row in below), default=0))):
        if any(k < len(row.cells) and row.cells[k] for row in below):
            cells.extend([""] * (k + 1 - len(cells)))
            cells[k] = cells[k] or cells[k - 1]


def heads_of_tests(
    grid: CellTable, head: Sequence[TableRow], tests: Sequence[Sequence[int]], key_columns: set[int], known: Terms
) -> list[HeadOfTest]:
    """What the rows of a head say of each test.

    tests : positions of the columns of each. key_columns : positions before those of the first test, in which keys
    stand. A row holds a key and one value a test, pairs of key and value, values with units, or names of tests.
    """
    results = [HeadOfTest() for _ in tests]
    own = [sorted(set(columns) - key_columns) for columns in tests]
    last = max(max(columns) for columns in own)
    for row in head:
        place = grid.location(row.line)
        filled = {k: cell for k, cell in enumerate(row.cells) if cell}
        margin = {k: cell for k, cell in filled.items() if k > last + 1 and not is_number(cell, grid.dialect)}
        if margin and len(margin) < len(filled):
            filled = {k: cell for k, cell in filled.items() if k not in margin}
            for result in results:
                put_entry(result.entries, f"label line {row.line}", "; ".join(margin.values()), place, grid, known)
        first = min(filled)
        key = filled[first] if known.is_condition(filled[first].rstrip(": ")) else ""
        if (
            len(set(filled.values())) == 1
            and not key
            and not (len(tests) == 1 and conditions_of_head(filled[first], known))
        ):
            for result in results:
                _add_title(result, filled[first], row, grid, known)
            continue
        measured = {k: conditions_of_head(cell, known) for k, cell in filled.items() if not key}
        if measured and all(measured.values()):
            for result, columns in zip(results, own, strict=True):
                k = _covering(measured, columns)
                for quantity, text in () if k is None else measured[k]:
                    put_entry(result.entries, quantity, text, place, grid, known)
                if k is not None and k < columns[0] and k not in key_columns:
                    result.assumptions += (f"{filled[k]} in line {row.line} holds for the columns right of it",)
            continue
        _add_row(results, own, row, filled, key, key_columns, grid, known)
    return results


def _covering(filled: Mapping[int, object], columns: Sequence[int]) -> int | None:
    """The cell that stands above columns: within them, else the last one left of them."""
    within = [k for k in filled if columns[0] <= k <= columns[-1]]
    return within[0] if within else max((k for k in filled if k < columns[0]), default=None)


def _add_row(
    results: Sequence[HeadOfTest],
    own: Sequence[Sequence[int]],
    row: TableRow,
    filled: Mapping[int, str],
    key: str,
    key_columns: set[int],
    grid: CellTable,
    known: Terms,
) -> None:
    """Add a row of a key and values, of pairs of key and value, or of names."""
    place, first = grid.location(row.line), min(filled)
    values_at = {k: cell for k, cell in filled.items() if k != first} if key else dict(filled)
    for result, columns in zip(results, own, strict=True):
        values = [(k, filled[k]) for k in range(columns[0], columns[-1] + 1) if k in filled]
        if len(values) > 1 and known.is_condition(values[0][1].rstrip(": ")):
            put_entry(result.entries, values[0][1], values[1][1], place, grid, known)
        elif key:
            one_for_all = len(values_at) == 1 and len(results) > 1
            k = next(iter(values_at)) if one_for_all else _covering(values_at, columns)
            if k is None:
                continue
            put_entry(result.entries, key, values_at[k], place, grid, known)
            if one_for_all:
                result.assumptions += (f"{key} in line {row.line} holds for all tests",)
            elif k < columns[0]:
                result.assumptions += (f"{key} in line {row.line} holds from '{quoted(values_at[k], 20)}' on",)
        elif values and is_number(values[0][1], grid.dialect):
            raise HistoryError(
                f"{place}: '{quoted(values[0][1])}' stands above the names of the columns, and "
                f"'{quoted(filled[first])}' is no condition that is known; write one such as 'Stress (MPa)' before it"
            )
        elif values:
            is_label = first in key_columns and len(set(filled.values())) < len(filled)
            written = f"label {filled[first].rstrip(': ')}" if is_label else "name"
            put_entry(result.entries, written, values[0][1], place, grid, known)
            result.sources += conditions_in_text(values[0][1], place, known)


def _add_title(result: HeadOfTest, text: str, row: TableRow, grid: CellTable, known: Terms) -> None:
    """Keep a title; what it states is a weak source, but for `key: value`."""
    place = grid.location(row.line)
    key, colon, value = (part.strip() for part in text.partition(":"))
    if colon and value and known.is_condition(key):
        put_entry(result.entries, key, value, place, grid, known)
        return
    put_entry(result.entries, f"label line {row.line}", text, place, grid, known)
    result.sources += conditions_in_text(text, place, known)


def head_of_one_test(grid: CellTable, head: Sequence[TableRow], known: Terms) -> HeadOfTest:
    """What rows of a head say of the only test: keys, each with its value and perhaps a unit behind it; titles."""
    result = HeadOfTest()
    for row in head:
        place, cells = grid.location(row.line), [cell for cell in row.cells if cell]
        if grid.dialect.delimiter == " ":
            cells = [" ".join(cells)]
        if len(cells) == 1 and ":" in cells[0]:
            parts = [part.strip() for part in cells[0].split(":", 1)]
            cells = parts if known.is_condition(parts[0]) else cells
        while cells:
            key, *rest = cells
            if is_number(key, grid.dialect):
                raise HistoryError(
                    f"{place}: the number {quoted(key)} stands above the names of the columns, and is that of a column "
                    "without a name, or has no key before it; name every column of the table, or the condition"
                )
            if "=" in key and conditions_in_text(key, place, known):
                _add_title(result, key, row, grid, known)
                cells = rest
                continue
            measured = conditions_of_head(key, known)
            for quantity, text in measured:
                put_entry(result.entries, quantity, text, place, grid, known)
            if measured:
                cells = rest
                continue
            if not rest:
                if known.is_condition(key):
                    raise HistoryError(
                        f"{place}: '{quoted(key)}' stands above the names of the columns without a value"
                    )
                _add_title(result, key, row, grid, known)
                break
            value, cells = rest[0], rest[1:]
            if cells and is_number(value, grid.dialect) and unit_suffix(cells[0]):
                key, cells = _with_unit(key, cells[0], place), cells[1:]
            put_entry(result.entries, _key_or_label(key, known), value, place, grid, known)
    return result


def _key_or_label(key: str, known: Terms) -> str:
    """A key of a head; one that is no condition, nor nearly one, is that of a label."""
    plain = key.rstrip(": ")
    if known.is_condition(plain) or known.misspelt(plain):
        return key
    return f"label {plain}"


def _with_unit(key: str, unit: str, place: str) -> str:
    """A key with the unit that stands behind its value; HistoryError where the key has another one."""
    _, stated = split_written_name(key.rstrip(": "))
    if stated and unit_suffix(stated) != unit_suffix(unit):
        raise HistoryError(
            f"{place}: '{quoted(key, 60)}' has the unit '{quoted(unit, 20)}' behind its value; keep one of the two "
            "units"
        )
    return key if stated else f"{key.rstrip(': ')} ({unit})"


def put_entry(entries: dict[str, SourceText], key: str, text: str, place: str, grid: CellTable, known: Terms) -> None:
    """Add an entry under creepkit's name of its key; HistoryError where it is there already."""
    written = key.rstrip(": ")
    key = known.condition(written)
    if key in entries and key.startswith("label line "):
        entries[key] = SourceText(f"{entries[key].text}; {text}", place, grid.dialect.decimal, written)
        return
    if key in entries:
        raise HistoryError(f"{place}: '{quoted(written, 60)}' was already given; keep one of them")
    entries[key] = SourceText(text, place, grid.dialect.decimal, written)
