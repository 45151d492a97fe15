"""Pictures of a plate's laws after Chen et al.: what sparsity costs (Fig. 7b), which law each class obeys (7c)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from creepkit.figures import empty_figure
from creepkit.plates.answer import AlloyResult, mean_chi_square, mean_relative_squared_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.plates.plate import Plate

MISFIT_MEASURES = (("loss of Eq. (4), mean over outputs", mean_relative_squared_error), ("chi-square, mean over outputs", mean_chi_square))
LOG_TICKS, MIN_LOG_RATIO = (1.0, 2.0, 5.0), 5.0
"""Of logarithmic axes: where ticks are, and the ratio of their ends below which they are linear instead."""


class LegendLabels:
    """Labels for a legend, each given out once."""

    def __init__(self) -> None:
        self._used: set[str] = set()

    def first_use(self, name: str) -> str | None:
        """The name the first time, None from then on."""
        if name in self._used:
            return None
        self._used.add(name)
        return name


def class_colours(plate: Plate) -> Mapping[str, str]:
    """{class: colour}."""
    return {name: f"C{k % 10}" for k, name in enumerate(plate.by_class())}


def plot_misfits(plate: Plate, results: list[AlloyResult]) -> Figure:
    """Misfit of the reduced law against that of the dense one (Fig. 7b): Eq. (4), and in units of noise."""
    figure = empty_figure(8.6, 4.6)
    colours, labels = class_colours(plate), LegendLabels()
    for axes, (title, measure) in zip(figure.subplots(1, 2), MISFIT_MEASURES, strict=True):
        points = [(measure(a.dense_fit), measure(a.reduced_fit)) for a in results if a.dense_fit is not None]
        for (x, y), result in zip(points, results, strict=True):
            name = plate.class_of(result.alloy)
            axes.plot(x, y, "o", ms=5, color=colours[name], alpha=0.75, label=labels.first_use(name))
        values = np.array(points)[np.isfinite(points).all(axis=1)]
        _finish_misfit(axes, (values.min() / 1.2, values.max() * 1.2) if values.size else (0.1, 10.0))
        axes.set_title(title, fontsize=10)
    figure.legend(loc="outside lower center", ncols=6, fontsize=8)
    return figure


def _finish_misfit(axes: Axes, limits: tuple[float, float]) -> None:
    """Equal axes, logarithmic where they span much."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.plot(limits, limits, "k-", lw=0.7, alpha=0.6)
    axes.set(xlim=limits, ylim=limits, xlabel="law without sparsity", ylabel="reduced law")
    axes.grid(alpha=0.25)
    if limits[1] < MIN_LOG_RATIO * limits[0]:
        return
    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=LOG_TICKS))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())


def plot_law_fractions(plate: Plate) -> Figure:
    """Share of each law by class (Fig. 7c): full colour where decisive, hatched what is shared out between laws."""
    figure = empty_figure(7.2, 4.4)
    axes: Axes = figure.subplots()
    classes = plate.by_class()
    bottom, positions = np.zeros(len(classes)), range(len(classes))
    for k, law in enumerate(sorted({w.fit.law.name for a in plate.identified for w in a.laws})):
        decisive_fractions, undecided_fractions = (np.array([_law_fraction(m, law, d) for m in classes.values()]) for d in (True, False))
        axes.bar(positions, decisive_fractions, bottom=bottom, color=f"C{k}", label=law, width=0.6)
        axes.bar(positions, undecided_fractions, bottom=bottom + decisive_fractions, color=f"C{k}", alpha=0.45, hatch="///", width=0.6,
                 edgecolor="white", linewidth=0)  # fmt: skip
        bottom += decisive_fractions + undecided_fractions
    axes.set_xticks(positions, [f"{name}\n{len(m)} alloy{'s' if len(m) > 1 else ''}" for name, m in classes.items()])
    axes.set(ylim=(0, 1), xlim=(-0.6, max(len(classes), 3) - 0.4), ylabel="share of alloys")
    axes.set_title("identified laws by class; hatched: shared out by weight where not decisive", fontsize=10)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _law_fraction(members: tuple[AlloyResult, ...], law: str, decisive: bool) -> float:
    """Mean weight of a law over the members that are decisive, or over those that are not, as a share of all."""
    weights = [w.weight for m in members if m.decisive is decisive for w in m.laws if w.fit.law.name == law]
    return sum(weights) / len(members)
