"""What a forecast says: what was asked for and how far to trust it, and of each test everything that is predicted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.forecasts.banded_output import CHOICE_OF_LAW, LAW
from creepkit.forecasts.draws import MISFIT_THERE
from creepkit.inverse.reference_conditions import usable_frames
from creepkit.records import SECONDS_PER_HOUR, is_logarithmic
from creepkit.records.units import celsius_text, hours_number
from creepkit.reports.answer import MOST_CAUTIONS, KeyFigure, asked_figures, end_figures, time_figure
from creepkit.reports.blocks import Answer, Block, Items, Table, listed, named, plural
from creepkit.reports.figures import panel_grid, span, wrapped
from creepkit.reports.histories import kind_of_test
from creepkit.reports.identification_plot import axis_label, side_of
from creepkit.reports.wording import say, shown_unit
from creepkit.reports.words import FORECAST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.forecasts.banded_output import OutputForecast
    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.forecast_of_test import TestForecast
    from creepkit.inverse.uncertainty.law_misfit import LawMisfit
    from creepkit.reports.svg import PageFigures


SHOWN_SHARE = 0.02
"""Of the variance: smaller parts of a band are not named."""


def forecast_answer(forecast: Forecast, picture: Block | None = None) -> Answer:
    """What was asked for of a test, or how many measured ones lie within their bands; then the others."""
    shown, tests, level = asked_figures(forecast), forecast.tests, f"{100 * forecast.level:g} %"
    described = f"{kind_of_test(tests[0].history)}, {tests[0].history.condition}"
    if len(tests) == 1:  # what was asked for, what else it reaches, and what it shows at its end
        said_first = {one.name for one in shown}
        shown += [one for one in _figures(tests[0]) if math.isfinite(one.value) and one.name not in said_first]
        shown = [replace(one, where="") for one in shown]
    inside = [_lies_inside(one) for one in tests]
    outside, judged = inside.count(False), len(tests) - inside.count(None)
    beyond = [names for one in tests if (names := _asked_beyond(one, times=forecast.asked))]
    kind = "none" if not shown else "measured" if judged > 1 else "single"
    trust = FORECAST[("some beyond" if len(tests) > 1 else "beyond") if beyond else "within"]
    values = {
        "what": shown[0].name if shown else "",
        "value": shown[0].text if shown else "",
        "trust": trust.format(quantities=listed([*chain(*beyond)]), count=len(beyond))
        + FORECAST["contradicted"] * forecast.rejected,
        **{"inside": judged - outside, "judged": judged, "level": level},
    }
    parts = [part for one in tests for part in end_shares(next(iter(one.outputs.values()), None))][:1]
    following = "outside" if outside else "beyond" if beyond else "contradicted" if forecast.rejected else "use"
    following = "fixed" if following in ("beyond", "use") and parts and parts[0] not in NARROWED else following
    said = _laws_and_level(forecast, level)
    return Answer(
        FORECAST[kind].format(**values),
        described if len(tests) == 1 else plural(len(tests), "test"),
        figures=[(one.name, one.where, one.text, one.remark) for one in shown[kind == "single" :]],
        cautions=_cautions(forecast, [one.name for one, holds in zip(tests, inside, strict=True) if holds is False]),
        next_step=FORECAST[f"next {following}"].format(part=[*parts, ""][0]),
        remarks=[said],
        brackets=said,
        picture=picture,
        more=".details(), or creepkit predict --json",
    )


def _laws_and_level(forecast: Forecast, level: str) -> str:
    """By which laws, with their weights, and what the intervals are."""
    alone = len(forecast.laws) == 1
    names = ", ".join(name if alone else f"{name} ({weight:.2g})" for name, weight in forecast.laws.items())
    names += f" ({forecast.left_out} more of too little weight)" if forecast.left_out else ""
    right = FORECAST["wider" if forecast.rejected else "right" if alone else "one right"]
    return FORECAST["by"].format(laws=names, level=level, right=right)


NARROWED = (LAW, CHOICE_OF_LAW, MISFIT_THERE)
"""Parts of a band that further tests make smaller."""


def _lies_inside(test: TestForecast) -> bool | None:
    """Whether all that was measured of a test lies in its bands and intervals; None where nothing was."""
    found = [one.inside for one in test.times if one.inside is not None]
    found += [*test.inside.whole.values()] if test.inside is not None else []
    return all(found) if found else None


def _asked_beyond(test: TestForecast, *, times: bool) -> list[str]:
    """In which quantities what is shown first of a test is extrapolated; times : to values were asked for."""
    reached = [one for one in test.times if math.isfinite(one.median) and bool(one.output) == times]
    return test.extrapolated_in(reached[0] if reached and times else None)


def _cautions(forecast: Forecast, outside: Sequence[str]) -> list[str]:
    """What to mind, the most serious first; what is said of several tests stands once."""
    found = [FORECAST["outside"].format(tests=named(outside, "test"))] * bool(outside)
    misfits = [one.misfit for one in forecast.tests if one.misfit is not None]
    worst = max(misfits, key=lambda one: abs(one.log_factor), default=None)
    found += [_misfit_text(worst)] if worst is not None else []
    found += [one.caution.partition(". ")[0] for one in forecast.tests if one.caution]
    return list(dict.fromkeys([*found, *(note for one in forecast.tests for note in one.notes)]))[:MOST_CAUTIONS]


def _misfit_text(misfit: LawMisfit) -> str:
    at = f"{misfit.stress:.4g} MPa, {celsius_text(misfit.temperature, digits=0)}"
    factor, here = f"{math.exp(abs(misfit.log_factor)):.3g}", f"{misfit.factor:.3g}"
    return say(FORECAST["misses"], at=at, factor=factor, here=here * (here != "1"))


def forecast_blocks(forecast: Forecast, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The answer, with `figures` the curves, a table of all that is predicted, and remarks. of : " of " its name."""
    drawn = None
    if figures is not None and any(test.outputs for test in forecast.tests):
        caption = f"Bands of {100 * forecast.level:g} %: of measured values, and of whole curves (paler)."
        description = "Forecast curves over time with pointwise and simultaneous bands; the numbers stand beside them."
        drawn = figures.picture(lambda: forecast_figure(forecast), f"Forecasts{of}", description, caption)
    rows = [(test.name, one.name, one.text, one.remark) for test in forecast.tests for one in _figures(test)]
    caption = f"everything that is predicted, with {100 * forecast.level:g} % intervals of a single test"
    table = Table(caption, ("test", "what", "value", "remarks"), rows)
    said: dict[str, list[str]] = {}
    for test in forecast.tests:
        for line in _remarks(test):
            said.setdefault(line, []).append(test.name)
    answer, several = forecast_answer(forecast, drawn), len(forecast.tests) > 1
    for caution in answer.cautions:  # what they do not say of it
        said = {line.removeprefix(caution).removeprefix(". "): names for line, names in said.items()}
    lines = [f"{named(names, 'test')}: {line}" if several else line for line, names in said.items() if line]
    listed_there = len(answer.figures) + 1 >= len(rows) and not several
    return [answer, *([] if listed_there else [table]), Items(lines)]


