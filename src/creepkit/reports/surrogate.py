"""Text and figures of data sets and surrogates: errors, training curves, parity (Fig. 4 of the paper), size study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.dataset.dataset import summary
from creepkit.errors import SurrogateError
from creepkit.records import output_named
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import draw_parity, make_folder, panel_grid, panels_of, place_legend, save_figure, span
from creepkit.reports.terminal import print_json, tell, tell_written
from creepkit.surrogates.evaluation import PredictionComparison, evaluate
from creepkit.surrogates.parameter_gru import SurrogateMetadata

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset
    from creepkit.surrogates.surrogate import Surrogate


MOST_POINTS = 4000
"""Drawn at most in a panel of a parity plot."""


def training_curves(metadata: SurrogateMetadata, path: str | Path | None = None) -> Figure:
    """The losses of each epoch, and where the rate fell."""
    curves = metadata.curves
    if not curves.get("loss"):
        raise SurrogateError("this surrogate holds no training curves")
    figure, axes = panels_of(6.4, 4.2)
    epochs, best = np.arange(1, len(curves["loss"]) + 1), int(np.argmin(curves["validation"]))
    drawn = {"loss": "training, own loss", "validation": "validation, own loss", "rse": "validation, Eq. (4)"}
    for name, label in drawn.items():
        if name != "rse" or curves["rse"] != curves["validation"]:
            axes.plot(epochs, curves[name], lw=1.2, label=label)
    place = (best + 1, curves["rse"][best])
    axes.plot(*place, "o", ms=6, mfc="none", color="black", label=f"best: {place[1]:.3g}")
    rates = np.array(curves["rate"])
    for k, epoch in enumerate(np.flatnonzero(rates[1:] < 0.5 * rates[:-1]) + 2):
        axes.axvline(epoch, color="grey", lw=0.8, ls=":", label="rate falls" if k == 0 else None)
    axes.set(xlabel="epoch", ylabel="loss", title=f"{metadata.law.name}, {metadata.specimen.name}")
    span(axes, "y", *(curves[name] for name in drawn), logarithmic=True, most=8)
    place_legend(axes)
    return save_figure(figure, path)


def parity_figure(comparison: PredictionComparison, times: Sequence[float], path: str | Path | None = None) -> Figure:
    """Predicted against true outputs at some times: a row each time, a column each output."""
    outputs = comparison.outputs
    figure, panels = panel_grid(len(outputs) * len(times), len(outputs), 3.4, 3.1)
    at = [(time, k, name) for time in times for k, name in enumerate(outputs)]
    for axes, (time, k, name) in zip(panels, at, strict=True):
        true, predicted = (one[:, k] for one in comparison.at_time(time))
        axes.set(title=f"{output_named(name).label} at {time:g} s", xlabel="simulated", ylabel="predicted")
        if not true.size:
            axes.text(0.5, 0.5, "no sample lasts so long", ha="center", transform=axes.transAxes)
            continue
        draw_parity(axes, true, predicted)
        thinned = slice(None, None, -(-true.size // MOST_POINTS))
        axes.plot(true[thinned], predicted[thinned], ".", ms=3, alpha=0.5)
        spread = ((true - true.mean()) ** 2).sum()
        if spread > 0:
            r_squared = 1.0 - ((predicted - true) ** 2).sum() / spread
            axes.text(0.04, 0.96, f"R2 {r_squared:.4f}", va="top", fontsize=8, transform=axes.transAxes)
    figure.suptitle(f"{len(comparison.true)} samples, predicted against simulated", fontsize=10)
    return save_figure(figure, path)


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
    """Draw the curves and the parity plot; returns their paths."""
    make_folder(folder)
    paths = [folder / f"{name}-{what}.png" for what in ("curves", "parity")]
    evaluation = evaluate(surrogate, data)
    training_curves(surrogate.metadata, paths[0])
    parity_figure(evaluation.comparison, evaluation.times, paths[1])
    return paths


def size_study_rows(trainings: Sequence[Mapping[str, Any]]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The heads and rows of a table, the best first."""
    results = sorted(trainings, key=lambda one: one["loss"])
    outputs = list(results[0]["outputs"]) if results else []
    heads = ("hidden", "layers", "samples", "weights", "loss (Eq. 4)", "training", "epochs", "best")
    rows = [
        (
            *(str(one[name]) for name in ("hidden", "layers", "samples", "weight_count")),
            *(f"{one['loss']:.4g}", f"{one['training']:.4g}", str(one["epochs"]), str(one["best_epoch"])),
            *(f"{one['outputs'][name]:.3g}" for name in outputs),
        )
        for one in results
    ]
    return (*heads, *(f"RSE {name}" for name in outputs)), rows


# ---- data sets -------------------------------------------------------------------------------------------------------


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
