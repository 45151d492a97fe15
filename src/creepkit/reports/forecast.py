"""What a forecast says: by which laws, and of each test what it will show, how a measurement compares, and cautions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.records import output_unit
from creepkit.records.units import celsius_text, hours_number
from creepkit.reports.blocks import Block, Items, Paragraph, as_text
from creepkit.reports.forecast_plot import forecast_figure
from creepkit.reports.json_values import fields_to_json, finite
from creepkit.reports.load_programs import kind_of_test

if TYPE_CHECKING:
    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.measured_test import ExplainedNuisance, TestScore
    from creepkit.forecasts.results import OutputForecast, TestForecast, TimeForecast
    from creepkit.inverse.uncertainty.law_misfit import LawMisfit
    from creepkit.reports.svg import PageFigures

SHOWN_SHARE = 0.02
"""Of the variance: smaller parts of a band are not named."""


LARGEST_LOG = 700.0


def forecast_text(forecast: Forecast) -> str:
    """What is forecast by which laws, then each test."""
    return as_text(forecast_blocks(forecast))


def forecast_blocks(forecast: Forecast, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The laws and what bands hold, a list for each test, and with `figures` the curves. of : " of " its name."""
    names = ", ".join(name if len(forecast.laws) == 1 else f"{name} ({w:.2g})" for name, w in forecast.laws.items())
    names += f" ({forecast.left_out} more of too little weight)" if forecast.left_out else ""
    right = "the law is right" if len(forecast.laws) == 1 else "one of these laws is right, with these weights"
    bands = f"{100 * forecast.level:g} % bands and intervals of single tests"
    blocks: list[Block] = [Paragraph(f"by {names}: {bands}, if {right}")]
    if forecast.rejected:
        blocks.append(
            Paragraph("the tests contradict the law: bands and intervals are wider by what it misses of their rates")
        )
    if figures is not None and any(test.outputs for test in forecast.tests):
        caption = (
            f"Forecast with bands of {100 * forecast.level:g} % (drawn), and below it shares of the variance, which "
        )
        caption += "are of first order."
        description = (
            "Forecast curves over time with pointwise and simultaneous bands, and what the variance is made of."
        )
        blocks.append(figures.picture(lambda: forecast_figure(forecast), f"Forecasts{of}", description, caption))
    for test in forecast.tests:
        blocks.append(Paragraph(f"{test.name}: {kind_of_test(test.history)}, {test.history.condition}:"))
        blocks.append(Items([*_lines(test)]))
    return blocks


def _lines(test: TestForecast) -> Iterator[str]:
    """Outputs at the end, times, what the law misses, a measurement, what the band is made of, cautions."""
    yield from map(_end_text, test.outputs.values())
    yield from (_time_text(one, float(test.history.times[-1])) for one in test.times)
    if test.misfit is not None:
        yield misfit_sentence(test.misfit)
    if test.caution:
        yield test.caution
    if test.score is not None:
        yield from score_lines(test.score)
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
        f"the law misses the rate of the tests nearest to it, at {where}, by a factor of {factor:.3g} when the others "
        f"predict it; what it misses here is in the intervals, as a factor of {misfit.factor:.3g} on the rate"
    )


def _end_text(one: OutputForecast) -> str:
    alive = np.flatnonzero(np.isfinite(one.value) & np.isfinite(one.band.low))
    unit = f" {output_unit(one.output)}" if output_unit(one.output) else ""
    if not alive.size:
        return f"{one.output}: nothing is predicted"
    k = int(alive[-1])
    high = f"{one.band.high[k]:.3g}" if math.isfinite(one.band.high[k]) else "ruptured"
    return (
        f"{one.output.replace('_', ' ')} at {hours_number(float(one.times[k]))} h: {one.value[k]:.3g}{unit} "
        f"[{one.band.low[k]:.3g}, {high}]"
    )


def _time_text(one: TimeForecast, end: float) -> str:
    """When something comes; end : the last time of the test, s, before which it was asked for."""
    if not math.isfinite(one.low) and not math.isfinite(one.measured):
        return f"{one.event}: not within the test of {hours_number(end)} h (probability of it {one.chance:.2g})"
    text = f"{one.event}: median {hours_number(one.median)} [{hours_number(one.low)}, {hours_number(one.high)}] h"
    if math.isfinite(one.measured):
        where = {True: "inside", False: "outside", None: ""}[one.inside]
        return f"{text}, measured {'> ' if one.censored else ''}{hours_number(one.measured)} h, {where}"
    return f"{text}; before the end of the test at {hours_number(end)} h with probability {one.chance:.2g}"


def score_lines(score: TestScore) -> list[str]:
    """How a measured test compares, in two lines."""
    inside = ", ".join(
        f"{name} {100 * share:.0f} % of the frames in the band"
        + (" and the whole curve in the wider one" if score.whole_inside[name] else "")
        for name, share in score.inside.items()
    )
    rms = ", ".join(f"{name} {before:.3g} to {score.rms_explained[name]:.3g}" for name, before in score.rms.items())
    moved = [nuisance_text(one) for one in score.nuisances if abs(one.deviation) > 0.1]
    return [
        f"measured: {inside}; a test lies as far off, or farther, with probability {score.departure_p_value:.2g} "
        f"(noise of its frames included: {score.p_value:.2g})",
        f"with the law fixed, a rate, offsets and dimensions of its own describe {100 * score.explained:.0f} % of what "
        f"differs (rms over noise: {rms}){': ' if moved else ''}{', '.join(moved)}",
    ]


def nuisance_text(one: ExplainedNuisance) -> str:
    """A nuisance and how far it lies from its prior mean."""
    if one.kind == "rate":
        return f"rate x {math.exp(min(one.value, LARGEST_LOG)):.3g} ({one.deviation:+.1f} sd)"
    return f"{one.kind} {one.value:.4g} ({one.deviation:+.1f} sd)"


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
    misfit, score = test.misfit, test.score
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
        "score": None
        if score is None
        else {
            **fields_to_json(score, "inside whole_inside freedom p_value departure_p_value log_score explained"),
            **fields_to_json(score, "rms rms_explained"),
            "nuisances": [fields_to_json(n, "kind value sd prior_mean prior_sd deviation") for n in score.nuisances],
        },
    }
