"""The tableaux keep the order that they declare: by the conditions of rooted trees, and as measured."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from creepkit.core import address, function
from creepkit.integration.core_structures import tableau_structure
from creepkit.integration.time_discretisation import SDIRK2, SDIRK4, SMALLEST_EXPONENT, Tableau, merge_programs
from creepkit.kernels import lower
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import Program
from helpers.implicit_stage import SOLVED
from helpers.time_transformation import (
    TimeTransformation,
    power_law_transformation,
    shifted_power_law_transformation,
    transformed_times,
)

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


# ---- time transformation ---------------------------------------------------------------------------------------------

# Clocks: times and positions are inverse, derivatives are exact, and hardening becomes a straight line.


CLOCKS = [
    TimeTransformation(0.0, 1e5, 0.3, 0.0),
    TimeTransformation(0.0, 1e5, 0.05, 0.0),
    TimeTransformation(3e3, 1e5, 0.4, 2.0),
    TimeTransformation(3e3, 1e5, 0.4, 4e9),
    TimeTransformation(3e3, 1e5, -0.7, 5e2),
    TimeTransformation(7.0, 20.0, 1.0, 20.0),
]


@pytest.mark.parametrize("clock", CLOCKS)
def test_position_and_moment_are_inverse(clock: TimeTransformation) -> None:
    s = np.array([1e-3, 0.2, 0.7, 1.0])
    found = transformed_times(clock, s)
    np.testing.assert_allclose(found.position, s, rtol=1e-8)
    assert transformed_times(clock, 1e-300).position == pytest.approx(0.0, abs=1e-15)
    assert found.time[-1] == pytest.approx(clock.start + clock.length, rel=1e-14)


@pytest.mark.parametrize("clock", CLOCKS)
def test_pace_is_the_derivative_of_time(clock: TimeTransformation) -> None:
    s = np.array([0.1, 0.5, 0.9])
    h = 1e-5 * s
    difference = (transformed_times(clock, s + h).time - transformed_times(clock, s - h).time) / (2 * h)
    np.testing.assert_allclose(np.exp(transformed_times(clock, s).log_pace), difference, rtol=1e-6)


@pytest.mark.parametrize("clock", CLOCKS[:3] + CLOCKS[4:5])
def test_velocity_is_the_derivative_to_the_clock(clock: TimeTransformation) -> None:
    found = transformed_times(clock, 0.4)
    for field in ("beta", "tau"):
        value = getattr(clock, field)
        by_time, by_pace = getattr(found, f"time_by_{field}"), getattr(found, f"log_pace_by_{field}")
        if value == 0.0:
            assert (by_time, by_pace) == (0.0, 0.0)
            continue
        h = 1e-5 * value
        up, down = (transformed_times(clock._replace(**{field: value + d}), 0.4) for d in (h, -h))
        assert by_time == pytest.approx((up.time - down.time) / (2 * h), rel=1e-6)
        assert by_pace == pytest.approx((up.log_pace - down.log_pace) / (2 * h), rel=1e-6)


@pytest.mark.parametrize(("exponent", "lag"), [(0.4, 50.0), (0.9, 3e4), (-0.5, 1e3)])
def test_a_shifted_power_of_time_gives_its_own_clock(exponent: float, lag: float) -> None:
    """For p = (1 + y/lag)^exponent, p'' = r p' with r = (exponent - 1)/(lag + y)."""
    clock = shifted_power_law_transformation(10.0, 1e4, (exponent - 1) / lag, -(exponent - 1) / lag**2)
    assert (clock.beta, clock.tau) == pytest.approx((exponent, lag), rel=1e-12)


def test_a_curve_that_does_not_harden_gets_plain_time() -> None:
    for bend, rate in ((1e-3, 1e-6), (-1e-3, -1e-6), (float("nan"), 1.0), (0.0, 0.0)):
        assert shifted_power_law_transformation(0.0, 100.0, bend, rate) == (0.0, 100.0, 1.0, 100.0)
    times = transformed_times(TimeTransformation(5.0, 100.0, 1.0, 100.0), [0.25, 0.5]).time
    np.testing.assert_allclose(times, [30.0, 55.0], rtol=1e-15)


def test_exponents_are_kept_within_reach() -> None:
    assert power_law_transformation(0.0, 1.0, 1e-3).beta == SMALLEST_EXPONENT
    assert power_law_transformation(0.0, 1.0, 7.0).beta == 1.0
