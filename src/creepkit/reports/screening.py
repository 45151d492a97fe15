"""A screened plate as text for a terminal and as plots after Fig. 7 of Chen et al."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.frame_noise import usable_frames
from creepkit.records import SECONDS_PER_HOUR, growing_output, output_named, specimen_of
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import empty_figure, make_folder, panels_of, place_legend_below, save_figure, set_range
from creepkit.reports.terminal import print_json, print_table, tell
from creepkit.screening.files import COMPARISON_STRESS, confirmation_text, result_columns
from creepkit.screening.results import AlloyResult, PredictedOutputs, mean_chi_square, mean_relative_squared_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.records import History
    from creepkit.screening.results import ScreeningResult


TABLE_COLUMNS = ("alloy", "class", "law", "weight", "rate at 100 MPa, 1/s", "local exponent", "chi-square", "confirmed")


def table_rows(plate: ScreeningResult) -> list[tuple[str, ...]]:
    """One row an alloy; its cells are those of TABLE_COLUMNS."""
    return [_table_row(plate, result) for result in plate.results]


def screening_text(plate: ScreeningResult) -> str:
    """The table, the share of each law in each class, and what failed."""
    return "\n".join([*aligned(TABLE_COLUMNS, table_rows(plate)), "", *summary_lines(plate)])


def summary_lines(plate: ScreeningResult) -> list[str]:
    """What the alloys say together, and what is odd, a line each."""
    decisive = sum(result.decisive for result in plate.identified)
    lines = [f"{len(plate.identified)} of {len(plate.results)} alloys identified, {decisive} of them decisively"]
    if plate.compositions is not None:
        for name, law_fractions in plate.law_fractions().items():
            fractions = ", ".join(
                f"{law} {100 * fraction:.0f} %" for law, fraction in sorted(law_fractions.items(), key=lambda p: -p[1])
            )
            lines.append(f"{name} ({len(plate.by_class()[name])}): {fractions}")
    lines += [f"failed: {_failure_text(alloy, reason)}" for alloy, reason in plate.failures.items()]
    for result in plate.identified:
        if result.confirmation is not None and not result.confirmation.confirmed:
            lines.append(f"{result.alloy}: {result.confirmation.verdict}")
    return [*lines, *(f"note: {note}" for note in plate.notes)]


def _table_row(plate: ScreeningResult, result: AlloyResult) -> tuple[str, ...]:
    first_cells = (result.alloy, plate.class_of(result.alloy))
    if not result.identified:
        return (*first_cells, "none", *[""] * (len(TABLE_COLUMNS) - 3))
    fit = result.best
    names = fit.law.name + (f" or {', '.join(result.credible_laws[1:])}" if len(result.credible_laws) > 1 else "")
    return (
        *first_cells,
        names,
        f"{result.laws[0].weight:.2f}",
        _interval_text(fit.rate(COMPARISON_STRESS, warn=False), 3),
        _interval_text(fit.local_exponent(COMPARISON_STRESS, warn=False), 3),
        f"{mean_chi_square(fit):.3g}",
        confirmation_text(result),
    )


def _interval_text(interval: Sequence[Any], digits: int) -> str:
    value, low, high = (float(v) for v in interval)
    return f"{value:.{digits}g} [{low:.{digits}g}, {high:.{digits}g}]"


def _failure_text(alloy: str, failure: str) -> str:
    """The reason, after the alloy's name where it does not say it itself."""
    return failure if f"'{alloy}'" in failure else f"alloy '{alloy}': {failure}"


def plotted_series(test: History, outputs: Mapping[str, Floats]) -> dict[str, Floats]:
    """What is drawn of a test: {title: (frames,)}, what its specimen says, else the output that shows creep.

    outputs : {name: (frames,)} in the units of the specimen.
    """
    stated = getattr(specimen_of(test), "plotted_series", None)
    if stated is not None:
        return dict(stated(outputs))
    output = output_named(growing_output(test), test.specimen)
    return {output.label: np.asarray(outputs[output], float)} if output in outputs else {}


def _quantity_label(tests: Sequence[History]) -> str:
    """The quantity that is drawn, and its unit."""
    output = output_named(growing_output(tests[0]), tests[0].specimen)
    quantity = "displacement" if output.quantity == "length" else output.long_name
    return f"{quantity}, {output.unit}" if output.unit else quantity


