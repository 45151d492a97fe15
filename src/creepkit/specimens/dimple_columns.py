"""How a dimple is cut into columns: a strip from the axis over the roof and down the wall, fanned out to the rim.

The cavity is one smooth curve of an angle q: the floor for q < 0, the elliptic roof from 0 to pi/2, the wall beyond.
Column lines run straight from it to the top, or past one that ends in the upper outer corner, to the rim.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Floats

Numbers: TypeAlias = NDArray[np.inexact[Any]]

QUARTER = 0.5 * np.pi
TAPERED_LAYERS = np.array([0.0, 0.16, 0.38, 0.57, 0.68, 1.0])
PLATE_LAYERS = np.array([0.0, 0.17, 0.4, 0.6, 0.83, 1.0])
"""Ends of the layers, from the cavity, of a tapered dimple and of a plate with a fillet.

Their number decides: creep stress has a kink where bending changes sign, sharper for larger exponents, and the more
layers the less it matters on which side of the kink a point lies.
"""

LAYERS = len(PLATE_LAYERS) - 1

SHIFT = 1 / 3
"""How much denser the columns of a tapered roof are at its middle, where it bulges most."""

STEEPEST = 1.5
"""Largest power of the fan over the columns it runs through: the middle node of the last side along the top then lies
at .32 of it, and at .25 the element would fold."""

GROWTH_RATIO = 1.35
"""How much later the top of a tapered dimple fans out, for its roof bulges where the columns stand upright."""


class DimpleDimensions(NamedTuple):
    """The lengths of a dimple, mm; where one has an imaginary part, the points computed from it have theirs."""

    apex_thickness: Any
    cavity_radius: Any
    roof_radial: Any
    roof_axial: Any
    plate_thickness: Any
    outer_radius: Any

    @property
    def span(self) -> tuple[Any, Any]:
        """The angles at the axis and at the foot of the wall."""
        wall = self.plate_thickness - self.apex_thickness - self.roof_axial
        return 1.0 - self.cavity_radius / self.roof_radial, QUARTER + wall / self.roof_axial

    def cavity(self, angles: Numbers) -> Numbers:
        """Points (angles, 2) of the floor, the roof and the wall."""
        roof = _within_roof(angles)
        across = np.sin(roof) + np.where(angles.real < 0, angles, 0.0)
        down = 1.0 - np.cos(roof) + np.where(angles.real > QUARTER, angles - QUARTER, 0.0)
        radius = self.cavity_radius - self.roof_radial * (1.0 - across)
        height = self.plate_thickness - self.apex_thickness - self.roof_axial * down
        return np.stack([radius, height], axis=-1)


class MeshLayout(NamedTuple):
    """What stays as it is when a length of the dimple changes a little.

    floor, roof, wall : columns; what is too short for a column of its own is part of the roof.
    corner : the column line that ends in the upper outer corner.
    shift : how much denser the columns of the roof are at its middle. power : how late the top fans out.
    breaks : (layers + 1,) from 0 at the cavity to 1.
    """

    floor: int
    roof: int
    wall: int
    corner: int
    shift: float
    power: float
    breaks: Floats

    @property
    def counts(self) -> tuple[int, ...]:
        """Its whole numbers."""
        return self.floor, self.roof, self.wall, self.corner, len(self.breaks)


def mesh_layout(size: DimpleDimensions, refinement: float) -> MeshLayout:
    """The layout of a dimple with `refinement` times as many columns and layers as it needs."""
    taper = float(np.clip((size.roof_radial / size.cavity_radius - 0.2) / 0.8, 0.0, 1.0))
    columns, fine = _columns(size, 1.0), _columns(size, refinement)
    coarse = MeshLayout(*columns, 1, SHIFT * taper, 1.0, _breaks(taper, 1.0))
    corner = _corner(size, coarse)
    turn = _same_place(corner, columns, fine)
    wanted = _power(size, coarse, corner) * (1.0 + GROWTH_RATIO * taper)
    return coarse._replace(
        floor=fine[0],
        roof=fine[1],
        wall=fine[2],
        corner=turn,
        power=min(wanted, max(1.2, STEEPEST * (min(turn, fine[0] + fine[1]) - fine[0]))),
        breaks=_breaks(taper, refinement),
    )


def column_lines(size: DimpleDimensions, layout: MeshLayout) -> tuple[Numbers, Numbers]:
    """Ends of the column lines, those of mid-columns included, on the cavity and outside: (2 columns + 1, 2) each."""
    angles = _angles(size, layout)
    inner = size.cavity(angles)
    last = 2 * layout.corner
    depth = size.plate_thickness - inner[: last + 1, 1]
    turned = _within_roof(angles[: last + 1])
    fan = depth / depth[-1] * (turned / turned[-1]) ** layout.power
    outer = np.empty_like(inner)
    outer[: last + 1, 0] = inner[: last + 1, 0] + fan * (size.outer_radius - inner[last, 0])
    outer[: last + 1, 1] = size.plate_thickness
    outer[last:, 0] = size.outer_radius
    outer[last:, 1] = inner[last:, 1] / inner[last, 1] * size.plate_thickness
    inner[0, 0] = outer[0, 0] = inner[-1, 1] = outer[-1, 1] = 0.0  # exactly on the axis and on the ground
    return inner, outer


def _columns(size: DimpleDimensions, refinement: float) -> tuple[int, int, int]:
    """Columns of floor, roof and wall; unrefined 0, 8, 2 in the paper's dimple and 8, 6, 1 where a = R / 5.

    None of floor or wall is much shorter than those of the roof; what is shorter than half of one has none.
    """
    alpha = size.roof_radial / size.cavity_radius
    start, end = size.span
    height = (end - QUARTER) * size.roof_axial / size.plate_thickness
    roof = round(refinement * round(5.5 + 2.5 * alpha))
    floor, wall = (
        min(max(1, round(refinement * max(1, round(wanted)))), round(angle / (QUARTER / roof)))
        for wanted, angle in ((10.0 * (1 - alpha), -start), (3.9 * height, end - QUARTER))
    )
    return floor, roof, wall


def _corner(size: DimpleDimensions, layout: MeshLayout) -> int:
    """The column line for the upper outer corner: the end of the roof, or where the cavity lies deep enough.

    Deep enough is about as far below the top as the rim is wide, so that the strip turns at 45 degrees.
    """
    depth = size.plate_thickness - size.cavity(_angles(size, layout)[::2])[:, 1]
    wanted = min(0.9 * (size.outer_radius - size.cavity_radius), 0.55 * size.plate_thickness)
    wanted = max(wanted, size.apex_thickness + 0.4 * size.roof_axial)
    end = layout.floor + layout.roof
    if 0.6 * wanted <= depth[end] <= min(1.7 * wanted, 0.75 * size.plate_thickness):
        return end
    first = layout.floor + 1
    return int(first + np.argmin(abs(depth[first:-1] - wanted)))


def _power(size: DimpleDimensions, layout: MeshLayout, corner: int) -> float:
    """The power of the fan that makes the sides along the top about equally long at the roof's middle and its end."""
    angle = _angles(size, layout)[2 * corner]
    turned = min(angle, QUARTER)
    (radius, height), (_, end) = size.cavity(np.array([angle, turned]))
    depth, whole = size.plate_thickness - end, size.plate_thickness - height
    width = depth * min((size.outer_radius - radius) / whole, 1.25)
    deepening = size.roof_axial * turned * np.sin(turned) / depth
    return float(np.clip(1 + 0.7 * size.roof_radial * turned / width - deepening, 1.2, 6.0))


