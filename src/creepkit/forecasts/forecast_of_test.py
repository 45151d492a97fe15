"""The forecast of one test: its curves with bands, what the bands are made of, and the times that are asked for."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.forecasts.banded_output import (
    CHOICE_OF_LAW,
    LAW,
    MISFIT,
    NOISE,
    NUMERICAL,
    OFFSET,
    BandedOutput,
    OutputForecast,
)
from creepkit.forecasts.draws import (
    LIFE_SCATTER,
    DrawnLaw,
    LawDraws,
    crossing_times,
    drawn_law,
    first_crossing,
    has_sampled_draws,
)
from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.extrapolation import HOUR, UNSEEN_RUPTURE, extrapolation_text, outside_combinations
from creepkit.inverse.identification import Identification
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.inverse.reference_conditions import simulated_stresses, usable_frames
from creepkit.inverse.uncertainty.laplace_approximation import is_open
from creepkit.inverse.uncertainty.law_misfit import LawMisfit
from creepkit.inverse.uncertainty.rate_scatter import LEVELS, USUAL_SD
from creepkit.records import ZERO_CELSIUS, History, Predictor, is_length_nuisance, output_unit
from creepkit.records.conditions import stated_condition


@dataclass(frozen=True)
class TimeForecast:
    """When an output reaches a value, or the specimen breaks.

    event : in words. output, target : what is reached; "" for rupture. value : s, at the identified values.
    median, low, high : s, of a single test. All may be infinite.
    measured : s, NaN where it is not known; censored : whether the test was stopped then, unbroken.
    chance : probability that it comes before the last time of the test.
    """

    event: str
    value: float
    median: float
    low: float
    high: float
    chance: float
    measured: float = float("nan")
    censored: bool = False
    output: str = ""
    target: float = float("nan")

    @property
    def inside(self) -> bool | None:
        """Whether the measured time lies within the interval; None where nothing was measured."""
        if not np.isfinite(self.measured):
            return None
        return self.measured <= self.high if self.censored else self.low <= self.measured <= self.high


@dataclass(frozen=True)
class FramesInside:
    """How a measured test compares with its forecast.

    share : {output: share of frames inside the pointwise band}. whole : {output: whether all of its frames are inside
    the simultaneous band}.
    """

    share: Mapping[str, float]
    whole: Mapping[str, bool]


@dataclass(frozen=True, eq=False)
class TestForecast:
    """The forecast of one test.

    outputs : {name: its curve and band}. times : to targets and to rupture. inside : of a measured test, else None.
    includes : what the bands are made of, with sizes. caution : why bands are not those of the tests, or "".
    extrapolation : beyond the fitted ranges, in one sentence, or "". misfit : what the law of most weight misses there,
    where bands and times hold that.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    history: History
    outputs: Mapping[str, OutputForecast]
    times: tuple[TimeForecast, ...]
    includes: Mapping[str, str]
    extrapolation: str = ""
    inside: FramesInside | None = None
    notes: tuple[str, ...] = ()
    caution: str = ""
    misfit: LawMisfit | None = None

    @property
    def name(self) -> str:
        """Name of the test."""
        return self.history.name

    def extrapolated_in(self, time: TimeForecast | None = None) -> list[str]:
        """The quantities in which a time, or by default the end of the test, is extrapolated."""
        names = extrapolated_names(self.extrapolation)
        if time is not None:  # how long the test goes on, and the strain that it ends at, are not of this time
            own = "time" if f"{time.event} after" in self.extrapolation else "strain" if time.output else "rupture"
            names = [name for name in names if name not in ("time", "strain")]
            names += [own] if f"{time.event} " in self.extrapolation else []
        return names


