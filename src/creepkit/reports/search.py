"""Convergence of a global search, and term selection."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.sparsity.result import LEAST_CONTRIBUTION
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import panels_of, place_legend_below, save_figure, set_range

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.search.global_search import SearchTrace
    from creepkit.inverse.sparsity.result import Sparsity


SMALLEST_DRAWN_COST = 1e-12
"""Costs below it are drawn there: the axis is logarithmic."""


MARKER_LIMIT = 60
"""Above this many iterations they are drawn without marks."""


def search_figure(trace: SearchTrace, path: str | Path | None = None) -> Figure:
    """The lowest cost over iterations, and how the candidates spread."""
    figure, axes = panels_of(7.0, 4.4)
    _draw_costs(axes, trace)
    _draw_evaluations(axes, trace)
    place_legend_below(figure, axes)
    return save_figure(figure, path)


def _draw_costs(axes: Axes, trace: SearchTrace) -> None:
    iterations = np.arange(1, len(trace) + 1)
    if len(trace.quartiles):
        lower, median, upper = np.maximum(trace.quartiles, SMALLEST_DRAWN_COST).T
        axes.fill_between(iterations, lower, upper, color="C0", alpha=0.18, lw=0, label="middle half of candidates")
        axes.plot(iterations, median, color="C0", lw=1.0, alpha=0.7, label="their median")
    marker = "o" if len(trace) < MARKER_LIMIT else None
    best = np.maximum(trace.best_cost, SMALLEST_DRAWN_COST)
    axes.plot(iterations, best, color="C3", lw=2.0, marker=marker, ms=3, label="best so far")
    if trace.refined_cost is not None:
        label = f"after least squares, {trace.refinement_evaluations} more simulations"
        axes.axhline(max(trace.refined_cost, SMALLEST_DRAWN_COST), color="black", lw=1.0, ls="--", label=label)
    axes.set(xlabel="iteration", xlim=(1, max(len(trace), 2)))
    refined = [] if trace.refined_cost is None else [trace.refined_cost]
    drawn = np.maximum(np.concatenate([best, np.ravel(trace.quartiles), refined]), SMALLEST_DRAWN_COST)
    set_range(axes, "y", 0.9 * float(drawn.min()), 1.1 * float(drawn.max()), logarithmic=True)
    axes.set_ylabel("cost (half of chi-square,\nbound penalties and penalty included)")
    axes.set_title(trace.search, fontsize=10)


def _draw_evaluations(axes: Axes, trace: SearchTrace) -> None:
    """Evaluations on a second axis above, at ticks of their own."""
    iterations = np.arange(1, len(trace) + 1)
    top_axis = axes.secondary_xaxis("top")
    ticks = np.unique(np.linspace(0, len(trace) - 1, min(len(trace), 6)).astype(int))
    top_axis.set_xticks(iterations[ticks], [f"{count:,}" for count in trace.evaluations[ticks]], fontsize=8)
    top_axis.set_xlabel("candidates evaluated", fontsize=8)


def sparsity_text(sparsity: Sparsity) -> str:
    """The verdict, and the contribution of every term without penalty, with it, and after the refit."""
    strength = "" if sparsity.strength is None else f" of strength {sparsity.strength:g}"
    rows = []
    for term, contribution in sparsity.contributions_without_penalty.items():
        after = sparsity.contributions_after_refit.get(term)
        numbers = (contribution, sparsity.contributions_with_penalty[term])
        rows.append((term, *(f"{one:.3f}" for one in numbers), "dropped" if after is None else f"{after:.3f}"))
    lines = [f"{sparsity.penalty}{strength}: {sparsity.verdict}", *aligned(("", "without", "with", "after"), rows)]
    return "\n".join([*lines, f"(contributions; below {LEAST_CONTRIBUTION:g} a term is dropped)"])
