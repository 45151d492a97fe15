"""The implicit stage satisfies its equation wherever a solution exists, and its derivatives are exact."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from creepkit.kernels import lower
from creepkit.kernels.interface import MEAN_STRESS, PRINCIPAL_STRESS, STRAIN, STRESS, TIME, call_entry
from creepkit.language import Param, mean_stress, parameters, principal_stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from helpers.implicit_stage import (
    BY_LOG_WEIGHT,
    BY_MEAN,
    BY_PRINCIPAL,
    BY_STRAIN,
    BY_TIME,
    BY_TRIAL,
    INPUTS,
    NO_SOLUTION,
    SOLVED,
    UNIAXIAL,
    Axes,
    StageProblem,
    solve_stage,
    stage_response,
)
from helpers.kachanov_law import kachanov

(a,) = parameters("a")
MULTIAXIAL_DAMAGE = kachanov(
    a * principal_stress + (1 - a) * mean_stress, 0.9, {a: Param("weight of the principal stress", bounds=(0, 1))}
)


def update_at(kernel, theta, row):
    """The law's update at one point: [ln rate, rates of the states], then their derivatives."""
    return call_entry(kernel, "update", row[None], theta)[0][0]


def solved(kernel, theta, problem, z0=(), axes=UNIAXIAL, time=1e3, guess=1e-6, tolerance=1e-7):
    """Solve one stage; return increment, flag, and the law's row."""
    row = np.zeros(6 + len(z0))
    row[TIME], row[3], row[6:] = time, 1000.0, z0
    return solve_stage(kernel, theta, problem, row, axes=axes, guess=guess, tolerance=tolerance)


def samples(count: int) -> np.ndarray:
    return qmc.Sobol(12, seed=5).random(count)


@pytest.mark.parametrize("stiffness", [0.0, 1.5e5])
def test_the_stage_equation_holds_over_the_bounds_of_the_combined_law(stiffness: float) -> None:
    """From k D << trial to creep that takes all the stress, from p0 = 0 with m = -1 on; D = w f to 1e-10."""
    kernel = lower(COMBINED, "compiled")
    for u in samples(512):
        low = np.array([-90, 1, np.log(2), -90, 1, -1, -90, 1, -0.95])
        high = np.array([-10, 8, np.log(800), -10, 8, 0, -10, 8, 0])
        theta = low + u[:9] * (high - low)
        start = 0.0 if u[9] < 0.3 else 10 ** (-9 + 8 * u[9])
        problem = StageProblem(10 ** (1 + 1.5 * u[10]), stiffness, 0.0, 10 ** (-3 + 8 * u[11]), start)
        increment, flag, row = solved(kernel, theta, problem, guess=10 ** (-12 + 11 * u[2]))
        assert flag == SOLVED
        if not 1e-25 < increment < 1e10:
            continue
        out = update_at(kernel, theta, row)
        assert np.log(increment / problem.weight) == pytest.approx(out[0], abs=1e-10 * max(1.0, abs(out[0])))
        assert row[STRAIN] == pytest.approx(start + increment, rel=1e-14)
        assert row[STRESS] + stiffness * increment == pytest.approx(problem.trial, rel=1e-12)


@pytest.mark.parametrize("guess", [1e-30, 1e-6, 1.0, 1e20])
def test_any_guess_leads_to_the_closed_form(guess: float) -> None:
    """Norton with n = 1: D = w A (trial - k D), a linear equation."""
    kernel = lower(NORTON, "compiled")
    theta = NORTON.to_internal({"A": 1e-9, "n": 1.0})[0]
    for weight in (1e-6, 1.0, 1e5, 1e12):
        increment, flag, _ = solved(kernel, theta, StageProblem(100.0, 1e5, 0.0, weight, 0.0), guess=guess)
        assert flag == SOLVED
        assert increment == pytest.approx(weight * 1e-9 * 100 / (1 + weight * 1e-9 * 1e5), rel=1e-12)


def test_constant_load_has_a_solution_only_up_to_the_turning_point() -> None:
    """D = w A s exp(n D) has its last solution at D = 1/n; beyond it the step must be refused."""
    kernel = lower(NORTON, "compiled")
    theta = NORTON.to_internal({"A": 1e-9, "n": 4.0})[0]
    last = 1 / (4 * np.e) / (1e-9 * 50.0**4)
    increment, flag, _ = solved(kernel, theta, StageProblem(50.0, 0.0, 1.0, 0.9 * last, 0.0))
    assert flag == SOLVED
    assert increment == pytest.approx(0.9 * last * 1e-9 * 50**4 * np.exp(4 * increment), rel=1e-10)
    assert solved(kernel, theta, StageProblem(50.0, 0.0, 1.0, 1.1 * last, 0.0))[1] != SOLVED


