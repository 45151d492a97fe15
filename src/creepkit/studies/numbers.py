"""Numbers of a stage's result that study.lock records, so that a run says whether it gives them again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from creepkit.files.record_codec import record_to_json
from creepkit.studies.stages import StageKind

SAME_NUMBER = 1e-6
"""Relative difference up to which two numbers are taken as equal: other processors round otherwise."""


class Missing:
    """Stands for a number that one side does not have."""


MISSING = Missing()


def numbers_of(kind: StageKind, result: Any) -> dict[str, Any]:
    """The numbers of a result by name, as JSON holds them."""
    found: dict[str, Any]
    if kind == "extraction":
        found = {
            one.name: {
                "frames": int(one.used.sum()),
                "centre": one.center,
                **{name: float(values[one.used][-1]) for name, values in one.outputs.items() if one.used.any()},
            }
            for one in result.tests
        }
    elif kind == "record":
        found = {
            f"{k + 1}": {"lag_s": one.alignment.lag, "interval_s": one.alignment.lag_interval, "zero_s": one.time_zero}
            for k, one in enumerate(result.tests)
        }
    elif kind == "identification":
        found = {"weights": {one.fit.law.name: one.weight for one in result.laws}}
        found["values"] = {one.fit.law.name: one.fit.values for one in result.laws}
    elif kind == "temperature":
        found = {"forms": result.temperature_law.forms, "values": result.temperature_law.values}
    elif kind == "rupture":
        found = {
            f"{one.method} {one.hours:g} h {one.temperature:g} K": one.value
            for one in result.strengths
            if one.value is not None
        }
    elif kind == "forecast":
        found = {
            test.name: {
                **{name: float(output.value[-1]) for name, output in test.outputs.items()},
                **{time.event: [time.value, time.low, time.high] for time in test.times},
            }
            for test in result.tests
        }
    elif kind == "design":
        found = {"plan": [test.description for test in result.plan]}
    else:
        found = {}
    numbers: dict[str, Any] = record_to_json(found)
    return numbers


def changed_numbers(old: Any, new: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """(name, old, new) of numbers and texts that differ by more than rounding; MISSING where there is none."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in [*old, *(one for one in new if one not in old)]:
            yield from changed_numbers(old.get(key, MISSING), new.get(key, MISSING), f"{place} {key}".strip())
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for first, second in zip(old, new, strict=True):
            yield from changed_numbers(first, second, place)
    elif isinstance(old, int | float) and isinstance(new, int | float):
        if not math.isclose(old, new, rel_tol=SAME_NUMBER, abs_tol=1e-300):
            yield place, old, new
    elif old != new:
        yield place, old, new
