"""Text and figure of a sampling domain: what its criteria accept before anything is simulated."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import DatasetError
from creepkit.reports.figures import empty_figure, place_legend_below, save_figure
from creepkit.reports.terminal import print_json, tell
from creepkit.sampling.conditions import ROOM_TEMPERATURE
from creepkit.sampling.criteria import OutcomeCriterion, RateLimit
from creepkit.sampling.domains import Acceptance, SamplingDomain
from creepkit.sampling.domains import acceptance as evaluate_acceptance
from creepkit.sampling.rates import RateArguments, ln_rate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
