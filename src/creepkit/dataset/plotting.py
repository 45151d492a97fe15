"""Pictures of a data set: what was drawn, and some of what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.describe import columns, design_name, units
from creepkit.errors import DatasetError
from creepkit.figures import blank

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset

HANDFUL = 30
"""Histories that are drawn."""
ACROSS = 4
"""Panels in a row."""
DECADES = 1.5
"""Columns that span more than this are drawn on a logarithmic axis."""

_ACCEPTED, _OTHERS = "tab:blue", "0.75"


def draw(data: Dataset, folder: str | Path, seed: int = 0) -> list[Path]:
    """Write inputs.png and histories.png into a folder, which is made if needed; returns their paths."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        inputs(data, folder / "inputs.png")
        histories(data, folder / "histories.png", seed=seed)
    except OSError as error:
        raise DatasetError(f"{folder}: no pictures can be written there ({error.strerror})") from None
    return [folder / "inputs.png", folder / "histories.png"]


def inputs(data: Dataset, path: str | Path | None = None) -> Figure:
    """Histograms of all that was drawn, and of where samples ended: all of them grey, the accepted ones blue."""
    known = [(name, values) for name, values in columns(data) if np.isfinite(values).any()]
    rows = -(-len(known) // ACROSS)
    figure = blank(3.1 * ACROSS, 2.1 * rows + 0.5)
    panels = np.atleast_1d(figure.subplots(rows, ACROSS, squeeze=False).ravel())
    for axes, (name, values) in zip(panels, known, strict=False):
        _histogram(axes, values, data.reasons == 0, name, units(data)[name])
    for axes in panels[len(known) :]:
        axes.set_axis_off()
    figure.suptitle(f"{_title(data)}: drawn (grey) and accepted (blue)", fontsize=11)
    _save(figure, path)
    return figure


def _histogram(axes: Axes, values: Floats, accepted: Bools, name: str, unit: str) -> None:
    """One column; what is switched off (0 on a logarithmic axis) is told in words."""
    finite = np.isfinite(values)
    positive = finite & (values > 0)
    there = values[positive]
    wide = there.size > 1 and (values[finite] >= 0).all() and np.log10(there.max() / there.min()) > DECADES
    shown = positive if wide else finite
    if wide:
        axes.set_xscale("log")
        bins = np.geomspace(there.min(), there.max() * (1 + 1e-9), 31)
    else:
        bins = np.linspace(values[finite].min(), values[finite].max() + 1e-12, 31)
    axes.hist(values[shown], bins.tolist(), color=_OTHERS)
    axes.hist(values[shown & accepted], bins.tolist(), color=_ACCEPTED)
    off = float((values[finite] == 0).mean()) if wide else 0.0
    told = f"\n{100 * off:.0f} % are 0" if off else ""
    axes.set_xlabel(f"{name}{_unit(unit)}{told}", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def histories(data: Dataset, path: str | Path | None = None, *, seed: int = 0) -> Figure:
    """Outputs over time of a random handful of accepted samples, coloured by the largest load."""
    chosen = _handful(data, seed)
    figure = blank(4.6 * len(data.outputs), 4.0)
    panels = figure.subplots(1, len(data.outputs), squeeze=False)[0]
    loads = _loads(data)[chosen]
    colours = _colours(loads)
    for axes, name in zip(panels, data.outputs, strict=True):
        for row, load in zip(chosen, loads, strict=True):
            axes.plot(data.times(row) / 3600.0, data.output(name)[row], lw=0.9, color=colours.to_rgba(load))
        axes.set(xlabel="time, h", ylabel=f"{name}{_unit(units(data)[f'last {name}'])}")
        axes.grid(alpha=0.25)
    panels[0].set_ylim(bottom=0.0)
    figure.colorbar(colours, ax=panels, label="largest load, MPa", pad=0.01)
    figure.suptitle(f"{_title(data)}: {len(chosen)} of {int((data.reasons == 0).sum())} accepted samples", fontsize=11)
    _save(figure, path)
    return figure


def _handful(data: Dataset, seed: int) -> Ints:
    good = np.flatnonzero(data.reasons == 0)
    if not good.size:
        return good
    return np.sort(np.random.default_rng(seed).choice(good, min(HANDFUL, good.size), replace=False))


def _loads(data: Dataset) -> Floats:
    """(n,) MPa, the larger level of each test."""
    levels = [k for k, name in enumerate(data.condition_names) if name in ("P1", "P2", "stress_1", "stress_2")]
    return data.conditions[:, levels].max(axis=1) if levels else np.zeros(len(data))


def _colours(loads: Floats) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(*((loads.min(), loads.max()) if loads.size else (0.0, 1.0))), "viridis")


def _title(data: Dataset) -> str:
    return f"{data.law.name} on {data.specimen.name}, design {design_name(data)}"


def _unit(unit: str) -> str:
    return f", {unit}" if unit not in ("", "1") else ""


def _save(figure: Figure, path: str | Path | None) -> None:
    if path is not None:
        figure.savefig(path, dpi=110)
