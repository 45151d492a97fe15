"""Text and figures of data sets and of the acceptance of a sampling domain."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.dataset import column_units, design_name, summary, summary_columns
from creepkit.errors import DatasetError
from creepkit.report.figures import empty_figure, save_figure
from creepkit.sampling.conditions import ROOM_TEMPERATURE
from creepkit.sampling.criteria import RateLimit
from creepkit.sampling.rates import RateArguments, internal_parameters, ln_rate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset


if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.sampling.domains import Acceptance


if TYPE_CHECKING:
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
            axes.plot(data.times(row) / 3600.0, data.output(name)[row], lw=0.9, color=colour_map.to_rgba(load))
        axes.set(xlabel="time, h", ylabel=f"{name}{_unit_label(column_units(data)[f'last {name}'])}")
        axes.grid(alpha=0.25)
    panels[0].set_ylim(bottom=0.0)
    figure.colorbar(colour_map, ax=panels, label="largest load, MPa", pad=0.01)
    figure.suptitle(
        f"{_dataset_title(data)}: {len(selected)} of {int((data.reasons == 0).sum())} accepted samples", fontsize=11
    )
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


CURVES_SHOWN = 60
"""Rows whose rates are drawn: the first of the sequence, which a Sobol sequence spreads."""


SHOWN_STRAIN, SHOWN_TIME = 0.01, 1e4
"""At which they are, as in the paper's criteria 1 and 2; s."""


REJECTED_COLOUR, KEPT_COLOUR, USEFUL_COLOUR = "0.72", "tab:blue", "tab:green"


RATE_DECADES_SHOWN = (-40.0, 10.0)
"""Decades of rate, 1/s, that are shown at most."""


def acceptance_figure(acceptance: Acceptance, path: str | Path | None = None) -> Figure:
    """Draw rates over stress for some rows, and the strain that the mean rate of every row gives by the end."""
    figure = empty_figure(11.0, 4.6)
    rates, strains = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_rates(rates, acceptance)
    _draw_strains(strains, acceptance)
    design = acceptance.design
    figure.suptitle(
        f"{design.law.title or design.law.name}: {design.name} sampling domain, {len(acceptance.draws)} draws", fontsize=11
    )
    return save_figure(figure, path, DatasetError)


def _draw_rates(axes: Axes, acceptance: Acceptance) -> None:
    stress = np.geomspace(20.0, 700.0, 60)
    curves = _rate_curves(acceptance, stress)
    colours = np.where(acceptance.useful, USEFUL_COLOUR, np.where(acceptance.kept, KEPT_COLOUR, REJECTED_COLOUR))[
        : len(curves)
    ]
    for curve, colour in zip(curves, colours, strict=True):
        axes.plot(stress, curve, lw=0.8, color=str(colour), alpha=0.75)
    low, high = np.clip(np.quantile(curves, (0.02, 0.98)), *RATE_DECADES_SHOWN)
    limits = [c for c in acceptance.design.criteria if isinstance(c, RateLimit)]
    ends = [v for c in limits for v in (c.lower, c.upper) if v is not None]
    axes.set(ylim=(min([low, *ends]) - 2, max([high, *ends]) + 2), xlim=(stress[0], stress[-1]), xscale="log")
    for criterion in limits:
        _draw_limit(axes, criterion)
    _draw_window(axes, acceptance)
    axes.set(xlabel="stress, MPa", ylabel=f"log10 of rate, 1/s, at strain {SHOWN_STRAIN:g} and {SHOWN_TIME:,.0f} s")
    for set_formatter in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
        set_formatter("{x:g}")
    axes.set_xticks([20, 50, 100, 200, 400, 700], minor=False)
    axes.tick_params(axis="x", which="minor", labelbottom=False)
    axes.grid(alpha=0.25)
    axes.set_title(f"{len(curves)} of the sampled laws; box: useful rates at reference stresses", fontsize=10)


def _rate_curves(acceptance: Acceptance, stress: Floats) -> Floats:
    """log10 of rates over stress of the first rows, (rows, stresses)."""
    law, draws = acceptance.design.law, acceptance.draws
    theta = internal_parameters(law, draws.parameters[:CURVES_SHOWN])
    temperature = draws.condition("temperature", ROOM_TEMPERATURE)[: len(theta), None]
    return np.asarray(
        ln_rate(law, theta[:, None, :], RateArguments(stress, SHOWN_STRAIN, SHOWN_TIME, temperature)) / np.log(10.0)
    )


def _draw_limit(axes: Axes, criterion: RateLimit) -> None:
    """An arrow to the side on which the rate must lie."""
    arrow_length = 0.09 * float(np.ptp(axes.get_ylim()))
    style = {"arrowstyle": "->", "lw": 1.6}
    for limit, shift in ((criterion.lower, arrow_length), (criterion.upper, -arrow_length)):
        if limit is not None:
            position = (criterion.stress, limit)
            axes.annotate("", (criterion.stress, limit + shift), position, arrowprops=style)
            axes.plot(*position, "k_", ms=12, mew=2)
            label = axes.annotate(
                f"criterion {criterion.name}", position, (-8, 0), textcoords="offset points", fontsize=8
            )
            label.set(ha="right", va="center", bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1})


