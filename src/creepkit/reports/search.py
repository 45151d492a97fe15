"""Text and plots of searches: convergence of a global search, term selection, and the path of a penalty."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.sparsity.result import LEAST_CONTRIBUTION
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import panels_of, place_legend_below, save_figure, set_range

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.search.global_search import SearchTrace
    from creepkit.inverse.sparsity.result import PenaltyPath, Sparsity


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
    for k, start in enumerate(trace.restarts):
        axes.axvline(start + 1, color="grey", lw=0.8, ls=":", label="restart" if k == 0 else None)
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


def penalty_path_text(path: PenaltyPath) -> str:
    """One row a strength: chi-square, BIC less the least, contributions and the terms that are kept."""
    rows = []
    for k, strength in enumerate(path.strengths):
        numbers = [f"{strength:g}", f"{path.chi_square[k]:.1f}", f"{path.bic_excess[k]:.1f}"]
        rows.append([*numbers, *(f"{c:.3f}" for c in path.contributions[k]), ", ".join(path.kept_terms[k])])
    rows[path.chosen][-1] += "   <- chosen"
    return "\n".join(aligned(("strength", "chi-square", "BIC - least", *path.terms, "kept"), rows))


SMALLEST_DRAWN_RISE = 0.1
"""Rises of chi-square below this are drawn there: the axis is logarithmic."""


def penalty_path_figure(path: PenaltyPath, file: str | Path | None = None) -> Figure:
    """Contributions on the left axis, the rise of chi-square on the right one."""
    figure, axes = panels_of(7.2, 4.4)
    positions = _strength_positions(path.strengths)
    for label, contribution in zip(path.terms, path.contributions.T, strict=True):
        axes.plot(positions, contribution, "o-", ms=4, lw=1.6, label=label)
    axes.axvline(positions[path.chosen], color="black", lw=1.0, ls=":", label="chosen by BIC")
    axes.axhspan(0.0, 0.05, color="black", alpha=0.06, lw=0)
    axes.set(xscale="log", ylim=(0, 1.05), xlabel="strength of the penalty", ylabel="contribution of each term")
    _draw_ticks(axes, path, positions)
    _draw_chi_square(axes, path, positions)
    place_legend_below(figure, axes, columns=4)
    axes.set_title(f"{path.penalty}: terms below 5 % (grey) are dropped", fontsize=10)
    return save_figure(figure, file)


def _strength_positions(strengths: Floats) -> Floats:
    """Where strengths are drawn: none stands to the left of the weakest."""
    weakest = strengths[1] if strengths.size > 1 else 1.0
    return np.array([weakest / 3.0, *strengths[1:]])


def _draw_ticks(axes: Axes, path: PenaltyPath, positions: Floats) -> None:
    axes.set_xticks(positions, ["none", *(f"{s:.2g}" if s < 100 else f"{s:.0f}" for s in path.strengths[1:])])
    axes.minorticks_off()


def _draw_chi_square(axes: Axes, path: PenaltyPath, positions: Floats) -> None:
    """The rise of chi-square over the sum without penalty."""
    right = axes.twinx()
    rise = np.maximum(path.chi_square - path.chi_square[0], SMALLEST_DRAWN_RISE)
    right.plot(positions, rise, "s--", color="grey", ms=3, lw=1.0)
    set_range(right, "y", float(rise.min()), float(rise.max()), logarithmic=True)
    right.set_ylabel("rise of chi-square (grey squares)")
