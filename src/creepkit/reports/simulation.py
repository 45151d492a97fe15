"""Text of simulated tests, and the deformed section of a test piece."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.mesh import CORNERS, GAUSS_POINTS, SIDES, outline, shape_functions
from creepkit.records import Status
from creepkit.records.units import time_text
from creepkit.reports.figures import panels_of, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.specimens.bulge.run import BulgeRun
    from creepkit.specimens.run import Run


SUBDIVISIONS = 6
"""Facets along the side of an element: its curved sides look smooth."""


_LABELS = {"stress": "von Mises stress, MPa", "creep strain": "equivalent creep strain"}


_GREY = "0.45"


def run_text(run: Run) -> str:
    """One line: how the test ended, its frames, and the last value of each output."""
    how = "complete" if run.status is Status.COMPLETE else f"ended at {run.end_time:g} s ({run.reason})"
    last = ", ".join(f"{name} {values[-1]:.4g}" for name, values in run.outputs.items())
    return f"{run.name}: {how}; {run.times.size} frames to {run.times[-1]:g} s, where {last}"


def section_figure(run: BulgeRun, time: float | None, name: str, path: str | Path | None = None) -> Figure:
    """The deformed section, both halves, coloured by a field, over the outline at rest; true to scale.

    time : s, by default that of the last frame.
    """
    from matplotlib.tri import Triangulation

    time = float(run.times[-1]) if time is None else float(time)
    field = run.field(name, time)
    body = run.test.model
    moved = body.nodes + run._at(run.simulation.displacements, time)
    figure, axes = panels_of(9.0, 3.1)
    places, facets = _facets(moved[body.elements])
    values = _at_facets(field.values.reshape(-1, 4), body.elements)
    for side in (1.0, -1.0):
        half = Triangulation(side * places[:, 0], places[:, 1], facets)
        coloured = axes.tripcolor(half, values, shading="gouraud", cmap="viridis", rasterized=True)
        coloured.set_clim(field.values.min(), field.values.max())
        _draw_outline(axes, body.nodes, body.elements, side, color=_GREY, lw=0.8, ls=(0, (4, 3)))
        _draw_outline(axes, moved, body.elements, side, color="black", lw=0.9)
    figure.colorbar(coloured, ax=axes, label=_LABELS.get(name, name), shrink=0.8, pad=0.01, aspect=18)
    pressure = float(run.test.load_history.pressure.at(time))
    axes.set(aspect="equal", xlabel="r, mm", ylabel="z, mm")
    axes.set_title(f"{run.name}: {time_text(time)}, {pressure:.3g} MPa (dashed: at rest)", fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
    return save_figure(figure, path, SolveError)


def _facets(nodes: Floats) -> tuple[Floats, Ints]:
    """Corners (corners, 2) and triangles (triangles, 3) of elements (elements, 8, 2) cut into small pieces."""
    side = SUBDIVISIONS + 1
    corners = np.einsum("pa,eai->epi", shape_functions(_grid()), nodes).reshape(-1, 2)
    first = np.add.outer(side * np.arange(SUBDIVISIONS), np.arange(SUBDIVISIONS)).ravel()
    one = np.stack([first, first + 1, first + side + 1], axis=1)
    other = np.stack([first, first + side + 1, first + side], axis=1)
    pieces = np.concatenate([one, other])
    return corners, (side**2 * np.arange(len(nodes))[:, None, None] + pieces).reshape(-1, 3)


def _at_facets(values: Floats, elements: Ints) -> Floats:
    """Values (elements, 4 points) at the corners of the facets.

    Bilinear through the points of an element, then the mean of the elements that meet at a node, then quadratic
    between the nodes; never beyond what the points hold.
    """
    nodes = np.vstack([CORNERS, 0.5 * (CORNERS + np.roll(CORNERS, -1, axis=0))])
    scaled, signs = nodes / np.abs(GAUSS_POINTS[0, 0]), np.sign(GAUSS_POINTS)
    own_values = values @ (0.25 * np.prod(1.0 + scaled[:, None] * signs, axis=2)).T
    count = np.bincount(elements.ravel())
    mean = np.bincount(elements.ravel(), weights=own_values.ravel()) / np.maximum(count, 1)
    smooth = mean[elements] @ shape_functions(_grid()).T
    return np.clip(smooth, values.min(), values.max()).ravel()


def _grid() -> Floats:
    """(places, 2) local coordinates of the corners of the facets."""
    ticks = np.linspace(-1.0, 1.0, SUBDIVISIONS + 1)
    return np.stack([a.ravel() for a in np.meshgrid(ticks, ticks)], axis=1)


def _draw_outline(axes: Axes, nodes: Floats, elements: Ints, side: float, **style: object) -> None:
    """The sides that belong to one element only, but for those on the axis."""
    from matplotlib.collections import LineCollection

    ticks = np.linspace(-1.0, 1.0, SUBDIVISIONS + 1)[:, None]
    weights = np.hstack([0.5 * ticks * (ticks - 1.0), 1.0 - ticks**2, 0.5 * ticks * (ticks + 1.0)])
    chosen = outline(elements)
    ends = nodes[elements[chosen[:, 0, None], SIDES[chosen[:, 1]]]]
    curves = np.einsum("pa,eai->epi", weights, ends[(ends[:, :, 0] > 1e-9).any(axis=1)])
    axes.add_collection(LineCollection(list(curves * [side, 1.0]), **style))  # type: ignore[arg-type]