def _same_place(line: int, old: tuple[int, int, int], new: tuple[int, int, int]) -> int:
    """The column line nearest to what `line` was before every piece was divided anew; never the first or last."""
    starts = np.concatenate([[0], np.cumsum(old)])
    piece = int(np.searchsorted(starts[1:], line, side="left"))
    share = (line - starts[piece]) / old[piece]
    return int(np.clip(sum(new[:piece]) + round(share * new[piece]), 1, sum(new) - 1))


def _breaks(taper: float, refinement: float) -> Floats:
    layers = max(2, round(LAYERS * refinement))
    even = np.linspace(0.0, 1.0, LAYERS + 1)
    return np.interp(np.linspace(0.0, 1.0, layers + 1), even, taper * TAPERED_LAYERS + (1 - taper) * PLATE_LAYERS)


def _angles(size: DimpleDimensions, layout: MeshLayout) -> Numbers:
    """Angles of the column lines, those of mid-columns included, (2 columns + 1,)."""
    start, end = size.span
    rise, fall = (0.0 if layout.floor else start), (QUARTER if layout.wall else end)
    share = _halves(layout.roof)
    pieces = [
        start + (rise - start) * _halves(layout.floor)[:-1],
        rise + (fall - rise) * (share - layout.shift * share * (1 - share)),
        fall + (end - fall) * _halves(layout.wall)[1:],
    ]
    return np.concatenate(pieces)


def _within_roof(angles: Numbers) -> Numbers:
    """The angles, but not beyond the two ends of the ellipse."""
    return np.where(angles.real > QUARTER, QUARTER, np.where(angles.real < 0, 0.0, angles))


def _halves(columns: int) -> Floats:
    """Shares 0 to 1 of a piece at its column lines and mid-columns."""
    return np.arange(2 * columns + 1) / max(2 * columns, 1)
