"""Text and figures of surrogates: errors, training curves, parity (Fig. 4 of the paper), worst samples, size study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import SurrogateError
from creepkit.records import output_named
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import empty_figure, make_folder, panels_of, place_legend_below, save_figure, set_range
from creepkit.surrogates.evaluation import PredictionComparison, evaluate, worst_histories
from creepkit.surrogates.parameter_gru import SurrogateMetadata

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset
    from creepkit.surrogates.surrogate import Surrogate
    from creepkit.surrogates.training import SizeStudyResult


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
        best + 1,
        curves_by_name["rse"][best],
        "o",
        ms=6,
        mfc="none",
        color="black",
        label=f"best: {curves_by_name['rse'][best]:.3g}",
    )
    rate_drops = [k for k in range(1, len(epochs)) if curves_by_name["rate"][k] < 0.5 * curves_by_name["rate"][k - 1]]
    for k in rate_drops:
        axes.axvline(k + 1, color="grey", lw=0.8, ls=":", label="rate falls" if k == rate_drops[0] else None)
    axes.set(xlabel="epoch", ylabel="loss", yscale="log", title=f"{metadata.law.name}, {metadata.specimen.name}")
    losses = np.concatenate([curves_by_name[name] for name in ("loss", "validation", "rse")])
    losses = losses[np.isfinite(losses) & (losses > 0)]
    set_range(axes, "y", float(losses.min()), float(losses.max()), logarithmic=True)
    place_legend_below(figure, axes)
    return save_figure(figure, path, SurrogateError)


def parity_figure(comparison: PredictionComparison, times: Sequence[float], path: str | Path | None = None) -> Figure:
    """Predicted against true outputs at some times: a row each time, a column each output."""
    figure, panels = panels_of(
        3.4 * len(comparison.outputs) + 0.4, 3.1 * len(times), len(times), len(comparison.outputs), squeeze=False
    )
    for row, time in zip(panels, times, strict=True):
        true, predicted = comparison.at_time(time)
        for k, (axes, name) in enumerate(zip(row, comparison.outputs, strict=True)):
            _draw_parity(axes, true[:, k], predicted[:, k])
            axes.set_title(f"{output_named(name).label} at {time:g} s", fontsize=9)
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
    set_range(axes, "x", float(limits[0]), float(limits[1]), most=5)
    set_range(axes, "y", float(limits[0]), float(limits[1]), most=5)
    axes.plot(limits, limits, "k-", lw=0.8)
    axes.plot(true[thinned], predicted[thinned], ".", ms=3, alpha=0.5)
    spread = ((true - true.mean()) ** 2).sum()
    if spread > 0:
        slope = ((true - true.mean()) * predicted).sum() / spread
        r_squared = 1.0 - ((predicted - true) ** 2).sum() / spread
        axes.text(0.04, 0.96, f"slope {slope:.4f}\nR2 {r_squared:.4f}", va="top", fontsize=8, transform=axes.transAxes)


def worst_samples_figure(comparison: PredictionComparison, path: str | Path | None = None) -> Figure:
    """The samples with the largest errors of the first output, simulated and predicted over time."""
    rows = worst_histories(comparison, comparison.largest_errors())[:WORST_SHOWN]
    figure, grid = panels_of(9.6, 5.6, 2, 3)
    panels = grid.ravel()
    for axes in panels[len(rows) :]:
        axes.axis("off")
    for axes, sample in zip(panels, rows, strict=False):
        k = int(sample["row"])
        mask, hours = comparison.mask[k], comparison.times[k] / 3600.0
        axes.plot(hours[mask], comparison.true[k, mask, 0], "k-", lw=1.4, label="simulated")
        axes.plot(hours[mask], comparison.predicted[k, mask, 0], "--", lw=1.4, color="tab:red", label="predicted")
        axes.set_title(f"sample {int(sample['index'])}: off by {sample['error']:.3g}", fontsize=9)
        axes.grid(alpha=0.25)
    place_legend_below(figure, panels[0])
    name = comparison.outputs[0]
    for axes in panels[3:]:
        axes.set_xlabel("time, h", fontsize=9)
    figure.supylabel(output_named(name).label, fontsize=10)
    return save_figure(figure, path, SurrogateError)


ERROR_COLUMNS = ("rse", "mse", "mae", "r2", "largest_median", "largest_p95")


ERROR_HEADS = ("RSE (Eq. 4)", "MSE", "MAE", "R2", "largest error, median", "95 %")


def surrogate_text(surrogate: Surrogate) -> str:
    """Title, laws, errors on the validation rows for each output, and where it came from."""
    metadata, metrics, source = surrogate.metadata, surrogate.metadata.metrics, surrogate.metadata.provenance
    lines = [surrogate.title, f"predicts law '{metadata.law.name}', and that less some of its terms"]
    if metrics:
        rows = [(name, *(_number_text(one[c]) for c in ERROR_COLUMNS)) for name, one in metrics["outputs"].items()]
        lines += aligned(("output", *ERROR_HEADS), rows, numeric=range(1, 1 + len(ERROR_HEADS)))
        lines.append(f"validation loss (Eq. 4, outputs together): {_number_text(metrics['loss'])}")
    if "training_rows" in source:
        counts = f"{source['training_rows']} samples for training, {source['validation_rows']} for validation"
        lines.append(f"{counts}; best epoch {source['best_epoch']} of {source['epochs']}, seed {source['seed']}")
    return "\n".join([*lines, *(f"note: {note}" for note in metadata.notes)])


def _number_text(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def write_surrogate_figures(surrogate: Surrogate, data: Dataset, folder: Path, name: str) -> list[Path]:
    """Draw the curves, the parity plot and the worst samples; returns their paths."""
    make_folder(folder, SurrogateError)
    paths = [folder / f"{name}-{what}.png" for what in ("curves", "parity", "worst")]
    evaluation = evaluate(surrogate, data)
    training_curves(surrogate.metadata, paths[0])
    parity_figure(evaluation.comparison, evaluation.times, paths[1])
    worst_samples_figure(evaluation.comparison, paths[2])
    return paths


def size_study_rows(results: Sequence[SizeStudyResult]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The heads and rows of a table, the best first."""
    outputs = list(results[0].outputs) if results else []
    sizes_and_losses = ("cell", "hidden", "layers", "samples", "weights", "loss (Eq. 4)", "training", "epochs", "best")
    heads = (*sizes_and_losses, *(f"RSE {name}" for name in outputs))
    rows: list[tuple[str, ...]] = []
    for result in sorted(results, key=lambda e: e.loss):
        sizes = tuple(map(str, (result.cell, result.hidden, result.layers, result.samples, result.weight_count)))
        output_errors = (f"{result.outputs[name]:.3g}" for name in outputs)
        rows.append(
            (
                *sizes,
                f"{result.loss:.4g}",
                f"{result.training:.4g}",
                str(result.epochs),
                str(result.best_epoch),
                *output_errors,
            )
        )
    return heads, rows


