"""The tables of a one-degree-of-freedom model for people: as text, and as a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.figures import empty_figure
from creepkit.specimens.reduced_curves import LOG_GROWTH, LOG_STRESS
from creepkit.specimens.reduced_redistribution import growth_multiplier, redistribution_sizes
from creepkit.specimens.reduced_tables import LOADS, ReducedOrderTables

_SHOWN = (0.05, 0.1, 0.2, 0.4, 0.6, 0.9, 1.2, 1.6, 2.0, 2.6, 3.2, 4.0, 4.8)
"""Deflections of the text over the apex thickness."""
_EXPONENTS = (3.0, 5.0, 8.0, 12.0)
_STRAINS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
_COLUMN = 8


def describe_tables(tables: ReducedOrderTables) -> str:
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


def plot_tables(tables: ReducedOrderTables, path: str | Path) -> None:
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
        axes.set(xlabel="D, mm", xlim=(0, None), ylim=(0, None))
        axes.legend(frameon=False, fontsize=8)
    strains = np.geomspace(1e-3, 5.0, 80)
    for k, n in enumerate(_EXPONENTS):
        right.loglog(strains, growth_multiplier(strains, n, size=_first(tables)), color=f"C{k}", label=f"n = {n:g}")
    right.axhline(1.0, color="0.7", lw=0.8)
    right.set(xlabel="$\\lambda$ = E $\\epsilon^*$/$\\sigma^*$", title="growth over steady growth at first")
    right.legend(frameon=False, fontsize=8)
    for axes in (left, middle, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)
