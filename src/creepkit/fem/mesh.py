"""Mesh: nodes, eight-node elements, what is held, where the pressure acts, and where the surface is looked at."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints, frozen
from creepkit.errors import SolveError

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
"""Corners of the reference element; mid-side nodes follow, on the sides 1-2, 2-3, 3-4 and 4-1."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A half section of a body of revolution, in mm.

    nodes : (nodes, 2) radius r >= 0 and height z.
    elements : (elements, 8) nodes of each element, four corners anticlockwise (r to the right, z up), then the nodes
        in the middle of the sides 1-2, 2-3, 3-4, 4-1.
    held : (nodes, 2) whether u_r and u_z are prescribed (zero unless a motion is given); u_r is held on the axis.
    pressed : (edges, 3) sides under pressure: first, middle and last node, in the order of the element they belong to
        (the solid lies to the left).
    top : (top nodes,) corner and middle nodes of the observed surface in turn, from the axis outwards; an odd number,
        or none.
    """

    nodes: Floats
    elements: Ints
    held: Bools
    pressed: Ints
    top: Ints

    def __post_init__(self) -> None:
        freeze = object.__setattr__
        freeze(self, "nodes", frozen(self.nodes))
        freeze(self, "elements", frozen(self.elements, dtype=np.int64))
        held = np.array(self.held, bool)
        held[self.nodes[:, 0] <= 0.0, 0] = True
        freeze(self, "held", frozen(held, dtype=np.bool_))
        freeze(self, "pressed", frozen(np.reshape(self.pressed, (-1, 3)), dtype=np.int64))
        freeze(self, "top", frozen(self.top, dtype=np.int64))
        if self.nodes.ndim != 2 or self.nodes.shape[1] != 2 or not np.isfinite(self.nodes).all():
            raise SolveError("a mesh needs nodes of two finite coordinates, r and z in mm")
        if (self.nodes[:, 0] < 0).any():
            k = int(np.argmin(self.nodes[:, 0]))
            raise SolveError(f"node {k} of the mesh has a radius of {self.nodes[k, 0]:g} mm; it must not be negative")
        for name, array in (("elements", self.elements), ("pressed", self.pressed), ("top", self.top)):
            if array.size and not 0 <= array.min() <= array.max() < len(self.nodes):
                raise SolveError(f"the mesh has {len(self.nodes)} nodes, but its {name} name node {array.max()}")

    def moved(self, nodes: Floats) -> Mesh:
        """The same mesh with its nodes elsewhere."""
        return replace(self, nodes=nodes)
