"""Text of forecasts, as a whole, as rows of a table, and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.records import output_unit
from creepkit.records.units import celsius_text, hours_number
from creepkit.reports.load_programs import kind_of_test

if TYPE_CHECKING:
    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.measured_test import ExplainedNuisance, TestScore
    from creepkit.forecasts.results import OutputForecast, TestForecast, TimeForecast
    from creepkit.inverse.uncertainty.law_misfit import LawMisfit

SHOWN_SHARE = 0.02
"""Of the variance: smaller parts of a band are not named."""


def forecast_text(forecast: Forecast) -> str:
    """What is forecast by which laws, then a paragraph for each test."""
    names = ", ".join(name if len(forecast.laws) == 1 else f"{name} ({w:.2g})" for name, w in forecast.laws.items())
    names += f" ({forecast.left_out} more of too little weight)" if forecast.left_out else ""
    lines = [f"by {names}: {100 * forecast.level:g} % bands and intervals of single tests, if {right_law(forecast)}"]
    if forecast.rejected:
        lines.append("the tests contradict the law: bands and intervals are wider by what it misses of their rates")
    for test in forecast.tests:
        lines += ["", *_test_lines(test)]
    return "\n".join(lines)


def right_law(forecast: Forecast) -> str:
    """The condition under which bands hold what they say, behind "if"."""
    return "the law is right" if len(forecast.laws) == 1 else "one of these laws is right, with these weights"


def _test_lines(test: TestForecast) -> list[str]:
    lines = [f"{test.name}: {kind_of_test(test.history)}, {test.history.condition}"]
    lines += [f"  {_end_text(one)}" for one in test.outputs.values()]
    lines += [f"  {_time_text(one, float(test.history.times[-1]))}" for one in test.times]
    lines += [f"  {misfit_sentence(test.misfit)}"] if test.misfit is not None else []
    lines += [f"  {test.caution}"] if test.caution else []
    if test.score is not None:
        lines += [f"  {line}" for line in score_lines(test.score)]
    leading = next(iter(test.outputs.values()), None)
    if leading is not None:
        parts = ", ".join(f"{part} {100 * share:.0f} %" for part, share in end_shares(leading).items())
        lines.append(f"  shares of the variance at its end, to first order: {parts}")
    lines += [f"  {test.extrapolation}"] if test.extrapolation else []
    return [*lines, *(f"  note: {note}" for note in test.notes)]


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
    return (
        f"{one.output.replace('_', ' ')} at {hours_number(float(one.times[k]))} h: {one.value[k]:.3g}{unit} "
        f"[{one.band.low[k]:.3g}, {_number(one.band.high[k])}]"
    )


def _time_text(one: TimeForecast, end: float) -> str:
    if not math.isfinite(one.low) and not math.isfinite(one.measured):
        return f"{one.event}: not within the test of {hours_number(end)} h (probability of it {one.chance:.2g})"
    text = f"{one.event}: {_median_and_interval(one)} h"
    if math.isfinite(one.measured):
        where = {True: "inside", False: "outside", None: ""}[one.inside]
        return f"{text}, measured {'> ' if one.censored else ''}{hours_number(one.measured)} h, {where}"
    return f"{text}; {_chance(one, end)}"


def _median_and_interval(one: TimeForecast) -> str:
    return f"median {hours_number(one.median)} [{hours_number(one.low)}, {hours_number(one.high)}]"


def _chance(one: TimeForecast, end: float) -> str:
    """The probability of what was asked: that it comes before the last time of the test, s."""
    return f"before the end of the test at {hours_number(end)} h with probability {one.chance:.2g}"


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "ruptured"


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


LARGEST_LOG = 700.0


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


FORECAST_COLUMNS = (
    *("test", "kind of test and condition", "at the end", "times, h", "measured", "own nuisances explain"),
    "extrapolated",
)


def forecast_rows(forecast: Forecast) -> list[tuple[str, ...]]:
    """One row a test: its leading output at the end, times, and how a measurement compares."""
    rows: list[tuple[str, ...]] = []
    for test in forecast.tests:
        leading = next(iter(test.outputs.values()), None)
        times = "\n".join(
            f"{t.event}: {_median_and_interval(t)}, {_chance(t, float(test.history.times[-1]))}" for t in test.times
        )
        measured = explained = ""
        if test.score is not None:
            inside = [f"{name} {100 * share:.0f} % inside" for name, share in test.score.inside.items()]
            inside += [f"{t.event}: {hours_number(t.measured)}" for t in test.times if math.isfinite(t.measured)]
            measured, explained = "\n".join(inside), f"{100 * test.score.explained:.0f} %"
        end = "" if leading is None else _end_text(leading).replace(" at ", "\nat ", 1)
        end += f"\n{test.caution}" if test.caution else ""
        condition = f"{kind_of_test(test.history)}, {test.history.condition}"
        beyond = [test.extrapolation] if test.extrapolation else []
        beyond += [misfit_sentence(test.misfit)] if test.misfit is not None else []
        rows.append((test.name, condition, end, times, measured, explained, "\n".join(beyond) or "no"))
    return rows


def forecast_to_json(forecast: Forecast) -> dict[str, Any]:
    """The forecast as JSON-able data: s and the units of the outputs; null for what is infinite or not known."""
    return {
        "laws": dict(forecast.laws),
        "level": forecast.level,
        "rejected": forecast.rejected,
        "tests": [_test_to_json(test) for test in forecast.tests],
    }


def _test_to_json(test: TestForecast) -> dict[str, Any]:
    return {
        "name": test.name,
        "condition": test.history.condition,
        "outputs": {name: _output_to_json(one) for name, one in test.outputs.items()},
        "times": [
            {
                "event": one.event,
                **{key: _finite(getattr(one, key)) for key in ("value", "median", "low", "high", "chance", "measured")},
                "censored": one.censored,
            }
            for one in test.times
        ],
        "includes": dict(test.includes),
        "extrapolation": test.extrapolation,
        "misfit": None if test.misfit is None else _misfit_to_json(test.misfit),
        "notes": list(test.notes),
        "caution": test.caution,
        "score": None if test.score is None else _score_to_json(test.score),
    }


def _misfit_to_json(misfit: LawMisfit) -> dict[str, Any]:
    """The factor in the intervals, and that by which the law misses the tests nearest to the question."""
    nearest = {"stress": misfit.stress, "temperature": misfit.temperature, "factor": math.exp(misfit.log_factor)}
    return {"factor": misfit.factor, "nearest": nearest}


def _output_to_json(one: OutputForecast) -> dict[str, Any]:
    curves: Mapping[str, Any] = {
        "time": one.times,
        "value": one.value,
        **{key: getattr(one.band, key) for key in ("median", "low", "high", "lowest", "highest")},
    }
    return {
        **{key: [_finite(float(v)) for v in values] for key, values in curves.items()},
        "unit": output_unit(one.output),
        "shares": {part: [_finite(float(v)) for v in values] for part, values in one.shares.items()},
    }


def _score_to_json(score: TestScore) -> dict[str, Any]:
    numbers = ("freedom", "p_value", "departure_p_value", "log_score", "explained")
    return {
        "inside": dict(score.inside),
        "whole_inside": dict(score.whole_inside),
        **{key: _finite(float(getattr(score, key))) for key in numbers},
        "rms": {k: _finite(v) for k, v in score.rms.items()},
        "rms_explained": {k: _finite(v) for k, v in score.rms_explained.items()},
        "nuisances": [
            {**{key: getattr(n, key) for key in ("kind", "value", "sd", "prior_mean", "prior_sd", "deviation")}}
            for n in score.nuisances
        ],
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
