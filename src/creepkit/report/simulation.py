"""Text and plots of simulated tests: outputs over time, deformed section, tables of the reduced-order model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.mesh import CORNERS, GAUSS_POINTS, SIDES, outline, shape_functions
from creepkit.records import Status
from creepkit.report.figures import empty_figure, save_figure, set_range
from creepkit.specimens.bulge.reduced_order.deflection_curves import LOG_GROWTH, LOG_STRESS
from creepkit.specimens.bulge.reduced_order.step_equations import growth_multiplier, redistribution_sizes
from creepkit.specimens.bulge.reduced_order.tables import LOADS, ReducedOrderTables

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
    body = run.setup.model
    moved = body.nodes + run._at(run.simulation.displacements, time)
    figure = empty_figure(9.0, 3.1)
    axes = figure.subplots()
    places, facets = _facets(moved[body.elements])
    values = _at_facets(field.values.reshape(-1, 4), body.elements)
    for side in (1.0, -1.0):
        half = Triangulation(side * places[:, 0], places[:, 1], facets)
        coloured = axes.tripcolor(half, values, shading="gouraud", cmap="viridis", rasterized=True)
        coloured.set_clim(field.values.min(), field.values.max())
        _draw_outline(axes, body.nodes, body.elements, side, color=_GREY, lw=0.8, ls=(0, (4, 3)))
        _draw_outline(axes, moved, body.elements, side, color="black", lw=0.9)
    figure.colorbar(coloured, ax=axes, label=_LABELS.get(name, name), shrink=0.8, pad=0.01, aspect=18)
    pressure = float(run.setup.load_history.pressure.at(time))
    axes.set(aspect="equal", xlabel="r, mm", ylabel="z, mm")
    axes.set_title(f"{run.name}: {_duration(time)}, {pressure:.3g} MPa (dashed: at rest)", fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
    return save_figure(figure, path, SolveError)


def outputs_figure(run: BulgeRun, path: str | Path | None = None) -> Figure:
    """Amplitude, width, shape and pressure over time, one below the other."""
    figure = empty_figure(6.4, 6.6)
    panels = figure.subplots(4, 1, sharex=True, height_ratios=(2.0, 1.0, 1.0, 0.8))
    hours, units = run.times / 3600.0, {"amplitude": ", mm", "width": ", mm"}
    for axes, (name, values) in zip(panels, run.outputs.items(), strict=False):
        axes.plot(hours, values, lw=1.5, color="tab:blue")
        axes.set_ylabel(f"{name}{units.get(name, '')}")
    program = run.setup.load_history.pressure
    inside = program.times[program.times < run.end_time]
    knots = np.unique(np.concatenate([inside, [0.0, run.end_time]]))
    panels[3].plot(knots / 3600.0, program.at(knots), lw=1.5, color="tab:red")
    panels[3].set(ylabel="pressure, MPa", xlabel="time, h")
    for axes in panels:
        values = np.concatenate([line.get_ydata() for line in axes.lines])
        values = values[np.isfinite(values)]
        low = 0.0 if axes in (panels[0], panels[3]) else float(values.min(initial=np.inf))
        set_range(
            axes,
            "y",
            min(low, float(values.max(initial=0.0))),
            (1.1 if axes is panels[3] else 1.0) * float(values.max(initial=1e-9)),
            most=5,
        )
        axes.grid(alpha=0.25)
    set_range(panels[3], "x", 0.0, float(knots[-1]) / 3600.0)
    ended = f", ended at {_duration(run.end_time)}: {run.reason}" if run.reason else ""
    figure.suptitle(f"{run.name}{ended}", fontsize=10)
    figure.align_ylabels(panels)
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


def _duration(time: float) -> str:
    return f"{time / 3600:.4g} h" if time >= 3600 else f"{time:.4g} s"


_SHOWN = (0.05, 0.1, 0.2, 0.4, 0.6, 0.9, 1.2, 1.6, 2.0, 2.6, 3.2, 4.0, 4.8)
"""Deflections of the text over the apex thickness."""


_EXPONENTS = (3.0, 5.0, 8.0, 12.0)


_STRAINS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)


_COLUMN = 8


def tables_text(tables: ReducedOrderTables) -> str:
    """k and kappa at some deflections for each thickness, the elastic deflection, and the multiplier."""
    nominal, grid = tables.geometry.apex_thickness, tables.grid
    deflections = np.array([d for d in nominal * np.array(_SHOWN) if d <= grid.points[-1]])
    parts = []
    for which, title in ((LOG_STRESS, "k = sigma*/P"), (LOG_GROWTH, "kappa = dD/d eps*, mm")):
        rows = [np.exp(np.interp(deflections, grid.points, own_values[which])) for own_values in tables.curves]
        parts.append(_table(title, "h \\ D, mm", deflections, tables.thicknesses, rows))
    loads = LOADS.points[8::8]
    rows = [tables.elastic_deflection(loads, float(h))[0] for h in tables.thicknesses]
    parts.append(_table("elastic deflection, mm", "h, mm \\ P/E", loads, tables.thicknesses, rows))
    rows = [growth_multiplier(np.array(_STRAINS), n, size=_first(tables)) for n in _EXPONENTS]
    title = "growth over steady growth after the first loading"
    parts.append(_table(title, "n \\ E eps*/sigma*", np.array(_STRAINS), np.array(_EXPONENTS), rows))
    return "\n\n".join(parts)


def _first(tables: ReducedOrderTables) -> float:
    return float(redistribution_sizes(np.zeros(1))[0])


def _table(title: str, corner: str, columns: Floats, labels: Floats, rows: list[Floats]) -> str:
    """A table of numbers with four digits."""
    width = max(len(corner), 6) + 2
    head = f"{corner:<{width}}" + "".join(f"{c:>{_COLUMN}.3g}" for c in columns)
    lines = [
        f"{label:<{width}.4g}" + "".join(f"{v:>{_COLUMN}.4g}" for v in row)
        for label, row in zip(labels, rows, strict=True)
    ]
    return "\n".join([title, head, *lines])


def tables_figure(tables: ReducedOrderTables, path: str | Path | None = None) -> Figure:
    """k and kappa against D for each thickness, and the multiplier against creep strain, side by side."""
    figure = empty_figure(11.0, 3.6)
    left, middle, right = figure.subplots(1, 3)
    shades = np.linspace(0.75, 0.25, tables.thicknesses.size)
    for own_values, h, shade in zip(tables.curves, tables.thicknesses, shades, strict=True):
        for axes, which in ((left, LOG_STRESS), (middle, LOG_GROWTH)):
            axes.plot(tables.grid.points, np.exp(own_values[which]), color=str(1.0 - shade), label=f"h = {h:.3g} mm")
    left.set(ylabel="k = $\\sigma^*$/P", title="stress of the reference point")
    middle.set(ylabel="$\\kappa$ = dD/d$\\epsilon^*$, mm", title="growth by its strain")
    for axes in (left, middle):
        set_range(axes, "x", 0.0, float(tables.grid.points[-1]))
        set_range(axes, "y", 0.0, max(float(np.max(line.get_ydata())) for line in axes.lines))
        axes.set(xlabel="D, mm")
        axes.legend(frameon=False, fontsize=8)
    strains = np.geomspace(1e-3, 5.0, 80)
    for k, n in enumerate(_EXPONENTS):
        right.loglog(strains, growth_multiplier(strains, n, size=_first(tables)), color=f"C{k}", label=f"n = {n:g}")
    set_range(right, "x", float(strains[0]), float(strains[-1]), logarithmic=True)
    set_range(right, "y", 0.9, max(float(np.max(line.get_ydata())) for line in right.lines), logarithmic=True)
    right.axhline(1.0, color="0.7", lw=0.8)
    right.set(xlabel="$\\lambda$ = E $\\epsilon^*$/$\\sigma^*$", title="growth over steady growth at first")
    right.legend(frameon=False, fontsize=8)
    for axes in (left, middle, right):
        axes.spines[["top", "right"]].set_visible(False)
    return save_figure(figure, path, SolveError)
