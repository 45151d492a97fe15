"""The dimple: a plate hollowed from below until a thin roof is left, which gas pressure bulges.

Half section, mm: a flat floor z = H - h for r <= R - a, an elliptic roof (R - a + a sin q, H - h - b + b cos q) for
q from 0 to pi/2, a vertical wall r = R down to z = 0. With a = R the floor is absent: the tapered dimple. Below zero
and above pi/2 the angle q is continued along the floor and down the wall, so that the whole cavity is one smooth curve.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, ClassVar

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError, nearest
from creepkit.fem.mesh import Mesh
from creepkit.fem.strip import strip_mesh, strip_nodes
from creepkit.specimens.dimple_columns import DimpleDimensions, MeshLayout, mesh_layout, column_lines

EDGES = ("bottom", "rim")
LENGTH_RANGE = (1e-3, 1e4)
"""Least and greatest length, mm."""

REFINEMENT_RANGE = (0.5, 16.0)
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
        if field not in self.lengths:
            raise SolveError(f"dimple: no length is called '{field}'; {nearest(field, self.lengths)}")
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

    def section(self, points: int = 100) -> Floats:
        """The outline of the half section, (points, 2), from the middle of the roof and closed; for drawing."""
        H, Ro = self.plate_thickness, self.outer_radius
        size = self._dimensions()
        cavity = size.cavity(np.linspace(*size.span, max(points - 4, 2)))
        return np.vstack([cavity, [[Ro, 0.0], [Ro, H], [0.0, H]], cavity[:1]])

    def _dimensions(self) -> DimpleDimensions:
        return DimpleDimensions(*(getattr(self, name) for name in self.lengths))

    def _layout(self, refinement: float) -> MeshLayout:
        least, most = REFINEMENT_RANGE
        if not _between(refinement, least, most):
            raise SolveError(
                f"dimple: refinement is {refinement!r}; allowed is a number from {least:g} to {most:g}, 2 giving twice "
                "as many elements each way as 1, the mesh for production"
            )
        return mesh_layout(self._dimensions(), float(refinement))


def _nodes(size: DimpleDimensions, layout: MeshLayout) -> Floats:
    """Nodes of a dimple of that size, laid out so."""
    inner, outer = (side.real for side in column_lines(size, layout))
    return strip_nodes(inner, outer, layout.breaks)


def _between(value: object, least: float, most: float) -> bool:
    return not isinstance(value, bool) and isinstance(value, Real) and least <= float(value) <= most


def _checked_length(name: str, value: Any) -> float:
    """One length as a float."""
    least, most = LENGTH_RANGE
    if not _between(value, least, most):
        raise SolveError(f"dimple: {name} is {value!r}; allowed is a number from {least:g} to {most:g}, a length in mm")
    return float(value)


def _checked_edges(clamped: str | Iterable[str]) -> tuple[str, ...]:
    """The clamped edges, each once and in one order."""
    chosen = {clamped} if isinstance(clamped, str) else set(clamped)
    if not chosen or not chosen <= set(EDGES):
        result = ", ".join(f"'{edge}'" for edge in sorted(map(str, chosen))) or "empty"
        raise SolveError(f"dimple: clamped is {result}; allowed are 'bottom', 'rim' or both, for the plate must be held")
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