def forecast_test(
    laws: Sequence[tuple[LawDraws, float]],
    history: History,
    predictor: Predictor,
    *,
    level: float,
    targets: Mapping[str, Sequence[float]],
    tolerances: Mapping[str, float],
    rng: np.random.Generator,
) -> TestForecast:
    """The forecast of one test by weighted laws.

    targets : {output: values}, in its unit. tolerances : {kind: standard deviation}.
    """
    banded = _banded_history(history)
    drawn = [drawn_law(draws, weight, banded, predictor, tolerances, rng) for draws, weight in laws]
    best = max(drawn, key=lambda one: one.weight)
    fit = best.draws.fit
    outputs = {
        name: BandedOutput(drawn, banded, name).forecast(level, rng)
        for name in best.central.outputs
        if np.isfinite(best.central.of(name, banded.times)).any()
    }
    times = _times(drawn, history, targets, level, rng)
    notes = _notes(fit, history, outputs)
    failed = sum(one.failed for one in drawn)
    if RUPTURE_OUTPUT not in fit.noise_model.outputs and any(not t.output for t in times):
        notes.append(UNSEEN_RUPTURE)
    notes += [f"the solver did not finish {failed} of the draws; they are left out"] if failed else []
    inside = _inside(banded, outputs)
    includes = _includes(drawn, best, outputs)
    extrapolation = _extrapolation(banded, predictor, best, times)
    caution = _caution([one.draws for one in drawn])
    return TestForecast(history, outputs, times, includes, extrapolation, inside, tuple(notes), caution, best.misfit)


MOST_TIMES = 300
"""Of a test at which bands are made; of more frames so many are taken, half in time and half in its logarithm."""


def _banded_history(history: History) -> History:
    """The history at the times of its bands."""
    times = history.times
    if times.size <= MOST_TIMES:
        return history
    half = MOST_TIMES // 2
    first = float(times[times > 0][0])
    targets = np.concatenate([np.geomspace(first, times[-1], half), np.linspace(first, times[-1], half)])
    kept = np.unique(np.searchsorted(times, targets).clip(max=times.size - 1))
    return replace(
        history,
        times=times[kept],
        outputs={name: values[kept] for name, values in history.outputs.items()},
        standard_deviation={name: values[kept] for name, values in history.standard_deviation.items()},
        used=history.used[kept],
    )


# ---- times ---------------------------------------------------------------------------------------------------


def _times(
    laws: Sequence[DrawnLaw],
    history: History,
    targets: Mapping[str, Sequence[float]],
    level: float,
    rng: np.random.Generator,
) -> tuple[TimeForecast, ...]:
    """Times to targets of outputs that are predicted, and to rupture."""
    forecasts, best = [], max(laws, key=lambda one: one.weight)
    for name, target in ((name, target) for name, values in targets.items() for target in values):
        if name not in best.central.outputs:
            continue
        output = BandedOutput(laws, history, name)
        curve = best.central.of(name)[0]
        rising = bool(np.append(curve[np.isfinite(curve)], target)[0] <= target)
        crossings = [
            crossing_times(one.drawn, name, output.reached(target, len(one.drawn.values), rng), rising=rising)
            for one in laws
        ]
        value = float(crossing_times(best.central, name, np.array([target]))[0])
        measure = f"{history.strain_measure} " if name == "strain" else ""
        event = f"{measure}{name.replace('_', ' ')} {target:g} {output_unit(name)}".strip()
        measured = _measured_crossing(history, name, target)
        made = _time_forecast(event, value, np.concatenate(crossings), history, level, measured, censored=False)
        forecasts.append(replace(made, output=name, target=float(target)))
    ends = np.concatenate([one.drawn.end_times for one in laws])
    noise = best.draws.fit.noise_model
    noise = replace(noise, life=0.0) if best.draws.fit.coordinates.damage_rates else noise  # which the draws have
    ends = ends * np.exp(noise.scatter_of_value(RUPTURE_OUTPUT) * rng.standard_normal(ends.size))
    asked = history.end_known or RUPTURE_OUTPUT in noise.outputs or RUPTURE_OUTPUT in targets
    if np.isfinite(ends).any() and (asked or (ends <= history.times[-1]).mean() > NOTEWORTHY_CHANCE):
        measured = history.rupture_time or (float(history.times[-1]) if history.unruptured else float("nan"))
        value = float(best.central.end_times[0])
        forecasts.append(_time_forecast("rupture", value, ends, history, level, measured, censored=history.unruptured))
    return tuple(forecasts)


def _time_forecast(
    event: str, value: float, times: Floats, history: History, level: float, measured: float, *, censored: bool
) -> TimeForecast:
    known = np.sort(times[~np.isnan(times)])
    if not known.size:
        known = np.array([np.inf])
    low, median, high = (
        float(known[min(int(p * known.size), known.size - 1)]) for p in (0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level)
    )
    chance = float((known <= history.times[-1]).mean())
    return TimeForecast(event, value, median, low, high, chance, measured, censored)