MISFIT_MEASURES = (
    ("loss of Eq. (4), mean over outputs", mean_relative_squared_error),
    ("chi-square, mean over outputs", mean_chi_square),
)


MIN_LOG_RATIO = 5.0
"""Ratio of the ends of an axis below which it is linear."""


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


def class_colours(plate: ScreeningResult) -> Mapping[str, str]:
    """{class: colour}."""
    return {name: f"C{k % 10}" for k, name in enumerate(plate.by_class())}


def plot_misfits(plate: ScreeningResult, results: list[AlloyResult]) -> Figure:
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
    logarithmic = limits[1] >= MIN_LOG_RATIO * limits[0]
    set_range(axes, "x", *limits, logarithmic=logarithmic, most=6)
    set_range(axes, "y", *limits, logarithmic=logarithmic, most=6)
    axes.plot(axes.get_xlim(), axes.get_xlim(), "k-", lw=0.7, alpha=0.6, scalex=False, scaley=False)
    axes.set(xlabel="law without sparsity", ylabel="reduced law")


def plot_law_fractions(plate: ScreeningResult) -> Figure:
    """Share of each law by class (Fig. 7c): full colour where decisive, hatched what is shared out between laws."""
    figure, axes = panels_of(7.2, 4.4)
    classes = plate.by_class()
    bottom, positions = np.zeros(len(classes)), range(len(classes))
    for k, law in enumerate(sorted({w.fit.law.name for a in plate.identified for w in a.laws})):
        decisive_fractions, undecided_fractions = (
            np.array([_law_fraction(m, law, d) for m in classes.values()]) for d in (True, False)
        )
        axes.bar(positions, decisive_fractions, bottom=bottom, color=f"C{k}", label=law, width=0.6)
        bars = axes.bar(positions, undecided_fractions, bottom=bottom + decisive_fractions, color=f"C{k}", width=0.6)
        for bar in bars:
            bar.set(alpha=0.45, hatch="///", edgecolor="white", linewidth=0)
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


MAX_CLASSES = 4
"""Classes that are shown."""


def plot_histories(plate: ScreeningResult, results: list[AlloyResult]) -> Figure:
    """A panel a class: the first test of its first alloy, at three radii."""
    shown_results: dict[str, AlloyResult] = {}
    for name in plate.by_class():
        members = [a for a in results if plate.class_of(a.alloy) == name]
        if members and len(shown_results) < MAX_CLASSES:
            shown_results[name] = next((a for a in members if a.decisive), members[0])
    figure, panels = panels_of(3.6 * max(len(shown_results), 2), 3.9, 1, len(shown_results), squeeze=False)
    panels = panels[0]
    for axes, (name, result) in zip(panels, shown_results.items(), strict=True):
        test = plate.histories[result.alloy][0]
        _plot_series(axes, test, result.predicted[test.name])
        axes.set_title(f"{result.alloy}, {name}: {result.best.law.name}", fontsize=9)
    panels[0].set_ylabel(_quantity_label(plate.histories[results[0].alloy]))
    place_legend_below(figure, panels[0], title="measured (dots), identified (lines)")
    return figure


def _plot_series(axes: Axes, test: History, predicted: PredictedOutputs) -> None:
    measured, hours = plotted_series(test, test.outputs), test.times / SECONDS_PER_HOUR
    for k, (title, values) in enumerate(plotted_series(test, predicted).items()):
        if title in measured:
            axes.plot(hours[test.used], measured[title][test.used], ".", ms=2, color=f"C{k}", alpha=0.4)
            axes.plot(hours, values, "-", lw=1.2, color=f"C{k}", label=title)
    drawn = np.concatenate([np.zeros(1), *(line.get_ydata() for line in axes.lines)])
    set_range(axes, "y", 0.0, float(np.nanmax(drawn, initial=1e-9)))
    set_range(axes, "x", 0.0, float(test.times[-1]) / SECONDS_PER_HOUR, most=6)
    axes.set(xlabel="time, h")


