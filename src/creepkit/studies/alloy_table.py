"""The table of alloys of a plate: which dimple is of which alloy, with what is known of each beside its frames.

    camera,dimple,alloy,thickness [mm],thickness tolerance [%],modulus [GPa],grain size [um],Ni [wt.%],exclude
    west,D1,A17,0.492,2,148,35,61.2,

A CSV of any dialect or the first sheet of an .xlsx. A length of the test piece has its column, and its tolerance, one
standard deviation, another; other columns are labels of the test, such as heat, grain size and composition.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from creepkit.errors import CreepkitError, HistoryError, nearest, quoted
from creepkit.files.delimited_text import Dialect, is_number, parse_number
from creepkit.readers.spreadsheets import read_sheets
from creepkit.readers.table import CellTable
from creepkit.readers.text_files import read_text_table
from creepkit.readers.vocabulary import plain_name, split_written_name, unit_suffix
from creepkit.records import Specimen, dimensions_of
from creepkit.records.quantities import LENGTH, MODULUS

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "camera": ("camera", "view", "field_of_view", "kamera"),
    "dimple": ("dimple", "test_piece", "piece", "site", "position", "pos", "kalotte"),
    "alloy": ("alloy", "material", "composition", "legierung", "werkstoff"),
    "modulus": ("modulus", "young_s_modulus", "youngs_modulus", "elastic_modulus", "e", "e_modul"),
    "exclude": ("exclude", "excluded", "exclusion", "leave_out", "ausschluss", "ausgeschlossen"),
}
"""{what a column holds: names of it}."""


EMPTY_HEADS = (
    *("camera", "dimple", "alloy", "thickness [mm]", "thickness tolerance [%]", "modulus [GPa]"),
    *("grain size [um]", "exclude"),
)
"""Of a table that is to be filled in."""


TOLERANCE_WORDS = ("tolerance", "tol", "sd", "uncertainty", "toleranz", "unsicherheit")
"""Behind the name of a length."""


THICKNESS_WORDS = ("thickness", "dicke", "wall", "blechdicke", "t")
"""Names of the first length of a test piece, which is that of its plate."""


NOTHING = ("", "-", "no", "nein", "0", "false", "n", "none")
PLAIN_YES = ("yes", "ja", "x", "1", "true", "y", "j", "exclude")
"""Cells of the column of exclusions that give no reason."""


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
    heads = _heads(grid, specimen)
    rows: list[Dimple] = []
    for row in grid.rows[1:]:
        cells = [" ".join(cell.split()) for cell in row.cells]
        if not any(cells):
            continue
        one = _dimple(grid.location(row.line), dict(zip(heads, cells, strict=False)), grid.dialect)
        if any((one.camera, one.name) == (other.camera, other.name) for other in rows):
            raise HistoryError(f"{one.place}: '{quoted(one.name)}' stands there twice; keep one row of each dimple")
        rows.append(one)
    if not rows:
        raise HistoryError(f"{path}: has no row below its heads; write one for each dimple")
    return AlloyTable(path, tuple(rows))


@dataclass(frozen=True)
class _Head:
    """A column. role : of COLUMNS, "length", "tolerance" or "label". name : of the length or the label."""

    role: str
    name: str
    unit: str
    written: str

    def value(self, cell: str, place: str, dialect: Dialect, length: float | None = None) -> float:
        """The number of a cell, mm or MPa; length : mm, of which a tolerance may be in per cent."""
        number, kind = parse_number(cell, dialect, place, self.written), MODULUS if self.role == "modulus" else LENGTH
        suffix = unit_suffix(self.unit) if self.unit else "mm" if self.role == "length" else ""
        if self.role == "tolerance" and suffix == "pct":
            if length is None:
                raise HistoryError(
                    f"{place}: a tolerance in % needs the length that it is of; write that in its column"
                )
            number, suffix = 0.01 * number * length, "mm"
        if not suffix:
            units = ", ".join(kind.units)
            raise HistoryError(f"{place}: '{quoted(self.written)}' has no unit that is known; write it as in [{units}]")
        value = kind.convert(number, suffix, place, self.written)
        if not value > 0.0:
            raise HistoryError(f"{place}: '{quoted(self.written)}' is {number:g}; write a number above zero")
        return value


def _heads(grid: CellTable, specimen: Specimen) -> list[_Head]:
    if not grid.rows:
        raise HistoryError(f"{grid.place}: has no heads; write camera, dimple, alloy, ...")
    place = grid.location(grid.rows[0].line)
    roles = {spelling: role for role, spellings in COLUMNS.items() for spelling in spellings}
    lengths = {plain_name(name): one.name for one in dimensions_of(specimen) for name in one.names}
    thickness = next(iter(lengths.values()), "")
    lengths |= dict.fromkeys(THICKNESS_WORDS, thickness)
    heads: list[_Head] = []
    for written in grid.rows[0].cells:
        name, unit = split_written_name(written)
        plain = plain_name(name)
        first, _, last = plain.rpartition("_")
        if plain in roles:
            head = _Head(roles[plain], "", unit, written)
        elif plain in lengths:
            head = _Head("length", lengths[plain], unit, written)
        elif last in TOLERANCE_WORDS and (not first or first in lengths):
            head = _Head("tolerance", lengths.get(first, thickness), unit, written)
        else:
            head = _Head("label", " ".join(written.split()), "", written)
        if (head.role, head.name) in [(one.role, one.name) for one in heads]:
            raise HistoryError(f"{place}: '{quoted(written)}' stands there twice; rename one of these columns")
        heads.append(head)
    if not {"dimple", "alloy"} <= {one.role for one in heads}:
        found = quoted(", ".join(one.written for one in heads), 200)
        raise HistoryError(f"{place}: a table of alloys has the columns dimple and alloy, found {found}")
    return heads


def _dimple(place: str, cells: Mapping[_Head, str], dialect: Dialect) -> Dimple:
    texts = {head.role: cell for head, cell in cells.items()}
    if not texts["dimple"]:
        raise HistoryError(f"{place}: does not name its dimple; write it, such as D1")
    filled: dict[str, dict[str, tuple[_Head, str]]] = {}
    for head, cell in cells.items():
        if cell:
            filled.setdefault(head.role, {})[head.name] = (head, cell)
    lengths = {name: head.value(cell, place, dialect) for name, (head, cell) in filled.get("length", {}).items()}
    word = texts.get("exclude", "")
    reason = "" if word.casefold() in NOTHING else word
    return Dimple(
        place,
        texts.get("camera", ""),
        texts["dimple"],
        texts["alloy"],
        lengths,
        {
            name: head.value(cell, place, dialect, lengths.get(name))
            for name, (head, cell) in filled.get("tolerance", {}).items()
        },
        next((head.value(cell, place, dialect) for head, cell in filled.get("modulus", {}).values()), None),
        f"excluded by {place}" if reason.casefold() in PLAIN_YES else reason,
        {name: cell for name, (_, cell) in filled.get("label", {}).items() if name},
    )


def looks_like_alloys(path: Path, specimen: Specimen) -> bool:
    """Whether a file is a table of alloys."""
    if path.suffix.lower() not in (".csv", ".xlsx", ".txt", ".tsv"):
        return False
    with suppress(CreepkitError, OSError):
        grid = _grid(path)
        _heads(grid, specimen)
        return not any(is_number(cell, grid.dialect) for cell in grid.rows[0].cells)
    return False


def empty_table(dimples: Mapping[str, Sequence[str]]) -> str:
    """The text of a table with a row for each of {camera: dimples}, whose cells are to be filled in."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(EMPTY_HEADS)
    for camera, names in dimples.items():
        writer.writerows([camera, name, *[""] * (len(EMPTY_HEADS) - 2)] for name in names)
    return text.getvalue()