def _remarks(test: TestForecast) -> Iterator[str]:
    """What the law misses, a measurement, what the band is made of, what is extrapolated, cautions."""
    if test.misfit is not None:
        yield _misfit_text(test.misfit)
    if test.inside is not None:
        shares, whole = test.inside.share, test.inside.whole
        yield from (f"{100 * share:.0f} % of the readings of {one} lie in the band" for one, share in shares.items())
        yield from (f"the whole curve of {one} lies in the wider band" for one in shares if whole[one])
    if shares := end_shares(next(iter(test.outputs.values()), None)):
        parts = ", ".join(f"{part} {100 * share:.0f} %" for part, share in shares.items())
        yield f"shares of the variance at its end, to first order: {parts}"
    yield from filter(None, (test.extrapolation.replace("), ", "); "), test.caution, *test.notes))


def _figures(test: TestForecast) -> Iterator[KeyFigure]:
    """Times, with how probably each comes before the end of the test, and what it shows there."""
    end = hours_number(float(test.history.times[-1]))
    for one in test.times:
        figure, chance = time_figure(one), f"before {end} h with probability {one.chance:.2g}"
        yield replace(figure, remark="; ".join(filter(None, (figure.remark, chance))))
    yield from end_figures(test)


def end_shares(one: OutputForecast | None) -> dict[str, float]:
    """{part: share of the variance} at the last time that is predicted, the largest first."""
    alive = np.flatnonzero(np.isfinite(one.value)) if one is not None else np.zeros(0, int)
    if one is None or not alive.size:
        return {}
    shares = {part: float(values[alive[-1]]) for part, values in one.shares.items()}
    return {part: share for part, share in sorted(shares.items(), key=lambda pair: -pair[1]) if share >= SHOWN_SHARE}


