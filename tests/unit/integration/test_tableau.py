"""The tableaux keep the order that they declare: by the conditions of rooted trees, and as measured."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from creepkit.core import address, function
from creepkit.integration.core_structures import tableau_structure
from creepkit.integration.time_discretisation import SDIRK2, SDIRK4, Tableau
from creepkit.kernels import lower
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from helpers.implicit_stage import SOLVED

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


def in_equal_steps(theta: np.ndarray, tableau: Tableau, steps: int, segment: list[float], start: float) -> np.ndarray:
    """Strain at the end of a segment and at 0.3 of the first step, from `start`; strain hardening."""
    out, program = np.zeros(2), np.array(segment)
    flag = function("creepkit_integrate_in_equal_steps")(
        ctypes.c_void_p(lower(STRAIN_HARDENING, "compiled").update.address),
        address(theta),
        ctypes.byref(tableau_structure(tableau)),
        address(program),
        ctypes.c_double(start),
        ctypes.c_int64(steps),
        ctypes.c_double(1e-9),
        ctypes.c_double(0.3),
        address(out),
    )
    assert flag == SOLVED
    return out


@TABLEAUX
def test_measured_order_of_step_and_dense_output(tableau: Tableau) -> None:
    """p' = A s^n p^m under constant true stress from p(0) = p0: p^(1-m) is a straight line in time."""
    A, n, m, stress, start, length = 1e-12, 3.0, -0.6, 100.0, 0.2, 2e5
    theta = STRAIN_HARDENING.to_internal({"A": A, "n": n, "m": m})[0]

    def exact(times: np.ndarray) -> np.ndarray:
        return np.asarray((start ** (1 - m) + (1 - m) * A * stress**n * times) ** (1 / (1 - m)))

    errors = []
    for steps in (16, 32):
        found = in_equal_steps(theta, tableau, steps, [0.0, length, stress, stress, 1000.0, 1000.0], start)
        errors.append(np.abs(found - exact(length * np.array([1.0, 0.3 / steps]))))
    slope, dense_slope = np.log2(errors[0] / errors[1])
    assert slope == pytest.approx(tableau.order, abs=0.2)
    assert dense_slope == pytest.approx(tableau.dense_order + 1, abs=0.35)
