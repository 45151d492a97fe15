"""Pictures of a plate, after Fig. 7 of Chen et al."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import FitError
from creepkit.figures import empty_figure
from creepkit.inverse.scales import usable_frames
from creepkit.plates.answer import AlloyResult
from creepkit.plates.plotting_laws import LegendLabels, class_colours, plot_misfits, plot_law_fractions
from creepkit.plates.plotting_tests import plot_histories
from creepkit.plates.profiles import PROFILE_OUTPUTS, PLOT_RADII, profile_displacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.plates.plate import Plate


def plot_screening(plate: Plate, folder: Path) -> list[Path]:
    """Write histories.png and parity.png (bulge tests), misfit.png (with a dense law) and laws.png; their paths."""
    if not plate.identified:
        raise FitError("no alloy of this plate has a law, so there is nothing to draw; see Plate.failed")
    bulge_results = [a for a in plate.identified if any("amplitude" in rows for rows in a.predicted.values())]
    dense_results = [a for a in plate.identified if a.dense_fit is not None]
    figures = {"laws.png": plot_law_fractions(plate)}
    if bulge_results:
        figures["parity.png"] = _plot_parity(plate, bulge_results)
        figures["histories.png"] = plot_histories(plate, bulge_results)
    if dense_results:
        figures["misfit.png"] = plot_misfits(plate, dense_results)
    return [_save_figure(figure, folder / name) for name, figure in sorted(figures.items())]


def _plot_parity(plate: Plate, results: list[AlloyResult]) -> Figure:
    """Identified against measured displacement at three radii, and their difference (Fig. 7a, of all alloys)."""
    figure = empty_figure(3.7 * len(PLOT_RADII), 5.6)
    panels = figure.subplots(2, len(PLOT_RADII), height_ratios=(2.2, 1.0), sharex="col")
    colours, labels = class_colours(plate), LegendLabels()
    for (upper, lower), radius in zip(panels.T, PLOT_RADII, strict=True):
        errors, axis_limit = [np.zeros(0)], 0.0
        for result in results:
            name = plate.class_of(result.alloy)
            for measured, predicted in _displacement_pairs(plate, result, radius):
                upper.plot(measured, predicted, ".", ms=2, color=colours[name], alpha=0.6, label=labels.first_use(name))
                lower.plot(measured, 1e3 * (predicted - measured), ".", ms=1.5, color=colours[name], alpha=0.5)
                errors.append(predicted - measured)
                axis_limit = max(axis_limit, float(measured.max()), float(predicted.max()))
        _finish_parity(upper, lower, radius, np.concatenate(errors), 1.05 * axis_limit or 1.0)
    figure.legend(loc="outside lower center", ncols=6, fontsize=8, markerscale=4)
    return figure


def _displacement_pairs(plate: Plate, result: AlloyResult, radius: float) -> list[tuple[Any, Any]]:
    """Measured and identified displacement of each test that has what the radius needs, (frames,) mm."""
    pairs = []
    for test in plate.histories[result.alloy]:
        predicted_outputs = result.predicted.get(test.name, {})
        if "amplitude" not in predicted_outputs or (radius > 0 and not set(PROFILE_OUTPUTS) <= set(predicted_outputs)):
            continue
        used = usable_frames(test, "amplitude")
        measured, predicted = profile_displacement(test.outputs, radius)[used], profile_displacement(predicted_outputs, radius)[used]
        finite = np.isfinite(measured) & np.isfinite(predicted)
        pairs.append((measured[finite], predicted[finite]))
    return [pair for pair in pairs if pair[0].size]


def _finish_parity(upper: Axes, lower: Axes, radius: float, errors: Any, axis_limit: float) -> None:
    upper.plot([0, axis_limit], [0, axis_limit], "k-", lw=0.7, alpha=0.6)
    lower.axhline(0, color="black", lw=0.7, alpha=0.6)
    rms = f", rms {1e3 * float(np.sqrt(np.mean(errors**2))):.2g} um" if errors.size else ": not observed"
    upper.set(xlim=(0, axis_limit), ylim=(0, axis_limit))
    upper.set_title(f"r = {radius:g} mm{rms}", fontsize=10)
    lower.set(xlabel="measured displacement, mm")
    for axes in (upper, lower):
        axes.grid(alpha=0.25)
    if radius == PLOT_RADII[0]:
        upper.set_ylabel("identified displacement, mm")
        lower.set_ylabel("difference, um")


def _save_figure(figure: Figure, path: Path) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as error:
        raise FitError(f"{path}: cannot be written ({error.strerror}); name a folder that can be") from None
    return path
