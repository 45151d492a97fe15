"""What a network sees of a test: numbers that stand for it, its load over time, and a summary for the domain guard."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SurrogateError
from creepkit.records import History, Program, Specimen

CONSTANTS = ("modulus", "apex_thickness", "temperature")
"""Conditions that do not change during a test: MPa, mm, K."""
SERIES = ("load", "mean_load", "time", "step")
"""Inputs at each frame: the load there, its mean since the frame before (MPa), log10 of 1 s + the time, and of 1 s +
the time since the frame before."""
DEGREE = 0.1
"""K, by which a modulus is differenced."""
UNNOTICED = 0.02
"""Mean deviation of a load from a jump, over its largest value, that is none."""
STEADY = 1.0
"""K by which the temperature of a test may drift."""


@dataclass(frozen=True, eq=False)
class CourseInputs:
    """Inputs that tests of one specimen give.

    constants : of CONSTANTS, those that the data set varied. series : of SERIES, those of the recipe. relative :
    whether frames are at shares of a test's end.
    """

    specimen: Specimen
    constants: tuple[str, ...]
    series: tuple[str, ...]
    relative: bool = False

    def numbers(self, history: History) -> Floats:
        """(constants,) of one test."""
        return np.array([_constant(name, history, self.specimen) for name in self.constants])

    def moved(self, history: History, effects: Mapping[str, Floats], count: int) -> tuple[Floats, dict[str, Floats]]:
        """(count, constants) of one test with effects, {kind: (count,)}, and {kind: derivatives}; see Nuisance."""
        numbers = np.tile(self.numbers(history), (count, 1))
        slopes = {kind: np.zeros_like(numbers) for kind in effects}
        place = {name: k for k, name in enumerate(self.constants)}
        if "thickness" in effects:
            numbers[:, place["apex_thickness"]] = effects["thickness"]
            slopes["thickness"][:, place["apex_thickness"]] = 1.0
        if "temperature" in effects:
            warmer = effects["temperature"]
            numbers[:, place["temperature"]] += warmer
            slopes["temperature"][:, place["temperature"]] = 1.0
            if "modulus" in place:
                ends = [_softened(history, warmer + step) for step in (0.0, -DEGREE, DEGREE)]
                numbers[:, place["modulus"]] = ends[0]
                slopes["temperature"][:, place["modulus"]] = (ends[2] - ends[1]) / (2 * DEGREE)
        if "modulus" in effects:
            factor, k = 1.0 + effects["modulus"], place["modulus"]
            slopes["modulus"][:, k] = numbers[:, k]
            numbers[:, k] *= factor
            if "temperature" in effects:
                slopes["temperature"][:, k] *= factor
        return numbers, slopes

    def over_time(self, history: History, times: Floats) -> Floats:
        """(frames, series) at the times of frames, s."""
        program = history.loading.program()
        return np.stack([_COLUMNS[name](program, times) for name in self.series], axis=1)

    def domain(self, history: History, times: Floats) -> Floats:
        """What the domain guard sees of a test, named by `domain_names`.

        The constants, and a thickness also where it did not vary; of the load over the frames the value at the first
        that is loaded, the last, the mean, and how unlike one jump from the first to the last it is; and where grids
        stretch with the test log10 of its end.
        """
        load = _loaded(history, times)
        course = [load[0], load[-1], load.mean(), _unlike_a_jump(load)]
        fixed = [thickness_of(history, self.specimen)] if self._has_fixed_thickness else []
        end = [np.log10(times[-1])] if self.relative else []
        return np.array([*self.numbers(history), *fixed, *course, *end])

    def domain_names(self, history: History) -> tuple[str, ...]:
        """Of what `domain` gives."""
        load = history.loading.quantity
        course = (f"first {load}", f"last {load}", f"mean {load}", f"{load} unlike one jump")
        fixed = ("apex_thickness",) if self._has_fixed_thickness else ()
        return (*self.constants, *fixed, *course, *(("log10 end_time",) if self.relative else ()))

    @property
    def _has_fixed_thickness(self) -> bool:
        geometry = getattr(self.specimen, "geometry", None)
        return "apex_thickness" not in self.constants and hasattr(geometry, "apex_thickness")


def _constant(name: str, history: History, specimen: Specimen) -> float:
    where = history.source or f"history '{history.name}'"
    warmth = history.temperature_program().values
    if name in ("modulus", "temperature") and np.ptp(warmth) > STEADY:
        raise SurrogateError(
            f"{where}: its temperature goes from {warmth.min():g} to {warmth.max():g} K; the surrogate was trained at "
            "temperatures that do not change, use the specimen itself"
        )
    if name == "temperature":
        return float(warmth.mean())
    if name == "modulus":
        if history.elastic is None:
            raise SurrogateError(f"{where}: the surrogate needs the modulus; set elastic=Elastic(E=150e3), in MPa")
        return float(history.elastic.at(float(warmth.mean())).E)
    return thickness_of(history, specimen)


def _softened(history: History, warmer: Floats) -> Floats:
    """The modulus, MPa, at the temperature of a test and so many K more."""
    assert history.elastic is not None  # _constant has complained
    T = float(history.temperature_program().values.mean())
    return np.array([float(history.elastic.at(T + float(step)).E) for step in warmer])


def thickness_of(history: History, specimen: Specimen) -> float:
    """The apex thickness of a test, mm: its own, or the specimen's."""
    geometry: Any = getattr(specimen, "geometry", None)
    return float(history.geometry.get("apex_thickness", getattr(geometry, "apex_thickness", np.nan)))


def _loaded(history: History, times: Floats) -> Floats:
    """The load from the first frame on that is loaded, MPa."""
    load = history.loading.program().at(times)
    loaded = np.flatnonzero(load > 0)
    return load[loaded[0] :] if loaded.size else load


def _unlike_a_jump(load: Floats) -> float:
    """Mean distance of a load from the nearest one that jumps from its first to its last value, over its largest.

    Zero below UNNOTICED: a recorded load is noisy, and a frame may lie on a ramp.
    """
    before, after = (np.abs(load - level) for level in (load[0], load[-1]))
    kept = np.concatenate([[0.0], np.cumsum(before)])
    left = np.concatenate([np.cumsum(after[::-1])[::-1], [0.0]])
    share = float((kept + left).min() / load.size / max(float(load.max()), 1e-300))
    return share if share > UNNOTICED else 0.0


def _means(program: Program, times: Floats) -> Floats:
    """Mean of a program since the time before, (times,); the first since zero, or the value at zero."""
    knots = np.union1d(program.times, times)
    after, before = program.at(np.nextafter(knots[:-1], np.inf)), program.at(np.nextafter(knots[1:], -np.inf))
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (after + before) * np.diff(knots))])
    steps, rises = (np.diff(v, prepend=0.0) for v in (times, integral[np.searchsorted(knots, times)]))
    return np.where(steps > 0, rises / np.where(steps > 0, steps, 1.0), program.at(times))


_COLUMNS: dict[str, Callable[[Program, Floats], Floats]] = {
    "load": lambda program, times: program.at(times),
    "mean_load": _means,
    "time": lambda program, times: np.log10(1.0 + times),
    "step": lambda program, times: np.log10(1.0 + np.diff(times, prepend=0.0)),
}
