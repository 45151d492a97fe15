"""Pictures of a training: its curves, predicted against true outputs (the paper's Fig. 4), and the worst samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import SurrogateError
from creepkit.figures import empty_figure, save_figure
from creepkit.surrogate.metrics import PredictionComparison, worst_histories
from creepkit.surrogate.recipe import SurrogateMetadata

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OUTPUT_LABELS = {"amplitude": "amplitude, mm", "width": "width, mm", "shape": "shape", "strain": "strain"}
MOST_POINTS = 4000
"""Drawn at most in a panel of a parity plot."""
WORST_SHOWN = 6
"""Worst samples that are drawn."""


def training_curves(metadata: SurrogateMetadata, path: str | Path | None = None) -> Figure:
    """The losses of each epoch, and where the rate fell."""
    curves_by_name = metadata.curves
    if not curves_by_name.get("loss"):
        raise SurrogateError("this surrogate holds no training curves")
    figure = empty_figure(6.4, 4.2)
    axes, epochs = figure.subplots(), np.arange(1, len(curves_by_name["loss"]) + 1)
    axes.plot(epochs, curves_by_name["loss"], lw=1.2, label="training, own loss")
    axes.plot(epochs, curves_by_name["validation"], lw=1.2, label="validation, own loss")
    if curves_by_name["rse"] != curves_by_name["validation"]:
        axes.plot(epochs, curves_by_name["rse"], "k", lw=1.6, label="validation, Eq. (4)")
    best = int(np.argmin(curves_by_name["validation"]))
    axes.plot(
        best + 1, curves_by_name["rse"][best], "o", ms=6, mfc="none", color="black", label=f"best: {curves_by_name['rse'][best]:.3g}"
    )
    rate_drops = [k for k in range(1, len(epochs)) if curves_by_name["rate"][k] < 0.5 * curves_by_name["rate"][k - 1]]
    for k in rate_drops:
        axes.axvline(k + 1, color="grey", lw=0.8, ls=":", label="rate falls" if k == rate_drops[0] else None)
    axes.set(xlabel="epoch", ylabel="loss", yscale="log", title=f"{metadata.law.name}, {metadata.specimen.name}")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)
    return save_figure(figure, path, SurrogateError)


def parity_figure(comparison: PredictionComparison, times: Sequence[float], path: str | Path | None = None) -> Figure:
    """Predicted against true outputs at some times: a row each time, a column each output."""
    figure = empty_figure(3.4 * len(comparison.outputs) + 0.4, 3.1 * len(times))
    panels = figure.subplots(len(times), len(comparison.outputs), squeeze=False)
    for row, time in zip(panels, times, strict=True):
        true, predicted = comparison.at_time(time)
        for k, (axes, name) in enumerate(zip(row, comparison.outputs, strict=True)):
            _draw_parity(axes, true[:, k], predicted[:, k])
            axes.set_title(f"{OUTPUT_LABELS.get(name, name)} at {time:g} s", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("simulated")
    for axes in panels[:, 0]:
        axes.set_ylabel("predicted")
    figure.suptitle(f"{len(comparison.true)} samples, predicted against simulated", fontsize=10)
    return save_figure(figure, path, SurrogateError)


def _draw_parity(axes: Axes, true: Any, predicted: Any) -> None:
    if not true.size:
        axes.text(0.5, 0.5, "no sample lasts so long", ha="center", transform=axes.transAxes)
        return
    limits = np.array([min(true.min(), predicted.min()), max(true.max(), predicted.max())])
    thinned = slice(None, None, -(-true.size // MOST_POINTS))
    axes.plot(limits, limits, "k-", lw=0.8)
    axes.plot(true[thinned], predicted[thinned], ".", ms=3, alpha=0.5)
    spread = ((true - true.mean()) ** 2).sum()
    if spread > 0:
        slope = ((true - true.mean()) * predicted).sum() / spread
        r_squared = 1.0 - ((predicted - true) ** 2).sum() / spread
        axes.text(0.04, 0.96, f"slope {slope:.4f}\nR2 {r_squared:.4f}", va="top", fontsize=8, transform=axes.transAxes)
    axes.grid(alpha=0.25)


def worst_samples_figure(comparison: PredictionComparison, path: str | Path | None = None) -> Figure:
    """The samples with the largest errors of the first output, simulated and predicted over time."""
    rows = worst_histories(comparison, comparison.largest_errors())[:WORST_SHOWN]
    figure = empty_figure(9.6, 5.6)
    panels = figure.subplots(2, 3).ravel()
    for axes in panels[len(rows) :]:
        axes.axis("off")
    for axes, sample in zip(panels, rows, strict=False):
        k = int(sample["row"])
        mask, hours = comparison.mask[k], comparison.times[k] / 3600.0
        axes.plot(hours[mask], comparison.true[k, mask, 0], "k-", lw=1.4, label="simulated")
        axes.plot(hours[mask], comparison.predicted[k, mask, 0], "--", lw=1.4, color="tab:red", label="predicted")
        axes.set_title(f"sample {int(sample['index'])}: off by {sample['error']:.3g}", fontsize=9)
        axes.grid(alpha=0.25)
    panels[0].legend(fontsize=8)
    name = comparison.outputs[0]
    figure.supxlabel("time, h", fontsize=10)
    figure.supylabel(OUTPUT_LABELS.get(name, name), fontsize=10)
    return save_figure(figure, path, SurrogateError)
