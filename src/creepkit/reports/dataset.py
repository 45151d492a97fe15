"""Text and figures of data sets: counts, ranges, histograms of what was drawn, and histories."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.dataset import column_units, summary, summary_columns
from creepkit.errors import DatasetError
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import empty_figure, make_folder, save_figure, set_range
from creepkit.reports.terminal import print_json, tell, tell_written
from creepkit.sampling.specimen_conditions import specimen_conditions

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
    make_folder(folder, DatasetError)
    input_histograms(data, folder / "inputs.png")
    history_figure(data, folder / "histories.png", seed=seed)
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
    return save_figure(figure, path, DatasetError)


def _histogram(axes: Axes, values: Floats, accepted: Bools, name: str, unit: str) -> None:
    """One column; what is switched off (0 on a logarithmic axis) is stated in words."""
    finite = np.isfinite(values)
    positive = finite & (values > 0)
    positive_values = values[positive]
    logarithmic = (
        positive_values.size > 1
        and (values[finite] >= 0).all()
        and np.log10(positive_values.max() / positive_values.min()) > LOG_AXIS_DECADES
    )
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
            axes.plot(
                data.times(row) / 3600.0,
                data.values[row, :, data.outputs.index(name)],
                lw=0.9,
                color=colour_map.to_rgba(load),
            )
        axes.set(xlabel="time, h", ylabel=f"{name}{_unit_label(column_units(data)[f'last {name}'])}")
        axes.grid(alpha=0.25)
    for axes in panels:
        rows = [np.ravel(line.get_ydata()) for line in axes.lines]
        values = np.concatenate([*rows, np.zeros(1)] if axes is panels[0] else rows or [np.zeros(1)])
        finite = values[np.isfinite(values)]
        if finite.size:
            set_range(axes, "y", float(finite.min()), float(finite.max()))
        longest = max((float(data.times(row)[-1]) for row in selected), default=3600.0)
        set_range(axes, "x", 0.0, longest / 3600.0, most=6)
    figure.colorbar(colour_map, ax=panels, label=_load_label(data), pad=0.01)
    figure.suptitle(
        f"{_dataset_title(data)}: {len(selected)} of {int((data.reasons == 0).sum())} accepted samples", fontsize=11
    )
    return save_figure(figure, path, DatasetError)


def _random_accepted(data: Dataset, seed: int) -> Ints:
    accepted = np.flatnonzero(data.reasons == 0)
    if not accepted.size:
        return accepted
    return np.sort(np.random.default_rng(seed).choice(accepted, min(HISTORIES_SHOWN, accepted.size), replace=False))


def _largest_loads(data: Dataset) -> Floats:
    """(n,) in the unit of the load, the larger level of each test."""
    known = specimen_conditions(data.specimen).levels
    levels = [k for k, name in enumerate(data.condition_names) if name in known]
    return data.conditions[:, levels].max(axis=1) if levels else np.zeros(len(data))


def _load_label(data: Dataset) -> str:
    load = specimen_conditions(data.specimen).load
    return f"largest {load.long_name}{_unit_label(load.unit)}"


def _load_colours(loads: Floats) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(*((loads.min(), loads.max()) if loads.size else (0.0, 1.0))), "viridis")


def _dataset_title(data: Dataset) -> str:
    return f"{data.law.name} on {data.specimen.name}, design {data.provenance.get('design', 'unknown')}"


def _unit_label(unit: str) -> str:
    return f", {unit}" if unit not in ("", "1") else ""


def dataset_text(data: Dataset) -> str:
    """A page of text: counts, reasons of rejection, ranges and origin."""
    known = summary(data)
    percent, times, source = 100 * known["accepted"] / max(known["samples"], 1), known["times"], known["provenance"]
    until = "over the length of each test" if times["relative"] else f"to {times['to'] / 3600:g} h"
    lines = [
        f"{known['samples']} samples of {known['law']} on {known['specimen']}: {known['accepted']} accepted "
        f"({percent:.1f} %)",
        f"{known['frames']} frames {until}; {known['burst_accepted']} of the accepted burst before their end",
    ]
    for entry in known["reasons"]:
        left_out, rejected = entry["not_simulated"], entry["rejected"]
        suffix = f"; {'' if left_out == rejected else f'{left_out} of them '}not simulated" if left_out else ""
        lines.append(f"{rejected:>9} rejected: criterion {entry['criterion']}, {entry['text']}{suffix}")
    lines += [f"{known['failed']:>9} failed"] if known["failed"] else []
    lines += [f"{occurrences:>18} x {message}" for message, occurrences in known["failures"].items()]
    rows = [
        (name, known["units"][name], *(f"{numbers[key]:.4g}" for key in ("least", "median", "most")))
        for name, numbers in known["ranges"].items()
    ]
    ranges = aligned(("accepted samples", "unit", "least", "median", "most"), rows, numeric=(2, 3, 4)) if rows else []
    origin = ", ".join(f"{k} {source[k]}" for k in ("design", "seed", "creepkit", "when", "fingerprint") if k in source)
    return "\n".join([*lines, "", *ranges, "", f"from {origin}"])


def print_dataset(data: Dataset, to: Path, part: str | None, as_json: bool) -> None:
    """Print what was made, and where it lies."""
    if as_json:
        print_json({**summary(data), "file": str(to), "part": part})
        return
    tell(f"{data}\n")
    if part is None:
        tell_written(to, f": {to.stat().st_size / 1e6:.1f} MB; remove {to}.parts when no more samples are wanted")
    else:
        tell(f"part {part} is done in {to}.parts; the same command without --part merges all parts into {to}")
