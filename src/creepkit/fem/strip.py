"""A strip of eight-node elements between two lines, numbered across the strip so that the bandwidth stays small."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats, Ints


class StripMesh(NamedTuple):
    """Nodes and elements of a strip, and its four sides as node numbers.

    nodes : (nodes, 2) mm. elements : (elements, 8), in the order that `Mesh` asks for.
    inner, outer : (columns, 3) element sides along the two lines, the solid to their left.
    first, last : (2 layers + 1,) nodes of the first and of the last column line, from the inner side.
    inner_line, outer_line : (2 columns + 1,) corner and middle nodes along the two lines, from the first column on.
    """

    nodes: Floats
    elements: Ints
    inner: Ints
    outer: Ints
    first: Ints
    last: Ints
    inner_line: Ints
    outer_line: Ints


def strip_mesh(inner: Floats, outer: Floats, breaks: Floats) -> StripMesh:
    """The strip whose column lines run straight from `inner` to `outer`.

    inner, outer : (2 columns + 1, 2) ends of the column lines, those of mid-columns included; each lies on its curve,
        so the sides of the elements are parabolas through three points of it.
    breaks : (layers + 1,) rising from 0 on the inner side to 1 on the outer side.
    With `layers` layers the half-bandwidth of a matrix of two unknowns a node is 6 layers + 9.
    """
    columns, layers = len(inner) // 2, len(breaks) - 1
    start = (3 * layers + 2) * np.arange(columns + 1)
    middle = start[:-1] + 2 * layers + 1
    a, b, j = start[:-1, None], start[1:, None], np.arange(layers)
    corners = [a + 2 * j, b + 2 * j, b + 2 * j + 2, a + 2 * j + 2]
    middles = [middle[:, None] + j, b + 2 * j + 1, middle[:, None] + j + 1, a + 2 * j + 1]
    elements = np.stack(corners + middles, axis=2)
    inner_line = _interleaved(start, middle)
    outer_line = _interleaved(start + 2 * layers, middle + layers)
    return StripMesh(
        nodes=strip_nodes(inner, outer, breaks),
        elements=elements.reshape(-1, 8),
        inner=elements[:, 0, [0, 4, 1]],
        outer=elements[:, -1, [2, 6, 3]],
        first=np.arange(2 * layers + 1),
        last=start[-1] + np.arange(2 * layers + 1),
        inner_line=inner_line,
        outer_line=outer_line,
    )


def strip_nodes(inner: Floats, outer: Floats, breaks: Floats) -> Floats:
    """The nodes of a strip, (nodes, 2); linear in the two sides, so velocities of the sides give those of the nodes."""
    fine = np.empty(2 * len(breaks) - 1)
    fine[::2], fine[1::2] = breaks, 0.5 * (breaks[:-1] + breaks[1:])
    lines = [_points_across(inner[k], outer[k], breaks if k % 2 else fine) for k in range(len(inner))]
    return np.concatenate(lines)


def _points_across(inner: Floats, outer: Floats, breaks: Floats) -> Floats:
    return np.asarray((1 - breaks[:, None]) * inner + breaks[:, None] * outer)


def _interleaved(corners: Ints, middles: Ints) -> Ints:
    line = np.empty(corners.size + middles.size, dtype=np.int64)
    line[::2], line[1::2] = corners, middles
    return line
