"""Pictures of a training: its curves, predicted against true outputs (the paper's Fig. 4), and the worst samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import SurrogateError
from creepkit.figures import blank, written
from creepkit.surrogate.metrics import Compared, worst
from creepkit.surrogate.recipe import Told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LABELS = {"amplitude": "amplitude, mm", "width": "width, mm", "shape": "shape", "strain": "strain"}
DOTS = 4000
"""Drawn at most in a panel of a parity plot."""
SHOWN = 6
"""Worst samples that are drawn."""


def curves(told: Told, path: str | Path | None = None) -> Figure:
    """The losses of each epoch, and where the rate fell."""
    known = told.curves
    if not known.get("loss"):
        raise SurrogateError("this surrogate holds no training curves")
    figure = blank(6.4, 4.2)
    axes, epochs = figure.subplots(), np.arange(1, len(known["loss"]) + 1)
    axes.plot(epochs, known["loss"], lw=1.2, label="training, own loss")
    axes.plot(epochs, known["validation"], lw=1.2, label="validation, own loss")
    if known["rse"] != known["validation"]:
        axes.plot(epochs, known["rse"], "k", lw=1.6, label="validation, Eq. (4)")
    best = int(np.argmin(known["validation"]))
    axes.plot(
        best + 1, known["rse"][best], "o", ms=6, mfc="none", color="black", label=f"best: {known['rse'][best]:.3g}"
    )
    falls = [k for k in range(1, len(epochs)) if known["rate"][k] < 0.5 * known["rate"][k - 1]]
    for k in falls:
        axes.axvline(k + 1, color="grey", lw=0.8, ls=":", label="rate falls" if k == falls[0] else None)
    axes.set(xlabel="epoch", ylabel="loss", yscale="log", title=f"{told.law.name}, {told.specimen.name}")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)
    return written(figure, path, SurrogateError)


def parity(found: Compared, times: Sequence[float], path: str | Path | None = None) -> Figure:
    """Predicted against true outputs at some times: a row each time, a column each output."""
    figure = blank(3.4 * len(found.outputs) + 0.4, 3.1 * len(times))
    panels = figure.subplots(len(times), len(found.outputs), squeeze=False)
    for row, time in zip(panels, times, strict=True):
        true, predicted = found.at(time)
        for k, (axes, name) in enumerate(zip(row, found.outputs, strict=True)):
            _draw_parity(axes, true[:, k], predicted[:, k])
            axes.set_title(f"{LABELS.get(name, name)} at {time:g} s", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("simulated")
    for axes in panels[:, 0]:
        axes.set_ylabel("predicted")
    figure.suptitle(f"{len(found.true)} samples, predicted against simulated", fontsize=10)
    return written(figure, path, SurrogateError)


def _draw_parity(axes: Axes, true: Any, predicted: Any) -> None:
    if not true.size:
        axes.text(0.5, 0.5, "no sample lasts so long", ha="center", transform=axes.transAxes)
        return
    ends = np.array([min(true.min(), predicted.min()), max(true.max(), predicted.max())])
    some = slice(None, None, -(-true.size // DOTS))
    axes.plot(ends, ends, "k-", lw=0.8)
    axes.plot(true[some], predicted[some], ".", ms=3, alpha=0.5)
    spread = ((true - true.mean()) ** 2).sum()
    if spread > 0:
        slope = ((true - true.mean()) * predicted).sum() / spread
        fit = 1.0 - ((predicted - true) ** 2).sum() / spread
        axes.text(0.04, 0.96, f"slope {slope:.4f}\nR2 {fit:.4f}", va="top", fontsize=8, transform=axes.transAxes)
    axes.grid(alpha=0.25)


def worst_samples(found: Compared, path: str | Path | None = None) -> Figure:
    """The samples with the largest errors of the first output, simulated and predicted over time."""
    rows = worst(found, found.largest())[:SHOWN]
    figure = blank(9.6, 5.6)
    panels = figure.subplots(2, 3).ravel()
    for axes in panels[len(rows) :]:
        axes.axis("off")
    for axes, sample in zip(panels, rows, strict=False):
        k = int(sample["row"])
        known, hours = found.mask[k], found.times[k] / 3600.0
        axes.plot(hours[known], found.true[k, known, 0], "k-", lw=1.4, label="simulated")
        axes.plot(hours[known], found.predicted[k, known, 0], "--", lw=1.4, color="tab:red", label="predicted")
        axes.set_title(f"sample {int(sample['index'])}: off by {sample['error']:.3g}", fontsize=9)
        axes.grid(alpha=0.25)
    panels[0].legend(fontsize=8)
    name = found.outputs[0]
    figure.supxlabel("time, h", fontsize=10)
    figure.supylabel(LABELS.get(name, name), fontsize=10)
    return written(figure, path, SurrogateError)
