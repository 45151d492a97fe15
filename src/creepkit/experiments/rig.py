"""Rig: what the equipment can do, and the runs of it that could be made next, or that a user plans."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from creepkit.arrays import Floats, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import FitError, quoted
from creepkit.inverse.identification import Identification
from creepkit.limits import Limits
from creepkit.limits import numbers as numbers_between
from creepkit.options import CELSIUS, Options, option
from creepkit.records import (
    History,
    Loading,
    Predictor,
    TwoLevels,
    dimension_named,
    dimensions_of,
    load_unit,
    loading_of,
)
from creepkit.records.held_levels import held_temperatures
from creepkit.records.loading import held_of
from creepkit.records.units import celsius_text, time_text

LOWER_LEVEL, HIGHER_LEVEL, EXTENSION = 0.7, 1.4, 2.0
"""Where nothing is said of a rig: its least and greatest level over those of the tests that were made, and its longest
test over the longest of these."""


LONGEST_INTERVAL = 1e7
"""s, between frames: tests of years are read once in four months at least."""


SETUP_HOURS = 1.0
"""Oven hours of a run beside its test, where nothing is said: heating, mounting, cooling."""


LARGEST_GROWTH = 2.0
"""Largest leading output of a planned test over the largest that was measured: a law is not trusted much further."""


VARIED_RATIOS = (0.9, 1.0, 1.1)
"""By which a length is varied where nothing is said; the one that is known least exactly."""


ROUNDED_TEMPERATURE = 5.0
"""K, within which two tests are at one temperature."""


@checked
@dataclass(frozen=True)
class Rig(Options, title="settings of a rig"):
    """What the equipment can do with one kind of specimen.

    specimen : its name, as histories have it. levels : (least, greatest) load, in its unit.
    longest_hours : h, the longest test. temperatures : K, at which tests can be made.
    dimensions : {length: values in mm} of test pieces that can be made, such as {"apex_thickness": (0.44, 0.5, 0.58)}.
    tests_per_run : test pieces that the oven takes at once, under one load and temperature. setup_hours : h, of the
    oven for each run, beside its test. frame_interval : s, between frames. load_changes : whether the load may be
    changed during a test. largest_output : up to which the leading output may grow, in its unit.
    """

    specimen: str = option(MISSING, "Whose rig is described, where tests are of several specimens.")
    levels: tuple[float, float] = option(MISSING, "What it can load, MPa, or a strain.", example="4:14")
    longest_hours: float = option(MISSING, "The longest test.", numbers_between(1e-9, 1e7), key="longest_h")
    temperatures: tuple[float, ...] = option(
        MISSING,
        "At which tests can be made.",
        numbers_between(-273.15, 9726.85, above=True),
        flag="temperature-c",
        **CELSIUS,
    )
    dimensions: Mapping[str, tuple[float, ...]] = option(
        dict, "Test pieces that can be made, mm.", flag="dimension", example="apex_thickness=0.44,0.5,0.58"
    )
    tests_per_run: int = option(1, "Test pieces that the oven takes at once.", Limits(1, 25))
    setup_hours: float = option(
        SETUP_HOURS, "Of the oven for each run, beside its test.", numbers_between(0, 1e7), key="setup_h"
    )
    frame_interval: float = option(900.0, "Between frames.", numbers_between(0, LONGEST_INTERVAL, above=True), unit="s")
    load_changes: bool = True
    largest_output: float = float("inf")

    def __post_init__(self) -> None:
        low, high = map(float, self.levels)
        if not 0 < low <= high < np.inf:
            raise FitError(f"a rig's levels are (least, greatest) above zero, such as (4, 14) MPa; found {self.levels}")
        if not self.largest_output > 0:
            raise FitError(f"a rig's largest_output must be above zero, found {quoted(repr(self.largest_output), 60)}")
        temperatures = list(dict.fromkeys(map(float, self.temperatures)))
        dimensions = {n: tuple(float(v) for v in np.atleast_1d(values)) for n, values in self.dimensions.items()}
        for name, values in {"temperatures": temperatures, **dimensions}.items():
            if not 1 <= len(values) <= MOST_VALUES:
                raise FitError(f"a rig has {len(values)} values of {name}; give 1 to {MOST_VALUES}")
        for name, values in dimensions.items():
            if not all(0 < value < LONGEST_DIMENSION for value in values):
                raise FitError(f"a rig's {name} must be lengths in mm above zero, found {values}")
        set_fields(self, levels=(low, high), temperatures=tuple(temperatures), dimensions=dimensions)

    def refusal(self, history: History) -> str:
        """Why this rig cannot make a planned test, in a sentence; "" where it can."""
        levels = history.loading.program().values
        positive = levels[levels > 0]
        unit = f" {load_unit(history)}".rstrip()
        if positive.size and (positive.max() > 1.0001 * self.levels[1] or positive.min() < 0.9999 * self.levels[0]):
            outside = positive.max() if positive.max() > 1.0001 * self.levels[1] else positive.min()
            return f"{outside:.3g}{unit} is outside the rig's {self.levels[0]:.3g} to {self.levels[1]:.3g}{unit}"
        hours = float(history.times[-1]) / 3600.0
        if hours > 1.0001 * self.longest_hours:
            return f"{hours:.3g} h is more than the {self.longest_hours:.3g} h of the rig's longest test"
        for temperature in history.temperature_program().values:
            if min(abs(temperature - T) for T in self.temperatures) > ROUNDED_TEMPERATURE:
                known = ", ".join(f"{T:.4g}" for T in self.temperatures)
                return f"{temperature:.4g} K is none of the rig's temperatures ({known} K)"
        return ""


def changed_rigs(rigs: Sequence[Rig], changes: Mapping[str, Any]) -> list[Rig]:
    """The rigs with what was said of one of them; changes : {field: value}, the specimen among them."""
    names = [rig.specimen for rig in rigs]
    specimen = changes.get("specimen")
    if specimen is not None and specimen not in names:
        raise FitError(f"the rig of specimen '{specimen}' is described, and the tests are of {' and '.join(names)}")
    if changes and len(rigs) > 1 and specimen is None:
        raise FitError(f"the tests are of {' and '.join(names)}: say by specimen whose rig is described")
    return [rig.changed(changes) if rig.specimen == (specimen or names[0]) else rig for rig in rigs]


def rigs_of(histories: Sequence[History], predictor: Predictor) -> tuple[Rig, ...]:
    """For each specimen among the tests that were made, a rig that can do a little more than what it did.

    Levels from 0.7 times the least to 1.4 times the greatest, tests twice as long, the same temperatures, one test
    piece a run; the thickness that the tests or the specimen state, and 10 % less and more.
    """
    specimens = dict.fromkeys(h.specimen for h in histories)
    return tuple(_rig_of([h for h in histories if h.specimen == name], predictor) for name in specimens)


def _rig_of(tests: Sequence[History], predictor: Predictor) -> Rig:
    levels = np.concatenate([h.loading.program().values for h in tests])
    levels = levels[levels > 0]
    if not levels.size:
        raise FitError(f"tests of specimen '{tests[0].specimen}' hold no load above zero; say what the rig can do")
    temperatures: list[float] = []
    for T in sorted(value for h in tests for value in held_temperatures(h)):
        if not temperatures or T - temperatures[-1] > ROUNDED_TEMPERATURE:
            temperatures.append(round(T, 2))
    largest = max(_largest_output(h, predictor) for h in tests)
    return Rig(
        specimen=tests[0].specimen,
        levels=(LOWER_LEVEL * float(levels.min()), HIGHER_LEVEL * float(levels.max())),
        longest_hours=EXTENSION * max(float(h.times[-1]) for h in tests) / 3600.0,
        temperatures=tuple(temperatures),
        dimensions=_dimensions(tests, predictor),
        frame_interval=min(float(np.median([h.times[-1] / h.times.size for h in tests])), LONGEST_INTERVAL),
        largest_output=LARGEST_GROWTH * largest if largest > 0 else float("inf"),
    )


def rigs_for(fit: Identification, rig: Rig | Sequence[Rig] | None) -> tuple[Rig, ...]:
    """The rigs given, or those that the tests suggest; FitError for one of another specimen."""
    assert fit.predictor is not None
    if rig is None:
        return rigs_of(fit.histories, fit.predictor)
    rigs = (rig,) if isinstance(rig, Rig) else tuple(rig)
    if not rigs:
        raise FitError("rig= takes a ck.Rig, or several in a list; found none")
    known = dict.fromkeys(h.specimen for h in fit.histories)
    for one in rigs:
        if one.specimen not in known:
            raise FitError(
                f"the rig tests specimen '{one.specimen}', but the law was identified from tests of "
                f"{' and '.join(repr(name) for name in known)}"
            )
        check_dimensions(one, fit)
    return rigs


def check_dimensions(rig: Rig, fit: Identification) -> None:
    """FitError for a dimension that the test pieces of a rig do not have."""
    assert fit.predictor is not None
    history = next(h for h in fit.histories if h.specimen == rig.specimen)
    predictor = fit.predictor.for_history(history)
    known = [d.name for d in dimensions_of(predictor)]
    for name in rig.dimensions:
        if name not in history.geometry and name not in known:
            listed = f"; it has {', '.join(known)}" if known else ""
            raise FitError(f"a test piece of '{rig.specimen}' has no dimension '{name}'{listed}")


def _largest_output(history: History, predictor: Predictor) -> float:
    """The largest value of the leading output, in its unit."""
    outputs = predictor.for_history(history).outputs_of_test(history) or tuple(history.outputs)
    values = next((history.outputs[name] for name in outputs if name in history.outputs), np.zeros(1))
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else 0.0


def _dimensions(tests: Sequence[History], predictor: Predictor) -> dict[str, tuple[float, ...]]:
    """The length of the tests that is known least exactly, as they or the specimen state it; a single one is varied."""
    known = max(dimensions_of(predictor.for_history(tests[0])), key=lambda d: d.tolerance, default=None)
    if known is None or known.tolerance == 0.0:
        return {}
    own = [dimension_named(predictor.for_history(h), known.name) or known for h in tests]
    values = sorted({round(float(h.geometry.get(d.name, d.default)), 4) for h, d in zip(tests, own, strict=True)})
    varied = [round(r * values[0], 4) for r in VARIED_RATIOS] if len(values) == 1 else values
    return {known.name: tuple(varied)}


MOST_VALUES = 20
"""Temperatures of a rig, and values of one dimension."""


LONGEST_DIMENSION = 1e4
"""mm."""


FEWEST_FRAMES, MOST_FRAMES = 8, 60
"""Frames of a planned test: one each interval of the rig's frames; no test is shorter than the first of these, and what
more frames than the second would tell is not counted."""


LEVELS, DURATIONS, CHANGE_AT = 5, 6, 1.0 / 3.0
"""Of the grid: levels between the least and the greatest, durations up to the longest, and when the load is changed."""


SHORTEST = 1.0 / 30.0
"""Duration over the longest."""


LARGEST_CHANGE = 2.0
"""Ratio of two levels of one test."""


@dataclass(frozen=True)
class CandidateTest:
    """A run of the machine that could be made.

    description : in words. histories : the test or tests that it holds, without outputs, which share the oven.
    hours : h of machine time.
    """

    description: str
    histories: tuple[History, ...]
    hours: float

    @property
    def duration(self) -> float:
        """s, of its longest test."""
        return max(float(h.times[-1]) for h in self.histories)

    @property
    def first_level(self) -> float:
        """The first load above zero of its first test."""
        levels = self.histories[0].loading.program().values
        return float(levels[levels > 0][0])


def grid_of_rig(
    rig: Rig, base: History, *, budget: float = np.inf, by_temperature: bool = True, of: str = ""
) -> list[CandidateTest]:
    """What a rig can make: constant loads and changes of load, durations, temperatures and dimensions.

    base : a test that was made of that specimen; what is not varied is as there. budget : h, the most that one may
    take. by_temperature : whether the temperature is varied, else that of `base`. of : to say of the material.
    """
    longest = min(rig.longest_hours, budget - rig.setup_hours) * 3600.0
    if longest <= 0:
        raise FitError(f"a budget of {budget:g} h leaves no time for a test beside {rig.setup_hours:g} h to set it up")
    quantity = base.loading.quantity
    if quantity == NOT_PLANNED:
        raise FitError(f"no further tests are known for a loading by {quantity}; give candidates=, a list of histories")
    temperatures: tuple[float, ...] = rig.temperatures if by_temperature else (base.mean_temperature,)
    pieces = [*_test_pieces(rig, base)]
    candidates = []
    for duration, T in product(_durations(rig, longest), temperatures):
        for loading, text in _loadings(rig, base, duration):
            at_temperature = f" at {celsius_text(T)}" if len(temperatures) > 1 else ""
            whole = f"{text} {time_text(duration)}{at_temperature}{of}"
            times = frame_times(duration, rig.frame_interval)
            for dimensions, pieces_text in pieces:
                description = f"{pieces_text} at {whole}" if pieces_text else whole
                histories = tuple(
                    base.replace(
                        times=times,
                        outputs={},
                        standard_deviation={},
                        loading=loading,
                        temperature=T,
                        geometry={**base.geometry, **one},
                        name=f"plan: {description}" + (f", {k + 1}" if len(dimensions) > 1 else ""),
                        specimen=rig.specimen,
                    )
                    for k, one in enumerate(dimensions)
                )
                candidates.append(CandidateTest(description, histories, duration / 3600.0 + rig.setup_hours))
    return candidates


def _durations(rig: Rig, longest: float) -> list[float]:
    """Of the grid, s, geometric; the shortest has FEWEST_FRAMES."""
    shortest = min(longest, max(SHORTEST * longest, FEWEST_FRAMES * rig.frame_interval))
    count = int(np.clip(np.ceil(np.log2(longest / shortest)) + 1, 1, DURATIONS))
    return [float(duration) for duration in np.geomspace(longest, shortest, count)[::-1]]


def frame_times(duration: float, interval: float) -> Floats:
    """(frames,) s, of a planned test: frames at their interval, at least FEWEST_FRAMES and at most MOST_FRAMES."""
    count = int(np.clip(round(duration / interval), FEWEST_FRAMES, MOST_FRAMES))
    return np.asarray(np.arange(1, count + 1) * (duration / count), float)


def _test_pieces(rig: Rig, base: History) -> Iterator[tuple[tuple[dict[str, float], ...], str]]:
    """The test pieces of one run, as lengths that differ from those of `base`: each alone, then several at once."""
    if not rig.dimensions:
        count = rig.tests_per_run
        yield from (((({},) * k), "" if k == 1 else f"{k} specimens") for k in sorted({1, count}))
        return
    for name, values in rig.dimensions.items():
        label = name.replace("_", " ")
        for value in values:
            yield ({name: value},), f"a test piece of {label} {value:.3g} mm"
        for count in sorted({min(rig.tests_per_run, 2), rig.tests_per_run} - {1}):
            chosen = [values[k] for k in np.linspace(0, len(values) - 1, min(count, len(values))).round().astype(int)]
            chosen = [chosen[k % len(chosen)] for k in range(count)]
            thicknesses = ", ".join(f"{v:.3g}" for v in chosen[:-1]) + f" and {chosen[-1]:.3g}"
            yield tuple({name: value} for value in chosen), f"{count} test pieces of {label} {thicknesses} mm"


def _levels(rig: Rig) -> list[float]:
    low, high = rig.levels
    return [float(f"{level:.3g}") for level in np.geomspace(low, high, LEVELS if high > low else 1)]


def _pairs(rig: Rig) -> Iterator[tuple[float, float]]:
    """Neighbouring levels up, two levels apart up, and neighbours down."""
    levels = _levels(rig) if rig.load_changes else []
    for first, second in product(levels, levels):
        if first != second and max(first / second, second / first) <= LARGEST_CHANGE:
            yield first, second


def _loadings(rig: Rig, base: History, duration: float) -> Iterator[tuple[Loading, str]]:
    """Levels held, and changes of level after a time; with the ramp and the control of `base`.

    Each in words, which the description of the test goes on with.
    """
    quantity, change = base.loading.quantity, CHANGE_AT * duration
    factor, unit = (100.0, " % strain") if quantity == "strain" else (1.0, f" {load_unit(base)}".rstrip())
    ramp = None if quantity == "stress" else min(_ramp_of(base), 0.1 * duration)

    def made(value: float | TwoLevels, end: float) -> Loading:
        return loading_of(quantity, value, control=held_of(base.loading), ramp=ramp, end=end)

    for level in _levels(rig):
        yield made(level, 0.5 * duration), f"{factor * level:.3g}{unit} for"
    for first, second in _pairs(rig):
        text = f"{factor * first:.3g}{unit} to {time_text(change)}, then {factor * second:.3g}{unit} to"
        yield made(TwoLevels(first, second, change), duration), text


def _ramp_of(base: History) -> float:
    """s, in which the load of a test was reached."""
    if base.loading.quantity in ("pressure", "strain"):
        return float(getattr(base.loading, "ramp", 5.0 if base.loading.quantity == "pressure" else 0.0))
    program = base.loading.program()
    return float(program.times[1]) if program.values[0] == 0.0 and program.times.size > 1 else 0.0


NOT_PLANNED = "components"
"""The load of a material point: there are too many of it to plan."""


def candidates_given(histories: Sequence[History], rigs: Sequence[Rig]) -> list[CandidateTest]:
    """Planned tests that a user gives, with names of their own; FitError for one that no rig can make."""
    candidates = []
    for given in histories:
        rig = _rig_for(given, rigs)
        planned = replace(given, name=f"plan: {given.name}", outputs={}, standard_deviation={})
        hours = float(given.times[-1]) / 3600.0 + rig.setup_hours
        candidates.append(CandidateTest(given.name, (planned,), hours))
    return candidates


def _rig_for(history: History, rigs: Sequence[Rig]) -> Rig:
    """The rig of a planned test; FitError where none can make it."""
    rig = next((r for r in rigs if r.specimen == history.specimen), None)
    if rig is None:
        known = " and ".join(f"'{r.specimen}'" for r in rigs)
        raise FitError(
            f"the planned test '{history.name}' is of specimen '{history.specimen}', but the law was identified from "
            f"tests of {known}"
        )
    refusal = rig.refusal(history)
    if refusal:
        raise FitError(f"the planned test '{history.name}' cannot be made: {refusal}")
    return rig
