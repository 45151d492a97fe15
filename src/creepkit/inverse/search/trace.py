"""How a search got where it ended: the best cost after each iteration, and what it had evaluated by then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.figures import blank, written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

QUARTILES = (25.0, 50.0, 75.0)
FLOOR = 1e-12
"""Costs below it are drawn there: the axis is logarithmic."""
CROWDED = 60
"""Above this many iterations they are drawn without marks."""


@dataclass(frozen=True)
class Trace:
    """One row for each iteration.

    best : (iterations,) lowest cost so far; evaluations : (iterations,) candidates evaluated so far.
    quartiles : (iterations, 3) of the costs of that iteration's candidates, 25, 50 and 75 %; NaN where there are none.
    restarts : iterations at which a new run of the search began, but for the first.
    polished : lowest cost after the best were refined by least squares, and `refinements`, the simulations that took.
    """

    search: str
    best: Floats
    evaluations: Ints
    quartiles: Floats = field(default_factory=lambda: np.empty((0, 3)))
    restarts: tuple[int, ...] = ()
    polished: float | None = None
    refinements: int = 0

    @classmethod
    def of(cls, search: str, costs: Sequence[Floats], restarts: Sequence[int] = ()) -> Trace:
        """From the costs of the candidates of each iteration, one array each."""
        lowest = np.minimum.accumulate([float(np.min(each)) for each in costs])
        counted = np.cumsum([len(each) for each in costs])
        quartiles = np.array([np.percentile(each, QUARTILES) for each in costs])
        return cls(search, lowest, counted, quartiles, tuple(restarts))

    def __len__(self) -> int:
        return len(self.best)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the lowest cost, and how the candidates spread; written to `path` when given."""
        figure = blank(7.0, 4.4)
        axes = figure.subplots()
        self._draw(axes)
        self._count(axes)
        return written(figure, path)

    def _draw(self, axes: Axes) -> None:
        iterations = np.arange(1, len(self) + 1)
        if len(self.quartiles):
            low, middle, high = np.maximum(self.quartiles, FLOOR).T
            axes.fill_between(iterations, low, high, color="C0", alpha=0.18, lw=0, label="middle half of candidates")
            axes.plot(iterations, middle, color="C0", lw=1.0, alpha=0.7, label="their median")
        mark = "o" if len(self) < CROWDED else None
        best = np.maximum(self.best, FLOOR)
        axes.plot(iterations, best, color="C3", lw=2.0, marker=mark, ms=3, label="best so far")
        if self.polished is not None:
            words = f"after least squares, {self.refinements} more simulations"
            axes.axhline(max(self.polished, FLOOR), color="black", lw=1.0, ls="--", label=words)
        for k, start in enumerate(self.restarts):
            axes.axvline(start + 1, color="grey", lw=0.8, ls=":", label="restart" if k == 0 else None)
        axes.set(xlabel="iteration", yscale="log", xlim=(1, max(len(self), 2)))
        axes.set_ylabel("cost (half of chi-square, walls and penalty included)")
        axes.set_title(self.search, fontsize=10)
        axes.grid(alpha=0.25)
        axes.legend(fontsize=8)

    def _count(self, axes: Axes) -> None:
        """Evaluations on a second axis above, at ticks of their own."""
        iterations = np.arange(1, len(self) + 1)
        shown = axes.secondary_xaxis("top")
        ticks = np.unique(np.linspace(0, len(self) - 1, min(len(self), 6)).astype(int))
        shown.set_xticks(iterations[ticks], [f"{count:,}" for count in self.evaluations[ticks]], fontsize=8)
        shown.set_xlabel("candidates evaluated", fontsize=8)
