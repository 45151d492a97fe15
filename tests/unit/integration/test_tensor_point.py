"""A driven point: its tangent, its order, frames, programs, ends and refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import qmc

from creepkit.integration import IntegrationSettings
from creepkit.integration.tensor_integration import (
    TENSOR_COMPONENTS,
    integrate_tensor_point,
    prescribed_strain,
    prescribed_stress,
)
from creepkit.integration.time_discretisation import SDIRK2, SDIRK4
from creepkit.kernels import lower
from creepkit.kernels.interface import MEAN_STRESS, PRINCIPAL_STRESS, STRAIN, STRESS, TIME, call_entry
from creepkit.language import CreepLaw, Param, State, arrhenius, mean_stress, parameters, principal_stress, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
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
from helpers.kachanov_law import A, C, damage, kachanov, n, v
from helpers.tensor_response import constitutive_response

STEEL = (150e3, 0.3)
DAMAGING = kachanov(0.6 * principal_stress + 0.4 * mean_stress, 0.9)
KACHANOV = kachanov(stress, 0.9)
RATES = KACHANOV.params


def run(law, values, controls, times, temperature=300.0, settings=None, tableau=SDIRK2):
    kernel = lower(law, "compiled")
    theta = law.to_internal(values)[0]
    return integrate_tensor_point(
        kernel, theta, STEEL, controls, temperature, times, settings=settings, tableau=tableau
    )


@pytest.mark.parametrize("weight", [1.0, 30.0, 1e3], ids=["elastic", "half crept", "crept"])
def test_the_tangent_is_the_derivative_of_stress(weight: float) -> None:
    """Central differences of strain, for a law of all four: von Mises, principal, mean stress and a state."""
    kernel = lower(DAMAGING, "compiled")
    theta = DAMAGING.to_internal({"A": 1e-14, "n": 4.0, "C": 1e-13, "v": 3.5})[0]
    base = np.array([1e-4, -6e-5, -4e-5, 3e-5, 0.0, 1e-5, 2e-4, 0.1])
    strain = np.array([1.2e-3, 3e-4, -2e-4, 4e-4, 2e-4, -3e-4])

    def answer(change: np.ndarray):
        return constitutive_response(kernel, theta, STEEL, strain + change, base, 1e3, 300.0, weight)

    found = answer(np.zeros(6)).tangent
    for j, step in enumerate(1e-7 * np.eye(6)):
        difference = (answer(step).stress - answer(-step).stress) / 2e-7
        np.testing.assert_allclose(found[:, j], difference, atol=1e-6 * np.abs(found).max())


@pytest.mark.parametrize("tableau", [SDIRK2, SDIRK4], ids=["SDIRK2", "SDIRK4"])
def test_the_order_is_that_of_the_tableau(tableau) -> None:
    """A strain and a stress that grow, in equal steps; the error falls by 2^order when the steps are halved."""
    ramp = Program(np.array([0.0, 100.0]), np.array([2e-4, 1.2e-3]))
    controls = {
        "11": prescribed_strain(ramp),
        "12": prescribed_strain(3e-4),
        "22": prescribed_stress(Program(ramp.times, 6e4 * ramp.values)),
    }

    def end(step: float) -> float:
        loose = IntegrationSettings(rtol=1e9, first=step, longest=step)
        return float(run(NORTON, {"A": 1e-11, "n": 3}, controls, [100.0], settings=loose, tableau=tableau).stress[0, 0])

    coarse, middle, fine = (end(step) for step in (1 / 8, 1 / 16, 1 / 32))
    assert np.log2((coarse - middle) / (middle - fine)) == pytest.approx(tableau.order, abs=0.35)


def test_a_turned_frame_turns_the_answer() -> None:
    """Relaxation of a strain and of the same strain seen from axes turned about two of them."""
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    strain = np.diag([1e-3, 2e-4, -1e-4])
    rows, columns = [int(k[0]) - 1 for k in TENSOR_COMPONENTS], [int(k[1]) - 1 for k in TENSOR_COMPONENTS]
    tensors = []
    for tensor in (strain, turn @ strain @ turn.T):
        controls = {k: prescribed_strain(e) for k, e in zip(TENSOR_COMPONENTS, tensor[rows, columns], strict=True)}
        values = {"A": 1e-14, "n": 4.0, "C": 1e-12, "v": 3.5}
        result = run(DAMAGING, values, controls, [1e3])
        full = np.zeros((3, 3))
        full[rows, columns] = full[columns, rows] = result.stress[0]
        tensors.append(full)
    np.testing.assert_allclose(turn @ tensors[0] @ turn.T, tensors[1], rtol=1e-8, atol=1e-8 * tensors[0].max())


STRESSES = {
    "compression, the two largest equal": [-100.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    "the two largest equal": [80.0, 80.0, 0.0, 0.0, 0.0, 0.0],
    "the two largest equal, turned": [40.0, 40.0, 80.0, 40.0, 0.0, 0.0],
    "shear": [0.0, 0.0, 0.0, 60.0, 0.0, 0.0],
    "all different": [60.0, -20.0, 35.0, 18.0, -42.0, 27.0],
    "nearly equal": [70.0, 70.0 + 1e-7, -10.0, 1e-7, 1e-8, 0.0],
}


@pytest.mark.parametrize("stresses", STRESSES.values(), ids=STRESSES)
def test_a_law_of_the_largest_principal_stress(stresses: list[float]) -> None:
    """At constant stress p = A lambda^n t, with lambda the largest eigenvalue by NumPy, shifted to stay above zero."""
    shift = 150.0
    law = CreepLaw("principal", {"creep": A * (principal_stress + shift) ** n}, {k: RATES[k] for k in (A, n)})
    controls = {k: prescribed_stress(value) for k, value in zip(TENSOR_COMPONENTS, stresses, strict=True)}
    result = run(law, {"A": 1e-13, "n": 3.0}, controls, [1e3])
    s11, s22, s33, s12, s23, s13 = stresses
    largest = np.linalg.eigvalsh(np.array([[s11, s12, s13], [s12, s22, s23], [s13, s23, s33]]))[-1]
    assert result.equivalent[0] == pytest.approx(1e-13 * (largest + shift) ** 3 * 1e3, rel=1e-9)


def test_temperature_follows_its_program() -> None:
    """Strain is the integral of the rate, here over a temperature that rises evenly."""
    law = NORTON.times(arrhenius(T_ref=1000.0))
    values = {"A": 1e-14, "n": 4.0, "Q": 3e5}
    heating = Program(np.array([0.0, 3600.0]), np.array([900.0, 1100.0]))
    result = run(law, values, {"12": prescribed_stress(40.0)}, [3600.0], temperature=heating)

    def rate(t: float) -> float:
        return 1e-14 * 3**2 * 40.0**4 * np.exp(-3e5 / 8.314462618 * (1 / (900 + t / 18) - 1 / 1000))

    assert result.equivalent[0] == pytest.approx(quad(rate, 0, 3600)[0], rel=1e-5)


def test_outputs_at_a_jump_show_what_holds_from_then_on() -> None:
    controls = {"11": prescribed_stress(Program.steps([(0.0, 50.0), (100.0, 80.0)]))}
    result = run(NORTON, {"A": 1e-12, "n": 3}, controls, [0.0, 100.0, 100.0, 150.0])
    np.testing.assert_allclose(result.stress[:, 0], [50.0, 80.0, 80.0, 80.0])
    np.testing.assert_allclose(result.creep_strain[:, 0], 1e-12 * 50**3 * 100 * np.array([0, 1, 1, 1 + 0.5 * 1.6**3]))
    np.testing.assert_allclose(
        result.strain[:, 1], -0.5 * result.creep_strain[:, 0] - 0.3 * result.stress[:, 0] / 150e3
    )


def test_without_load_nothing_happens() -> None:
    result = run(DAMAGING, {"A": 1e-14, "n": 4.0, "C": 1e-12, "v": 3.5}, {"13": prescribed_strain(0.0)}, [1e3])
    assert result.status == Status.COMPLETE
    assert not result.stress.any()
    assert not result.strain.any()


class TestEnds:
    def test_a_state_at_its_limit(self) -> None:
        """Kachanov: (1 - damage)^(v+1) = 1 - (v+1) C s^v t; outputs beyond are left out."""
        result = run(
            KACHANOV, {"A": 1e-16, "n": 4, "C": 1e-13, "v": 4}, {"11": prescribed_stress(100.0)}, [5e3, 1.5e4, 1e5]
        )
        expected = (1 - 0.1**5) / (5 * 1e-13 * 100**4)
        assert result.status == Status.RUPTURED
        assert result.reason == "an internal variable reached its limit"
        assert result.end_time == pytest.approx(expected, rel=1e-4)
        np.testing.assert_array_equal(result.times, [5e3, 1.5e4])
        np.testing.assert_allclose(result.states[:, 0], 1 - (1 - 5e-5 * result.times) ** 0.2, rtol=1e-4)

    def test_the_strain_limit(self) -> None:
        values, settings = {"A": 1e-13, "n": 4}, IntegrationSettings(strain_limit=0.25)
        result = run(NORTON, values, {"11": prescribed_stress(100.0)}, [1e4, 1e5], settings=settings)
        assert result.status == Status.RUPTURED
        assert result.end_time == pytest.approx(0.25 / 1e-5, rel=1e-9)
        assert result.times.tolist() == [1e4]

    def test_a_limit_that_is_met_faster_than_any_step(self) -> None:
        """w = 1 - (1 - t/t_r)^(1/15): past w = 0.9 less is left than doubles tell from t_r."""
        growth = C * stress**v / (15 * (1 - damage) ** 14)
        law = CreepLaw("rabotnov", {"creep": A * stress**n}, RATES, states={damage: State(0.0, growth, limit=0.99)})
        values = {"A": 1e-15, "n": 3.0, "C": 1e-14, "v": 4.0}
        result = run(law, values, {"11": prescribed_stress(100.0)}, [1.0, 2e6], tableau=SDIRK4)
        assert result.status == Status.RUPTURED
        assert result.reason == "an internal variable reached its limit"
        assert result.end_time == pytest.approx(1e6, rel=1e-4)

    def test_the_cap_on_steps(self) -> None:
        settings = IntegrationSettings(max_steps=5)
        result = run(NORTON, {"A": 1e-10, "n": 4}, {"11": prescribed_strain(1e-3)}, [0.0, 1e6], settings=settings)
        assert result.status == Status.NOT_CONVERGED
        assert result.reason == "the cap on steps was reached"
        assert result.times.tolist() == [0.0]


# ---- implicit stage --------------------------------------------------------------------------------------------------

# The implicit stage satisfies its equation wherever a solution exists, and its derivatives are exact.


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