def _draw_window(axes: Axes, acceptance: Acceptance) -> None:
    """The useful rates at the reference stresses of nine tests in ten."""
    design = acceptance.design
    left, right = np.quantile(
        design.reference_stress.evaluation_points(acceptance.draws, design.conditions.end).mean_stress, (0.05, 0.95)
    )
    log10_end_times = np.log10(acceptance.draws.condition("end_time", design.conditions.end))
    low, high = np.median(acceptance.useful_strains - log10_end_times[:, None], axis=0)
    axes.fill_between(
        [left, max(right, 1.02 * left)], low, high, fc=USEFUL_COLOUR, alpha=0.3, ec="darkgreen", lw=2, zorder=3
    )


def _draw_strains(axes: Axes, acceptance: Acceptance) -> None:
    low, high = np.median(acceptance.useful_strains, axis=0)
    extent = np.clip(np.quantile(acceptance.log10_strains, (0.005, 0.995)), low - 30, high + 30)
    bins = np.linspace(min(extent[0], low - 1), max(extent[1], high + 1), 70)
    groups = {
        f"in the useful window: {_percent(acceptance.useful)}": (acceptance.useful, USEFUL_COLOUR),
        f"simulated, slower or faster: {_percent(acceptance.kept & ~acceptance.useful)}": (
            acceptance.kept & ~acceptance.useful,
            KEPT_COLOUR,
        ),
        f"rejected before simulation: {_percent(~acceptance.kept)}": (~acceptance.kept, REJECTED_COLOUR),
    }
    columns, colours = [acceptance.log10_strains[mask] for mask, _ in groups.values()], [c for _, c in groups.values()]
    axes.hist(columns, bins=list(bins), stacked=True, color=colours, label=list(groups))
    axes.axvspan(low, high, color=USEFUL_COLOUR, alpha=0.12, lw=0)
    axes.set(xlabel="log10 of (mean rate at the reference stress x duration)", ylabel="draws")
    axes.set_ylim(top=1.3 * axes.get_ylim()[1])
    axes.legend(fontsize=8, loc="upper right")
    axes.set_title("strain at the end; shaded: creep is visible and the test lasts", fontsize=10)


def _percent(mask: Bools) -> str:
    return f"{100 * float(mask.mean()):.1f} %"


def dataset_text(data: Dataset) -> str:
    """The same as a page of text."""
    summary_data = summary(data)
    return "\n".join(
        [
            *_dataset_heading(summary_data),
            *_rejection_lines(summary_data),
            "",
            *_range_table(summary_data),
            "",
            *_origin_lines(summary_data),
        ]
    )


def _dataset_heading(summary_data: dict[str, Any]) -> Iterator[str]:
    percent = 100 * summary_data["accepted"] / max(summary_data["samples"], 1)
    description = f"{summary_data['samples']} samples of {summary_data['law']} on {summary_data['specimen']}"
    yield f"{description}: {summary_data['accepted']} accepted ({percent:.1f} %)"
    times = summary_data["times"]
    until = "over the length of each test" if times["relative"] else f"to {times['to'] / 3600:g} h"
    yield f"{summary_data['frames']} frames {until}; {summary_data['burst_accepted']} of the accepted burst before their end"


def _rejection_lines(summary_data: dict[str, Any]) -> Iterator[str]:
    for entry in summary_data["reasons"]:
        not_simulated = entry["not_simulated"]
        part_text = "" if not_simulated == entry["rejected"] else f"{not_simulated} of them "
        suffix = f"; {part_text}not simulated" if not_simulated else ""
        yield f"{entry['rejected']:>9} rejected: criterion {entry['criterion']}, {entry['text']}{suffix}"
    if summary_data["failed"]:
        yield f"{summary_data['failed']:>9} failed"
    for error_message, occurrences in summary_data["failures"].items():
        yield f"{occurrences:>18} x {error_message}"


def _range_table(summary_data: dict[str, Any]) -> Iterator[str]:
    """Ranges, one row each."""
    if not summary_data["ranges"]:
        return
    width = max(map(len, summary_data["ranges"]))
    yield f"{'accepted samples':<{width}}  {'unit':<5}{'least':>12}{'median':>12}{'most':>12}"
    for name, statistics in summary_data["ranges"].items():
        numbers = "".join(f"{statistics[key]:>12.4g}" for key in ("least", "median", "most"))
        yield f"{name:<{width}}  {summary_data['units'][name]:<5}{numbers}"


def _origin_lines(summary_data: dict[str, Any]) -> Iterator[str]:
    for number, source in enumerate(summary_data["provenance"].get("joined", [summary_data["provenance"]]), start=1):
        items = {key: source[key] for key in ("design", "seed", "creepkit", "when", "fingerprint") if key in source}
        name = "from" if "joined" not in summary_data["provenance"] else f"from {number}."
        yield f"{name} {', '.join(f'{key} {value}' for key, value in items.items())}"
