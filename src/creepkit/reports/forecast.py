"""What a forecast says: by which laws, and of each test what it will show, how a measurement compares, and cautions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.frame_noise import usable_frames
from creepkit.records import SECONDS_PER_HOUR, is_logarithmic, output_unit
from creepkit.records.units import celsius_text, hours_number
from creepkit.reports.answer import end_figures, event_text
from creepkit.reports.blocks import WIDTH, Block, Items, Paragraph, as_text
from creepkit.reports.figures import panel_grid, span, wrapped
from creepkit.reports.json_values import fields_to_json, finite
from creepkit.reports.load_programs import kind_of_test
from creepkit.reports.prediction_bands import axis_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.forecasts.banded_output import OutputForecast
    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.forecast_of_test import FramesInside, TestForecast, TimeForecast
    from creepkit.inverse.uncertainty.law_misfit import LawMisfit
    from creepkit.reports.svg import PageFigures


SHOWN_SHARE = 0.02
"""Of the variance: smaller parts of a band are not named."""


def forecast_text(forecast: Forecast) -> str:
    """What is forecast by which laws, then each test."""
    lines = as_text(forecast_blocks(forecast)).splitlines()
    return "\n".join(line for text in lines for line in wrap(text, WIDTH, subsequent_indent="  "))


def forecast_blocks(forecast: Forecast, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The laws and what bands hold, a list for each test, and with `figures` the curves. of : " of " its name."""
    names = ", ".join(name if len(forecast.laws) == 1 else f"{name} ({w:.2g})" for name, w in forecast.laws.items())
    names += f" ({forecast.left_out} more of too little weight)" if forecast.left_out else ""
    right = "the law is right" if len(forecast.laws) == 1 else "one of these laws is right, with these weights"
    bands = f"{100 * forecast.level:g} % bands and intervals of single tests"
    blocks: list[Block] = [Paragraph(f"by {names}: {bands}, if {right}")]
    wider = "the tests contradict the law: bands and intervals are wider by what it misses of their rates"
    blocks += [Paragraph(wider)] if forecast.rejected else []
    if figures is not None and any(test.outputs for test in forecast.tests):
        caption = f"Forecast with bands of {100 * forecast.level:g} %: of measured values, and of whole curves (paler)."
        description = "Forecast curves over time with pointwise and simultaneous bands; the list below has the numbers."
        blocks.append(figures.picture(lambda: forecast_figure(forecast), f"Forecasts{of}", description, caption))
    for test in forecast.tests:
        blocks.append(Paragraph(f"{test.name}: {kind_of_test(test.history)}, {test.history.condition}:"))
        blocks.append(Items([*_lines(test)]))
    return blocks


def _lines(test: TestForecast) -> Iterator[str]:
    """Outputs at the end, times, what the law misses, a measurement, what the band is made of, cautions."""
    yield from (f"{one.name}: {one.text}" for one in end_figures(test))
    yield from (_time_text(one, float(test.history.times[-1])) for one in test.times)
    if test.misfit is not None:
        yield misfit_sentence(test.misfit)
    if test.caution:
        yield test.caution
    if test.inside is not None:
        yield inside_sentence(test.inside)
    leading = next(iter(test.outputs.values()), None)
    if leading is not None and (shares := end_shares(leading)):
        parts = ", ".join(f"{part} {100 * share:.0f} %" for part, share in shares.items())
        yield f"shares of the variance at its end, to first order: {parts}"
    if test.extrapolation:
        yield test.extrapolation
    yield from test.notes


def misfit_sentence(misfit: LawMisfit) -> str:
    """By which factor the law misses the tests nearest to a forecast, and what that widens it by."""
    factor = math.exp(abs(misfit.log_factor))
    where = f"{misfit.stress:.4g} MPa and {celsius_text(misfit.temperature, digits=0)}"
    return (
        f"it misses the rate of the nearest tests, at {where}, by a factor of {factor:.3g} where others predict them. "
        f"Intervals hold what it misses here, a factor of {misfit.factor:.3g} on the rate"
    )


def _time_text(one: TimeForecast, end: float) -> str:
    """When something comes; end : the last time of the test, s, before which it was asked for."""
    event = event_text(one)
    if not math.isfinite(one.low) and not math.isfinite(one.measured):
        return f"{event}: not within the test of {hours_number(end)} h (probability of it {one.chance:.2g})"
    text = f"{event}: median {hours_number(one.median)} [{hours_number(one.low)}, {hours_number(one.high)}] h"
    if math.isfinite(one.measured):
        where = {True: "inside", False: "outside", None: ""}[one.inside]
        return f"{text}, measured {'> ' if one.censored else ''}{hours_number(one.measured)} h, {where}"
    return f"{text}; before the end of the test at {hours_number(end)} h with probability {one.chance:.2g}"


