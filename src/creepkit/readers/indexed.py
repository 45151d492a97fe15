"""Folders with an index, one line a test, beside the frames: in one file for all tests, or in one file a test.

A laboratory's layout is a declaration of IndexedFolder; INDEXED_TABLE and INDEXED_FILES are two of them. Columns of
the index that are no condition known by name become labels, as they stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from creepkit.errors import HistoryError
from creepkit.readers.assemble import assemble
from creepkit.readers.tables import Entry, Row, Table, peek_columns, read_table
from creepkit.readers.words import Words
from creepkit.records import History


@dataclass(frozen=True)
class IndexedFolder:
    """Reader of a folder with an index; the alloy is the folder's name unless the index has a column `alloy`.

    key : the column that names the test, in the index and, where one file holds all frames, there too.
    frames : name of the file of frames; with `{key}` in it, one file a test.
    """

    name: str
    title: str
    key: str
    frames: str
    index: str = "index.csv"
    words: Words = field(default_factory=Words)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is such a folder, its index, or a file of frames in it."""
        folder = path if path.is_dir() else path.parent
        if path.is_file() and path.name != self.index and not path.match(self._pattern):
            return False
        return self.key in peek_columns(folder / self.index) and bool(self._frame_files(folder))

    def read(self, path: Path) -> list[History]:
        """Return the histories in the folder, in the order of the index; of one file of frames, when it is named."""
        folder = path if path.is_dir() else path.parent
        index = read_table(folder / self.index)
        tests = self._tests(index)
        if self._one_file:
            parts = self._cut(read_table(folder / self.frames), index, tests)
        else:
            only = path if path.is_file() and path.name != self.index else None
            parts = self._files(folder, index, tests, only)
        return [self._history(index, tests[key], key, frames) for key, frames in parts]

    @property
    def _one_file(self) -> bool:
        return "{key}" not in self.frames

    @property
    def _pattern(self) -> str:
        return self.frames.replace("{key}", "*")

    def _frame_files(self, folder: Path) -> list[Path]:
        return sorted(path for path in folder.glob(self._pattern) if path.name != self.index)

    def _tests(self, index: Table) -> dict[str, Row]:
        """The rows of the index by key."""
        k = index.column(self.key)
        tests: dict[str, Row] = {}
        for row in index.rows:
            key, place = row.cells[k], index.place(row.line)
            if not key or not key.isprintable():
                raise HistoryError(f"{place}: the {self.key} is empty or not printable; name every test")
            if key in tests:
                raise HistoryError(f"{place}: test '{key}' already stands in line {tests[key].line}; keep one of them")
            tests[key] = row
        return tests

    def _cut(self, table: Table, index: Table, tests: dict[str, Row]) -> Iterator[tuple[str, Table]]:
        """Key and frames of every test, cut from one table."""
        k = table.column(self.key)
        rows: dict[str, list[Row]] = {key: [] for key in tests}
        for row in table.rows:
            key = row.cells[k]
            if key not in rows:
                raise HistoryError(f"{table.place(row.line)}: test '{key}' is not in {index.path}; add it there")
            rows[key].append(row)
        for key, part in rows.items():
            if not part:
                raise HistoryError(f"{index.place(tests[key].line)}: test '{key}' has no frames in {table.path}")
            yield key, table.with_rows(part)

    def _files(
        self, folder: Path, index: Table, tests: dict[str, Row], only: Path | None
    ) -> Iterator[tuple[str, Table]]:
        """Key and frames of every test, each in a file of its own; of the one whose file is named, if any."""
        files = {key: folder / self.frames.replace("{key}", key) for key in tests}
        for path in self._frame_files(folder):
            if path not in files.values():
                raise HistoryError(f"{path}: no test in {index.path} has these frames; add it there or move the file")
        for key, path in files.items():
            if path.parent != folder or not path.is_file():
                raise HistoryError(f"{index.place(tests[key].line)}: test '{key}' has no file {path.name} in {folder}")
            if only is None or path == only:
                yield key, read_table(path)

    def _history(self, index: Table, row: Row, key: str, frames: Table) -> History:
        entries = {name: entry for name, entry in index.entries(row).items() if name != self.key}
        place = index.place(row.line)
        entries.setdefault("alloy", Entry(frames.path.absolute().parent.name, place))
        source = f"{frames.path} ({key})" if self._one_file else str(frames.path)
        return assemble(key, entries, frames, self.words, place=place, source=source, skip=(self.key,))


INDEXED_TABLE = IndexedFolder(
    name="indexed-table",
    title="a folder with index.csv (one line a test) and curves.csv (the frames of all tests, by `key`)",
    key="key",
    frames="curves.csv",
    words=Words(
        rename={"youngs_MPa": "modulus_MPa", "state": "ended"},
        endings={"Ruptured": "ruptured", "Discontinued": "stopped"},
    ),
)
"""How the creep curves of Alloy 617 in the moga_neml repository are kept (ACME-MG, github.com)."""

INDEXED_FILES = IndexedFolder(
    name="indexed-files",
    title="a folder with index.csv (one line a test) and, for each `test`, a file <test>_creep.csv",
    key="test",
    frames="{key}_creep.csv",
    words=Words(
        rename={"creep_extension_pct": "strain_pct"},
        endings={"Not applicable": "stopped"},
        averaged={"measured_temperature_C": ("T_top_C", "T_mid_C", "T_bot_C")},
    ),
)
"""How BAM keeps the creep curves of CMSX-6, with three thermocouples (doi 10.5281/zenodo.13937986)."""
