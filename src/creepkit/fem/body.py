"""Body: a mesh made ready for compiled code: integration points, equation numbers, places in the banded matrices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.mesh import Mesh
from creepkit.fem.shape import discretize


class FiniteElementModel(NamedTuple):
    """What compiled code knows of a mesh; displacements are kept as (2 nodes,) numbers, u_r and u_z in turn.

    nodes : (nodes, 2) mm. elements : (elements, 8). by_radius, by_height, over_radius : (elements, 4, 8), weights :
        (elements, 4), as in `fem.shape`.
    equations : (2 nodes,) number of the equation of a displacement, -1 where it is held.
    size, width : number of equations, half-bandwidth.
    places : (elements, 3, 8, 8) of an element's rr, rz, zz blocks in the symmetric band, laid flat; the last place is
        nobody's and takes what belongs to held displacements.
    pressed : (edges, 3) nodes; pressed_places : (edges, 3, 3, 3) of a side's rr, rz, zz blocks.
    top : (top,) nodes of the observed surface.
    """

    nodes: Floats
    elements: Ints
    by_radius: Floats
    by_height: Floats
    over_radius: Floats
    weights: Floats
    equations: Ints
    size: int
    width: int
    places: Ints
    pressed: Ints
    pressed_places: Ints
    top: Ints


def finite_element_model(mesh: Mesh) -> FiniteElementModel:
    """Prepare a mesh; refuse one that nothing holds or that is inverted."""
    at = discretize(mesh)
    free = ~mesh.held.ravel()
    if free.all() or not mesh.held[:, 1].any():
        raise SolveError("nothing holds the mesh along its axis; hold u_z somewhere")
    equations = np.where(free, np.cumsum(free) - 1, -1)
    both = np.stack([2 * mesh.elements, 2 * mesh.elements + 1], axis=1)
    numbers = equations[both]
    width = _half_bandwidth(numbers.reshape(len(numbers), 16))
    sides = equations[np.stack([2 * mesh.pressed, 2 * mesh.pressed + 1], axis=1)]
    size = int(free.sum())
    return FiniteElementModel(
        nodes=mesh.nodes,
        elements=mesh.elements,
        by_radius=at.by_radius,
        by_height=at.by_height,
        over_radius=np.ascontiguousarray(at.over_radius),
        weights=np.ascontiguousarray(at.weights),
        equations=equations,
        size=size,
        width=width,
        places=_places(numbers, size, width),
        pressed=mesh.pressed,
        pressed_places=_places(sides, size, width),
        top=mesh.top,
    )


def band_shape(size: int, width: int) -> tuple[int, int]:
    """Shape of the symmetric band with its padding (see `fem.band`)."""
    from creepkit.fem.band import BLOCK

    return (size + BLOCK - 1) // BLOCK * BLOCK + width + BLOCK, width + 1 + BLOCK


def _half_bandwidth(numbers: Ints) -> int:
    """Largest distance between two equations of one element."""
    high = numbers.max(axis=1)
    low = np.where(numbers >= 0, numbers, np.iinfo(np.int64).max).min(axis=1)
    return int(np.max(np.where(high >= 0, high - low, 0), initial=0))


def _places(numbers: Ints, size: int, width: int) -> Ints:
    """Flat places in the band of the blocks rr, rz, zz; numbers : (elements, 2, nodes)."""
    rows, columns = band_shape(size, width)
    blocks = []
    for i, j in ((0, 0), (0, 1), (1, 1)):
        one, other = numbers[:, i, :, None], numbers[:, j, None, :]
        low, high = np.minimum(one, other), np.maximum(one, other)
        blocks.append(np.where(low >= 0, low * columns + high - low, rows * columns))
    return np.ascontiguousarray(np.stack(blocks, axis=1))