def inside_sentence(inside: FramesInside) -> str:
    """How a measured test compares, in one line."""
    shares = ", ".join(
        f"{name} {100 * share:.0f} % of the frames in the band"
        + (" and the whole curve in the wider one" if inside.whole[name] else "")
        for name, share in inside.share.items()
    )
    return f"measured: {shares}"


def end_shares(one: OutputForecast) -> dict[str, float]:
    """{part: share of the variance} at the last time that is predicted, the largest first."""
    alive = np.flatnonzero(np.isfinite(one.value))
    if not alive.size:
        return {}
    shares = {part: float(values[alive[-1]]) for part, values in one.shares.items()}
    return {part: share for part, share in sorted(shares.items(), key=lambda pair: -pair[1]) if share >= SHOWN_SHARE}


def forecast_to_json(forecast: Forecast) -> dict[str, Any]:
    """The forecast as JSON-able data: s and the units of the outputs; null for what is infinite or not known."""
    return {
        **fields_to_json(forecast, "laws level rejected"),
        "tests": [_test_to_json(test) for test in forecast.tests],
    }


def _test_to_json(test: TestForecast) -> dict[str, Any]:
    misfit = test.misfit
    return {
        "name": test.name,
        "condition": test.history.condition,
        "outputs": {
            name: {
                "time": finite(one.times),
                "value": finite(one.value),
                **fields_to_json(one.band, "median low high lowest highest"),
                "unit": output_unit(one.output),
                "shares": finite(one.shares),
            }
            for name, one in test.outputs.items()
        },
        "times": [fields_to_json(one, "event value median low high chance measured censored") for one in test.times],
        **fields_to_json(test, "includes extrapolation notes caution"),
        "misfit": None
        if misfit is None
        else {
            "factor": misfit.factor,
            "nearest": {**fields_to_json(misfit, "stress temperature"), "factor": math.exp(misfit.log_factor)},
        },
        "inside": None if test.inside is None else fields_to_json(test.inside, "share whole"),
    }


# ---- figure ----------------------------------------------------------------------------------------------------------


MOST_DRAWN = 12
"""Tests in one figure."""


COLUMNS = 4
"""Tests side by side."""


TIME_COLOUR, RUPTURE_COLOUR = "#c51b7d", "#b2182b"


BELOW_EDGE = 0.04
"""Of the height of a panel: how far below its upper edge the interval of the rupture time is drawn."""


LONGEST_AXIS = 5.0
"""Of the time of a test: beyond, an interval goes on to the right of the axis, as an arrow says."""


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
        _draw_curve(axes, test, one)
    _legend(figure, forecast, [test for test, _ in drawn], loc="outside lower center", ncols=3)
    left_out = len(forecast.tests) - len({test.name for test, _ in drawn})
    more = f" ({left_out} more tests are not drawn)" if left_out > 0 else ""
    title = f"forecast by {' or '.join(forecast.laws)}{more}"
    figure.suptitle(wrapped(title, float(figure.get_size_inches()[0])), fontsize=10)
    return figure


def draw_forecast(axes: Axes, forecast: Forecast) -> None:
    """The leading output of the first test with both bands."""
    test = _drawable(forecast)[0]
    _draw_curve(axes, test, next(iter(test.outputs.values())))
    _legend(axes, forecast, [test])


def _drawable(forecast: Forecast) -> list[TestForecast]:
    tests = [t for t in forecast.tests if t.outputs]
    if not tests:
        raise FitError("nothing is predicted of these tests, so there is nothing to draw")
    return tests


def _scaled(one: OutputForecast) -> float:
    return 100.0 if is_logarithmic(one.output) else 1.0