def size_study_figure(results: Sequence[SizeStudyResult], path: str | Path | None = None) -> Figure:
    """Loss over epochs of every training, and the lowest of each, the best on top."""
    from matplotlib import colormaps

    ordered = sorted(results, key=lambda e: e.loss)
    canvas, (left, right) = panels_of(11.0, max(3.8, 0.28 * len(ordered) + 1.6), 1, 2, width_ratios=(1.15, 1.0))
    shades: list[Any] = [colormaps["viridis"](0.92 * k / max(len(ordered) - 1, 1)) for k in range(len(ordered))]
    for result, shade in reversed(list(zip(ordered, shades, strict=True))):
        left.plot(np.arange(1, len(result.losses) + 1), result.losses, lw=1.2, color=shade)
    left.set(xlabel="epoch", ylabel="loss of validation rows, Eq. (4)", yscale="log")
    positions = np.arange(len(ordered))
    for position, result, shade in zip(positions, ordered, shades, strict=True):
        right.plot([result.training, result.loss], [position, position], "-", lw=1.0, color="grey")
        right.plot(
            result.training, position, "o", ms=4, mfc="none", color="grey", label="training" if position == 0 else None
        )
        right.plot(result.loss, position, "o", ms=6, color=shade, label="validation" if position == 0 else None)
    right.set(xscale="log", xlabel="loss at the best epoch", yticks=positions)
    drawn = np.concatenate([result.losses for result in ordered])
    set_range(left, "y", float(drawn.min()), float(drawn.max()), logarithmic=True)
    ends = [loss for result in ordered for loss in (result.training, result.loss)]
    set_range(right, "x", min(ends), max(ends), logarithmic=True, most=6)
    right.set_yticklabels([result_entry.label for result_entry in ordered], fontsize=8)
    right.invert_yaxis()
    place_legend_below(canvas, right)
    return save_figure(canvas, path, SurrogateError)
