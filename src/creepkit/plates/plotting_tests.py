"""Displacement histories of one alloy of each class, measured and identified (Fig. 7a of Chen et al.)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from creepkit.figures import blank
from creepkit.plates.answer import AlloyAnswer, Outputs
from creepkit.plates.profiles import NEEDED, RADII, displacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.plates.plate import Plate
    from creepkit.records import History

MOST = 4
"""Classes that are shown."""
HOUR = 3600.0


def histories_figure(plate: Plate, answers: list[AlloyAnswer]) -> Figure:
    """A panel a class: the first test of its first alloy, at three radii."""
    chosen: dict[str, AlloyAnswer] = {}
    for name in plate.classes():
        members = [a for a in answers if plate.class_of(a.alloy) == name]
        if members and len(chosen) < MOST:
            chosen[name] = next((a for a in members if a.decisive), members[0])
    figure = blank(3.6 * max(len(chosen), 2), 3.9)
    panels = figure.subplots(1, len(chosen), squeeze=False)[0]
    for axes, (name, answer) in zip(panels, chosen.items(), strict=True):
        test = plate.histories[answer.alloy][0]
        _draw(axes, test, answer.predicted[test.name])
        axes.set_title(f"{answer.alloy}, {name}: {answer.best.law.name}", fontsize=9)
    panels[0].set_ylabel("displacement, mm")
    panels[0].legend(fontsize=8, title="measured (dots), identified", title_fontsize=8)
    return figure


def _draw(axes: Axes, test: History, predicted: Outputs) -> None:
    rows = {name: row for name, row in predicted.items() if name in NEEDED}
    for k, radius in enumerate(RADII):
        if radius > 0 and len(rows) < len(NEEDED):
            continue
        hours = test.times / HOUR
        axes.plot(hours[test.used], displacement(test.outputs, radius)[test.used], ".", ms=2, color=f"C{k}", alpha=0.4)
        axes.plot(hours, displacement(rows, radius), "-", lw=1.2, color=f"C{k}", label=f"r = {radius:g} mm")
    axes.set(xlabel="time, h", ylim=(0, None))
    axes.grid(alpha=0.25)
