"""Candidates for further tests: variations of the tests that were made, within what the same equipment can do."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import predictor_for
from creepkit.records import (
    History,
    Loading,
    Predictor,
    PressureJump,
    StrainSteps,
    StressSteps,
    constant_strain,
    constant_stress,
)
from creepkit.records.loading import Quantity

ControlledQuantity = Literal["load", "stress"]


CANDIDATE_FRAMES = 40
"""Of a planned test, half spread over time and half over its logarithm."""


LOWER_LEVEL, HIGHER_LEVEL, EXTENSION = 0.7, 1.4, 2.0
"""Levels of further tests, over the lowest and the highest level of those made; and how much longer they may be."""


@dataclass(frozen=True)
class CandidateTest:
    """A test that could be made: its history, without outputs, and what it is in words."""

    description: str
    history: History


def candidate_tests(
    histories: Sequence[History], exponent: float = 0.0, predictor: Predictor | None = None
) -> tuple[CandidateTest, ...]:
    """Variations of tests that were made: other levels, a change of level, longer; of bulge tests, other thickness.

    Each is made on the longest test of its kind of loading. A bar at another stress is tested for a time that goes
    with stress^-exponent, so that it strains as much, but never for more than twice as long. The thickness that is
    varied is that of the history, else that of the specimen `predictor`.
    """
    candidates: list[CandidateTest] = []
    for quantity in dict.fromkeys(h.loading.quantity for h in histories):
        tests = [h for h in histories if h.loading.quantity == quantity]
        if quantity in _VARIATIONS:
            longest = _with_apex_thickness(max(tests, key=lambda h: float(h.times[-1])), predictor)
            levels = np.concatenate([h.loading.program().values for h in tests])
            candidates += _VARIATIONS[quantity](longest, levels[levels > 0], exponent)
    if not candidates:
        kinds = ", ".join(dict.fromkeys(h.loading.quantity for h in histories))
        raise FitError(f"no further tests are known for a loading by {kinds}; give designs=, a list of histories")
    return tuple(candidates)


def _with_apex_thickness(history: History, predictor: Predictor | None) -> History:
    """The history, stating the apex thickness of its specimen where that has one and the history does not say."""
    specimen = None if predictor is None else getattr(predictor_for(predictor, history), "geometry", None)
    nominal = getattr(specimen, "apex_thickness", None)
    if nominal is None or "apex_thickness" in history.geometry:
        return history
    return replace(history, geometry={**history.geometry, "apex_thickness": float(nominal)})


def candidate_test(
    base_history: History, description: str, loading: Loading, end_time: float, **changes: object
) -> CandidateTest:
    """A test like `base_history` under another loading, to `end_time`, s; without outputs."""
    first_time = float(base_history.times[base_history.times > 0][0]) * end_time / float(base_history.times[-1])
    times = np.unique(
        np.concatenate(
            [
                np.geomspace(first_time, end_time, CANDIDATE_FRAMES // 2),
                np.linspace(first_time, end_time, CANDIDATE_FRAMES // 2 + 1),
            ]
        )
    )
    history = base_history.replace(
        times=times, outputs={}, standard_deviation={}, loading=loading, name=f"plan: {description}"
    )
    return CandidateTest(description, replace(history, **changes) if changes else history)  # type: ignore[arg-type]


def _stress_variations(base_history: History, levels: Floats, exponent: float) -> Iterator[CandidateTest]:
    lowest, highest, end_time = float(levels.min()), float(levels.max()), float(base_history.times[-1])
    middle, base_level = float(np.sqrt(lowest * highest)), float(base_history.loading.program().values.max())
    control: ControlledQuantity = getattr(base_history.loading, "control", "stress")
    for level in (LOWER_LEVEL * lowest, HIGHER_LEVEL * highest, EXTENSION * highest):
        duration = end_time * min((level / base_level) ** -exponent, EXTENSION)
        yield candidate_test(
            base_history, f"{level:.3g} MPa for {_hours_text(duration)}", constant_stress(level, control), duration
        )
    for factor in (HIGHER_LEVEL, LOWER_LEVEL):
        change = StressSteps(((0.0, middle), (0.5 * end_time, factor * middle)), control)
        hold, end = _hours_text(0.5 * end_time), _hours_text(end_time)
        description = f"{middle:.3g} MPa, from {hold} on {factor * middle:.3g} MPa, for {end}"
        yield candidate_test(base_history, description, change, end_time)
    yield candidate_test(
        base_history,
        f"{middle:.3g} MPa for {_hours_text(EXTENSION * end_time)}",
        constant_stress(middle, control),
        EXTENSION * end_time,
    )


def _pressure_variations(base_history: History, levels: Floats, _: float) -> Iterator[CandidateTest]:
    lowest, highest, end_time = float(levels.min()), float(levels.max()), float(base_history.times[-1])
    ramp = float(getattr(base_history.loading, "ramp", 5.0))
    for level in (LOWER_LEVEL * lowest, LOWER_LEVEL * highest, HIGHER_LEVEL * highest):
        description = f"a constant {level:.3g} MPa for {_hours_text(end_time)}"
        yield candidate_test(base_history, description, PressureJump(level, level, 0.5 * end_time, ramp), end_time)
    for first, second in ((lowest, HIGHER_LEVEL * highest), (LOWER_LEVEL * lowest, HIGHER_LEVEL * highest)):
        description = (
            f"{first:.3g} MPa, from {_hours_text(0.5 * end_time)} on {second:.3g} MPa, for {_hours_text(end_time)}"
        )
        yield candidate_test(base_history, description, PressureJump(first, second, 0.5 * end_time, ramp), end_time)
    yield candidate_test(
        base_history,
        f"the same loading for {_hours_text(EXTENSION * end_time)}",
        base_history.loading,
        EXTENSION * end_time,
    )
    thickness = base_history.geometry.get("apex_thickness")
    for varied in () if thickness is None else (0.9 * thickness, 1.1 * thickness):
        geometry = {**base_history.geometry, "apex_thickness": varied}
        yield candidate_test(
            base_history,
            f"a dimple of {varied:.3g} mm under the same loading",
            base_history.loading,
            end_time,
            geometry=geometry,
        )


def _strain_variations(base_history: History, levels: Floats, _: float) -> Iterator[CandidateTest]:
    lowest, highest, end_time = float(levels.min()), float(levels.max()), float(base_history.times[-1])
    ramp = float(getattr(base_history.loading, "ramp", 0.0))
    for level in (LOWER_LEVEL * lowest, HIGHER_LEVEL * highest):
        yield candidate_test(
            base_history, f"a strain of {level:.3g} for {_hours_text(end_time)}", constant_strain(level, ramp), end_time
        )
    change = StrainSteps(((0.0, lowest), (0.5 * end_time, EXTENSION * highest)), ramp)
    yield candidate_test(
        base_history,
        f"a strain of {lowest:.3g}, from {_hours_text(0.5 * end_time)} on {EXTENSION * highest:.3g}",
        change,
        end_time,
    )
    yield candidate_test(
        base_history,
        f"the same strain for {_hours_text(EXTENSION * end_time)}",
        base_history.loading,
        EXTENSION * end_time,
    )


def _hours_text(seconds: float) -> str:
    return f"{seconds / 3600.0:.3g} h"


_VARIATIONS: dict[Quantity, Callable[[History, Floats, float], Iterator[CandidateTest]]] = {
    "stress": _stress_variations,
    "pressure": _pressure_variations,
    "strain": _strain_variations,
}
