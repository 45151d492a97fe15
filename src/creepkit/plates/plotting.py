"""Pictures of a plate, after Fig. 7 of Chen et al."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import FitError
from creepkit.figures import blank
from creepkit.inverse.scales import usable
from creepkit.plates.answer import AlloyAnswer
from creepkit.plates.plotting_laws import Labels, colours_of, misfit_figure, shares_figure
from creepkit.plates.plotting_tests import histories_figure
from creepkit.plates.profiles import NEEDED, RADII, displacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.plates.plate import Plate


def draw(plate: Plate, folder: Path) -> list[Path]:
    """Write histories.png and parity.png (bulge tests), misfit.png (with a dense law) and laws.png; their paths."""
    if not plate.identified:
        raise FitError("no alloy of this plate has a law, so there is nothing to draw; see Plate.failed")
    bulged = [a for a in plate.identified if any("amplitude" in rows for rows in a.predicted.values())]
    compared = [a for a in plate.identified if a.dense is not None]
    figures = {"laws.png": shares_figure(plate)}
    if bulged:
        figures["parity.png"] = _parity(plate, bulged)
        figures["histories.png"] = histories_figure(plate, bulged)
    if compared:
        figures["misfit.png"] = misfit_figure(plate, compared)
    return [_saved(figure, folder / name) for name, figure in sorted(figures.items())]


def _parity(plate: Plate, answers: list[AlloyAnswer]) -> Figure:
    """Identified against measured displacement at three radii, and their difference (Fig. 7a, of all alloys)."""
    figure = blank(3.7 * len(RADII), 5.6)
    panels = figure.subplots(2, len(RADII), height_ratios=(2.2, 1.0), sharex="col")
    colours, labels = colours_of(plate), Labels()
    for (upper, lower), radius in zip(panels.T, RADII, strict=True):
        errors, top = [np.zeros(0)], 0.0
        for answer in answers:
            name = plate.class_of(answer.alloy)
            for measured, predicted in _pairs(plate, answer, radius):
                upper.plot(measured, predicted, ".", ms=2, color=colours[name], alpha=0.6, label=labels.once(name))
                lower.plot(measured, 1e3 * (predicted - measured), ".", ms=1.5, color=colours[name], alpha=0.5)
                errors.append(predicted - measured)
                top = max(top, float(measured.max()), float(predicted.max()))
        _finish_parity(upper, lower, radius, np.concatenate(errors), 1.05 * top or 1.0)
    figure.legend(loc="outside lower center", ncols=6, fontsize=8, markerscale=4)
    return figure


def _pairs(plate: Plate, answer: AlloyAnswer, radius: float) -> list[tuple[Any, Any]]:
    """Measured and identified displacement of each test that has what the radius needs, (frames,) mm."""
    found = []
    for test in plate.histories[answer.alloy]:
        rows = answer.predicted.get(test.name, {})
        if "amplitude" not in rows or (radius > 0 and not set(NEEDED) <= set(rows)):
            continue
        used = usable(test, "amplitude")
        measured, predicted = displacement(test.outputs, radius)[used], displacement(rows, radius)[used]
        sound = np.isfinite(measured) & np.isfinite(predicted)
        found.append((measured[sound], predicted[sound]))
    return [pair for pair in found if pair[0].size]


def _finish_parity(upper: Axes, lower: Axes, radius: float, errors: Any, top: float) -> None:
    upper.plot([0, top], [0, top], "k-", lw=0.7, alpha=0.6)
    lower.axhline(0, color="black", lw=0.7, alpha=0.6)
    rms = f", rms {1e3 * float(np.sqrt(np.mean(errors**2))):.2g} um" if errors.size else ": not observed"
    upper.set(xlim=(0, top), ylim=(0, top))
    upper.set_title(f"r = {radius:g} mm{rms}", fontsize=10)
    lower.set(xlabel="measured displacement, mm")
    for axes in (upper, lower):
        axes.grid(alpha=0.25)
    if radius == RADII[0]:
        upper.set_ylabel("identified displacement, mm")
        lower.set_ylabel("difference, um")


def _saved(figure: Figure, path: Path) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as error:
        raise FitError(f"{path}: cannot be written ({error.strerror}); name a folder that can be") from None
    return path
