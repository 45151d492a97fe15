"""Displacements of a surface between its nodes: matrices of quadratic shape functions along the sides of elements."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.errors import SolveError

_ROUNDING = 1e-9
"""mm by which a wanted radius may lie outside the nodes: a window that ends on a node ends inside."""


class SurfaceInterpolation(NamedTuple):
    """Matrices that the displacements of the top nodes are multiplied by.

    values : (wanted, nodes), giving the displacement at the wanted radii.
    slopes : (wanted, nodes) 1/mm, giving its derivative to r there.
    """

    values: Floats
    slopes: Floats


def surface_interpolation(radii_nodes: ArrayLike, wanted: ArrayLike) -> Floats:
    """Matrix (wanted, nodes) from the displacement of the top nodes to that at wanted radii.

    radii_nodes : (nodes,) mm, corner and middle nodes in turn from the axis outwards, in the undeformed plate.
    wanted : (wanted,) mm, or one number.

        >>> surface_interpolation([0, 1, 2], [0.5]) @ [0.0, 1.0, 4.0]
        array([0.25])
    """
    return surface_interpolation_with_slopes(radii_nodes, wanted).values


def surface_interpolation_with_slopes(radii_nodes: ArrayLike, wanted: ArrayLike) -> SurfaceInterpolation:
    """As `surface_interpolation`, with the slopes; where two sides meet, the mean of theirs.

    radii_nodes : (nodes,) mm. wanted : (wanted,) mm, or one number.
    """
    nodes, radii = checked_surface_radii(radii_nodes), np.atleast_1d(np.asarray(wanted, dtype=float))
    outside = ~((radii >= nodes[0] - _ROUNDING) & (radii <= nodes[-1] + _ROUNDING))
    if outside.any():
        raise SolveError(
            f"no displacement is known at a radius of {radii[outside][0]:g} mm; the observed surface reaches from "
            f"{nodes[0]:g} to {nodes[-1]:g} mm, ask for radii within it"
        )
    inner, outer = (
        _on_sides(nodes, radii, np.searchsorted(nodes[::2], radii + nudge) - 1) for nudge in (-_ROUNDING, _ROUNDING)
    )
    return SurfaceInterpolation(0.5 * (inner.values + outer.values), 0.5 * (inner.slopes + outer.slopes))


def checked_surface_radii(radii: ArrayLike) -> Floats:
    """Radii (nodes,) of top nodes, mm, as an array; SolveError unless they can be corner and middle nodes of sides.

    radii : (nodes,) mm, from the axis outwards.
    """
    nodes = np.asarray(radii, dtype=float)
    if nodes.ndim != 1 or nodes.size < 3 or nodes.size % 2 == 0:
        raise SolveError(
            f"the observed surface has radii of shape {nodes.shape}; it needs corner and middle nodes in turn, an odd "
            "number of three or more"
        )
    if not np.isfinite(nodes).all() or nodes[0] < 0.0 or (np.diff(nodes) <= 0.0).any():
        raise SolveError("the radii of the observed surface must be finite, not negative and increasing outwards")
    share = (nodes[1::2] - nodes[:-2:2]) / (nodes[2::2] - nodes[:-2:2])
    if not ((share > 0.25) & (share < 0.75)).all():
        k = 2 * int(np.argmax(np.abs(share - 0.5))) + 1
        raise SolveError(
            f"node {k} of the observed surface, at a radius of {nodes[k]:g} mm, is not in the middle half of its side; "
            "middle and corner nodes must come in turn"
        )
    return nodes


def _on_sides(nodes: Floats, radii: Floats, side: Ints) -> SurfaceInterpolation:
    """The matrices at radii (wanted,), mm, that lie on the sides of these numbers, or at an end of them.

    nodes : (nodes,) mm. side : (wanted,) number of the side, from the axis outwards.
    """
    side = np.clip(side, 0, nodes.size // 2 - 1)
    first, middle, last = nodes[2 * side], nodes[2 * side + 1], nodes[2 * side + 2]
    bend, reach = 0.5 * (first + last) - middle, 0.5 * (last - first)
    ahead = radii - middle
    c = 2.0 * ahead / (reach + np.sqrt(np.maximum(reach**2 + 4.0 * bend * ahead, 0.0)))
    shapes = np.stack([0.5 * c * (c - 1.0), 1.0 - c**2, 0.5 * c * (c + 1.0)], axis=1)
    slopes = np.stack([c - 0.5, -2.0 * c, c + 0.5], axis=1) / (reach + 2.0 * bend * c)[:, None]
    columns = 2 * side[:, None] + np.arange(3)
    matrices = SurfaceInterpolation(np.zeros((radii.size, nodes.size)), np.zeros((radii.size, nodes.size)))
    np.put_along_axis(matrices.values, columns, shapes, axis=1)
    np.put_along_axis(matrices.slopes, columns, slopes, axis=1)
    return matrices
