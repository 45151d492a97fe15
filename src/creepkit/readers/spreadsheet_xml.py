"""The XML of a file .xlsx, element by element, before openpyxl reads it: what its sheets, texts and formats say.

Each check is made on what an XML parser finds, in one pass, so that its time is linear in the bytes of the part.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any
from xml.parsers.expat import ExpatError, ParserCreate

from creepkit.errors import HistoryError, quoted
from creepkit.files.limits import how_to_raise, raised

MAXIMUM_MERGED, MAXIMUM_ROW, MAXIMUM_COLUMN, MAXIMUM_GAP = 10_000, 1_048_576, 16_384, 20_000
"""Merged cells of a sheet, last row and column that the format has, and empty rows between two of them."""


MAXIMUM_EMPTY_ROWS, MAXIMUM_CELLS = 100_000, 5_000_000
"""Empty rows above the last row of a sheet, and its cells, with the empty ones in its rows."""


MAXIMUM_CELL_TEXT, MAXIMUM_TEXT = 100_000, 50_000_000
"""Characters of a cell, of which the format has 32,767, and of all cells of a sheet, where each shared text counts as
often as cells refer to it."""


MAXIMUM_RUNS = 100_000
"""Elements of the texts of a sheet, or of those that it shares, beyond the three of a text that is written alike."""


MAXIMUM_UNUSED_TEXTS = 100_000
"""Shared texts beyond the number of the cells that refer to one."""


MAXIMUM_FORMAT, MAXIMUM_BRACKETS = 1000, 20
"""Characters of a number format, of which the format has 255, and those of them that are `[`."""


MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_DATA, _ROW, _CELL, _SI, _V, _F = (f"{MAIN} {name}" for name in ("sheetData", "row", "c", "si", "v", "f"))
_REFERENCE = re.compile(r"([A-Z]{1,3})([1-9][0-9]{0,6})")
_WAY_OUT = "open the file in a spreadsheet program and save it anew"


@dataclass(frozen=True)
class SheetRows:
    """What the XML of a sheet says of its rows.

    references : number of cells that refer to shared texts. hidden : numbers of rows. hidden_columns : whether there
    are some. uncomputed : row and column of the first formula without a value, if any. merged : row, first and last
    column of each range of merged cells. content : the least worksheet that holds its rows, b"" where there are none.
    """

    references: int = 0
    hidden: tuple[int, ...] = ()
    hidden_columns: bool = False
    uncomputed: tuple[int, int] | None = None
    merged: tuple[tuple[int, int, int], ...] = ()
    content: bytes = b""

    def remarks(self, sheet: str) -> tuple[str, ...]:
        """What was hidden and read nevertheless, for the label "assumed"."""
        shown = " ".join(map(str, self.hidden[:5])) + (" ..." if len(self.hidden) > 5 else "")
        rows = [f"hidden rows of sheet '{sheet}' read too: {shown}"] if self.hidden else []
        return (*rows, *([f"hidden columns of sheet '{sheet}' read too"] if self.hidden_columns else []))


def text_lengths(place: str, part: bytes) -> list[int]:
    """The number of characters of each shared text; HistoryError for one that no cell can hold."""
    lengths, elements = list[int](), count(1)

    def start(name: str, _: Mapping[str, str]) -> None:
        if name == _SI:
            lengths.append(0)
        _check_runs(place, next(elements), len(lengths))

    def text(characters: str) -> None:
        if lengths:
            lengths[-1] += len(characters)
            _check_cell_text(place, lengths[-1])

    parser = _parser(start)
    parser.CharacterDataHandler = text
    _parse(parser, place, part)
    return lengths


def check_formats(place: str, part: bytes) -> None:
    """HistoryError for a number format that is far longer than a spreadsheet program writes one."""

    def start(name: str, entries: Mapping[str, str]) -> None:
        code = entries.get("formatCode", "") if name.endswith(" numFmt") else ""
        if len(code) > MAXIMUM_FORMAT or code.count("[") > MAXIMUM_BRACKETS:
            raise HistoryError(
                f"{place}: the number format '{quoted(code, 20)}' has {len(code)} characters and {code.count('[')} "
                f"brackets; allowed are {MAXIMUM_FORMAT} and {MAXIMUM_BRACKETS}; give its cells another format"
            )

    _parse(_parser(start), place, part)


def check_sheet(place: str, part: bytes, shared: Sequence[int] = ()) -> SheetRows:
    """What the XML of a sheet says of its rows; HistoryError where they or its numbers cannot be what was entered.

    shared : number of characters of each shared text.
    """
    sheet = _Sheet(place, shared)
    _parse(sheet.parser, place, part)
    if not sheet.row:
        return SheetRows()
    root = part[sheet.root_from : sheet.root_to]  # with what is declared in its tag
    name = re.match(rb"<([^\s/>]+)", root)
    end = b"</" + (name[1] if name else b"") + b">"
    dimension = f'<dimension xmlns="{MAIN}" ref="A1"/>'.encode()
    content = root + dimension + part[sheet.data_from : part.index(b">", sheet.data_to) + 1] + end
    merged = tuple(sheet.merged)
    return SheetRows(sheet.references, tuple(sheet.hidden), sheet.hidden_columns, sheet.uncomputed, merged, content)


def _parser(start: Callable[[str, Mapping[str, str]], None]) -> Any:
    parser = ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    parser.StartElementHandler = start
    return parser


def _parse(parser: Any, place: str, part: bytes) -> None:
    try:
        parser.Parse(part, True)
    except ExpatError as error:
        raise HistoryError(f"{place}: its XML is damaged in line {error.lineno}; {_WAY_OUT}") from None


def _check_cell_text(place: str, length: int) -> None:
    if length > MAXIMUM_CELL_TEXT:
        raise HistoryError(
            f"{place}: a cell holds more than {MAXIMUM_CELL_TEXT} characters, which no cell of a test does; remove it"
        )


def _check_runs(place: str, elements: int, texts: int) -> None:
    if elements > 3 * texts + MAXIMUM_RUNS:
        raise HistoryError(f"{place}: texts in more than {MAXIMUM_RUNS} parts of their own style; write them in one")


def _column_number(letters: str) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number


class _Sheet:
    """A sheet while it is parsed; `depth` counts the elements that are open, and so do those that name one."""

    def __init__(self, place: str, shared: Sequence[int]) -> None:
        self.place, self.shared = place, shared
        self.hidden, self.hidden_columns = list[int](), False
        self.uncomputed: tuple[int, int] | None = None
        self.merged = list[tuple[int, int, int]]()
        self.root_from, self.root_to, self.data_from, self.data_to = -1, -1, -1, -1
        self.depth = self.row_depth = self.row = self.column = self.ranges = 0
        self.empty, self.cells, self.characters = 0, 0, 0
        self.kind, self.text, self.has_formula, self.values, self.length = "", "", False, 0, 0
        self.in_value, self.runs, self.references = False, 0, 0
        self.parser = _parser(self.start)
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.add_text

    def start(self, name: str, entries: Mapping[str, str]) -> None:
        self.depth += 1
        if self.row_depth:
            self._start_in_row(name, entries)
        elif name == _ROW:
            if self.data_from < 0 or self.data_to >= 0:
                raise HistoryError(f"{self.place}: a row stands outside of the data; {_WAY_OUT}")
            self._start_row(entries)
        elif self.depth == 1:
            self.root_from = self.parser.CurrentByteIndex
        else:
            self._start_beside(name, entries)

    def _start_beside(self, name: str, entries: Mapping[str, str]) -> None:
        if self.root_to < 0:
            self.root_to = self.parser.CurrentByteIndex
        if name == _DATA:
            if self.data_from >= 0 or self.depth != 2:
                raise HistoryError(f"{self.place}: has its rows in several parts; {_WAY_OUT}")
            self.data_from = self.parser.CurrentByteIndex
        elif name == f"{MAIN} col":
            self.hidden_columns |= entries.get("hidden") in ("1", "true")
        elif name == f"{MAIN} mergeCell":
            self.ranges += 1
            first, _, last = entries.get("ref", "").partition(":")
            a, b = _REFERENCE.fullmatch(first), _REFERENCE.fullmatch(last)
            if a and b:
                self.merged.append((int(a[2]), _column_number(a[1]), _column_number(b[1])))
            if self.ranges > MAXIMUM_MERGED:
                raise HistoryError(
                    f"{self.place}: has more than {MAXIMUM_MERGED} merged cells; save its columns as CSV"
                )

    def _start_row(self, entries: Mapping[str, str]) -> None:
        text, before = entries.get("r", str(self.row + 1)), self.row
        if not re.fullmatch(r"[1-9][0-9]{0,6}", text) or not before < int(text) <= MAXIMUM_ROW:
            raise HistoryError(
                f"{self.place}: a row is numbered {quoted(ascii(text)[1:-1], 20)} behind row {before}; rows must rise, "
                f"up to {MAXIMUM_ROW}; {_WAY_OUT}"
            )
        self.row, self.column, self.row_depth = int(text), 0, self.depth
        gap = self.row - before - 1
        self.empty += gap
        if gap >= MAXIMUM_GAP:
            raise HistoryError(
                f"{self.place}, row {text}: more than {MAXIMUM_GAP} empty rows stand above it; remove them or it"
            )
        if self.empty > (most := raised(MAXIMUM_EMPTY_ROWS)):
            raise HistoryError(
                f"{self.place}, row {text}: more than {most} empty rows stand in the sheet; remove them, or "
                f"{how_to_raise(2 * most, most)}"
            )
        if entries.get("hidden") in ("1", "true"):
            self.hidden.append(self.row)

    def _start_in_row(self, name: str, entries: Mapping[str, str]) -> None:
        if self.depth == self.row_depth + 1:
            self._start_cell(entries)
        elif name == _V:
            self.in_value, self.values = True, self.values + 1
            if self.values > 1 or self.depth != self.row_depth + 2:
                self._refuse("has several values")
        elif name == _F:
            self.has_formula = True
        elif name in (_ROW, _CELL) or self.in_value:
            self._refuse("holds a row or other parts in place of a value")
        else:
            self.runs += 1
            _check_runs(self.place, self.runs, self.cells)

    def _start_cell(self, entries: Mapping[str, str]) -> None:
        reference, before = entries.get("r"), self.column
        if reference is None:
            self.column = before + 1
        else:
            match = _REFERENCE.fullmatch(reference)
            self.column = _column_number(match[1]) if match else 0
            if match is None or int(match[2]) != self.row or not before < self.column <= MAXIMUM_COLUMN:
                raise HistoryError(
                    f"{self.place}, row {self.row}: a cell is named '{quoted(ascii(reference)[1:-1], 20)}', which is "
                    f"no cell of the row, or stands there twice or before others; {_WAY_OUT}"
                )
        self.kind, self.text, self.has_formula, self.values, self.length = entries.get("t", "n"), "", False, 0, 0
        self.cells += self.column - before
        if self.cells > (most := raised(MAXIMUM_CELLS)):
            raise HistoryError(
                f"{self.place}: has more than {most} cells; save its columns as CSV, or {how_to_raise(2 * most, most)}"
            )

    def add_text(self, characters: str) -> None:
        if self.row_depth and self.depth > self.row_depth:
            self.length += len(characters)
            _check_cell_text(self.place, self.length)
            if self.in_value:
                self.text += characters

    def end(self, name: str) -> None:
        if self.row_depth:
            if self.depth == self.row_depth:
                self.row_depth, self.empty = 0, self.empty + (self.column == 0)
            elif self.depth == self.row_depth + 1:
                self._end_cell()
            elif name == _V:
                self.in_value = False
        elif name == _DATA:
            self.data_to = self.parser.CurrentByteIndex
        self.depth -= 1

    def _end_cell(self) -> None:
        self.characters += self._length_of_shared() if self.kind == "s" else self.length
        if self.characters > (most := raised(MAXIMUM_TEXT)):
            raise HistoryError(
                f"{self.place}, row {self.row}: the cells down to it hold more than {most} characters; shorten their "
                f"texts, or {how_to_raise(2 * most, most)}"
            )
        if self.uncomputed is None and self.has_formula and not self.text.strip():
            self.uncomputed = self.row, self.column
        if self.kind != "str" and ("_" in self.text or not self.text.isascii()):
            # only Python takes for a number 1_2, or digits of another script
            self._refuse(f"the number {quoted(self.text, 40)!a} is not written as one; enter it anew in plain digits")

    def _refuse(self, problem: str) -> None:
        letters, number = "", self.column
        while number:
            number, digit = divmod(number - 1, 26)
            letters = chr(ord("A") + digit) + letters
        raise HistoryError(f"{self.place}, cell {letters}{self.row}: {problem}")

    def _length_of_shared(self) -> int:
        text = self.text.strip()
        number = int(text) if text.isascii() and text.isdigit() and len(text) < 10 else -1
        if self.values and not 0 <= number < len(self.shared):
            self._refuse(
                f"refers to text {quoted(ascii(text), 20)} of {len(self.shared)} that the file shares; {_WAY_OUT}"
            )
        self.references += self.values
        return self.shared[number] if self.values else 0