# ---- figure ----------------------------------------------------------------------------------------------------------


MOST_DRAWN = 12
"""Tests in one figure."""


COLUMNS = 4
"""Tests side by side."""


TIME_COLOUR, RUPTURE_COLOUR = "#c51b7d", "#b2182b"


BELOW_EDGE = 0.04
"""Of the height of a panel: how far below its upper edge the interval of the rupture time is drawn."""


SHOWN_RATIO = 1e-3
"""Of the largest strain: the lower end of a logarithmic axis."""


def forecast_figure(forecast: Forecast) -> Figure:
    """The leading output of each test with both bands, times to values and rupture, and what was measured.

    A single test shows all of its outputs. Tests beyond the first dozen are not drawn.
    """
    tests = _drawable(forecast)
    drawn = [
        (test, one) for test in tests[:MOST_DRAWN] for one in [*test.outputs.values()][: None if len(tests) == 1 else 1]
    ]
    figure, panels = panel_grid(len(drawn), COLUMNS, max(4.4, 6.6 / len(drawn)), 3.6)  # as wide as the legend at least
    for axes, (test, one) in zip(panels, drawn, strict=True):
        _draw_curve(axes, test, one, f"{100 * forecast.level:g} %")
    _legend(figure, panels, loc="outside lower center", ncols=3)
    left_out = len(forecast.tests) - len({test.name for test, _ in drawn})
    more = f" ({left_out} more tests are not drawn)" if left_out > 0 else ""
    title = f"forecast by {' or '.join(forecast.laws)}{more}"
    figure.suptitle(wrapped(title, float(figure.get_size_inches()[0])), fontsize=10)
    return figure


def draw_forecast(axes: Axes, forecast: Forecast) -> None:
    """The leading output of the first test with both bands."""
    test = _drawable(forecast)[0]
    _draw_curve(axes, test, next(iter(test.outputs.values())), f"{100 * forecast.level:g} %")
    _legend(axes, [axes])


def _drawable(forecast: Forecast) -> list[TestForecast]:
    tests = [t for t in forecast.tests if t.outputs]
    if not tests:
        raise FitError("nothing is predicted of these tests, so there is nothing to draw")
    return tests


