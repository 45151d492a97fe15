"""Folders with an index, one line a test, beside the frames: in one file for all tests, or in one file a test.

A laboratory's layout is a declaration of IndexedFolder; INDEXED_TABLE and INDEXED_FILES are two of them. Columns of
the index that are no condition known by name become labels, as they stand; one that is nearly such a name is an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.readers.assembly import assemble_history
from creepkit.readers.frames import unknown_text
from creepkit.readers.table import CellTable, SourceText, TableRow, grouped
from creepkit.readers.text_files import peek_table, read_table
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History


@dataclass(frozen=True)
class IndexedFolderReader:
    """Reader of a folder with an index; the alloy is the folder's name unless the index has a column `alloy`.

    key_column : the column that names the test, in the index and, where one file holds all frames, there too.
    frames_file : name of the file of frames; with `{key}` in it, one file a test.
    """

    name: str
    title: str
    key_column: str
    frames_file: str
    index_file: str = "index.csv"
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is such a folder, its index, or a file of frames in it."""
        folder = path if path.is_dir() else path.parent
        if path.is_file() and path.name != self.index_file and not path.match(self._pattern):
            return False
        index = peek_table(folder / self.index_file)
        return index is not None and self.key_column in index.rows[0].cells and bool(self._frame_files(folder))

    def read(self, path: Path) -> list[History]:
        """Return the histories in the folder, in the order of the index; of one file of frames, when it is named."""
        folder = path if path.is_dir() else path.parent
        index = read_table(folder / self.index_file, self.vocabulary.ignored)
        tests = self._index_rows(index)
        if self._has_common_frames_file:
            parts = self._split_common_file(self._frames(folder / self.frames_file), index, tests)
        else:
            only = path if path.is_file() and path.name != self.index_file else None
            parts = self._read_files(folder, index, tests, only)
        return [self._history(index, tests[key], key, frames) for key, frames in parts]

    @property
    def _has_common_frames_file(self) -> bool:
        return "{key}" not in self.frames_file

    @property
    def _pattern(self) -> str:
        return self.frames_file.replace("{key}", "*")

    def _frame_files(self, folder: Path) -> list[Path]:
        return sorted(path for path in folder.glob(self._pattern) if path.name != self.index_file)

    def _index_rows(self, index: CellTable) -> dict[str, TableRow]:
        """The rows of the index by key."""
        k = index.column(self.key_column)
        tests: dict[str, TableRow] = {}
        for row in index.rows:
            key, location = row.cells[k], index.location(row.line)
            if not key or not key.isprintable():
                raise HistoryError(f"{location}: the {self.key_column} is empty or not printable; name every test")
            if key in tests:
                raise HistoryError(
                    f"{location}: test '{key}' already stands in line {tests[key].line}; keep one of them"
                )
            tests[key] = row
        return tests

    def _split_common_file(
        self, table: CellTable, index: CellTable, tests: dict[str, TableRow]
    ) -> Iterator[tuple[str, CellTable]]:
        """Key and frames of every test, cut from one table."""
        k = table.column(self.key_column)

        def check(row: TableRow) -> None:
            if row.cells[k] not in tests:
                raise HistoryError(
                    f"{table.location(row.line)}: test '{quoted(row.cells[k])}' is not in {index.path}; add it there"
                )

        rows = grouped(table.rows, k, check)
        for key in tests:
            part = rows.get(key)
            if part is None:
                raise HistoryError(f"{index.location(tests[key].line)}: test '{key}' has no frames in {table.path}")
            yield key, replace(table, rows=part)

    def _read_files(
        self, folder: Path, index: CellTable, tests: dict[str, TableRow], only: Path | None
    ) -> Iterator[tuple[str, CellTable]]:
        """Key and frames of every test, each in a file of its own; of the one whose file is named, if any."""
        files = {key: folder / self.frames_file.replace("{key}", key) for key in tests}
        for path in self._frame_files(folder):
            if path not in files.values():
                raise HistoryError(f"{path}: no test in {index.path} has these frames; add it there or move the file")
        for key, path in files.items():
            if path.parent != folder or not path.is_file():
                raise HistoryError(
                    f"{index.location(tests[key].line)}: test '{key}' has no file {path.name} in {folder}"
                )
            if only is None or path == only:
                yield key, self._frames(path)

    def _frames(self, path: Path) -> CellTable:
        return read_table(path, self.vocabulary.ignored)

    def _history(self, index: CellTable, row: TableRow, key: str, frames: CellTable) -> History:
        entries = {name: entry for name, entry in index.entries(row).items() if name != self.key_column}
        location = index.location(row.line)
        entries.setdefault("alloy", SourceText(frames.path.absolute().parent.name, location))
        known = self.vocabulary.terms()
        unknown = [name for name in index.empty_columns(row) if known.is_condition(name) and name not in entries]
        if unknown and "label assumed" not in entries:
            entries["label assumed"] = SourceText(", ".join(map(unknown_text, unknown)), location)
        source = f"{frames.path} ({key})" if self._has_common_frames_file else str(frames.path)
        return assemble_history(
            key,
            entries,
            frames,
            self.vocabulary,
            location=location,
            source=source,
            skipped_columns=(self.key_column,),
            columns_as_labels=True,
        )


INDEXED_TABLE = IndexedFolderReader(
    name="indexed-table",
    title="a folder with index.csv (one line a test) and curves.csv (the frames of all tests, by `key`)",
    key_column="key",
    frames_file="curves.csv",
    vocabulary=HeaderVocabulary(
        synonyms={"youngs_MPa": "modulus_MPa", "state": "ended", "strain": "strain_1"},
        end_of_test_terms={"Ruptured": "ruptured", "Discontinued": "stopped"},
        labels=("environment", "product", "file", "t_end_s", "strain_end", "strain_max", "min_rate_est_per_s"),
    ),
)
"""How the creep curves of Alloy 617 in the moga_neml repository are kept (ACME-MG, github.com)."""


INDEXED_FILES = IndexedFolderReader(
    name="indexed-files",
    title="a folder with index.csv (one line a test) and, for each `test`, a file <test>_creep.csv",
    key_column="test",
    frames_file="{key}_creep.csv",
    vocabulary=HeaderVocabulary(
        synonyms={"creep_extension_pct": "strain_pct"},
        end_of_test_terms={"Not applicable": "stopped"},
        averaged_columns={"measured_temperature_C": ("T_top_C", "T_mid_C", "T_bot_C")},
        labels=("orientation_deg", "gauge_Le_mm", "duration_h", "elong_pct", "elastic_ext_pct", "init_plastic_pct"),
    ),
)
"""How BAM keeps the creep curves of CMSX-6, with three thermocouples (doi 10.5281/zenodo.13937986)."""
