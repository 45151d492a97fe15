"""How a camera system writes its frames: the declaration from which the readers of cameras work."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from creepkit.arrays import set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, nearest, quoted
from creepkit.records.units import spelled_factors

LENGTH_UNITS = spelled_factors("mm", "m", "cm", "um", "in")
"""{spelling of a unit: mm}."""


TIME_UNITS = spelled_factors("s", "ms", "us", "min", "h")
"""{spelling of a unit: s}."""


LENGTHS_ALLOWED, TIMES_ALLOWED = "mm, m, cm, um, in", "s, ms, us, min, h"
"""In messages."""


PIXELS = ("px", "pixel", "pixels", "pix")


COORDINATES, DISPLACEMENTS = ("x", "y", "z"), ("u", "v", "w")


OUT_OF_PLANE = ("z", "w")


QUANTITIES_OF_FRAMES = (*COORDINATES, *DISPLACEMENTS, "time", "image_x", "image_y")


_UNIT_IN_BRACKETS = re.compile(r"^([^\[(]*)[\[(]([^\])]*)[\])]$")


_RULE = re.compile(r"\s*(<=|>=|<|>|==)\s*([+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)\s*", re.ASCII)


class ColumnName(NamedTuple):
    """The name of a column without its unit, and the unit that stands with it; "" where none does."""

    name: str
    unit: str

    @classmethod
    def of(cls, text: str) -> ColumnName:
        """From the head of a file: `X [mm]`, `coor.X.mm`, `stereo_x_mm`, `"W (in)"`, `SIGMA`."""
        return _column_name(text)


@lru_cache(maxsize=4096)
def _column_name(text: str) -> ColumnName:
    """Of a text, of which all frames and all formats have the same."""
    text = " ".join(text.strip().strip('"').split())
    if found := _UNIT_IN_BRACKETS.match(text):
        return ColumnName(_plain(found[1]), found[2].strip())
    stem, mark, last = _plain(text).rpartition(" ")
    if mark and last in (*LENGTH_UNITS, *TIME_UNITS, *PIXELS):
        return ColumnName(stem, last)
    return ColumnName(_plain(text), "")


def _plain(name: str) -> str:
    """A name whose separators are blanks, so that `disp.Out-Of-Plane: W` and `disp_Out_Of_Plane_W` are one."""
    return " ".join(re.split(r"[\s._:\-]+", name.strip())).strip()


@dataclass(frozen=True)
class LostRule:
    """A column and what it holds for points that are lost: "< 0", "== -1"."""

    column: str
    comparison: str
    value: float


@checked
@dataclass(frozen=True)
class CameraFormat:
    """How one camera system writes its frames.

    name, title : short name, and one sentence. columns : {quantity: column}, or a tuple of such mappings, one for each
        version of the system; a column may be a tuple of spellings, and is given without its unit. Quantities are
        x y z (coordinates), u v w (displacements), where there is such a column time, and image_x, image_y (pixels)
        where only they tell the system from another one. Without z and w the format is that of a flat surface that
        moves in its plane.
    unit : of lengths where the head of the file states none; "" makes that an error.
    deformed : whether x y z are where the points are now, rather than where they were in the reference image.
    axes : factors of x, y, z, each 1 or -1, that turn them into right-handed axes whose z points to the cameras. Two
        factors of -1, or none, are a rotation; one, or three, say that the axes of the files are left-handed, as those
        are whose y points down and whose z points to the cameras.
    lost : {column: rule} of points that the correlation lost, such as {"sigma": "< 0"}; NaN is one in all systems.
    patterns : names of files, such as "*.csv".
    """

    name: str
    title: str
    columns: Mapping[str, str | tuple[str, ...]] | tuple[Mapping[str, str | tuple[str, ...]], ...]
    unit: str = ""
    deformed: bool = False
    axes: tuple[int, int, int] = (1, 1, 1)
    lost: Mapping[str, str] | tuple[LostRule, ...] = ()
    patterns: tuple[str, ...] = ("*.csv", "*.txt", "*.dat")

    def __post_init__(self) -> None:
        given = (self.columns,) if isinstance(self.columns, Mapping) else self.columns
        if not given:
            raise HistoryError(f"{self}: columns are empty; give {{quantity: column}}, or a tuple of them")
        if self.unit and self.unit not in LENGTH_UNITS:
            raise HistoryError(f"{self}: '{self.unit}' is no unit of length; {nearest(self.unit, LENGTH_UNITS)}")
        if not {*self.axes} <= {1, -1}:
            raise HistoryError(f"{self}: axes are {quoted(repr(self.axes), 60)}; give three factors that are 1 or -1")
        lost = tuple(self._rule(*rule) for rule in self.lost.items()) if isinstance(self.lost, Mapping) else self.lost
        set_fields(self, columns=tuple(self._checked_columns(one) for one in given), lost=lost)

    def __str__(self) -> str:
        return f"camera format '{self.name}'"

    @property
    def versions(self) -> tuple[Mapping[str, tuple[str, ...]], ...]:
        """{quantity: spellings of its column} of each version of the system."""
        return self.columns  # type: ignore[return-value]  # brought into this form when made

    @property
    def lost_rules(self) -> tuple[LostRule, ...]:
        """The rules of `lost`."""
        return self.lost  # type: ignore[return-value]  # brought into this form when made

    def _checked_columns(self, given: Mapping[str, str | tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        for quantity in given:
            if quantity not in QUANTITIES_OF_FRAMES:
                found = nearest(str(quantity), QUANTITIES_OF_FRAMES)
                raise HistoryError(f"{self}: '{quantity}' is no quantity of a frame; {found}")
        flat = not {*OUT_OF_PLANE} & {*given}
        needed = [q for q in (*COORDINATES, *DISPLACEMENTS) if not (flat and q in OUT_OF_PLANE)]
        if missing := [quantity for quantity in needed if quantity not in given]:
            raise HistoryError(f"{self}: no column is given for {missing[0]}; name those of {' '.join(needed)}")
        result: dict[str, tuple[str, ...]] = {}
        taken: dict[ColumnName, str] = {}
        for quantity, one in given.items():
            spellings = (one,) if isinstance(one, str) else tuple(one)
            if not spellings or not all(ColumnName.of(word).name for word in spellings):
                raise HistoryError(f"{self}: the column of {quantity} is {quoted(repr(one), 60)}; give its name")
            for name in map(ColumnName.of, spellings):
                if taken.setdefault(name, quantity) != quantity:
                    raise HistoryError(
                        f"{self}: the column '{name.name}' is named for {taken[name]} and for {quantity}; give each one"
                    )
            result[quantity] = spellings
        return result

    def _rule(self, column: str, rule: str) -> LostRule:
        found = _RULE.fullmatch(rule)
        if found is None:
            raise HistoryError(f"{self}: the rule of '{column}' is {rule!r}; write one such as '< 0' or '== -1'")
        return LostRule(column, found[1], float(found[2]))
