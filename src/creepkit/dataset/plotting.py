"""Pictures of a data set: what was drawn, and some of what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.describe import summary_columns, design_name, column_units
from creepkit.errors import DatasetError
from creepkit.figures import empty_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset

HISTORIES_SHOWN = 30
"""Histories that are drawn."""
PANELS_PER_ROW = 4
"""Panels in a row."""
LOG_AXIS_DECADES = 1.5
"""Columns that span more than this are drawn on a logarithmic axis."""

_ACCEPTED, _OTHERS = "tab:blue", "0.75"


def write_dataset_figures(data: Dataset, folder: str | Path, seed: int = 0) -> list[Path]:
    """Write inputs.png and histories.png into a folder, which is made if needed; returns their paths."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        input_histograms(data, folder / "inputs.png")
        history_figure(data, folder / "histories.png", seed=seed)
    except OSError as error:
        raise DatasetError(f"{folder}: no pictures can be written there ({error.strerror})") from None
    return [folder / "inputs.png", folder / "histories.png"]


def input_histograms(data: Dataset, path: str | Path | None = None) -> Figure:
    """Histograms of all that was drawn, and of where samples ended: all of them grey, the accepted ones blue."""
    columns_with_data = [(name, values) for name, values in summary_columns(data) if np.isfinite(values).any()]
    rows = -(-len(columns_with_data) // PANELS_PER_ROW)
    figure = empty_figure(3.1 * PANELS_PER_ROW, 2.1 * rows + 0.5)
    panels = np.atleast_1d(figure.subplots(rows, PANELS_PER_ROW, squeeze=False).ravel())
    for axes, (name, values) in zip(panels, columns_with_data, strict=False):
        _histogram(axes, values, data.reasons == 0, name, column_units(data)[name])
    for axes in panels[len(columns_with_data) :]:
        axes.set_axis_off()
    figure.suptitle(f"{_dataset_title(data)}: drawn (grey) and accepted (blue)", fontsize=11)
    _save_dataset_figure(figure, path)
    return figure


def _histogram(axes: Axes, values: Floats, accepted: Bools, name: str, unit: str) -> None:
    """One column; what is switched off (0 on a logarithmic axis) is told in words."""
    finite = np.isfinite(values)
    positive = finite & (values > 0)
    positive_values = values[positive]
    logarithmic = positive_values.size > 1 and (values[finite] >= 0).all() and np.log10(positive_values.max() / positive_values.min()) > LOG_AXIS_DECADES
    shown = positive if logarithmic else finite
    if logarithmic:
        axes.set_xscale("log")
        bins = np.geomspace(positive_values.min(), positive_values.max() * (1 + 1e-9), 31)
    else:
        bins = np.linspace(values[finite].min(), values[finite].max() + 1e-12, 31)
    axes.hist(values[shown], bins.tolist(), color=_OTHERS)
    axes.hist(values[shown & accepted], bins.tolist(), color=_ACCEPTED)
    zero_fraction = float((values[finite] == 0).mean()) if logarithmic else 0.0
    zero_note = f"\n{100 * zero_fraction:.0f} % are 0" if zero_fraction else ""
    axes.set_xlabel(f"{name}{_unit_label(unit)}{zero_note}", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def history_figure(data: Dataset, path: str | Path | None = None, *, seed: int = 0) -> Figure:
    """Outputs over time of a random handful of accepted samples, coloured by the largest load."""
    selected = _random_accepted(data, seed)
    figure = empty_figure(4.6 * len(data.outputs), 4.0)
    panels = figure.subplots(1, len(data.outputs), squeeze=False)[0]
    loads = _largest_loads(data)[selected]
    colour_map = _load_colours(loads)
    for axes, name in zip(panels, data.outputs, strict=True):
        for row, load in zip(selected, loads, strict=True):
            axes.plot(data.times(row) / 3600.0, data.output(name)[row], lw=0.9, color=colour_map.to_rgba(load))
        axes.set(xlabel="time, h", ylabel=f"{name}{_unit_label(column_units(data)[f'last {name}'])}")
        axes.grid(alpha=0.25)
    panels[0].set_ylim(bottom=0.0)
    figure.colorbar(colour_map, ax=panels, label="largest load, MPa", pad=0.01)
    figure.suptitle(f"{_dataset_title(data)}: {len(selected)} of {int((data.reasons == 0).sum())} accepted samples", fontsize=11)
    _save_dataset_figure(figure, path)
    return figure


def _random_accepted(data: Dataset, seed: int) -> Ints:
    accepted = np.flatnonzero(data.reasons == 0)
    if not accepted.size:
        return accepted
    return np.sort(np.random.default_rng(seed).choice(accepted, min(HISTORIES_SHOWN, accepted.size), replace=False))


def _largest_loads(data: Dataset) -> Floats:
    """(n,) MPa, the larger level of each test."""
    levels = [k for k, name in enumerate(data.condition_names) if name in ("P1", "P2", "stress_1", "stress_2")]
    return data.conditions[:, levels].max(axis=1) if levels else np.zeros(len(data))


def _load_colours(loads: Floats) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(*((loads.min(), loads.max()) if loads.size else (0.0, 1.0))), "viridis")


def _dataset_title(data: Dataset) -> str:
    return f"{data.law.name} on {data.specimen.name}, design {design_name(data)}"


def _unit_label(unit: str) -> str:
    return f", {unit}" if unit not in ("", "1") else ""


def _save_dataset_figure(figure: Figure, path: str | Path | None) -> None:
    if path is not None:
        figure.savefig(path, dpi=110)
