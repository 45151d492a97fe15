"""Geometry and structured mesh of the dimple: a plate hollowed from below until a thin roof is left.

Half section, mm: a flat floor z = H - h for r <= R - a, an elliptic roof (R - a + a sin q, H - h - b + b cos q) for q
from 0 to pi/2, a vertical wall r = R down to z = 0. With a = R the floor is absent. The mesh is a strip of columns
from the axis over the roof and down the wall.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Floats
from creepkit.errors import SolveError, refuse_unknown
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.mesh import Mesh, strip_mesh, strip_nodes
from creepkit.limits import numbers

EDGES = ("bottom", "rim")


LENGTH_RANGE = numbers(1e-3, 1e4)
"""Least and greatest length, mm."""


REFINEMENT_RANGE = numbers(0.5, 16.0)
"""Least and greatest refinement of a mesh; below it two layers would be left, or columns too few for the roof."""


_COMPLEX_STEP = 1e-30


@dataclass(frozen=True)
class DimpleGeometry:
    """The numbers of a dimple, mm.

    apex_thickness : h, between the middle of the roof and the top.
    cavity_radius : R. roof_radial, roof_axial : a and b, the semi-axes of the ellipse.
    plate_thickness : H. outer_radius : Ro, of the modelled disc.
    clamped : any of "bottom" (z = 0 from R to Ro) and "rim" (r = Ro over all z).
    """

    apex_thickness: float = 0.5
    cavity_radius: float = 7.5
    roof_radial: float = 7.5
    roof_axial: float = 1.5
    plate_thickness: float = 4.0
    outer_radius: float = 10.0
    clamped: tuple[str, ...] = EDGES

    lengths: ClassVar[tuple[str, ...]] = (
        "apex_thickness",
        "cavity_radius",
        "roof_radial",
        "roof_axial",
        "plate_thickness",
        "outer_radius",
    )

    def __post_init__(self) -> None:
        for name in self.lengths:
            object.__setattr__(self, name, _checked_length(name, getattr(self, name)))
        object.__setattr__(self, "clamped", _checked_edges(self.clamped))
        _refuse_contradictions(self)

    def replace(self, **changes: Any) -> DimpleGeometry:
        """The same dimple with some fields changed."""
        return replace(self, **changes)

    def mesh(self, refinement: float = 1.0) -> Mesh:
        """A structured mesh; `refinement` 2 has twice as many elements each way, 0.5 is the least.

        1 is meant for production: 10 columns of 5 layers in the tapered dimple, 15 of 5 in a plate with a fillet.
        """
        layout = self._layout(refinement)
        inner, outer = (side.real for side in column_lines(self._dimensions(), layout))
        body = strip_mesh(inner, outer, layout.breaks)
        held = np.zeros(body.nodes.shape, dtype=bool)
        if "bottom" in self.clamped:
            held[body.last] = True
        if "rim" in self.clamped:
            held[body.outer_line[2 * layout.corner :]] = True
        return Mesh(body.nodes, body.elements, held, body.inner, body.outer_line[: 2 * layout.corner + 1])

    def mesh_velocity(self, field: str, refinement: float = 1.0) -> Floats:
        """Derivative of the nodes of `mesh` to one length, (nodes, 2), with the columns and layers of this dimple."""
        refuse_unknown(field, self.lengths, SolveError, f"dimple: no length is called '{field}'")
        layout = self._layout(refinement)
        size = DimpleDimensions(*map(complex, self._dimensions()))
        # an imaginary step is exact, also where a real one would leave the allowed range, as at roof_radial = R
        changed = size._replace(**{field: complex(getattr(self, field), _COMPLEX_STEP)})
        inner, outer = (side.imag / _COMPLEX_STEP for side in column_lines(changed, layout))
        return strip_nodes(inner, outer, layout.breaks) + self._layout_velocity(field, refinement)

    def _layout_velocity(self, field: str, refinement: float) -> Floats:
        """What the layout adds: where columns and layers lie changes with the length, how many there are does not."""
        size, step = self._dimensions(), 1e-6 * getattr(self, field)
        lengths = (size._replace(**{field: getattr(self, field) + s}) for s in (step, -step))
        up, down = (mesh_layout(each, float(refinement)) for each in lengths)
        if up.counts != down.counts:
            return np.zeros(2)
        ahead, behind = (_nodes(size, layout) for layout in (up, down))
        return np.asarray((ahead - behind) / (2 * step))

    def _dimensions(self) -> DimpleDimensions:
        return DimpleDimensions(*(getattr(self, name) for name in self.lengths))

    def _layout(self, refinement: float) -> MeshLayout:
        if refinement not in REFINEMENT_RANGE:
            raise SolveError(
                f"dimple: refinement is {refinement!r}; allowed is {REFINEMENT_RANGE}, 2 giving twice as many elements "
                "each way as 1, the mesh for production"
            )
        return mesh_layout(self._dimensions(), float(refinement))


@lru_cache(maxsize=256)
def model_of_geometry(geometry: DimpleGeometry, refinement: float) -> FiniteElementModel:
    """The finite element model of a dimple; kept, for a fit needs it a thousand times."""
    return finite_element_model(geometry.mesh(refinement))


def _nodes(size: DimpleDimensions, layout: MeshLayout) -> Floats:
    """Nodes of a dimple of that size, laid out so."""
    inner, outer = (side.real for side in column_lines(size, layout))
    return strip_nodes(inner, outer, layout.breaks)


def _checked_length(name: str, value: Any) -> float:
    """One length as a float."""
    if value not in LENGTH_RANGE:
        raise SolveError(f"dimple: {name} is {value!r}; allowed is {LENGTH_RANGE}, a length in mm")
    return float(value)


def _checked_edges(clamped: str | Iterable[str]) -> tuple[str, ...]:
    """The clamped edges, each once and in one order."""
    chosen = {clamped} if isinstance(clamped, str) else set(clamped)
    if not chosen or not chosen <= set(EDGES):
        result = ", ".join(f"'{edge}'" for edge in sorted(map(str, chosen))) or "empty"
        raise SolveError(
            f"dimple: clamped is {result}; allowed are 'bottom', 'rim' or both, for the plate must be held"
        )
    return tuple(edge for edge in EDGES if edge in chosen)


def _refuse_contradictions(g: DimpleGeometry) -> None:
    """Lengths that do not fit each other."""
    height = g.roof_axial + g.apex_thickness
    if height > g.plate_thickness * (1 + 1e-12):
        raise SolveError(
            f"dimple: the roof would stand above the plate: roof_axial {g.roof_axial:g} mm and apex_thickness "
            f"{g.apex_thickness:g} mm add up to {height:g} mm, allowed is up to plate_thickness {g.plate_thickness:g} "
            "mm; make one of them smaller or the plate thicker"
        )
    if g.roof_radial > g.cavity_radius:
        raise SolveError(
            f"dimple: roof_radial is {g.roof_radial:g} mm; allowed is up to cavity_radius {g.cavity_radius:g} mm, "
            "where the roof reaches from the axis to the wall; make it smaller or the cavity wider"
        )
    if g.outer_radius <= g.cavity_radius:
        raise SolveError(
            f"dimple: outer_radius is {g.outer_radius:g} mm; allowed is above cavity_radius {g.cavity_radius:g} mm, "
            "for a rim must stand around the cavity; make it larger or the cavity narrower"
        )


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
at 0.32 of it, and at 0.25 the element would fold."""


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


@lru_cache(maxsize=256)
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
