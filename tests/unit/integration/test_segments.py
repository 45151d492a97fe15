"""Segments: every breakpoint of stress and temperature is a boundary, and jumps keep both their sides."""

from __future__ import annotations

import numpy as np

from creepkit.integration.time_discretisation import merge_programs
from creepkit.records import Program


def test_jumps_and_ramps_are_merged() -> None:
    stress = Program(np.array([0.0, 10.0, 10.0, 30.0]), np.array([50.0, 50.0, 80.0, 100.0]))
    temperature = Program(np.array([0.0, 20.0, 20.0]), np.array([900.0, 900.0, 950.0]))
    expected = [
        [0, 10, 50, 50, 900, 900],
        [10, 20, 80, 90, 900, 900],
        [20, 30, 90, 100, 950, 950],
        [30, 40, 100, 100, 950, 950],
    ]
    np.testing.assert_allclose(merge_programs(stress, temperature, end=40.0), expected)


def test_what_comes_after_the_end_is_left_out() -> None:
    stress = Program.steps([(0.0, 50.0), (100.0, 70.0)])
    np.testing.assert_allclose(merge_programs(stress, Program.constant(900.0), end=60.0), [[0, 60, 50, 50, 900, 900]])
    np.testing.assert_allclose(merge_programs(stress, Program.constant(900.0), end=100.0), [[0, 100, 50, 50, 900, 900]])
    assert merge_programs(stress, Program.constant(900.0), end=0.0).shape == (0, 6)
