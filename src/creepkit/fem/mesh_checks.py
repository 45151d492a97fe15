"""What a mesh is worth: the shape of its elements, its outline, and the bandwidth of its matrices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.fem.mesh import CORNERS, Mesh
from creepkit.fem.shape import GAUSS_POINTS, local_tangents

SIDES = np.array([[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]])
"""First, middle and last node of each side of an element."""


class MeshQuality(NamedTuple):
    """The worst of each element over its corners and integration points, 1 for a rectangle and 0 for a collapsed one.

    sine : (elements,) sine of the angle between its two local directions.
    evenness : (elements,) smallest over largest local area.
    """

    sine: Floats
    evenness: Floats


def mesh_quality(mesh: Mesh) -> MeshQuality:
    """How far the elements of a mesh are from parallelograms with right angles."""
    tangents = local_tangents(mesh.nodes[mesh.elements], np.vstack([CORNERS, GAUSS_POINTS]))
    areas = np.linalg.det(tangents)
    lengths = np.linalg.norm(tangents, axis=3).prod(axis=2)
    return MeshQuality((areas / lengths).min(axis=1), areas.min(axis=1) / areas.max(axis=1))


def half_bandwidth(elements: Ints) -> int:
    """Diagonals beside the main one in a matrix of two unknowns a node."""
    return int(2 * np.ptp(elements, axis=1).max() + 1)


def outline(elements: Ints) -> Ints:
    """Element and side number (sides, 2) of the sides that belong to one element only."""
    ends = np.sort(elements[:, SIDES[:, [0, 2]]].reshape(-1, 2), axis=1)
    _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
    alone = np.sort(first[count == 1])
    return np.stack([alone // 4, alone % 4], axis=1)
