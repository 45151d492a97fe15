"""The parts of a file .xlsx, checked before openpyxl reads them: their size unpacked, entities, counts of elements.

A few kB of ZIP can unpack to gigabytes. Only the parts that cells need are given to openpyxl.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from creepkit.errors import HistoryError
from creepkit.files.limits import how_to_raise, raised
from creepkit.readers.spreadsheet_xml import MAIN

MAXIMUM_UNPACKED_BYTES = 100_000_000
"""Of all parts of a file together."""


MAXIMUM_EXPANSION, _ALWAYS_ALLOWED_BYTES = 100, 10_000_000
"""Bytes unpacked a byte of the file, from so many bytes on; sheets of numbers have 5 to 30."""


MAXIMUM_ELEMENTS: Mapping[str, int] = {"sst": 1_000_000, "styleSheet": 100_000, "workbook": 50_000} | dict.fromkeys(
    ("Relationships", "Types", "Properties"), 20_000
)
"""Elements of parts that are read as a whole, by the name of their root."""


_KEPT_ROOTS = frozenset(("Types", "Relationships", "workbook", "sst", "styleSheet", "worksheet"))
"""Roots of the parts that cells need; no other part is given to openpyxl."""


_ENCODING = re.compile(rb"""^<\?xml[^>]*?encoding\s*=\s*["']([^"']*)["']""")


_SHEET, _TEXTS = (f'<{name} xmlns="{MAIN}"/>'.encode() for name in ("worksheet", "sst"))


@dataclass(frozen=True)
class WorkbookParts:
    """The parts of a file that its cells need, by their names. roots : the name of the first element of each."""

    contents: Mapping[str, bytes]
    roots: Mapping[str, str]

    def of_root(self, root: str) -> list[bytes]:
        """The parts of one kind."""
        return [part for name, part in self.contents.items() if self.roots[name] == root]

    def outline(self) -> io.BytesIO:
        """The file without cells, texts and formats: what its sheets are called, and in which parts they stand."""
        stubs = {"worksheet": _SHEET, "sst": _TEXTS, "styleSheet": None}
        return _archive({name: stubs.get(self.roots[name], part) for name, part in self.contents.items()})

    def with_sheets(self, sheets: Mapping[str, bytes]) -> io.BytesIO:
        """The file with these sheets in place of its own, the others empty."""
        return _archive(
            {
                name: (sheets.get(name) or _SHEET) if self.roots[name] == "worksheet" else part
                for name, part in self.contents.items()
            }
        )


def _archive(parts: Mapping[str, bytes | None]) -> io.BytesIO:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, part in parts.items():
            if part is not None:
                archive.writestr(name, part)
    return stream


def checked_parts(path: Path, content: bytes) -> WorkbookParts:
    """The parts that cells need, once it is known that the file unpacks to a sensible size and defines no entities."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _check_size(path, sum(part.file_size for part in archive.infolist()), len(content))
            contents, roots = dict[str, bytes](), dict[str, str]()
            for name in archive.namelist():
                part = archive.read(name)
                if _is_xml(part):
                    root = _check_xml(path, part)
                    if root in _KEPT_ROOTS:
                        contents[name], roots[name] = _sheets_alone(part) if root == "workbook" else part, root
            return WorkbookParts(contents, roots)
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
    return part[:2] in (b"\xff\xfe", b"\xfe\xff") or part.lstrip(b"\xef\xbb\xbf \t\r\n\0")[:1] == b"<"


def _sheets_alone(workbook: bytes) -> bytes:
    """The workbook without names, views and the like, of which nothing is read."""
    root = ElementTree.fromstring(workbook)
    for child in list(root):
        if child.tag not in (f"{{{MAIN}}}workbookPr", f"{{{MAIN}}}sheets"):
            root.remove(child)
    return ElementTree.tostring(root)


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
