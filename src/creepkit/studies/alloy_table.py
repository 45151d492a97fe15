"""The table of alloys of a plate: which dimple is of which alloy, with what is known of each beside its frames.

    camera,dimple,alloy,thickness [mm],thickness tolerance [%],modulus [GPa],grain size [um],Ni [wt.%],exclude
    west,D1,A17,0.492,2,148,35,61.2,

A CSV of any dialect or the first sheet of an .xlsx. A length of the test piece has its column, and its tolerance, one
standard deviation, another; other columns are labels of the test, such as heat, grain size and composition.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from creepkit.errors import CreepkitError, HistoryError, nearest, quoted
from creepkit.files.delimited_text import is_missing, is_number
from creepkit.readers.conditions import StatedConditions
from creepkit.readers.ends_of_tests import NO, YES
from creepkit.readers.spreadsheets import read_sheets
from creepkit.readers.table import CellTable, SourceText, TableRow, check_columns
from creepkit.readers.text_files import read_text_table
from creepkit.readers.vocabulary import HeaderVocabulary, split_unit, split_written_name, unit_suffix, words_of
from creepkit.records import Specimen
from creepkit.records.quantities import LENGTH

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "camera": ("camera", "view", "field of view", "kamera"),
    "dimple": ("dimple", "test piece", "piece", "site", "position", "pos", "kalotte"),
    "exclude": ("exclude", "excluded", "exclusion", "leave out", "ausschluss", "ausgeschlossen"),
}
"""{what a column holds beside the conditions of a test: names of it}."""


EMPTY_HEADS = (
    *("camera", "dimple", "alloy", "thickness [mm]", "thickness tolerance [%]", "modulus [GPa]"),
    *("grain size [um]", "exclude"),
)
"""Of a table that is to be filled in."""


_TOLERANCE = re.compile(r"(?:(.+) )?(?:tolerance|tol|sd|uncertainty|toleranz|unsicherheit)")
"""Behind the name of a length; alone, of the first one."""


_SEARCHED = 60
"""Rows among which the heads are looked for."""


@dataclass(frozen=True)
class Dimple:
    """One row: a test piece in the view of a camera.

    place : of the row, for errors. camera, name : "" where the table does not say which camera. alloy : "" where it is
    not stated. lengths, tolerances : {length of the test piece: mm}. modulus : MPa. excluded : why it is left out, ""
    where it is not. labels : {column: cell} of all else.
    """

    place: str
    camera: str
    name: str
    alloy: str = ""
    lengths: Mapping[str, float] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)
    modulus: float | None = None
    excluded: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class AlloyTable:
    """All rows of the table of alloys."""

    path: Path
    rows: tuple[Dimple, ...]

    def of_camera(self, camera: str, dimples: Sequence[str]) -> dict[str, Dimple]:
        """{dimple: its row} of these of one camera; rows that name no camera are of every one, or name it in front."""
        rows = {}
        for row in self.rows:
            for name in dimples:
                known_by = (name,) if row.camera else (name, f"{camera} {name}")
                if _same(row.camera or camera, camera) and any(_same(row.name, one) for one in known_by):
                    rows[name] = row
        return rows

    def check(self, camera: str, dimples: Sequence[str], cameras: Sequence[str]) -> None:
        """HistoryError for dimples of a camera without a row, and for rows of what it does not show."""
        rows = self.of_camera(camera, dimples)
        for row in self.rows:
            if row.camera and not any(_same(row.camera, one) for one in cameras):
                raise HistoryError(f"{row.place}: there is no camera '{row.camera}'; {nearest(row.camera, cameras)}")
            is_own = _same(row.camera, camera) or (not row.camera and len(cameras) == 1)
            if is_own and row not in rows.values():
                raise HistoryError(
                    f"{row.place}: camera '{camera}' shows no dimple '{row.name}'; it shows {', '.join(dimples[:30])}, "
                    "numbered row by row: where one between them is not seen, say names and centers_mm of the others"
                )
        lacking = [name for name in dimples if name not in rows]
        if lacking:
            raise HistoryError(
                f"{self.path}: has no row of {', '.join(lacking[:30])} of camera '{camera}'; write one for each, with "
                "a word under exclude for those that do not count"
            )


def _same(first: str, second: str) -> bool:
    """Whether two names are the same but for capitals and blanks; a number alone is that of D1, D2, ..."""
    one, other = ("".join(name.split()).casefold() for name in (first, second))
    return one == other or (one.isdecimal() and other == f"d{int(one)}")


def _grid(path: Path) -> CellTable:
    return read_sheets(path)[0] if path.suffix.lower() == ".xlsx" else read_text_table(path)


def read_alloy_table(path: Path, specimen: Specimen) -> AlloyTable:
    """Read a table of alloys; HistoryError, with file and row, says what is wrong with another."""
    grid = _grid(path)
    at, keys = _heads(grid, specimen)
    rows: list[Dimple] = []
    for row in grid.rows[at + 1 :]:
        if not any(row.cells):
            continue
        one = _dimple(grid, row, dict(zip(keys, grid.rows[at].cells, strict=True)), specimen)
        if any((one.camera, one.name) == (other.camera, other.name) for other in rows):
            raise HistoryError(f"{one.place}: '{quoted(one.name)}' stands there twice; keep one row of each dimple")
        rows.append(one)
    if not rows:
        raise HistoryError(f"{path}: has no row below its heads; write one for each dimple")
    return AlloyTable(path, tuple(rows))


def _heads(grid: CellTable, specimen: Specimen) -> tuple[int, list[str]]:
    """The row of the heads, and what its columns hold: roles of COLUMNS, keys of conditions, tolerances of lengths."""
    found = [[_key(cell, specimen) for cell in row.cells] for row in grid.rows[:_SEARCHED]]
    at = next((k for k, keys in enumerate(found) if {"dimple", "alloy"} <= {*keys}), None)
    if at is None:
        listed = quoted(", ".join(grid.rows[0].cells), 200) if grid.rows else "none"
        raise HistoryError(f"{grid.location(1)}: a table of alloys has the columns dimple and alloy, found {listed}")
    check_columns(grid.location(grid.rows[at].line), found[at])
    return at, found[at]


def _key(written: str, specimen: Specimen) -> str:
    """What a column of this head holds; a length without a unit is in mm, what is no condition of a dimple a label."""
    known = HeaderVocabulary().terms(specimen.name)
    words = words_of(split_written_name(written)[0])
    if role := next((role for role, names in COLUMNS.items() if words in names), ""):
        return role
    if tolerance := _TOLERANCE.fullmatch(words):
        name = known.condition(tolerance[1]) if tolerance[1] else next(iter(known.dimensions), "")
        if name in known.dimensions:
            return f"tolerance {known.dimensions[name]}"
    key = known.condition("thickness" if words == "t" else written)
    found = split_unit(key, known.conditions.kinds)
    if key in known.dimensions:
        return f"{key}_mm"
    is_own = key == "alloy" or key.startswith("label ") or (found and found[0] in ("modulus", *known.dimensions))
    return key if is_own else f"label {' '.join(written.split())}"


def _dimple(grid: CellTable, row: TableRow, heads: Mapping[str, str], specimen: Specimen) -> Dimple:
    """The test piece of a row; heads : {key of a column: as it is written}."""
    place, cells = grid.location(row.line), [" ".join(cell.split()) for cell in row.cells]
    entries = {
        key: SourceText(cell, place, grid.dialect.decimal, written)
        for (key, written), cell in zip(heads.items(), cells, strict=False)
        if cell or key in COLUMNS
    }
    camera, name, reason = (entries.pop(role).text if role in entries else "" for role in COLUMNS)
    if not name:
        raise HistoryError(f"{place}: does not name its dimple; write it, such as D1")
    reason = f"excluded by {place}" if reason.casefold() in (*YES, "exclude") else reason
    reason = "" if is_missing(reason) or reason.casefold() in (*NO, "none") else reason
    of_tolerances = {key: entries.pop(key) for key in [*entries] if key.startswith("tolerance ")}
    stated = StatedConditions(entries, HeaderVocabulary(default_texts={"specimen": specimen.name}), place)
    modulus, lengths, tolerances = stated.take_number("modulus"), stated.geometry, dict[str, float]()
    for key, entry in of_tolerances.items():
        length, unit = key.removeprefix("tolerance "), unit_suffix(split_written_name(entry.key)[1]) or ""
        if unit == "pct" and length not in lengths:
            what = "a tolerance in % needs the length that it is of; write that in its column"
            raise HistoryError(f"{place}: {what}")
        factor = 0.01 * lengths[length] if unit == "pct" else LENGTH.unit(unit, place, entry.key).factor
        tolerances[length] = factor * entry.number(entry.key)
    for what, value in (*lengths.items(), *tolerances.items()):
        if not value > 0.0:
            raise HistoryError(f"{place}: {what} is {value:g} mm; write a number above zero")
    return Dimple(
        place,
        camera,
        name,
        stated.take_text("alloy"),
        lengths,
        tolerances,
        None if modulus is None else modulus.value,
        reason,
        stated.labels,
    )


def looks_like_alloys(path: Path, specimen: Specimen) -> bool:
    """Whether a file is a table of alloys."""
    if path.suffix.lower() not in (".csv", ".xlsx", ".txt", ".tsv"):
        return False
    with suppress(CreepkitError, OSError):
        grid = _grid(path)
        return not any(is_number(cell, grid.dialect) for cell in grid.rows[_heads(grid, specimen)[0]].cells)
    return False


def empty_table(dimples: Mapping[str, Sequence[str]]) -> str:
    """The text of a table with a row for each of {camera: dimples}, whose cells are to be filled in."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(EMPTY_HEADS)
    for camera, names in dimples.items():
        writer.writerows([camera, name, *[""] * (len(EMPTY_HEADS) - 2)] for name in names)
    return text.getvalue()