def plot_screening(plate: ScreeningResult, folder: Path) -> list[Path]:
    """Write histories.png and parity.png, misfit.png (with a dense law) and laws.png; their paths."""
    if not plate.identified:
        raise FitError("no alloy of this plate has a law, so there is nothing to draw; see Plate.failed")
    first = plate.histories[plate.identified[0].alloy][0].specimen  # one quantity on the axes: tests of one specimen
    shown = [a for a in plate.identified if plate.histories[a.alloy][0].specimen == first]
    dense_results = [a for a in plate.identified if a.dense_fit is not None]
    figures = {"laws.png": plot_law_fractions(plate)}
    if any(_pairs(plate, result) for result in shown):
        figures["parity.png"] = _plot_parity(plate, shown)
        figures["histories.png"] = plot_histories(plate, shown)
    if dense_results:
        figures["misfit.png"] = plot_misfits(plate, dense_results)
    make_folder(folder, FitError)
    for name, figure in sorted(figures.items()):
        save_figure(figure, folder / name, FitError)
    return [folder / name for name in sorted(figures)]


def _plot_parity(plate: ScreeningResult, results: list[AlloyResult]) -> Figure:
    """Identified against measured, of each series that is drawn, and their difference (Fig. 7a, of all alloys)."""
    pairs = {result.alloy: _pairs(plate, result) for result in results}
    titles = list(dict.fromkeys(title for series in pairs.values() for title in series))
    figure, panels = panels_of(
        3.7 * max(len(titles), 2), 5.6, 2, len(titles), height_ratios=(2.2, 1.0), sharex="col", squeeze=False
    )
    colours, labels = class_colours(plate), LegendLabels()
    quantity = _quantity_label(plate.histories[results[0].alloy])
    for k, ((upper, lower), title) in enumerate(zip(panels.T, titles, strict=True)):
        errors, axis_limit = [np.zeros(0)], 0.0
        for result in results:
            name = plate.class_of(result.alloy)
            for measured, predicted in pairs[result.alloy].get(title, ()):
                upper.plot(measured, predicted, ".", ms=2, color=colours[name], alpha=0.6, label=labels.first_use(name))
                lower.plot(measured, predicted - measured, ".", ms=1.5, color=colours[name], alpha=0.5)
                errors.append(predicted - measured)
                axis_limit = max(axis_limit, float(measured.max()), float(predicted.max()))
        _finish_parity(upper, lower, title, np.concatenate(errors), 1.05 * axis_limit or 1.0)
        lower.set(xlabel=f"measured {quantity}")
        if k == 0:
            upper.set_ylabel(f"identified {quantity}")
            lower.set_ylabel("difference")
    figure.legend(loc="outside lower center", ncols=6, fontsize=8, markerscale=4)
    return figure


def _pairs(plate: ScreeningResult, result: AlloyResult) -> dict[str, list[tuple[Any, Any]]]:
    """{title: measured and identified values (frames,) of each test that has them}, where both are numbers."""
    pairs: dict[str, list[tuple[Any, Any]]] = {}
    for test in plate.histories[result.alloy]:
        predicted, measured = (plotted_series(test, o) for o in (result.predicted.get(test.name, {}), test.outputs))
        used = usable_frames(test, growing_output(test))
        for title in predicted.keys() & measured.keys():
            finite = used & np.isfinite(measured[title]) & np.isfinite(predicted[title])
            if finite.any():
                pairs.setdefault(title, []).append((measured[title][finite], predicted[title][finite]))
    return dict(sorted(pairs.items()))


def _finish_parity(upper: Axes, lower: Axes, title: str, errors: Any, axis_limit: float) -> None:
    set_range(upper, "y", 0.0, axis_limit, most=6)
    set_range(upper, "x", 0.0, axis_limit, most=6)
    upper.plot([0, axis_limit], [0, axis_limit], "k-", lw=0.7, alpha=0.6)
    lower.axhline(0, color="black", lw=0.7, alpha=0.6)
    rms = f", rms {float(np.sqrt(np.mean(errors**2))):.2g}" if errors.size else ": not observed"
    upper.set_title(f"{title}{rms}", fontsize=10)
    lower.grid(alpha=0.25)


def print_screening(plate: ScreeningResult, written: list[Path], as_json: bool) -> None:
    """Print the table, what it sums up to, and what was written."""
    if as_json:
        print_json(_plate_to_json(plate, written))
        return
    print_table(f"{len(plate.results)} alloys", TABLE_COLUMNS, table_rows(plate))
    for line in (*summary_lines(plate), *(f"wrote {path}" for path in written)):
        tell(line)


def _plate_to_json(plate: ScreeningResult, written: list[Path]) -> dict[str, Any]:
    return {
        "alloys": [result_columns(plate, result) for result in plate.results],
        "shares": plate.law_fractions(),
        "failed": plate.failures,
        "notes": list(plate.notes),
        "files": [str(path) for path in written],
    }
