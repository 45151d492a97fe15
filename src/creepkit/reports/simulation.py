"""Text of simulated tests, and the deformed section of a test piece."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.fem.mesh import CORNERS, GAUSS_POINTS, outline
from creepkit.records import Status
from creepkit.records.units import time_text
from creepkit.reports.figures import panels_of, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.specimens.bulge.run import BulgeRun
    from creepkit.specimens.run import Run


_LABELS = {"stress": "von Mises stress, MPa", "creep strain": "equivalent creep strain"}


def run_text(run: Run) -> str:
    """One line: how the test ended, its frames, and the last value of each output."""
    how = "complete" if run.status is Status.COMPLETE else f"ended at {run.end_time:g} s ({run.reason})"
    last = ", ".join(f"{name} {values[-1]:.4g}" for name, values in run.outputs.items())
    return f"{run.name}: {how}; {run.times.size} frames to {run.times[-1]:g} s, where {last}"


TRIANGLES = np.array([[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 6], [4, 6, 7]])
"""Of an element of eight nodes, by these."""


def section_figure(run: BulgeRun, time: float | None, name: str, path: str | Path | None = None) -> Figure:
    """The deformed section, both halves, coloured by a field, over the outline at rest; true to scale.

    time : s, by default that of the last frame.
    """
    from matplotlib.collections import LineCollection

    time = float(run.times[-1]) if time is None else float(time)
    field, body = run.field(name, time), run.test.model
    moved = body.nodes + run._at(run.simulation.displacements, time)
    values = _at_nodes(field.values.reshape(-1, 4), body.elements, len(moved))
    triangles, sides = body.elements[:, TRIANGLES].reshape(-1, 3), outline(body.elements)
    sides = sides[(body.nodes[sides][:, :, 0] > 1e-9).any(axis=1)]  # without those on the axis
    figure, axes = panels_of(9.0, 3.1)
    for half in ([1.0, 1.0], [-1.0, 1.0]):
        r, z = (moved * half).T
        coloured = axes.tripcolor(r, z, triangles, values, shading="gouraud", cmap="viridis", rasterized=True)
        axes.add_collection(LineCollection(list(body.nodes[sides] * half), color="0.45", lw=0.8, ls=(0, (4, 3))))
        axes.add_collection(LineCollection(list(moved[sides] * half), color="black", lw=0.9))
    figure.colorbar(coloured, ax=axes, label=_LABELS.get(name, name), shrink=0.8, pad=0.01, aspect=18)
    pressure = float(run.test.load_history.pressure.at(time))
    axes.set(aspect="equal", xlabel="r, mm", ylabel="z, mm")
    axes.set_title(f"{run.name}: {time_text(time)}, {pressure:.3g} MPa (dashed: at rest)", fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
    return save_figure(figure, path)


def _at_nodes(values: Floats, elements: Ints, count: int) -> Floats:
    """(count,) values at the nodes, of those at the four points of each element, (elements, 4).

    Bilinear through the points of an element, then the mean of the elements that meet at a node; never beyond what the
    points hold.
    """
    places = np.vstack([CORNERS, 0.5 * (CORNERS + np.roll(CORNERS, -1, axis=0))]) / np.abs(GAUSS_POINTS[0, 0])
    own = values @ (0.25 * np.prod(1.0 + places[:, None] * np.sign(GAUSS_POINTS), axis=2)).T
    total, meeting = (np.bincount(elements.ravel(), weights, count) for weights in (own.ravel(), None))
    return np.clip(total / np.maximum(meeting, 1), values.min(), values.max())
