"""The conditions of a sample, by name, and the test they describe.

One meaning everywhere, of a bulge test: modulus (MPa), P1, P2 (MPa), Tj (s), end_time (s), apex_thickness (mm); of a
bar in tension: stress_1, stress_2 (MPa), Tj (s), end_time (s); of both: temperature (K). A condition that is absent has
its default: the grid's last time, the specimen's own thickness, 293.15 K, no jump.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import DatasetError, nearest
from creepkit.language import Elastic
from creepkit.records import History, PressureJump, Specimen, StressSteps
from creepkit.records.history import ZERO_CELSIUS

ROOM_TEMPERATURE = ZERO_CELSIUS + 20.0
"""K; the temperature of tests of laws that do not depend on it."""

BULGE, UNIAXIAL = "bulge", "uniaxial"

CONDITION_UNITS = {
    "modulus": "MPa",
    "P1": "MPa",
    "P2": "MPa",
    "stress_1": "MPa",
    "stress_2": "MPa",
    "Tj": "s",
    "end_time": "s",
    "apex_thickness": "mm",
    "temperature": "K",
}

CONDITIONS = {
    BULGE: ("modulus", "P1", "P2", "Tj", "end_time", "apex_thickness", "temperature"),
    UNIAXIAL: ("stress_1", "stress_2", "Tj", "end_time", "temperature"),
}
"""Conditions of each kind of specimen."""

REQUIRED = {BULGE: ("modulus", "P1"), UNIAXIAL: ("stress_1",)}

LOAD_LEVELS = {BULGE: ("P1", "P2"), UNIAXIAL: ("stress_1", "stress_2")}
"""The two levels of the load."""


def test_kind(specimen: Specimen) -> str:
    """Which kind of test a specimen is put through: bulge or uniaxial (stand-ins say so before a comma)."""
    kind = specimen.name.split(",")[0]
    if kind not in CONDITIONS:
        raise DatasetError(f"no design knows how to load a specimen '{specimen.name}'; {nearest(kind, CONDITIONS)}")
    return kind


def planned_test(specimen: Specimen, conditions: Mapping[str, float], grid: TimeGrid, name: str = "sample") -> History:
    """Return the test that conditions describe, without outputs: all times of the grid up to its end."""
    kind = test_kind(specimen)
    check_condition_names(kind, conditions)
    for required in REQUIRED[kind]:
        if required not in conditions:
            raise DatasetError(f"a {kind} test needs the condition '{required}' ({CONDITION_UNITS[required]}); it is missing")
    end = float(conditions["end_time"]) if "end_time" in conditions else grid.end
    times = grid.times(end)
    levels, jump = _load_levels(kind, conditions, end)
    geometry = {"apex_thickness": conditions["apex_thickness"]} if "apex_thickness" in conditions else {}
    return History(
        name=name,
        times=times[times <= end * (1 + 1e-12)],
        outputs={},
        loading=PressureJump(*levels, jump) if kind == BULGE else _stress_steps(levels, jump),
        temperature=conditions.get("temperature", ROOM_TEMPERATURE),
        specimen=kind,
        elastic=Elastic(conditions["modulus"]) if kind == BULGE else None,
        geometry=geometry,
    )


def hold_times(test: History) -> Floats:
    """When the holds of a planned test begin and end, (4,) s: after the first ramp, before and after the jump, the end.

    Growth between two of them is creep: no elastic jump lies within a hold.
    """
    end = float(test.times[-1])
    if isinstance(test.loading, PressureJump):
        ramp, jump_time = test.loading.ramp, test.loading.Tj
        return np.minimum([ramp, jump_time, jump_time + ramp, end], end)
    step_times = [t for t, _ in getattr(test.loading, "steps", ())]
    jump_time = step_times[1] if len(step_times) > 1 else end
    return np.minimum([0.0, jump_time, jump_time, end], end)


def check_condition_names(kind: str, names: Mapping[str, object]) -> None:
    """DatasetError where a condition is none of a kind of specimen."""
    for name in names:
        if name not in CONDITIONS[kind]:
            raise DatasetError(f"a {kind} test has no condition '{name}': {nearest(name, CONDITIONS[kind])}")


def _load_levels(kind: str, conditions: Mapping[str, float], end: float) -> tuple[tuple[float, float], float]:
    """Both levels and when the second begins; without a jump the level stays."""
    first_name, second_name = LOAD_LEVELS[kind]
    if (second_name in conditions) != ("Tj" in conditions):
        raise DatasetError(f"a jump of a {kind} test needs both {second_name} and Tj; give both or neither")
    first_level = float(conditions[first_name])
    return (first_level, float(conditions.get(second_name, first_level))), float(conditions.get("Tj", 0.5 * end))


def _stress_steps(levels: tuple[float, float], jump_time: float) -> StressSteps:
    if levels[0] == levels[1]:
        return StressSteps(((0.0, levels[0]),))
    return StressSteps(((0.0, levels[0]), (jump_time, levels[1])))