def _draw_curve(axes: Axes, test: TestForecast, one: OutputForecast) -> None:
    """The curve, pointwise and simultaneous bands, the measured points, and intervals of times."""
    factor, logarithmic = _scaled(one), is_logarithmic(one.output)
    positive = one.times > 0
    hours, band = one.times[positive] / SECONDS_PER_HOUR, one.band
    curve, low, high, lowest, highest = (
        factor * v[positive] for v in (one.value, band.low, band.high, band.lowest, band.highest)
    )
    measured_hours, measured = _measured(test, one.output, factor)
    finite = np.concatenate([[1e-12], *(v[np.isfinite(v)] for v in (curve, low, high, measured))])
    top = float(finite.max())
    bottom = max(SHOWN_RATIO * top, 1e-12) if logarithmic else float(min(finite[1:].min(initial=0.0), 0.0))
    if not logarithmic and finite.size > 1 and finite[1:].min() > 0.4 * top:
        bottom = float(finite[1:].min()) - 0.1 * (top - float(finite[1:].min()))
    ceiling = 1.3 * top if logarithmic else top + 0.05 * abs(top - bottom)
    span(axes, "y", bottom, ceiling, logarithmic=logarithmic)
    ends = axes.get_ylim()
    for lower, upper, alpha in ((lowest, highest, 0.15), (low, high, 0.3)):
        axes.fill_between(hours, np.clip(lower, *ends), np.clip(upper, *ends), color="#3b6fb6", alpha=alpha, lw=0)
    axes.plot(hours, curve, color="#1f3f73", lw=1.3)
    axes.plot(measured_hours, measured, ".", ms=3, color="black", alpha=0.6)
    start, end = float(hours[0]) if logarithmic else 0.0, _time_end(test)
    span(axes, "x", start, end, logarithmic=logarithmic)
    axes.set_xlim(0.95 * start, 1.03 * end)
    _draw_times(axes, test, one)
    axes.set_title(wrapped(f"{test.name}: {test.history.condition}", 4.4, 11.0), fontsize=8)
    axes.set_ylabel(axis_label(one.output), fontsize=8)
    axes.set_xlabel("time, h", fontsize=8)
    axes.tick_params(labelsize=7)


def _time_end(test: TestForecast) -> float:
    """h, the end of the time axis: that of the test, or of an interval that begins before it, up to LONGEST_AXIS."""
    last = end = float(test.history.times[-1]) / SECONDS_PER_HOUR
    for time in sorted((t for t in test.times if np.isfinite(t.low)), key=lambda t: t.low):
        if time.low / SECONDS_PER_HOUR < end:
            end = max(end, min(time.high / SECONDS_PER_HOUR, LONGEST_AXIS * last))
    return end


def _measured(test: TestForecast, output: str, factor: float) -> tuple[Floats, Floats]:
    history = test.history
    if output not in history.outputs:
        return np.zeros(0), np.zeros(0)
    used = usable_frames(history, output) & (history.times > 0)
    return history.times[used] / SECONDS_PER_HOUR, factor * history.outputs[output][used]


def _draw_times(axes: Axes, test: TestForecast, one: OutputForecast) -> None:
    """Intervals of times, the median marked: at the value that is reached, and of rupture at the upper edge."""
    right, (bottom, top) = axes.get_xlim()[1], axes.get_ylim()
    edge = top * (bottom / top) ** BELOW_EDGE if is_logarithmic(one.output) else top - BELOW_EDGE * (top - bottom)
    for time in test.times:
        is_rupture = not time.output
        level = edge if is_rupture else _scaled(one) * time.target
        low, median, high, measured = (v / SECONDS_PER_HOUR for v in (time.low, time.median, time.high, time.measured))
        if time.output not in ("", one.output) or not bottom <= level <= top or not low <= right:
            continue
        colour = RUPTURE_COLOUR if is_rupture else TIME_COLOUR
        axes.plot([low, min(high, right)], [level, level], color=colour, lw=2.2, solid_capstyle="butt", zorder=4)
        if high > right:
            axes.plot([right], [level], ">", color=colour, ms=5, clip_on=False, zorder=5)
        if median <= right:
            axes.plot([median], [level], "|", color=colour, ms=9, mew=2, zorder=5)
        if np.isfinite(measured) and not time.censored:
            axes.plot([measured], [level], "x", color="black", ms=5, zorder=6)


def _legend(of: Figure | Axes, forecast: Forecast, tests: Sequence[TestForecast], **place: Any) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    per_cent = f"{100 * forecast.level:g} %"
    drawn = {not t.output for test in tests for t in test.times if t.low <= 1.03 * SECONDS_PER_HOUR * _time_end(test)}
    times = ((False, "a value", TIME_COLOUR), (True, "rupture", RUPTURE_COLOUR))
    look: Any = {"lw": 2.2, "marker": "|", "ms": 9, "mew": 2}
    handles = [
        Line2D([], [], color="#1f3f73", lw=1.3, label="identified law"),
        Patch(color="#3b6fb6", alpha=0.45, label=f"{per_cent} of measured values"),
        Patch(color="#3b6fb6", alpha=0.15, label=f"{per_cent} of whole curves"),
        *([Line2D([], [], color="black", marker=".", ls="", label="measured")] if any(t.inside for t in tests) else []),
        *(
            Line2D([], [], color=colour, label=f"time to {word}: median, {per_cent}", **look)
            for rupture, word, colour in times
            if rupture in drawn
        ),
    ]
    of.legend(handles=handles, fontsize=7, **place)
