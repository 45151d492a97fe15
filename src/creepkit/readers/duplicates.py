"""Tests that were published twice: they would count twice in a fit and sit on both sides of a validation split."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from creepkit.records import History, Program


def duplicate_tests(
    histories: Sequence[History], *, time_rounding: float = 1e-5, output_rounding: float = 1e-4
) -> list[tuple[str, str]]:
    """Return the names of every two histories that are one test: same condition, same end.

    The end is the last frame: its time and each output must agree to the relative roundings (two times of six digits
    may differ by 1e-5). Records of one test may differ elsewhere, since sources thin them in their own ways.
    """
    pairs = combinations(histories, 2)
    return [(a.name, b.name) for a, b in pairs if _same_test(a, b, time_rounding, output_rounding)]


def _same_test(a: History, b: History, time_rounding: float, output_rounding: float) -> bool:
    if a.specimen != b.specimen or a.outputs.keys() != b.outputs.keys():
        return False
    if not np.isclose(a.times[-1], b.times[-1], rtol=time_rounding, atol=0.0):
        return False
    if not all(np.isclose(a.outputs[k][-1], b.outputs[k][-1], rtol=output_rounding, atol=0.0) for k in a.outputs):
        return False
    return _same_program(a.loading.program(), b.loading.program()) and _same_program(a.temperature_program(), b.temperature_program())


def _same_program(a: Program, b: Program) -> bool:
    return a.times.shape == b.times.shape and np.allclose(a.times, b.times) and np.allclose(a.values, b.values)
