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
    OUT_OF_PLANE,
    PIXELS,
    TIME_UNITS,
    TIMES_ALLOWED,
    CameraFormat,
    ColumnName,
)

LARGEST_LENGTH = 1e6
"""mm; what is beyond is no coordinate of a test piece."""


OPTIONAL = ("confidence", "time")


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
    confidence_unit : of the column confidence.
    """

    names: tuple[str, ...]
    positions: tuple[int, ...]
    quantities: Mapping[str, int]
    factors: Mapping[str, float]
    rules: tuple[tuple[int, str, float], ...]
    confidence_unit: str

    def name_of(self, place: int) -> str:
        """The name of a column that is read."""
        return self.names[self.positions[place]]


def fits(format: CameraFormat, names: Sequence[str], any_case: bool = False) -> bool:
    """Whether a table with columns of these names is one of the format; by the letter unless any_case."""
    return _version_of(format, [ColumnName.of(name).name for name in names], any_case) is not None


def count_of_columns(format: CameraFormat, names: Sequence[str]) -> int:
    """How many of the format's columns are among these names, by the letter, of its nearest version."""
    known = {ColumnName.of(name).name for name in names}
    return max(
        sum(any(ColumnName.of(word).name in known for word in spellings) for spellings in version.values())
        for version in format.versions
    )


def looks_planar(format: CameraFormat, names: Sequence[str]) -> bool:
    """Whether these are the columns of a two-dimensional correlation of the system."""
    known = {ColumnName.of(name).name for name in names}

    def has(spellings: Sequence[str]) -> bool:
        return any(ColumnName.of(word).name in known for word in spellings)

    if format.planar and all(has((name,)) for name in format.planar):
        return True
    return any(
        has(version["u"]) and has(version["v"]) and not (has(version["z"]) or has(version["w"]))
        for version in format.versions
        if "w" in version
    )


def columns_of(format: CameraFormat, names: Sequence[str], location: str) -> FrameColumns:
    """The columns of a frame; HistoryError for one that is missing, comes twice, or has no unit of length.

    A spelling with other capitals is taken where it is the only one.
    """
    parsed = [ColumnName.of(name) for name in names]
    version = _version_of(format, [one.name for one in parsed]) or _nearest_version(format, parsed)
    places: dict[str, int] = {}
    spelt: dict[str, ColumnName] = {}
    for quantity, spellings in version.items():
        found = [(k, word) for word in spellings for k in _matches(parsed, word)]
        if len({k for k, _ in found}) > 1:  # the same in the image and on the surface, as of pyvale
            found = [(k, word) for k, word in found if parsed[k].unit.casefold() not in PIXELS] or found
        if len({k for k, _ in found}) > 1:
            both = " and ".join(f"'{quoted(names[k])}'" for k in sorted({k for k, _ in found})[:2])
            raise HistoryError(f"{location}: {both} both are the column {quantity} of {format}; keep one of them")
        if found:
            places[quantity], spelt[quantity] = found[0][0], ColumnName.of(found[0][1])
        elif quantity not in OPTIONAL:
            raise HistoryError(f"{location}: {_missing(format, names, quantity, spellings)}")
    wanted = {q: k for q, k in places.items() if q not in ("image_x", "image_y")}
    units = {q: parsed[k].unit or spelt[q].unit for q, k in wanted.items()}
    factors = {
        q: _factor(format, q, units[q], quoted(names[k]), location) for q, k in wanted.items() if q != "confidence"
    }
    positions = list(wanted.values())
    rules = []
    for rule in format.lost_rules:
        for k in _matches(parsed, rule.column):
            if k not in positions:
                positions.append(k)
            rules.append((positions.index(k), rule.comparison, rule.value))
    return FrameColumns(
        tuple(names),
        tuple(positions),
        {q: positions.index(k) for q, k in wanted.items()},
        factors,
        tuple(rules),
        units.get("confidence", "") or (format.confidence_unit if "confidence" in wanted else ""),
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
    confidence = np.full(len(values), np.nan)
    if "confidence" in columns.quantities:
        confidence = values[:, columns.quantities["confidence"]]
    return CameraFrame(lengths[:, :3], lengths[:, 3:], valid, confidence, time, source)


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


def _matches(parsed: Sequence[ColumnName], word: str) -> list[int]:
    """Positions of the columns of a name; where there is none, those with other capitals."""
    wanted = ColumnName.of(word)
    found = [k for k, one in enumerate(parsed) if one.name == wanted.name]
    return found or [k for k, one in enumerate(parsed) if one.name.casefold() == wanted.name.casefold()]


def _version_of(
    format: CameraFormat, names: Sequence[str], any_case: bool = False
) -> Mapping[str, tuple[str, ...]] | None:
    """The first version of the system all of whose columns are there."""
    fold = str.casefold if any_case else str
    known = {fold(name) for name in names}
    for version in format.versions:
        needed = (spellings for quantity, spellings in version.items() if quantity not in OPTIONAL)
        if all(any(fold(ColumnName.of(word).name) in known for word in spellings) for spellings in needed):
            return version
    return None


def _nearest_version(format: CameraFormat, parsed: Sequence[ColumnName]) -> Mapping[str, tuple[str, ...]]:
    """The version of which most columns are there."""

    def count(version: Mapping[str, tuple[str, ...]]) -> int:
        return sum(any(_matches(parsed, word) for word in spellings) for spellings in version.values())

    return max(format.versions, key=count)


def _missing(format: CameraFormat, names: Sequence[str], quantity: str, spellings: Sequence[str]) -> str:
    if quantity in OUT_OF_PLANE and looks_planar(format, names):
        return (
            "a table of a two-dimensional correlation, which has no out-of-plane displacement; export a stereo one, or "
            "name x, y, u and v alone with format=ck.CameraFormat(...)"
        )
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
