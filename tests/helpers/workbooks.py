"""Spreadsheets of rows."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from openpyxl import Workbook


def workbook(
    path: Path, sheets: Mapping[str, Iterable[Sequence[Any]]], shaped: Callable[[Any], object] = lambda sheet: None
) -> Path:
    """Written with these sheets of rows, each of which is then shaped."""
    book = Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
        shaped(sheet)
    book.save(path)
    return path
