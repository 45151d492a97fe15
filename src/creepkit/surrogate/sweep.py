"""Sweeps: the same data learnt by networks of several sizes, from several numbers of samples; the paper's Fig. S7."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import SurrogateError
from creepkit.figures import empty_figure, save_figure
from creepkit.surrogate.parameter_gru import ParameterGru
from creepkit.surrogate.parameter_module import RecurrentCell
from creepkit.surrogate.recipe import ProgressCallback
from creepkit.surrogate.surrogate import Surrogate
from creepkit.surrogate.train import train
from creepkit.surrogate.trainable import training_split, trainable_samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset


@dataclass(frozen=True)
class SizeStudyResult:
    """One training of a sweep.

    cell, hidden, layers, samples : what was varied; samples are those learnt from.
    weights : numbers that were fitted. loss : Eq. (4) of the validation rows at the best epoch; training : the loss of
        the training rows in that epoch. outputs : {output: its RSE}. losses : Eq. (4) of each epoch.
    """

    cell: RecurrentCell
    hidden: int
    layers: int
    samples: int
    weight_count: int
    loss: float
    training: float
    epochs: int
    best_epoch: int
    outputs: dict[str, float]
    losses: tuple[float, ...]
    file: str

    @property
    def label(self) -> str:
        """In words."""
        return f"{self.cell} {self.hidden} x {self.layers}, {self.samples} samples"


def size_study(
    data: Dataset, recipe: ParameterGru, *, to: str | Path, layers: Sequence[int] = (), hidden: Sequence[int] = (),
    cells: Sequence[RecurrentCell] = (), samples: Sequence[int] = (), seed: int = 0, device: str = "auto",
    progress: ProgressCallback | None = None,
) -> list[SizeStudyResult]:  # fmt: skip
    """Train every combination, each to a file of its own in the folder `to`; those that are there already are read.

    What is not given stays as the recipe has it; samples are numbers to learn from. Every training is judged by the
    same rows, a share of the whole data set that none of them learns from.
    """
    data, folder = trainable_samples(data), Path(to)
    training_count = len(training_split(len(data), recipe.training, seed)[0])
    counts = [*samples] or [training_count]
    training_split(len(data), replace(recipe.training, samples=max(counts)), seed)  # complains now, not after hours of training
    folder.mkdir(parents=True, exist_ok=True)
    combinations = list(product(cells or [recipe.cell], layers or [recipe.layers], hidden or [recipe.hidden], counts))
    results = []
    for k, (cell, depth, width, count) in enumerate(combinations):
        settings = replace(recipe.training, samples=count)
        variant = replace(recipe, cell=cell, layers=depth, hidden=width, training=settings)
        path = folder / f"{cell}-{width}x{depth}-{count}.safetensors"
        named_progress = _with_task_name(progress, f"{k + 1} of {len(combinations)}, {path.stem}")
        model = train(data, variant, to=path, seed=seed, device=device, progress=named_progress)
        results.append(_study_result(model, variant, count, path))
    return results


def _with_task_name(progress: ProgressCallback | None, name: str) -> ProgressCallback | None:
    if progress is None:
        return None
    return lambda task, done, total, note: progress(f"{name}, {task}", done, total, note)


def _study_result(model: Surrogate, recipe: ParameterGru, count: int, path: Path) -> SizeStudyResult:
    metadata, provenance = model.metadata, model.metadata.provenance
    best = int(provenance["best_epoch"])
    return SizeStudyResult(
        recipe.cell, recipe.hidden, recipe.layers, count,
        weight_count=sum(weight.numel() for weight in model.module.parameters()),
        loss=float(metadata.metrics["loss"]),
        training=float(metadata.curves["loss"][best - 1]),
        epochs=int(provenance["epochs"]),
        best_epoch=best,
        outputs={name: float(errors_of_output["rse"]) for name, errors_of_output in metadata.metrics["outputs"].items()},
        losses=tuple(metadata.curves["rse"]),
        file=path.name,
    )  # fmt: skip


def size_study_rows(results: Sequence[SizeStudyResult]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The heads and rows of a table, the best first."""
    outputs = list(results[0].outputs) if results else []
    heads = ("cell", "hidden", "layers", "samples", "weights", "loss (Eq. 4)", "training", "epochs", "best",
             *(f"RSE {name}" for name in outputs))  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for result in sorted(results, key=lambda e: e.loss):
        sizes = tuple(map(str, (result.cell, result.hidden, result.layers, result.samples, result.weight_count)))
        output_errors = (f"{result.outputs[name]:.3g}" for name in outputs)
        rows.append((*sizes, f"{result.loss:.4g}", f"{result.training:.4g}", str(result.epochs), str(result.best_epoch), *output_errors))
    return heads, rows


def size_study_figure(results: Sequence[SizeStudyResult], path: str | Path | None = None) -> Figure:
    """Loss over epochs of every training, and the lowest of each, the best on top."""
    from matplotlib import colormaps
    from matplotlib.ticker import LogLocator, NullFormatter

    ordered = sorted(results, key=lambda e: e.loss)
    canvas = empty_figure(11.0, max(3.8, 0.28 * len(ordered) + 1.6))
    left, right = canvas.subplots(1, 2, width_ratios=(1.15, 1.0))
    shades: list[Any] = [colormaps["viridis"](0.92 * k / max(len(ordered) - 1, 1)) for k in range(len(ordered))]
    for result, shade in reversed(list(zip(ordered, shades, strict=True))):
        left.plot(np.arange(1, len(result.losses) + 1), result.losses, lw=1.2, color=shade)
    left.set(xlabel="epoch", ylabel="loss of validation rows, Eq. (4)", yscale="log")
    left.grid(alpha=0.25)
    positions = np.arange(len(ordered))
    for position, result, shade in zip(positions, ordered, shades, strict=True):
        right.plot([result.training, result.loss], [position, position], "-", lw=1.0, color="grey")
        right.plot(result.training, position, "o", ms=4, mfc="none", color="grey", label="training" if position == 0 else None)
        right.plot(result.loss, position, "o", ms=6, color=shade, label="validation" if position == 0 else None)
    right.set(xscale="log", xlabel="loss at the best epoch", yticks=positions)
    for axis in (left.yaxis, right.xaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    right.set_yticklabels([result_entry.label for result_entry in ordered], fontsize=8)
    right.invert_yaxis()
    right.grid(alpha=0.25)
    right.legend(fontsize=8)
    return save_figure(canvas, path, SurrogateError)