def _measured_crossing(history: History, output: str, target: float) -> float:
    """s, when the measured output first reaches a target; NaN where it does not, or is not measured."""
    if output not in history.outputs:
        return float("nan")
    used = usable_frames(history, output)
    times = history.times[used]
    crossing = first_crossing(times, history.outputs[output][used], target)
    return crossing if times.size and times[0] < crossing < np.inf else float("nan")


# ---- what is said beside it ----------------------------------------------------------------------------------


def _inside(banded: History, outputs: Mapping[str, OutputForecast]) -> FramesInside | None:
    """How a measured test compares with its bands; banded : the test at their times."""
    shares, whole = {}, {}
    for name, forecast in outputs.items():
        if name not in banded.outputs or not usable_frames(banded, name).any():
            continue
        used, band = usable_frames(banded, name), forecast.band
        values = banded.outputs[name]
        shares[name] = float(((values >= band.low) & (values <= band.high))[used].mean())
        whole[name] = bool(((values >= band.lowest) & (values <= band.highest))[used].all())
    return FramesInside(shares, whole) if shares else None


def _includes(drawn: Sequence[DrawnLaw], best: DrawnLaw, outputs: Mapping[str, OutputForecast]) -> dict[str, str]:
    """{part of the band: its size in words}."""
    fit, sizes = best.draws.fit, defaultdict[str, list[str]](list)
    whence = "samples of the posterior" if has_sampled_draws(fit) else "posterior covariance"
    sizes[LAW].append(f"{whence} of its parameters, within their bounds")
    if len(drawn) > 1:
        sizes[CHOICE_OF_LAW] += [f"{one.draws.fit.law.name} ({one.weight:.2g})" for one in drawn]
    for source, variance in best.own_variances.items():
        if variance > 0:
            sizes[source].append(f"{100 * np.sqrt(variance):.2g} % of the rate")
    if fit.noise_model.life > UNDETECTED_SCATTER:
        sizes[LIFE_SCATTER].append(f"{100 * fit.noise_model.life:.2g} % of the life")
    for dimension in best.dimensions:
        unit = "mm" if is_length_nuisance(dimension.kind) else UNITS.get(dimension.kind, "")
        sizes[dimension.kind].append(f"{dimension.mean:.4g} ± {dimension.sd:.2g} {unit}".strip())
    for name in (name for name in outputs if name in fit.noise_model.outputs):
        known = fit.noise_model[name]
        for part, size in (OFFSET, known.offset), (NOISE, known.noise), (NUMERICAL, best.numerical.get(name, 0.0)):
            if size > 0:
                sizes[part].append(f"{name} {size:.2g} {output_unit(name)}".strip())
        if known.misfit > 0 or fit.noise_model.discrepancy > 0:
            sizes[MISFIT] = ["what the fitted tests showed beside the law"]
    return {part: ", ".join(texts) for part, texts in sizes.items()}


FAR = 100.0
"""K from the fitted temperatures from which on one may have been stated in Celsius."""


NEARBY = {"stress": 0.01, "temperature": 0.002, "time": 0.1, "strain": 0.1}
"""Relative distances beyond the fitted ranges within which nothing is said of them."""


UNITS = {"temperature": "K", "temperature drift": "K"}
"""Of dimensions; others are relative."""


def _extrapolation(history: History, predictor: Predictor, best: DrawnLaw, asked: Sequence[TimeForecast]) -> str:
    """What of the test, or of a time stated of it, lies outside the region of the fitted tests; "" if nothing."""
    fit, temperatures = best.draws.fit, history.temperature_program().at(history.times)
    held = simulated_stresses(fit.law, fit.values, history, predictor)
    point = {"stress": held, "temperature": temperatures, "time": history.times[-1:]}
    point |= {one.name: np.array(stated_condition(history, one)[:1]) for one in fit.law.conditions}
    if "strain" in best.central.outputs:
        strain = best.central.of("strain", history.times)[0]
        point["strain"] = np.array([np.nanmax(strain, initial=0.0)])
    parts = [extrapolation_text(fit.ranges, point, NEARBY).removeprefix("extrapolated: ")]
    if "stress" not in extrapolated_names(parts[0]):
        grid = [(float(s), float(T)) for s in held for T in np.unique(np.round(temperatures, 1))]
        conditions = np.array(grid, float).reshape(-1, 2)
        parts.append(outside_combinations(fit, conditions[:, 0], conditions[:, 1]))
    parts = [part for part in (*parts, *_extrapolated_times(fit, asked)) if part]
    text = f"extrapolated: {', '.join(parts)}" if parts else ""
    low, high = fit.ranges["temperature"]
    celsius = float(temperatures.max())
    meant = celsius < low - FAR and low - FAR < celsius + ZERO_CELSIUS < high + FAR
    return f"{text}; temperatures are in K: is {celsius:g} °C meant, {celsius + ZERO_CELSIUS:g} K?" if meant else text


