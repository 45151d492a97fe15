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
from creepkit.readers.column_names import plain_name, split_written_name, unit_suffix
from creepkit.readers.spreadsheets import read_sheets
from creepkit.readers.table import CellTable
from creepkit.readers.text_files import read_text_table
from creepkit.records import Specimen, dimensions_of
from creepkit.records.quantities import LENGTH, MODULUS, QuantityKind

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


def read_alloy_table(path: Path, specimen: Specimen) -> AlloyTable:
    """Read a table of alloys; HistoryError, with file and row, says what is wrong with another."""
    grid = read_sheets(path)[0] if path.suffix.lower() == ".xlsx" else read_text_table(path)
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


def _heads(grid: CellTable, specimen: Specimen) -> list[_Head]:
    if not grid.rows:
        raise HistoryError(f"{grid.place}: has no heads; write camera, dimple, alloy, ...")
    place = grid.location(grid.rows[0].line)
    roles = {spelling: role for role, spellings in COLUMNS.items() for spelling in spellings}
    lengths = {plain_name(name): one.name for one in dimensions_of(specimen) for name in one.names}
    lengths |= dict.fromkeys(THICKNESS_WORDS, next(iter(lengths.values()), ""))
    heads = []
    for written in grid.rows[0].cells:
        name, unit = split_written_name(written)
        plain, first, _ = plain_name(name), *plain_name(name).rpartition("_")[::2]
        last = plain_name(name).rpartition("_")[2]
        if plain in roles:
            heads.append(_Head(roles[plain], "", unit, written))
        elif plain in lengths:
            heads.append(_Head("length", lengths[plain], unit, written))
        elif plain in TOLERANCE_WORDS or (last in TOLERANCE_WORDS and first in lengths):
            heads.append(_Head("tolerance", lengths.get(first) or next(iter(lengths.values())), unit, written))
        else:
            heads.append(_Head("label", " ".join(written.split()), "", written))
    named = [(one.role, one.name) for one in heads]
    if ("dimple", "") not in named or ("alloy", "") not in named:
        found = quoted(", ".join(one.written for one in heads), 200)
        raise HistoryError(f"{place}: a table of alloys has the columns dimple and alloy, found {found}")
    for one in heads:
        if named.count((one.role, one.name)) > 1:
            raise HistoryError(f"{place}: '{quoted(one.written)}' stands there twice; rename one of these columns")
    return heads


def _dimple(place: str, cells: Mapping[_Head, str], dialect: Dialect) -> Dimple:
    texts = {head.role: cell for head, cell in cells.items()}
    if not texts["dimple"]:
        raise HistoryError(f"{place}: does not name its dimple; write it, such as D1")
    lengths: dict[str, float] = {}
    tolerances: dict[str, float] = {}
    modulus = None
    for head, cell in cells.items():
        if not cell or head.role not in ("length", "tolerance", "modulus"):
            continue
        number = parse_number(cell, dialect, place, head.written)
        if head.role == "length":
            lengths[head.name] = _converted(number, head, LENGTH, "mm", place)
        elif head.role == "modulus":
            modulus = _converted(number, head, MODULUS, "", place)
    for head, cell in cells.items():
        if cell and head.role == "tolerance":
            number = parse_number(cell, dialect, place, head.written)
            tolerances[head.name] = _tolerance(number, head, lengths.get(head.name), place)
    word = texts.get("exclude", "")
    reason = "" if word.casefold() in NOTHING else word
    labels = {head.name: cell for head, cell in cells.items() if head.role == "label" and head.name and cell}
    return Dimple(
        place,
        texts.get("camera", ""),
        texts["dimple"],
        texts["alloy"],
        lengths,
        tolerances,
        modulus,
        f"excluded by {place}" if reason.casefold() in PLAIN_YES else reason,
        labels,
    )


def _converted(number: float, head: _Head, kind: QuantityKind, usual: str, place: str) -> float:
    """A number in creepkit's unit; `usual` is the unit of a column that states none, "" where there must be one."""
    suffix = unit_suffix(head.unit) if head.unit else usual
    if not suffix:
        units = ", ".join(kind.units)
        raise HistoryError(f"{place}: '{quoted(head.written)}' has no unit that is known; write it as in [{units}]")
    value = kind.convert(number, suffix, place, head.written)
    if not value > 0.0:
        raise HistoryError(f"{place}: '{quoted(head.written)}' is {number:g}; write a number above zero")
    return value


def _tolerance(number: float, head: _Head, length: float | None, place: str) -> float:
    """mm, of a length, mm; per cent of it where the column says so."""
    if unit_suffix(head.unit) == "pct":
        if length is None:
            raise HistoryError(f"{place}: a tolerance in % needs the length that it is of; write that in its column")
        return _converted(0.01 * number * length, _Head(head.role, head.name, "mm", head.written), LENGTH, "mm", place)
    return _converted(number, head, LENGTH, "", place)


def looks_like_alloys(path: Path, specimen: Specimen) -> bool:
    """Whether a file is a table of alloys."""
    if path.suffix.lower() not in (".csv", ".xlsx", ".txt", ".tsv"):
        return False
    with suppress(CreepkitError, OSError):
        grid = read_sheets(path)[0] if path.suffix.lower() == ".xlsx" else read_text_table(path)
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