def test_no_stress_no_creep() -> None:
    kernel = lower(NORTON, "compiled")
    theta = NORTON.to_internal({"A": 1e-9, "n": 4.0})[0]
    assert solved(kernel, theta, StageProblem(0.0, 0.0, 0.0, 1e3, 0.1))[:2] == (0.0, SOLVED)
    assert solved(kernel, theta, StageProblem(-1.0, 1e5, 0.0, 1e3, 0.1))[1] == NO_SOLUTION
    off = NORTON.to_internal({"A": 0.0, "n": 4.0})[0]
    assert solved(kernel, off, StageProblem(100.0, 0.0, 0.0, 1e3, 0.1))[:2] == (0.0, SOLVED)


DAMAGE_VALUES = {"A": 1e-14, "n": 4.0, "C": 1e-12, "v": 3.5, "a": 0.4}


@pytest.mark.parametrize("problem", [StageProblem(90.0, 0.0, 0.0, 1e4, 0.01), StageProblem(200.0, 1e5, 0.0, 3e4, 0.0)])
def test_states_satisfy_their_equations(problem: StageProblem) -> None:
    kernel = lower(MULTIAXIAL_DAMAGE, "compiled")
    theta = MULTIAXIAL_DAMAGE.to_internal(DAMAGE_VALUES)[0]
    axes = Axes(30.0, 0.7, 40.0, 0.0)
    increment, flag, row = solved(kernel, theta, problem, (0.1,), axes)
    assert flag == SOLVED
    out = update_at(kernel, theta, row)
    assert increment == pytest.approx(problem.weight * np.exp(out[0]), rel=1e-10)
    assert row[6] == pytest.approx(0.1 + problem.weight * out[1], rel=1e-10)
    assert row[PRINCIPAL_STRESS] == pytest.approx(30 + 0.7 * row[STRESS])
    assert row[MEAN_STRESS] == pytest.approx(40.0)


def responses(kernel, theta, problem, z0, axes, entry):
    """All derivatives of the solution, from `update` or from `sensitivity`."""
    solution = solved(kernel, theta, problem, z0, axes, tolerance=1e-10)
    response = stage_response(kernel, theta, problem, solution, axes=axes, entry=entry)
    assert response is not None
    return response


@pytest.mark.parametrize("entry", ["update", "sensitivity"])
@pytest.mark.parametrize(
    "problem",
    [
        StageProblem(90.0, 0.0, 0.0, 1e4, 0.01),
        StageProblem(200.0, 1e5, 0.0, 3e4, 0.02),
        StageProblem(60.0, 0.0, 1.0, 3e4, 0.0),
    ],
    ids=["prescribed stress", "prescribed strain", "constant load"],
)
def test_responses_are_the_derivatives_of_the_solution(problem: StageProblem, entry: str) -> None:
    kernel = lower(MULTIAXIAL_DAMAGE, "compiled")
    theta = MULTIAXIAL_DAMAGE.to_internal(DAMAGE_VALUES)[0]
    axes, z0, time = Axes(30.0, 0.7, 40.0, 0.1), np.array([0.1]), 1e3
    response = responses(kernel, theta, problem, z0, axes, entry)

    def solution(**change):
        place = {"problem": problem, "axes": axes, "z0": z0, "theta": theta, **change}
        increment, flag, row = solved(
            kernel, place["theta"], place["problem"], place["z0"], place["axes"], time, tolerance=1e-10
        )
        assert flag == SOLVED
        return np.array([increment, row[6]])

    def difference(vary, h):
        return (solution(**vary(h)) - solution(**vary(-h))) / (2 * h)

    weight = problem.weight
    checks = {
        BY_TRIAL: difference(lambda h: {"problem": problem._replace(trial=problem.trial + h)}, 1e-4),
        BY_STRAIN: difference(lambda h: {"problem": problem._replace(strain=0.01 + h)}, 1e-5),
        BY_LOG_WEIGHT: difference(lambda h: {"problem": problem._replace(weight=weight * np.exp(h))}, 1e-5),
        BY_PRINCIPAL: difference(lambda h: {"axes": axes._replace(principal=30 + h)}, 1e-4),
        BY_MEAN: difference(lambda h: {"axes": axes._replace(mean=40 + h)}, 1e-4),
        INPUTS: difference(lambda h: {"z0": z0 + h}, 1e-6),
        BY_TIME: np.zeros(2),
    }
    if entry == "sensitivity":
        for p in range(theta.size):
            checks[INPUTS + 1 + p] = difference(lambda h, p=p: {"theta": theta + h * np.eye(theta.size)[p]}, 1e-5)
    for column, expected in checks.items():
        np.testing.assert_allclose(response[:, column], expected, rtol=2e-7, atol=1e-13)
