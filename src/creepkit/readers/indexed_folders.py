"""Folders with an index, one line a test, beside the frames: in one file for all tests, or in one file a test.

A laboratory's layout is a declaration of IndexedFolderReader; INDEXED_TABLE and INDEXED_FILES are two of them. Columns
of the index that are no condition known by name become labels, as they stand; one that is nearly such a name is an
error.
"""

from __future__ import annotations

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
        if path.is_file() and path.name != self.index_file and not path.match(self.frames_file.replace("{key}", "*")):
            return False
        index = peek_table(folder / self.index_file)
        return index is not None and self.key_column in index.rows[0].cells and bool(self._files_by_key(folder))

    def read(self, path: Path) -> list[History]:
        """Return the histories in the folder, in the order of the index; of one file of frames, when it is named."""
        folder = path if path.is_dir() else path.parent
        index = read_table(folder / self.index_file, self.vocabulary.ignored)
        tests = grouped(index.rows, index.column(self.key_column))
        for key, rows in tests.items():
            if not key or not key.isprintable():
                what = f"the {self.key_column} is empty or not printable; name every test"
                raise HistoryError(f"{index.location(rows[0].line)}: {what}")
            if len(rows) > 1:
                what = f"test '{key}' already stands in line {rows[0].line}; keep one of them"
                raise HistoryError(f"{index.location(rows[1].line)}: {what}")
        files, parts = self._files_by_key(folder), dict[str, CellTable]()
        if "" in files:
            table = read_table(files[""], self.vocabulary.ignored)
            parts = {
                key: replace(table, rows=rows)
                for key, rows in grouped(table.rows, table.column(self.key_column)).items()
            }
        for key in [one for one in (parts or files) if one not in tests]:
            place = parts[key].location(parts[key].rows[0].line) if parts else files[key]
            what = f"test '{quoted(key)}' is not in {index.path}; add it there, or move its frames"
            raise HistoryError(f"{place}: {what}")
        for key, rows in tests.items():
            if key not in (parts or files):
                file = f"file {self.frames_file.replace('{key}', key)} in {folder}"
                where = f"frames in {files['']}" if parts else file
                raise HistoryError(f"{index.location(rows[0].line)}: test '{key}' has no {where}")
        wanted = [key for key in tests if path not in files.values() or parts or files[key] == path]
        return [
            self._history(
                index, tests[key][0], key, parts[key] if parts else read_table(files[key], self.vocabulary.ignored)
            )
            for key in wanted
        ]

    def _files_by_key(self, folder: Path) -> dict[str, Path]:
        """{test: its file of frames}; "" for that of all tests."""
        front, _, back = self.frames_file.partition("{key}")
        paths = [
            one for one in sorted(folder.glob(self.frames_file.replace("{key}", "*"))) if one.name != self.index_file
        ]
        return {one.name[len(front) : len(one.name) - len(back)] if one.name != front else "": one for one in paths}

    def _history(self, index: CellTable, row: TableRow, key: str, frames: CellTable) -> History:
        entries = {name: entry for name, entry in index.entries(row).items() if name != self.key_column}
        location = index.location(row.line)
        entries.setdefault("alloy", SourceText(frames.path.absolute().parent.name, location))
        known = self.vocabulary.terms()
        unknown = [name for name in index.empty_columns(row) if known.is_condition(name) and name not in entries]
        if unknown and "label assumed" not in entries:
            entries["label assumed"] = SourceText(", ".join(map(unknown_text, unknown)), location)
        return assemble_history(
            key,
            entries,
            frames,
            self.vocabulary,
            location=location,
            source=f"{frames.path}{'' if '{key}' in self.frames_file else f' ({key})'}",
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
        labels=(
            *("orientation_deg", "gauge_Le_mm", "duration_h", "elong_pct", "elastic_ext_pct", "init_plastic_pct"),
            *("T_top_C", "T_mid_C", "T_bot_C"),
        ),
    ),
)
"""How BAM keeps the creep curves of CMSX-6, with three thermocouples (doi 10.5281/zenodo.13937986)."""
