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

ROOM = ZERO_CELSIUS + 20.0
"""K; the temperature of tests of laws that do not depend on it."""

BULGE, UNIAXIAL = "bulge", "uniaxial"

UNITS = {
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

KNOWN = {
    BULGE: ("modulus", "P1", "P2", "Tj", "end_time", "apex_thickness", "temperature"),
    UNIAXIAL: ("stress_1", "stress_2", "Tj", "end_time", "temperature"),
}
"""Conditions of each kind of specimen."""

NEEDED = {BULGE: ("modulus", "P1"), UNIAXIAL: ("stress_1",)}

LEVELS = {BULGE: ("P1", "P2"), UNIAXIAL: ("stress_1", "stress_2")}
"""The two levels of the load."""


def kind_of(specimen: Specimen) -> str:
    """Which kind of test a specimen is put through: bulge or uniaxial (stand-ins say so before a comma)."""
    kind = specimen.name.split(",")[0]
    if kind not in KNOWN:
        raise DatasetError(f"no design knows how to load a specimen '{specimen.name}'; {nearest(kind, KNOWN)}")
    return kind


def plan(specimen: Specimen, conditions: Mapping[str, float], grid: TimeGrid, name: str = "sample") -> History:
    """Return the test that conditions describe, without outputs: all times of the grid up to its end."""
    kind = kind_of(specimen)
    check_names(kind, conditions)
    for needed in NEEDED[kind]:
        if needed not in conditions:
            raise DatasetError(f"a {kind} test needs the condition '{needed}' ({UNITS[needed]}); it is missing")
    end = float(conditions["end_time"]) if "end_time" in conditions else grid.end
    times = grid.times(end)
    levels, jump = _levels(kind, conditions, end)
    thickness = {"apex_thickness": conditions["apex_thickness"]} if "apex_thickness" in conditions else {}
    return History(
        name=name,
        times=times[times <= end * (1 + 1e-12)],
        outputs={},
        loading=PressureJump(*levels, jump) if kind == BULGE else _steps(levels, jump),
        temperature=conditions.get("temperature", ROOM),
        specimen=kind,
        elastic=Elastic(conditions["modulus"]) if kind == BULGE else None,
        geometry=thickness,
    )


def mark_times(test: History) -> Floats:
    """When the holds of a planned test begin and end, (4,) s: after the first ramp, before and after the jump, the end.

    Growth between two of them is creep: no elastic jump lies within a hold.
    """
    end = float(test.times[-1])
    if isinstance(test.loading, PressureJump):
        ramp, jump = test.loading.ramp, test.loading.Tj
        return np.minimum([ramp, jump, jump + ramp, end], end)
    starts = [t for t, _ in getattr(test.loading, "steps", ())]
    jump = starts[1] if len(starts) > 1 else end
    return np.minimum([0.0, jump, jump, end], end)


def check_names(kind: str, names: Mapping[str, object]) -> None:
    """DatasetError where a condition is none of a kind of specimen."""
    for name in names:
        if name not in KNOWN[kind]:
            raise DatasetError(f"a {kind} test has no condition '{name}': {nearest(name, KNOWN[kind])}")


def _levels(kind: str, conditions: Mapping[str, float], end: float) -> tuple[tuple[float, float], float]:
    """Both levels and when the second begins; without a jump the level stays."""
    first, second = LEVELS[kind]
    if (second in conditions) != ("Tj" in conditions):
        raise DatasetError(f"a jump of a {kind} test needs both {second} and Tj; give both or neither")
    low = float(conditions[first])
    return (low, float(conditions.get(second, low))), float(conditions.get("Tj", 0.5 * end))


def _steps(levels: tuple[float, float], jump: float) -> StressSteps:
    if levels[0] == levels[1]:
        return StressSteps(((0.0, levels[0]),))
    return StressSteps(((0.0, levels[0]), (jump, levels[1])))
