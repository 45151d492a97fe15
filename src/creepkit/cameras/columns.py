"""From the columns of a table, by their names, to a frame: units, lost points, axes."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError, quoted
from creepkit.records import CameraFrame
from creepkit.records.camera_format import (
    COORDINATES,
    DISPLACEMENTS,
    LENGTH_UNITS,
    LENGTHS_ALLOWED,
    PIXELS,
    TIME_UNITS,
    TIMES_ALLOWED,
    CameraFormat,
    ColumnName,
)

LARGEST_LENGTH = 1e6
"""mm; what is beyond is no coordinate of a test piece."""


COMPARISONS: dict[str, Callable[[Floats, float], Bools]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
}


@dataclass(frozen=True)
class FrameColumns:
    """Which columns of a table a frame is made of.

    names : of all columns as the head writes them. positions : of the columns that are read. quantities : {quantity:
    place in positions}. factors : {quantity: mm or s in its unit}. rules : (place, comparison, value) of lost points.
    """

    names: tuple[str, ...]
    positions: tuple[int, ...]
    quantities: Mapping[str, int]
    factors: Mapping[str, float]
    rules: tuple[tuple[int, str, float], ...]

    def name_of(self, place: int) -> str:
        """The name of a column that is read."""
        return self.names[self.positions[place]]


Places = Mapping[str, Sequence[tuple[int, ColumnName]]]


def _places(version: Mapping[str, Sequence[str]], names: Sequence[str], any_case: bool = True) -> Places:
    """{quantity: position and spelling of each column of its names}; in other capitals where there is no other."""
    parsed, found = [ColumnName.of(name) for name in names], {}
    for quantity, spellings in version.items():
        for fold in (str, str.casefold) if any_case else (str,):
            words = [(ColumnName.of(word), fold(ColumnName.of(word).name)) for word in spellings]
            same = [(k, word) for word, text in words for k, one in enumerate(parsed) if fold(one.name) == text]
            if same:
                found[quantity] = same
                break
    return found


def _lacking(version: Mapping[str, Sequence[str]], places: Places) -> str:
    """The first quantity without a column of those that a frame needs; "" for none."""
    return next((one for one in version if one != "time" and one not in places), "")


def fits(format: CameraFormat, names: Sequence[str], any_case: bool = False) -> bool:
    """Whether a table with columns of these names is one of the format; by the letter unless any_case."""
    return any(not _lacking(version, _places(version, names, any_case)) for version in format.versions)


def count_of_columns(format: CameraFormat, names: Sequence[str]) -> int:
    """How many of the format's columns are among these names, by the letter, of its nearest version."""
    return max(len(_places(version, names, any_case=False)) for version in format.versions)


def columns_of(format: CameraFormat, names: Sequence[str], location: str) -> FrameColumns:
    """The columns of a frame; HistoryError for one that is missing, comes twice, or has no unit of length.

    A spelling with other capitals is taken where it is the only one.
    """
    by_letter = [_lacking(version, _places(version, names, False)) == "" for version in format.versions]
    each = [_places(version, names) for version in format.versions]
    nearest = max(range(len(each)), key=lambda k: (by_letter[k], len(each[k])))
    version, places = format.versions[nearest], each[nearest]
    units = [ColumnName.of(name).unit for name in names]
    wanted: dict[str, tuple[int, ColumnName]] = {}
    for quantity, found in places.items():
        if len({k for k, _ in found}) > 1:  # the same in the image and on the surface, as of pyvale
            found = [(k, word) for k, word in found if units[k].casefold() not in PIXELS] or found
        positions = sorted({k for k, _ in found})
        if len(positions) > 1:
            both = " and ".join(f"'{quoted(names[k])}'" for k in positions[:2])
            raise HistoryError(f"{location}: {both} both are the column {quantity} of {format}; keep one of them")
        wanted[quantity] = found[0]
    if lacking := _lacking(version, places):
        raise HistoryError(f"{location}: {_missing(format, names, lacking, version[lacking])}")
    wanted = {quantity: one for quantity, one in wanted.items() if quantity not in ("image_x", "image_y")}
    stated = {quantity: units[k] or word.unit for quantity, (k, word) in wanted.items()}
    read = [k for k, _ in wanted.values()]
    rules = []
    for rule in format.lost_rules:
        for k, _ in _places({"": (rule.column,)}, names).get("", ()):
            read += [k] if k not in read else []
            rules.append((read.index(k), rule.comparison, rule.value))
    return FrameColumns(
        tuple(names),
        tuple(read),
        {quantity: read.index(k) for quantity, (k, _) in wanted.items()},
        {one: _factor(format, one, stated[one], quoted(names[k]), location) for one, (k, _) in wanted.items()},
        tuple(rules),
    )


