"""The panel of rupture times: predicted against measured, with a band of a factor of two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

HOUR = 3600.0


def draw_ruptures(axes: Axes, fit: Identification, colours: Sequence[Any]) -> None:
    """One point a test with its 95 % interval; tests that were stopped are open, and lie where they were stopped."""
    found = [(m.rupture, colour) for m, colour in zip(fit.misfits, colours, strict=True) if m.rupture is not None]
    for r, colour in found:
        if not np.isfinite(r.predicted):
            continue
        below, above = r.predicted - r.low, r.high - r.predicted
        axes.errorbar(
            r.measured / HOUR, r.predicted / HOUR, yerr=[[below / HOUR], [above / HOUR]], fmt=">" if r.stopped else "o",
            ms=4.5, lw=0.7, color=colour, mfc="white" if r.stopped else colour,
        )  # fmt: skip
    shown = [t / HOUR for r, _ in found for t in (r.measured, r.predicted) if np.isfinite(t)]
    ends = np.array([0.5 * min(shown), 2.0 * max(shown)])
    axes.plot(ends, ends, "k-", lw=1.2)
    axes.fill_between(ends, ends / 2, ends * 2, color="black", alpha=0.08, lw=0, label="within a factor of 2")
    if any(r.stopped for r, _ in found):
        axes.plot([], [], ">", ms=4.5, mfc="white", color="grey", label="stopped: broke later, if at all")
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends, xlabel="measured, h", ylabel="predicted, h")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8, loc="upper left")
    axes.set_title("time to rupture, 95 % of a single test", fontsize=10)
