"""What a file of tables was understood to hold: how it is written, and which column means what."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from creepkit.readers.columns_of_tests import column_called
from creepkit.readers.history_csv import HISTORY_CSV
from creepkit.readers.spreadsheets import SPREADSHEET, read_sheets
from creepkit.readers.table import CellTable
from creepkit.readers.table_heads import names_time
from creepkit.readers.table_layouts import tests_in
from creepkit.readers.tests_file import answers_of
from creepkit.readers.tests_in_rows import TEST_TABLE
from creepkit.readers.text_files import read_text_table
from creepkit.readers.vocabulary import HeaderVocabulary


@dataclass(frozen=True)
class TableSummary:
    """The table of one test as it stands in a file.

    place : the file and the sheet. dialect : its delimiter and decimal sign, "" in a spreadsheet. test : its name, ""
    where the file does not tell. columns : {name as written: creepkit's name}. rows : frames in the file.
    """

    place: str
    dialect: str
    test: str
    columns: Mapping[str, str]
    rows: int


def summarise_tables(path: Path, ignored: Collection[str] = ()) -> list[TableSummary]:
    """The tables of a text file or a spreadsheet in one of the general layouts; [] of any other file.

    ignored : columns that are left out.
    """
    vocabulary = answers_of(path).added_to(HeaderVocabulary(ignored=ignored))
    reader = replace(TEST_TABLE, vocabulary=vocabulary)
    if reader.accepts(path):
        return [
            TableSummary(str(path), "", "", {n: column_called(n).quantity or n for n in table.names}, len(table.rows))
            for table in reader.tables(path, [])
        ]
    if SPREADSHEET.accepts(path):
        grids = [grid for grid in read_sheets(path) if names_time(grid, vocabulary)]
    elif HISTORY_CSV.accepts(path):
        grids = [read_text_table(path)]
    else:
        return []
    return [summary for grid in grids for summary in _summaries(grid, vocabulary)]


def _summaries(grid: CellTable, vocabulary: HeaderVocabulary) -> list[TableSummary]:
    known = vocabulary.terms(grid.header["specimen"].text if "specimen" in grid.header else "")
    return [
        TableSummary(
            grid.place,
            "" if grid.sheet else str(grid.dialect),
            test.name,
            {name: known.column(name) for name in test.table.columns},
            len(test.table.rows),
        )
        for test in tests_in(grid, vocabulary)
    ]
