"""Candidates for further tests: runs of the machine that a rig can make, and tests that a user plans."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.experiments.rig import Rig
from creepkit.records import History, Loading, TwoLevels, load_unit, loading_of
from creepkit.records.units import celsius_text, time_text

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


def grid_of_rig(rig: Rig, base: History, *, budget: float = np.inf, by_temperature: bool = True) -> list[CandidateTest]:
    """What a rig can make: constant loads and changes of load, durations, temperatures and dimensions.

    base : a test that was made of that specimen; what is not varied is as there. budget : h, the most that one may
    take. by_temperature : whether the temperature is varied, else it is that of `base`.
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
            whole = f"{text} {time_text(duration)}{at_temperature}"
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
    unit = "" if quantity == "strain" else f" {load_unit(base)}".rstrip()
    ramp = None if quantity == "stress" else min(_ramp_of(base), 0.1 * duration)
    control: Literal["load", "stress"] = getattr(base.loading, "control", "stress")

    def made(value: float | TwoLevels, end: float) -> Loading:
        return loading_of(quantity, value, control=control, ramp=ramp, end=end)

    prefix = "a strain of " if quantity == "strain" else ""
    for level in _levels(rig):
        yield made(level, 0.5 * duration), f"{prefix}{level:.3g}{unit} for"
    for first, second in _pairs(rig):
        text = f"{prefix}{first:.3g}{unit} to {time_text(change)}, then {second:.3g}{unit} to"
        yield made(TwoLevels(first, second, change), duration), text


def _ramp_of(base: History) -> float:
    """s, in which the load of a test was reached."""
    if base.loading.quantity in ("pressure", "strain"):
        return float(getattr(base.loading, "ramp", 5.0 if base.loading.quantity == "pressure" else 0.0))
    program = base.loading.program()
    return float(program.times[1]) if program.values[0] == 0.0 and program.times.size > 1 else 0.0


NOT_PLANNED = "components"
"""The load of a material point: there are too many of it to plan."""


def candidates_given(histories: Sequence[History | CandidateTest], rigs: Sequence[Rig]) -> list[CandidateTest]:
    """Planned tests that a user gives, with names of their own; FitError for one that no rig can make."""
    candidates = []
    for given in histories:
        if isinstance(given, CandidateTest):
            if not (given.histories and 0 < given.hours < np.inf):
                raise FitError(f"the planned test '{given.description}' needs a history and a machine time above zero")
            for history in given.histories:
                _rig_for(history, rigs)
            candidates.append(given)
            continue
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
