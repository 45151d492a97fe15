"""Further tests that might separate laws: variations of the tests that were made, within reach of the same rig."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.together import predictor_of
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

Control = Literal["load", "stress"]

FRAMES = 40
"""Of a planned test, half spread over time and half over its logarithm."""
LOWER, HIGHER, FAR = 0.7, 1.4, 2.0
"""Levels of further tests, over the lowest and the highest level of those made; and how much longer they may be."""


@dataclass(frozen=True)
class Design:
    """A test that could be made: its history, without outputs, and what it is in words."""

    description: str
    history: History


def designs(histories: Sequence[History], exponent: float = 0.0, using: Predictor | None = None) -> tuple[Design, ...]:
    """Variations of tests that were made: other levels, a change of level, longer; of bulge tests, other thickness.

    Each is made on the longest test of its kind of loading. A bar at another stress is tested for a time that goes
    with stress^-exponent, so that it strains as much, but never for more than twice as long. The thickness that is
    varied is that of the history, else that of the specimen `using`.
    """
    found: list[Design] = []
    for quantity in dict.fromkeys(h.loading.quantity for h in histories):
        tests = [h for h in histories if h.loading.quantity == quantity]
        if quantity in _VARIATIONS:
            base = _with_thickness(max(tests, key=lambda h: float(h.times[-1])), using)
            levels = np.concatenate([h.loading.program().values for h in tests])
            found += _VARIATIONS[quantity](base, levels[levels > 0], exponent)
    if not found:
        kinds = ", ".join(dict.fromkeys(h.loading.quantity for h in histories))
        raise FitError(f"no further tests are known for a loading by {kinds}; give designs=, a list of histories")
    return tuple(found)


def _with_thickness(history: History, using: Predictor | None) -> History:
    """The history, stating the apex thickness of its specimen where that has one and the history does not say."""
    specimen = None if using is None else getattr(predictor_of(using, history), "geometry", None)
    usual = getattr(specimen, "apex_thickness", None)
    if usual is None or "apex_thickness" in history.geometry:
        return history
    return replace(history, geometry={**history.geometry, "apex_thickness": float(usual)})


def planned(base: History, description: str, loading: Loading, end: float, **changes: object) -> Design:
    """A test like `base` under another loading, to the time `end`, s; without outputs."""
    first = float(base.times[base.times > 0][0]) * end / float(base.times[-1])
    times = np.unique(np.concatenate([np.geomspace(first, end, FRAMES // 2), np.linspace(first, end, FRAMES // 2 + 1)]))
    blank = base.replace(times=times, outputs={}, standard_deviation={}, loading=loading, name=f"plan: {description}")
    return Design(description, replace(blank, **changes) if changes else blank)  # type: ignore[arg-type]


def _of_stress(base: History, levels: Floats, exponent: float) -> Iterator[Design]:
    low, high, end = float(levels.min()), float(levels.max()), float(base.times[-1])
    middle, own = float(np.sqrt(low * high)), float(base.loading.program().values.max())
    control: Control = getattr(base.loading, "control", "stress")
    for level in (LOWER * low, HIGHER * high, FAR * high):
        lasting = end * min((level / own) ** -exponent, FAR)
        yield planned(base, f"{level:.3g} MPa for {_hours(lasting)}", constant_stress(level, control), lasting)
    for factor in (HIGHER, LOWER):
        change = StressSteps(((0.0, middle), (0.5 * end, factor * middle)), control)
        told = f"{middle:.3g} MPa, from {_hours(0.5 * end)} on {factor * middle:.3g} MPa, for {_hours(end)}"
        yield planned(base, told, change, end)
    yield planned(base, f"{middle:.3g} MPa for {_hours(FAR * end)}", constant_stress(middle, control), FAR * end)


def _of_pressure(base: History, levels: Floats, _: float) -> Iterator[Design]:
    low, high, end = float(levels.min()), float(levels.max()), float(base.times[-1])
    ramp = float(getattr(base.loading, "ramp", 5.0))
    for level in (LOWER * low, LOWER * high, HIGHER * high):
        told = f"a constant {level:.3g} MPa for {_hours(end)}"
        yield planned(base, told, PressureJump(level, level, 0.5 * end, ramp), end)
    for first, second in ((low, HIGHER * high), (LOWER * low, HIGHER * high)):
        told = f"{first:.3g} MPa, from {_hours(0.5 * end)} on {second:.3g} MPa, for {_hours(end)}"
        yield planned(base, told, PressureJump(first, second, 0.5 * end, ramp), end)
    yield planned(base, f"the same loading for {_hours(FAR * end)}", base.loading, FAR * end)
    thickness = base.geometry.get("apex_thickness")
    for other in () if thickness is None else (0.9 * thickness, 1.1 * thickness):
        geometry = {**base.geometry, "apex_thickness": other}
        yield planned(base, f"a dimple of {other:.3g} mm under the same loading", base.loading, end, geometry=geometry)


def _of_strain(base: History, levels: Floats, _: float) -> Iterator[Design]:
    low, high, end = float(levels.min()), float(levels.max()), float(base.times[-1])
    ramp = float(getattr(base.loading, "ramp", 0.0))
    for level in (LOWER * low, HIGHER * high):
        yield planned(base, f"a strain of {level:.3g} for {_hours(end)}", constant_strain(level, ramp), end)
    change = StrainSteps(((0.0, low), (0.5 * end, FAR * high)), ramp)
    yield planned(base, f"a strain of {low:.3g}, from {_hours(0.5 * end)} on {FAR * high:.3g}", change, end)
    yield planned(base, f"the same strain for {_hours(FAR * end)}", base.loading, FAR * end)


def _hours(seconds: float) -> str:
    return f"{seconds / 3600.0:.3g} h"


_VARIATIONS: dict[Quantity, Callable[[History, Floats, float], Iterator[Design]]] = {
    "stress": _of_stress,
    "pressure": _of_pressure,
    "strain": _of_strain,
}
