"""The eight-node quadrilateral: its shape functions, its 2 x 2 points, and what a mesh is at those points.

Serendipity functions as in Zienkiewicz and Taylor, The Finite Element Method, vol. 1. Integration by 2 x 2 points keeps
the element from locking when creep makes it incompressible. The factor 2 pi is dropped from every integral.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.mesh import CORNERS, Mesh

GAUSS_POINTS = CORNERS / np.sqrt(3.0)
"""The 2 x 2 Gauss points (4, 2) of the reference element, each near the corner of its number; all weights are 1."""


class Discretization(NamedTuple):
    """A mesh at its integration points: (elements, 4 points, 8 nodes) unless said otherwise; mm.

    by_radius, by_height : derivatives of the shape functions to r and to z, 1/mm.
    over_radius : shape functions divided by the radius of the point, 1/mm.
    weights : (elements, 4) area of the section that belongs to a point, times its radius, mm^3.
    points : (elements, 4, 2) r and z, mm.
    """

    by_radius: Floats
    by_height: Floats
    over_radius: Floats
    weights: Floats
    points: Floats


class GeometryDerivative(NamedTuple):
    """How the points move with a number of the geometry, for each unit of it.

    gradient : (elements, 4, 2, 2) derivative of the velocity's component (first of the two) to r and z.
    hoop : (elements, 4) radial velocity over the radius.
    """

    gradient: Floats
    hoop: Floats


def shape_functions(places: Floats) -> Floats:
    """Values (places, 8) at places (places, 2) of the reference element."""
    x, y = places[:, :1], places[:, 1:]
    cx, cy = CORNERS.T
    corner = 0.25 * (1 + x * cx) * (1 + y * cy) * (x * cx + y * cy - 1)
    below_above = 0.5 * (1 - x**2) * (1 + y * np.array([-1.0, 1.0]))
    right_left = 0.5 * (1 + x * np.array([1.0, -1.0])) * (1 - y**2)
    return np.hstack([corner, _alternate(below_above, right_left)])


def shape_gradients(places: Floats) -> Floats:
    """Derivatives (places, 8, 2) to the two local coordinates at places (places, 2)."""
    x, y = places[:, :1], places[:, 1:]
    cx, cy = CORNERS.T
    up, right = np.array([-1.0, 1.0]), np.array([1.0, -1.0])
    by_x = 0.25 * cx * (1 + y * cy) * (2 * x * cx + y * cy)
    by_y = 0.25 * cy * (1 + x * cx) * (x * cx + 2 * y * cy)
    by_x = np.hstack([by_x, _alternate(-x * (1 + y * up), 0.5 * right * (1 - y**2))])
    by_y = np.hstack([by_y, _alternate(0.5 * (1 - x**2) * up, -(1 + x * right) * y)])
    return np.stack([by_x, by_y], axis=2)


def discretize(mesh: Mesh) -> Discretization:
    """Everything an integral over the mesh needs; an inverted element is refused."""
    refuse_inverted(mesh)
    nodes = mesh.nodes[mesh.elements]
    values = shape_functions(GAUSS_POINTS)
    points = np.einsum("pa,eai->epi", values, nodes)
    tangents = local_tangents(nodes, GAUSS_POINTS)
    slopes = np.einsum("epji,pai->epja", np.linalg.inv(tangents), shape_gradients(GAUSS_POINTS))
    return Discretization(
        by_radius=np.ascontiguousarray(slopes[:, :, 0]),
        by_height=np.ascontiguousarray(slopes[:, :, 1]),
        over_radius=values / points[:, :, :1],
        weights=np.linalg.det(tangents) * points[:, :, 0],
        points=points,
    )


def geometry_derivative(mesh: Mesh, velocity: Floats) -> GeometryDerivative:
    """What exact shape derivatives need when the nodes move with `velocity` (nodes, 2), mm a unit of the number."""
    at = discretize(mesh)
    moves = velocity[mesh.elements]
    gradient = np.stack([np.einsum("epa,eai->epi", slopes, moves) for slopes in (at.by_radius, at.by_height)], axis=3)
    return GeometryDerivative(gradient, np.einsum("epa,ea->ep", at.over_radius, moves[:, :, 0]))


def local_tangents(nodes: Floats, places: Floats) -> Floats:
    """Derivatives (elements, places, 2 local, 2) of r and z, for nodes (elements, 8, 2)."""
    return np.asarray(np.einsum("pai,eaj->epij", shape_gradients(places), nodes))


def refuse_inverted(mesh: Mesh) -> None:
    """Raise SolveError when an element is turned inside out at a corner or at an integration point."""
    places = np.vstack([CORNERS, GAUSS_POINTS])
    areas = np.linalg.det(local_tangents(mesh.nodes[mesh.elements], places))
    bad = np.flatnonzero(~(areas > 0).all(axis=1))
    if bad.size:
        worst = mesh.nodes[mesh.elements[bad[0], :4]].mean(axis=0)
        raise SolveError(
            f"element {bad[0]} of the mesh, near r = {worst[0]:.4g} mm, z = {worst[1]:.4g} mm, is inverted "
            f"({bad.size} of {len(areas)} elements are); number its corners anticlockwise and keep its middle nodes "
            "near the middle of its sides, or change the refinement of a mesh that was made here"
        )


def _alternate(first: Floats, second: Floats) -> Floats:
    """Columns of two arrays (places, 2) in turn: the middles of the sides 1-2, 2-3, 3-4, 4-1."""
    return np.stack([first, second], axis=2).reshape(len(first), 4)
