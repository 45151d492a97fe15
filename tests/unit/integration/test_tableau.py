"""The tableaux keep the order that they declare: by the conditions of rooted trees, and as measured."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.integration.time_discretisation import SDIRK2, SDIRK4, Tableau, merge_programs
from creepkit.records import Program

TABLEAUX = pytest.mark.parametrize("tableau", [SDIRK2, SDIRK4], ids=["SDIRK2", "SDIRK4"])


def trees(tableau: Tableau, weights: np.ndarray) -> dict[int, list[tuple[float, float]]]:
    """{order: [(sum over the tree, 1/density)]} for every rooted tree up to order 4 (Butcher)."""
    a, c = tableau.a, tableau.c
    return {
        1: [(weights.sum(), 1)],
        2: [(weights @ c, 1 / 2)],
        3: [(weights @ c**2, 1 / 3), (weights @ a @ c, 1 / 6)],
        4: [
            (weights @ c**3, 1 / 4),
            (weights @ (c * (a @ c)), 1 / 8),
            (weights @ a @ c**2, 1 / 12),
            (weights @ a @ a @ c, 1 / 24),
        ],
    }


@TABLEAUX
def test_weights_meet_the_order_conditions_and_no_more(tableau: Tableau) -> None:
    for order, conditions in trees(tableau, tableau.a[-1]).items():
        if order <= tableau.order:
            for total, target in conditions:
                assert total == pytest.approx(target, abs=1e-14)
    embedded = trees(tableau, tableau.a[-1] - tableau.error)
    for order in range(1, tableau.error_order + 1):
        for total, target in embedded[order]:
            assert total == pytest.approx(target, abs=1e-14)
    missed = [abs(total - target) for total, target in embedded[tableau.error_order + 1]]
    assert max(missed) > 1e-3, "an embedded method of the same order estimates nothing"


@TABLEAUX
@pytest.mark.parametrize("x", [0.1, 0.5, 0.9, 1.0])
def test_dense_output_meets_its_order_conditions_everywhere(tableau: Tableau, x: float) -> None:
    weights = tableau.dense @ x ** np.arange(1, tableau.dense.shape[1] + 1)
    for order in range(1, tableau.dense_order + 1):
        for total, target in trees(tableau, weights)[order]:
            assert total == pytest.approx(target * x**order, abs=1e-13)


@TABLEAUX
def test_the_method_is_stiffly_accurate_and_l_stable(tableau: Tableau) -> None:
    assert tableau.c[-1] == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(np.diag(tableau.a), tableau.gamma, rtol=1e-15)
    at_end = tableau.dense.sum(axis=1)
    np.testing.assert_allclose(at_end, tableau.a[-1], atol=1e-13)
    one, identity = np.ones(tableau.stages), np.eye(tableau.stages)
    for z in (1j * np.geomspace(1e-2, 1e3, 60)).tolist():
        growth = 1 + z * tableau.a[-1] @ np.linalg.solve(identity - z * tableau.a, one)
        assert abs(growth) <= 1 + 1e-12
    far = -1e9
    assert abs(1 + far * tableau.a[-1] @ np.linalg.solve(identity - far * tableau.a, one)) < 1e-7


# ---- segments --------------------------------------------------------------------------------------------------------

# Segments: every breakpoint of stress and temperature is a boundary, and jumps keep both their sides.


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
