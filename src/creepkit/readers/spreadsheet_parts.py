"""The parts of a file .xlsx, checked before openpyxl reads them: their size unpacked, entities, counts, rows, numbers.

A few kB of ZIP can unpack to gigabytes, and openpyxl takes a number with underscores, or in other digits, for a number.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.limits import how_to_raise, raised

MAXIMUM_UNPACKED_BYTES = 100_000_000
"""Of all parts of a file together."""


MAXIMUM_EXPANSION, _ALWAYS_ALLOWED_BYTES = 100, 10_000_000
"""Bytes unpacked a byte of the file, from so many bytes on; sheets of numbers have 5 to 30."""


MAXIMUM_ELEMENTS: Mapping[str, int] = {"sst": 1_000_000, "styleSheet": 200_000, "workbook": 50_000} | dict.fromkeys(
    ("Relationships", "Types", "Properties"), 20_000
)
"""Elements of parts that are read as a whole, by the name of their root."""


MAXIMUM_MERGED, MAXIMUM_ROW, MAXIMUM_EMPTY_ROWS, MAXIMUM_CELL_BYTES = 10_000, 1_048_576, 20_000, 1_000_000
"""Merged cells of a sheet, last row that the format has, empty rows between two of them, and bytes of one text."""


_ROW = re.compile(rb"<(?:\w+:)?row(?=[\s/>])([^<>]*)>")
_NUMBER_OF_ROW = re.compile(rb"""\sr\s*=\s*["']([^"']*)["']""")
_HIDDEN = re.compile(rb"""\shidden\s*=\s*["'](?:1|true)["']""")
_HIDDEN_COLUMNS = re.compile(rb"""<(?:\w+:)?col\s[^<>]*?hidden\s*=\s*["'](?:1|true)["']""")
_MERGED_CELL = re.compile(rb"<(?:\w+:)?mergeCell\s")
_ODD_VALUE = re.compile(rb"<(?:\w+:)?v(?:\s[^>]*)?>([^<]*[_\x80-\xff][^<]*)</")
_CELL = re.compile(rb"""<(?:\w+:)?c(?=[\s/>])([^<>]*)>""")
_TEXT = re.compile(rb"[^<]+")
_ENCODING = re.compile(rb"""^<\?xml[^>]*?encoding\s*=\s*["']([^"']*)["']""")


@dataclass(frozen=True)
class SheetRows:
    """What the XML of a sheet says of its rows. hidden : numbers of rows; hidden_columns : whether there are some."""

    hidden: tuple[int, ...]
    hidden_columns: bool

    def remarks(self, sheet: str) -> tuple[str, ...]:
        """What was hidden and read nevertheless, for the label "assumed"."""
        shown = " ".join(map(str, self.hidden[:5])) + (" ..." if len(self.hidden) > 5 else "")
        rows = [f"hidden rows of sheet '{sheet}' read too: {shown}"] if self.hidden else []
        return (*rows, *([f"hidden columns of sheet '{sheet}' read too"] if self.hidden_columns else []))


def checked_parts(path: Path, content: bytes) -> dict[str, bytes]:
    """{name: XML} of the sheets, once it is known that the file unpacks to a sensible size and defines no entities."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _check_size(path, sum(part.file_size for part in archive.infolist()), len(content))
            sheets = {}
            for name in archive.namelist():
                part = archive.read(name)
                if _is_xml(part):
                    root = _check_xml(path, part)
                    if root == "worksheet":
                        sheets[name] = part
            return sheets
    except HistoryError:
        raise
    except (zipfile.BadZipFile, zipfile.LargeZipFile, OSError, EOFError, RuntimeError, ValueError, NotImplementedError):
        raise HistoryError(f"{path}: is no spreadsheet in the format .xlsx; save it anew as .xlsx or CSV") from None
    except Exception as error:  # zlib.error and lzma.LZMAError have no common base
        raise HistoryError(f"{path}: its parts cannot be unpacked ({error}); save it anew as .xlsx") from None


def _check_size(path: Path, size: int, packed: int) -> None:
    is_bomb = size > _ALWAYS_ALLOWED_BYTES and size > MAXIMUM_EXPANSION * packed
    most = raised(MAXIMUM_UNPACKED_BYTES)
    if is_bomb:
        raise HistoryError(
            f"{path}: unpacks to {size / 1e6:.0f} MB, more than {MAXIMUM_EXPANSION} times its size, which no "
            "spreadsheet of tests does; save it as CSV"
        )
    if size > most:
        raise HistoryError(
            f"{path}: unpacks to {size / 1e6:.0f} MB, more than {most / 1e6:g} MB; save it as CSV, or "
            f"{how_to_raise(size, most)}"
        )


def _is_xml(part: bytes) -> bool:
    start = part[:200]
    return (
        start[:2] in (b"\xff\xfe", b"\xfe\xff") or start.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<"
    )


def _check_xml(path: Path, part: bytes) -> str:
    """The name of the root element of a part, once it is known that it is harmless to read."""
    encoding = _ENCODING.match(part.removeprefix(b"\xef\xbb\xbf"))
    if b"\0" in part or (encoding and encoding[1].upper() not in (b"UTF-8", b"US-ASCII", b"ASCII")):
        raise HistoryError(f"{path}: a part of it is not in UTF-8; save it anew as .xlsx")
    if b"<!DOCTYPE" in part or b"<!ENTITY" in part:
        raise HistoryError(f"{path}: a part of it defines XML entities; save it anew as .xlsx")
    root = _root(part)
    count = part.count(b"<") if root in MAXIMUM_ELEMENTS else 0
    if count > 2 * MAXIMUM_ELEMENTS.get(root, 0):  # most elements have an end
        raise HistoryError(
            f"{path}: its part '{root}' has {count} marks of elements, more than {2 * MAXIMUM_ELEMENTS[root]}; copy "
            "the cells to a new file"
        )
    if root in ("sst", "worksheet") and any(m.end() - m.start() > MAXIMUM_CELL_BYTES for m in _TEXT.finditer(part)):
        raise HistoryError(
            f"{path}: a cell holds more than {MAXIMUM_CELL_BYTES} characters, which no cell of a test does; remove it"
        )
    return root


def _root(part: bytes) -> str:
    """The name of the first element, without its prefix."""
    at = max(part.find(b"<"), 0)
    while part[at : at + 2] == b"<?" or part[at : at + 4] == b"<!--":
        end = part.find(b"?>" if part[at + 1 : at + 2] == b"?" else b"-->", at + 2)
        at = part.find(b"<", end) if end >= 0 else -1
        if at < 0:
            return ""
    name = re.match(rb"<(?:[\w.-]+:)?([\w.-]+)", part[at : at + 200])
    return name[1].decode("ascii", "replace") if name else ""


def check_sheet(place: str, part: bytes) -> SheetRows:
    """What the XML of a sheet says of its rows; HistoryError where they or its numbers cannot be what was entered."""
    merged = sum(1 for _ in _MERGED_CELL.finditer(part))
    if merged > MAXIMUM_MERGED:
        raise HistoryError(f"{place}: has {merged} merged cells, more than {MAXIMUM_MERGED}; save its columns as CSV")
    number, hidden = 0, list[int]()
    for row in _ROW.finditer(part):
        stated = _NUMBER_OF_ROW.search(row[1])
        text = stated[1] if stated else b"%d" % (number + 1)
        if not re.fullmatch(rb"[1-9]\d{0,6}", text) or not number < int(text) <= MAXIMUM_ROW:
            shown = quoted(text.decode("ascii", "backslashreplace"), 20)
            raise HistoryError(
                f"{place}: a row is numbered {shown} behind row {number}; rows must rise, up to {MAXIMUM_ROW}; open "
                "the file in a spreadsheet program and save it anew"
            )
        if int(text) - number > MAXIMUM_EMPTY_ROWS:
            raise HistoryError(
                f"{place}, row {int(text)}: more than {MAXIMUM_EMPTY_ROWS} empty rows stand above it; remove them or it"
            )
        number = int(text)
        if _HIDDEN.search(row[1]):
            hidden.append(number)
    _check_values(place, part)
    return SheetRows(tuple(hidden), _HIDDEN_COLUMNS.search(part) is not None)


def _check_values(place: str, part: bytes) -> None:
    """Refuse numbers that only Python takes for such: 1_2, or digits of another script."""
    for match in _ODD_VALUE.finditer(part):
        cells = list(_CELL.finditer(part, max(0, match.start() - 20_000), match.start()))
        if cells and re.search(rb"""\st\s*=\s*["']str["']""", cells[-1][1]):
            continue
        reference = _NUMBER_OF_ROW.search(cells[-1][1]) if cells else None
        cell = f", cell {quoted(reference[1].decode('ascii', 'replace'), 20)}" if reference else ""
        shown = ascii(quoted(match[1].decode("utf-8", "replace"), 40))
        raise HistoryError(f"{place}{cell}: the number {shown} is not written as one; enter it anew in plain digits")