def frame_of(
    format: CameraFormat, columns: FrameColumns, values: Floats, locate: Callable[[int], str], time: float, source: str
) -> CameraFrame:
    """The frame that the rows of a table hold.

    values : (points, columns that are read), in the units of the file. locate : the place of a row in the file.
    """
    if not len(values):
        raise HistoryError(f"{source}: no points below the line of columns; a frame needs at least one")
    valid = np.ones(len(values), dtype=bool)
    for place, comparison, limit in columns.rules:
        valid &= ~(COMPARISONS[comparison](values[:, place], limit) | np.isnan(values[:, place]))
    lengths = np.zeros((len(values), 6))
    for k, quantity in enumerate((*COORDINATES, *DISPLACEMENTS)):
        if quantity in columns.quantities:
            factor = columns.factors[quantity] * format.axes[k % 3]
            np.multiply(values[:, columns.quantities[quantity]], factor, out=lengths[:, k])
    if format.deformed:
        with np.errstate(invalid="ignore"):
            lengths[:, :3] -= lengths[:, 3:]
    valid &= ~np.isnan(lengths).any(axis=1)
    _check_sizes(columns, values, lengths, valid, locate)
    return CameraFrame(lengths[:, :3], lengths[:, 3:], valid, time, source)


def time_in(columns: FrameColumns, values: Floats) -> float:
    """The time, s, of a table with a column for it: that of its first row; else NaN.

    values : (points, columns that are read).
    """
    if "time" not in columns.quantities or not len(values):
        return float("nan")
    return float(values[0, columns.quantities["time"]]) * columns.factors["time"]


def _check_sizes(
    columns: FrameColumns, values: Floats, lengths: Floats, valid: Bools, locate: Callable[[int], str]
) -> None:
    """HistoryError for a coordinate or displacement of a valid point that is infinite or absurdly large."""
    wrong = valid[:, None] & ~(np.abs(lengths) <= LARGEST_LENGTH)
    if not wrong.any():
        return
    row, k = (int(one) for one in np.argwhere(wrong)[0])
    place = columns.quantities[(*COORDINATES, *DISPLACEMENTS)[k]]
    raise HistoryError(
        f"{locate(row)}: '{quoted(columns.name_of(place))}' is {values[row, place]:g}; a length is a finite number of "
        f"at most {LARGEST_LENGTH:g} mm, or nan for a lost point"
    )


def _missing(format: CameraFormat, names: Sequence[str], quantity: str, spellings: Sequence[str]) -> str:
    listed = ", ".join(quoted(name) for name in names[:20])
    return f"missing column '{spellings[0]}' ({quantity} of {format}); found: {quoted(listed, 400)}"


def _factor(format: CameraFormat, quantity: str, unit: str, name: str, location: str) -> float:
    """What brings a column into mm, or into s."""
    is_time = quantity == "time"
    units, wanted = (TIME_UNITS, "s") if is_time else (LENGTH_UNITS, "mm")
    unit = unit or ("" if is_time else format.unit)
    known = {one.casefold(): factor for one, factor in units.items()}
    if unit.casefold() in known:
        return known[unit.casefold()]
    if unit.casefold() in PIXELS:
        raise HistoryError(f"{location}: '{name}' is in pixels; calibrate the cameras and export it in mm")
    if not unit:
        raise HistoryError(
            f"{location}: the unit of '{name}' is not stated; write '{name} [{wanted}]', or say it by "
            f"format=dataclasses.replace(format, unit='mm')"
        )
    allowed = TIMES_ALLOWED if is_time else LENGTHS_ALLOWED
    raise HistoryError(f"{location}: '{name}' has the unit '{quoted(unit)}'; allowed are {allowed}")
