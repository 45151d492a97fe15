"""The picture of a design before it is simulated: some rates over stress, and where all of them lead."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.dataset.conditions import ROOM
from creepkit.dataset.criteria import RateLimit
from creepkit.dataset.term_rates import Point, internal, ln_rate
from creepkit.errors import DatasetError
from creepkit.figures import blank, written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.dataset.acceptance import Acceptance

CURVES = 60
"""Rows whose rates are drawn: the first of the sequence, which a Sobol sequence spreads."""

STRAIN, TIME = 0.01, 1e4
"""At which they are, as in the paper's criteria 1 and 2; s."""

REJECTED, KEPT, USEFUL = "0.72", "tab:blue", "tab:green"
EXTENT = (-40.0, 10.0)
"""Decades of rate, 1/s, that are shown at most."""


def figure_of(found: Acceptance, path: str | Path | None = None) -> Figure:
    """Draw rates over stress for some rows, and the strain that the mean rate of every row gives by the end."""
    figure = blank(11.0, 4.6)
    rates, strains = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_rates(rates, found)
    _draw_strains(strains, found)
    design = found.design
    figure.suptitle(f"{design.law.title or design.law.name}: {design.name} box, {len(found.draws)} draws", fontsize=11)
    return written(figure, path, DatasetError)


def _draw_rates(axes: Axes, found: Acceptance) -> None:
    stress = np.geomspace(20.0, 700.0, 60)
    curves = _curves(found, stress)
    colours = np.where(found.useful, USEFUL, np.where(found.kept, KEPT, REJECTED))[: len(curves)]
    for curve, colour in zip(curves, colours, strict=True):
        axes.plot(stress, curve, lw=0.8, color=str(colour), alpha=0.75)
    low, high = np.clip(np.quantile(curves, (0.02, 0.98)), *EXTENT)
    limits = [c for c in found.design.criteria if isinstance(c, RateLimit)]
    ends = [v for c in limits for v in (c.least, c.most) if v is not None]
    axes.set(ylim=(min([low, *ends]) - 2, max([high, *ends]) + 2), xlim=(stress[0], stress[-1]), xscale="log")
    for criterion in limits:
        _draw_limit(axes, criterion)
    _draw_window(axes, found)
    axes.set(xlabel="stress, MPa", ylabel=f"log10 of rate, 1/s, at strain {STRAIN:g} and {TIME:,.0f} s")
    for place in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
        place("{x:g}")
    axes.set_xticks([20, 50, 100, 200, 400, 700], minor=False)
    axes.tick_params(axis="x", which="minor", labelbottom=False)
    axes.grid(alpha=0.25)
    axes.set_title(f"{len(curves)} of the sampled laws; box: useful rates at reference stresses", fontsize=10)


def _curves(found: Acceptance, stress: Floats) -> Floats:
    """log10 of rates over stress of the first rows, (rows, stresses)."""
    law, draws = found.design.law, found.draws
    theta = internal(law, draws.parameters[:CURVES])
    warmth = draws.condition("temperature", ROOM)[: len(theta), None]
    return np.asarray(ln_rate(law, theta[:, None, :], Point(stress, STRAIN, TIME, warmth)) / np.log(10.0))


def _draw_limit(axes: Axes, criterion: RateLimit) -> None:
    """An arrow to the side on which the rate must lie."""
    reach = 0.09 * float(np.ptp(axes.get_ylim()))
    style = {"arrowstyle": "->", "lw": 1.6}
    for limit, way in ((criterion.least, reach), (criterion.most, -reach)):
        if limit is not None:
            at = (criterion.stress, limit)
            axes.annotate("", (criterion.stress, limit + way), at, arrowprops=style)
            axes.plot(*at, "k_", ms=12, mew=2)
            told = axes.annotate(f"criterion {criterion.name}", at, (-8, 0), textcoords="offset points", fontsize=8)
            told.set(ha="right", va="center", bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1})


def _draw_window(axes: Axes, found: Acceptance) -> None:
    """The useful rates at the reference stresses of nine tests in ten."""
    design = found.design
    left, right = np.quantile(design.reference.looks(found.draws, design.conditions.end).middle, (0.05, 0.95))
    ends = np.log10(found.draws.condition("end_time", design.conditions.end))
    low, high = np.median(found.window - ends[:, None], axis=0)
    axes.fill_between([left, max(right, 1.02 * left)], low, high, fc=USEFUL, alpha=0.3, ec="darkgreen", lw=2, zorder=3)


def _draw_strains(axes: Axes, found: Acceptance) -> None:
    low, high = np.median(found.window, axis=0)
    reach = np.clip(np.quantile(found.strains, (0.005, 0.995)), low - 30, high + 30)
    bins = np.linspace(min(reach[0], low - 1), max(reach[1], high + 1), 70)
    groups = {
        f"in the useful window: {_percent(found.useful)}": (found.useful, USEFUL),
        f"simulated, slower or faster: {_percent(found.kept & ~found.useful)}": (found.kept & ~found.useful, KEPT),
        f"rejected before simulation: {_percent(~found.kept)}": (~found.kept, REJECTED),
    }
    columns, colours = [found.strains[which] for which, _ in groups.values()], [c for _, c in groups.values()]
    axes.hist(columns, bins=list(bins), stacked=True, color=colours, label=list(groups))
    axes.axvspan(low, high, color=USEFUL, alpha=0.12, lw=0)
    axes.set(xlabel="log10 of (mean rate at the reference stress x duration)", ylabel="draws")
    axes.set_ylim(top=1.3 * axes.get_ylim()[1])
    axes.legend(fontsize=8, loc="upper right")
    axes.set_title("strain at the end; shaded: creep is visible and the test lasts", fontsize=10)


def _percent(which: Bools) -> str:
    return f"{100 * float(which.mean()):.1f} %"
