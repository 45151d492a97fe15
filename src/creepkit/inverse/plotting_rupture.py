"""The panel of rupture times: predicted against measured, with a band of a factor of two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

SECONDS_PER_HOUR = 3600.0


def draw_ruptures(axes: Axes, fit: Identification, colours: Sequence[Any]) -> None:
    """One point a test with its 95 % interval; tests that were stopped are open, and lie where they were stopped."""
    ruptures = [(m.rupture, colour) for m, colour in zip(fit.tests, colours, strict=True) if m.rupture is not None]
    for r, colour in ruptures:
        if not np.isfinite(r.predicted):
            continue
        below, above = r.predicted - r.low, r.high - r.predicted
        axes.errorbar(
            r.measured / SECONDS_PER_HOUR, r.predicted / SECONDS_PER_HOUR, yerr=[[below / SECONDS_PER_HOUR], [above / SECONDS_PER_HOUR]], fmt=">" if r.censored else "o",
            ms=4.5, lw=0.7, color=colour, mfc="white" if r.censored else colour,
        )  # fmt: skip
    plotted_hours = [t / SECONDS_PER_HOUR for r, _ in ruptures for t in (r.measured, r.predicted) if np.isfinite(t)]
    axis_limits = np.array([0.5 * min(plotted_hours), 2.0 * max(plotted_hours)])
    axes.plot(axis_limits, axis_limits, "k-", lw=1.2)
    axes.fill_between(axis_limits, axis_limits / 2, axis_limits * 2, color="black", alpha=0.08, lw=0, label="within a factor of 2")
    if any(r.censored for r, _ in ruptures):
        axes.plot([], [], ">", ms=4.5, mfc="white", color="grey", label="stopped: broke later, if at all")
    axes.set(xscale="log", yscale="log", xlim=axis_limits, ylim=axis_limits, xlabel="measured, h", ylabel="predicted, h")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8, loc="upper left")
    axes.set_title("time to rupture, 95 % of a single test", fontsize=10)
