"""Displacement histories of one alloy of each class, measured and identified (Fig. 7a of Chen et al.)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from creepkit.figures import empty_figure
from creepkit.plates.answer import AlloyResult, PredictedOutputs
from creepkit.plates.profiles import PROFILE_OUTPUTS, PLOT_RADII, profile_displacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.plates.plate import Plate
    from creepkit.records import History

MAX_CLASSES = 4
"""Classes that are shown."""
SECONDS_PER_HOUR = 3600.0


def plot_histories(plate: Plate, results: list[AlloyResult]) -> Figure:
    """A panel a class: the first test of its first alloy, at three radii."""
    shown_results: dict[str, AlloyResult] = {}
    for name in plate.by_class():
        members = [a for a in results if plate.class_of(a.alloy) == name]
        if members and len(shown_results) < MAX_CLASSES:
            shown_results[name] = next((a for a in members if a.decisive), members[0])
    figure = empty_figure(3.6 * max(len(shown_results), 2), 3.9)
    panels = figure.subplots(1, len(shown_results), squeeze=False)[0]
    for axes, (name, result) in zip(panels, shown_results.items(), strict=True):
        test = plate.histories[result.alloy][0]
        _plot_displacements(axes, test, result.predicted[test.name])
        axes.set_title(f"{result.alloy}, {name}: {result.best.law.name}", fontsize=9)
    panels[0].set_ylabel("displacement, mm")
    panels[0].legend(fontsize=8, title="measured (dots), identified", title_fontsize=8)
    return figure


def _plot_displacements(axes: Axes, test: History, predicted: PredictedOutputs) -> None:
    profile_outputs = {name: row for name, row in predicted.items() if name in PROFILE_OUTPUTS}
    for k, radius in enumerate(PLOT_RADII):
        if radius > 0 and len(profile_outputs) < len(PROFILE_OUTPUTS):
            continue
        hours = test.times / SECONDS_PER_HOUR
        axes.plot(hours[test.used], profile_displacement(test.outputs, radius)[test.used], ".", ms=2, color=f"C{k}", alpha=0.4)
        axes.plot(hours, profile_displacement(profile_outputs, radius), "-", lw=1.2, color=f"C{k}", label=f"r = {radius:g} mm")
    axes.set(xlabel="time, h", ylim=(0, None))
    axes.grid(alpha=0.25)