def extrapolated_names(text: str) -> list[str]:
    """Which quantities a sentence on an extrapolation begins its parts with."""
    return [name.replace("_", " ") for name in re.findall(r"(?:^|[,:] )(\w+) -?\d[^,(]*\(the tests", text)]


def _extrapolated_times(fit: Identification, asked: Sequence[TimeForecast]) -> list[str]:
    """Of each time that is stated whether it, or the strain that is reached then, lies beyond the tests."""
    longest, largest = fit.ranges["time"][1], fit.ranges["strain"][1]
    broke = any(m.rupture is not None and m.rupture.used for m in fit.tests)
    parts = []
    for one in asked:
        if np.isfinite(one.value) and one.value > (1.0 + NEARBY["time"]) * longest:
            parts.append(f"{one.event} after {one.value / HOUR:.3g} h (the longest test: {longest / HOUR:.3g} h)")
        elif one.output == "strain" and one.target > (1.0 + NEARBY["strain"]) * largest:
            parts.append(f"{one.event} (the tests reach {100 * largest:.3g} %)")
        elif not one.output and np.isfinite(one.value) and not broke:
            parts.append(f"{one.event} (no test broke)")
    return parts


def _notes(fit: Identification, history: History, outputs: Mapping[str, OutputForecast]) -> list[str]:
    notes, scatter = [], fit.scatter_of_rates
    test, (mean, covariance) = scatter.new_test(history), scatter.mean_joint
    if any(m.name == history.name for m in fit.tests):
        notes.append("this test was fitted: the forecast is that of another one like it")
    for level in LEVELS:
        if history.labels.get(level) and not (level in scatter.levels or level in scatter.common):
            notes.append(f"its {level} ('{history.labels[level]}') says nothing: the fitted tests state none")
    unknown = [name for name in outputs if name not in fit.noise_model.outputs]
    if unknown:
        notes.append(f"no fitted test shows the noise of {' and '.join(unknown)}; it is not in the band")
    counts = {level: len({n for n in names if not n.startswith("(of ")}) for level, names in scatter.members.items()}
    counts = {"test": len(fit.tests), **counts} if scatter.known is None else counts
    for level, count in counts.items():
        if count < FEW_TESTS:
            plural = {"test": f"test{'s' * (count > 1)}", "heat": "heats", "laboratory": "laboratories"}[level]
            says, among = "says" if plural == "test" else "say", "tests" if level == "test" else "them"
            usual = f"{100 * USUAL_SD[level]:.0f} % of the rate"
            notes.append(
                f"{count} {plural} {says} little of the scatter between {among}: what is usual holds it, {usual}"
            )
    for level in test.unseen:
        notes.append(
            f"all fitted tests are of one {level}, and this is of another: the scatter between them is what is usual, "
            f"{100 * USUAL_SD[level]:.0f} % of the rate"
        )
    for level, position in test.known.items():
        factor, sd = float(np.exp(mean[position])), float(np.sqrt(covariance[position, position]))
        notes.append(
            f"its {level} was fitted and creeps {factor:.3g} times as fast as the law says (± {100 * sd:.2g} %)"
        )
    return notes


def _caution(laws: Sequence[LawDraws]) -> str:
    """Why a band may hold what the tests exclude: Gaussian draws of values that they do not determine; else ""."""
    for draws in laws:
        open_ = [e.name for e in draws.fit.estimates if is_open(draws.fit.law.table[e.name], e)]
        if open_ and not has_sampled_draws(draws.fit):
            outside = f"{100 * draws.outside:.0f} % of them"
            names = ", ".join(open_)
            return (
                f"the band may be far too wide: the tests do not, or poorly, determine {names}. Its draws are Gaussian "
                f"about the values, not compared with the tests; {outside} lay outside the bounds of the law"
            )
    return ""


FEW_TESTS = 5
"""Below so many tests, or members of a level, their number is mentioned."""


NOTEWORTHY_CHANCE = 0.01
"""Of a rupture before the end of a test, from which on it is forecast where no fitted test broke."""
