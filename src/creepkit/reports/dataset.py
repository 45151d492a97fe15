"""Data sets and the sampling domains that they are drawn from: text and figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.dataset import column_units, summary, summary_columns
from creepkit.errors import DatasetError
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import empty_figure, make_folder, panels_of, place_legend_below, save_figure, set_range
from creepkit.reports.terminal import print_json, tell, tell_written
from creepkit.sampling.conditions import ROOM_TEMPERATURE, specimen_conditions
from creepkit.sampling.criteria import OutcomeCriterion, RateLimit
from creepkit.sampling.domains import Acceptance, SamplingDomain
from creepkit.sampling.domains import acceptance as evaluate_acceptance
from creepkit.sampling.rates import RateArguments, ln_rate

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
    figure, panels = panels_of(4.6 * len(data.outputs), 4.0, 1, len(data.outputs), squeeze=False)
    panels = panels[0]
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


# ---- sampling domains ------------------------------------------------------------------------------------------------


CURVES_SHOWN = 60
"""Rows whose rates are drawn: the first of the sequence, which a Sobol sequence spreads."""


SHOWN_STRAIN, SHOWN_TIME = 0.01, 1e4
"""At which they are, as in the paper's criteria 1 and 2; s."""


REJECTED_COLOUR, KEPT_COLOUR, USEFUL_COLOUR = "0.72", "tab:blue", "tab:green"


RATE_DECADES_SHOWN = (-40.0, 10.0)
"""Decades of rate, 1/s, that are shown at most."""


def acceptance_figure(acceptance: Acceptance, path: str | Path | None = None) -> Figure:
    """Draw rates over stress for some rows, and the strain that the mean rate of every row gives by the end."""
    figure, (rates, strains) = panels_of(11.0, 4.6, 1, 2, width_ratios=(1.15, 1.0))
    _draw_rates(rates, acceptance)
    _draw_strains(strains, acceptance)
    place_legend_below(figure, strains)
    design = acceptance.design
    figure.suptitle(
        f"{design.law.title or design.law.name}: {design.name} domain, {len(acceptance.draws)} draws", fontsize=11
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
    axes.set_title(f"{len(curves)} of the sampled laws; rectangle: useful rates at reference stresses", fontsize=10)


def _rate_curves(acceptance: Acceptance, stress: Floats) -> Floats:
    """log10 of rates over stress of the first rows, (rows, stresses)."""
    law, draws = acceptance.design.law, acceptance.draws
    theta = law.to_internal(draws.parameters[:CURVES_SHOWN])
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
    axes.set_title("strain at the end; shaded: creep is visible and the test lasts", fontsize=10)


def _percent(mask: Bools) -> str:
    return f"{100 * float(mask.mean()):.1f} %"


def acceptance_text(acceptance: Acceptance) -> str:
    """What was drawn, one line a criterion, and which share would be simulated."""
    return "\n".join([_title_line(acceptance), *_criterion_lines(acceptance), _summary_line(acceptance)])


def _title_line(acceptance: Acceptance) -> str:
    domain = acceptance.design
    count = f"{len(acceptance.draws)} draws, seed {acceptance.seed}"
    test = f"{domain.specimen} test of {domain.grid.frames} frames"
    return f"law '{domain.law.name}', {domain.name} sampling domain, {test}: {count}"


def _criterion_lines(acceptance: Acceptance) -> list[str]:
    lines = [f"{'criterion':<14} {'meet it':>8} {'rejected':>9}  asks"]
    remaining = np.ones(len(acceptance.draws), bool)
    for criterion in acceptance.design.criteria:
        if isinstance(criterion, OutcomeCriterion):
            numbers = f"{'after simulation':>18}"
        else:
            is_met = acceptance.criteria_met[criterion.name]
            numbers = f"{_percent(is_met):>8} {_percent(remaining & ~is_met):>9}"
            remaining = remaining & is_met
        lines.append(f"{criterion.name:<14} {numbers}  {criterion.text}")
    return lines


def _summary_line(acceptance: Acceptance) -> str:
    simulated, useful = _percent(acceptance.kept), _percent(acceptance.useful)
    screened = getattr(acceptance.design, "screened", 0)
    exception = " but for those that burst far too early by the reduced-order model" if screened else ""
    description = "a rate at which creep is visible and the test lasts (others may, too)"
    return f"{simulated} of the draws would be simulated{exception}; {useful} of all have {description}"


def print_acceptance(design: SamplingDomain, seed: int, to: Path | None, as_json: bool) -> None:
    """Print what the design would draw, and draw the rates of its samples."""
    assert isinstance(design, SamplingDomain)  # the command line makes no others
    result = evaluate_acceptance(design, seed=seed)
    plot_file = Path("rates.png") if to is None else to.with_suffix(".rates.png")
    result.plot(plot_file)
    if as_json:
        criterion_fractions = {name: float(passed.mean()) for name, passed in result.criteria_met.items()}
        fractions = {"simulated": float(result.kept.mean()), "useful": float(result.useful.mean())}
        print_json({"draws": len(result.draws), "met": criterion_fractions, **fractions, "picture": str(plot_file)})
    else:
        tell(f"{result}\nwrote {plot_file}; nothing was simulated")