def _draw_curve(axes: Axes, test: TestForecast, one: OutputForecast, level: str) -> None:
    """The curve, pointwise and simultaneous bands, the measured points, and intervals of times."""
    side = side_of(test.history) if is_logarithmic(one.output) else 0
    factor, logarithmic = shown_unit(one.output)[0] * (side or 1), side != 0
    positive = one.times > 0
    hours, band = one.times[positive] / SECONDS_PER_HOUR, one.band
    curve, low, high, lowest, highest = (
        factor * v[positive] for v in (one.value, band.low, band.high, band.lowest, band.highest)
    )
    measured_hours, measured = _measured(test, one.output, factor)
    known = np.concatenate([v[np.isfinite(v)] for v in (curve, low, high, measured)])
    top = float(known.max(initial=1e-12))
    span(axes, "y", known[known >= SHOWN_RATIO * top] if logarithmic else known, 1.1 * top, logarithmic=logarithmic)
    ends = axes.get_ylim()
    for lower, upper, alpha, what in ((lowest, highest, 0.15, "whole curves"), (low, high, 0.3, "measured values")):
        style: Any = {"color": "#3b6fb6", "alpha": alpha, "lw": 0, "label": f"{level} of {what}"}
        axes.fill_between(hours, np.clip(lower, *ends), np.clip(upper, *ends), **style)
    axes.plot(hours, curve, color="#1f3f73", lw=1.3, label="identified law")
    label = "measured" if measured.size else None
    axes.plot(measured_hours, measured, ".", ms=3, color="black", alpha=0.6, label=label)
    start, end = float(hours[0]) if logarithmic else 0.0, float(hours[-1])
    span(axes, "x", start, end, logarithmic=logarithmic)
    axes.set_xlim(start, end)  # where the bands end, not beyond
    _draw_times(axes, test, one, level)
    axes.set_title(wrapped(f"{test.name}: {test.history.condition}", 4.4, 11.0), fontsize=8)
    axes.set_ylabel(axis_label(one.output, test.history), fontsize=8)
    axes.set_xlabel("time, h", fontsize=8)
    axes.tick_params(labelsize=7)


def _measured(test: TestForecast, output: str, factor: float) -> tuple[Floats, Floats]:
    history = test.history
    if output not in history.outputs:
        return np.zeros(0), np.zeros(0)
    used = usable_frames(history, output)
    return history.times[used] / SECONDS_PER_HOUR, factor * history.outputs[output][used]


def _draw_times(axes: Axes, test: TestForecast, one: OutputForecast, interval: str) -> None:
    """Intervals of times, the median marked: at the value that is reached, and of rupture at the upper edge."""
    right, (bottom, top) = axes.get_xlim()[1], axes.get_ylim()
    is_linear = axes.get_yscale() == "linear"
    edge = top - BELOW_EDGE * (top - bottom) if is_linear else top * (bottom / top) ** BELOW_EDGE
    for time in test.times:
        is_rupture = not time.output
        level = edge if is_rupture else shown_unit(one.output)[0] * time.target
        low, median, high, measured = (v / SECONDS_PER_HOUR for v in (time.low, time.median, time.high, time.measured))
        if time.output not in ("", one.output) or not bottom <= level <= top or not low <= right:
            continue
        colour = RUPTURE_COLOUR if is_rupture else TIME_COLOUR
        label = f"time to {'rupture' if is_rupture else 'a value'}: median, {interval}"
        style: Any = {"color": colour, "lw": 2.2, "solid_capstyle": "butt", "zorder": 4, "label": label}
        axes.plot([low, min(high, right)], [level, level], **style)
        if high > right:
            axes.plot([right], [level], ">", color=colour, ms=5, clip_on=False, zorder=5)
        if median <= right:
            axes.plot([median], [level], "|", color=colour, ms=9, mew=2, zorder=5)
        if np.isfinite(measured) and not time.censored:
            axes.plot([measured], [level], "x", color="black", ms=5, zorder=6)


def _legend(of: Figure | Axes, panels: Sequence[Axes], **place: Any) -> None:
    """What is drawn in some panels, each kind once."""
    drawn = [zip(*axes.get_legend_handles_labels(), strict=True) for axes in panels]
    handles = {label: handle for pairs in drawn for handle, label in pairs}
    of.legend(handles.values(), handles.keys(), fontsize=7, **place)
