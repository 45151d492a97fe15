"""Sweeps: the same data learnt by networks of several sizes, from several numbers of samples; the paper's Fig. S7."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import SurrogateError
from creepkit.figures import blank, written
from creepkit.surrogate.parameter_gru import ParameterGru
from creepkit.surrogate.parameter_module import Cell
from creepkit.surrogate.recipe import Progress
from creepkit.surrogate.surrogate import Surrogate
from creepkit.surrogate.train import train
from creepkit.surrogate.trainable import split, trainable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.dataset.dataset import Dataset


@dataclass(frozen=True)
class Entry:
    """One training of a sweep.

    cell, hidden, layers, samples : what was varied; samples are those learnt from.
    weights : numbers that were fitted. loss : Eq. (4) of the validation rows at the best epoch; training : the loss of
        the training rows in that epoch. outputs : {output: its RSE}. losses : Eq. (4) of each epoch.
    """

    cell: Cell
    hidden: int
    layers: int
    samples: int
    weights: int
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


def sweep(
    data: Dataset, recipe: ParameterGru, *, to: str | Path, layers: Sequence[int] = (), hidden: Sequence[int] = (),
    cells: Sequence[Cell] = (), samples: Sequence[int] = (), seed: int = 0, device: str = "auto",
    progress: Progress | None = None,
) -> list[Entry]:  # fmt: skip
    """Train every combination, each to a file of its own in the folder `to`; those that are there already are read.

    What is not given stays as the recipe has it; samples are numbers to learn from. Every training is judged by the
    same rows, a share of the whole data set that none of them learns from.
    """
    data, folder = trainable(data), Path(to)
    whole = len(split(len(data), recipe.training, seed)[0])
    counts = [*samples] or [whole]
    split(len(data), replace(recipe.training, samples=max(counts)), seed)  # complains now, not after hours of training
    folder.mkdir(parents=True, exist_ok=True)
    varied = list(product(cells or [recipe.cell], layers or [recipe.layers], hidden or [recipe.hidden], counts))
    entries = []
    for k, (cell, depth, width, count) in enumerate(varied):
        how = replace(recipe.training, samples=count)
        one = replace(recipe, cell=cell, layers=depth, hidden=width, training=how)
        path = folder / f"{cell}-{width}x{depth}-{count}.safetensors"
        named = _named(progress, f"{k + 1} of {len(varied)}, {path.stem}")
        model = train(data, one, to=path, seed=seed, device=device, progress=named)
        entries.append(_entry(model, one, count, path))
    return entries


def _named(progress: Progress | None, name: str) -> Progress | None:
    if progress is None:
        return None
    return lambda task, done, total, note: progress(f"{name}, {task}", done, total, note)


def _entry(model: Surrogate, recipe: ParameterGru, count: int, path: Path) -> Entry:
    told, known = model.told, model.told.provenance
    best = int(known["best_epoch"])
    return Entry(
        recipe.cell, recipe.hidden, recipe.layers, count,
        weights=sum(weight.numel() for weight in model.module.parameters()),
        loss=float(told.metrics["loss"]),
        training=float(told.curves["loss"][best - 1]),
        epochs=int(known["epochs"]),
        best_epoch=best,
        outputs={name: float(own["rse"]) for name, own in told.metrics["outputs"].items()},
        losses=tuple(told.curves["rse"]),
        file=path.name,
    )  # fmt: skip


def rows_of(entries: Sequence[Entry]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The heads and rows of a table, the best first."""
    outputs = list(entries[0].outputs) if entries else []
    heads = ("cell", "hidden", "layers", "samples", "weights", "loss (Eq. 4)", "training", "epochs", "best",
             *(f"RSE {name}" for name in outputs))  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for e in sorted(entries, key=lambda e: e.loss):
        sizes = tuple(map(str, (e.cell, e.hidden, e.layers, e.samples, e.weights)))
        own = (f"{e.outputs[name]:.3g}" for name in outputs)
        rows.append((*sizes, f"{e.loss:.4g}", f"{e.training:.4g}", str(e.epochs), str(e.best_epoch), *own))
    return heads, rows


def figure(entries: Sequence[Entry], path: str | Path | None = None) -> Figure:
    """Loss over epochs of every training, and the lowest of each, the best on top."""
    from matplotlib import colormaps
    from matplotlib.ticker import LogLocator, NullFormatter

    ordered = sorted(entries, key=lambda e: e.loss)
    made = blank(11.0, max(3.8, 0.28 * len(ordered) + 1.6))
    left, right = made.subplots(1, 2, width_ratios=(1.15, 1.0))
    shades: list[Any] = [colormaps["viridis"](0.92 * k / max(len(ordered) - 1, 1)) for k in range(len(ordered))]
    for entry, shade in reversed(list(zip(ordered, shades, strict=True))):
        left.plot(np.arange(1, len(entry.losses) + 1), entry.losses, lw=1.2, color=shade)
    left.set(xlabel="epoch", ylabel="loss of validation rows, Eq. (4)", yscale="log")
    left.grid(alpha=0.25)
    places = np.arange(len(ordered))
    for place, entry, shade in zip(places, ordered, shades, strict=True):
        right.plot([entry.training, entry.loss], [place, place], "-", lw=1.0, color="grey")
        right.plot(entry.training, place, "o", ms=4, mfc="none", color="grey", label="training" if place == 0 else None)
        right.plot(entry.loss, place, "o", ms=6, color=shade, label="validation" if place == 0 else None)
    right.set(xscale="log", xlabel="loss at the best epoch", yticks=places)
    for axis in (left.yaxis, right.xaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    right.set_yticklabels([e.label for e in ordered], fontsize=8)
    right.invert_yaxis()
    right.grid(alpha=0.25)
    right.legend(fontsize=8)
    return written(made, path, SurrogateError)
