"""Adaptive integration of a point: endings, jumps, dense output, states, and work that stays bounded."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from creepkit.errors import SolveError
from creepkit.integration import IntegrationSettings, PointTest, integrate
from creepkit.integration.core_structures import DIVERGED, REACHED_END, STATE_LIMIT, STRAIN_LIMIT, TOO_MANY_STEPS
from creepkit.kernels import lower
from creepkit.language import CreepLaw, Param, State, parameters, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
from helpers.kachanov_law import A, C, damage, kachanov, n, v

KACHANOV = kachanov(stress, 0.9)
(phi,) = parameters("phi")
RABOTNOV = CreepLaw(
    name="rabotnov in damage itself",
    terms={"creep": A * stress**n},
    params={**{key: KACHANOV.params[key] for key in (A, n, C, v)}, phi: Param("exponent of damage", bounds=(0, 30))},
    states={damage: State(0.0, C * stress**v / ((1 + phi) * (1 - damage) ** phi), limit=0.99)},
    references=("Rabotnov (1969)",),
)
ROOM = Program.constant(1000.0)
SINH, HARDENING = {"A_1": 1e-9, "n_1": 2.0, "B": 80.0}, {"A_2": 1e-17, "n_2": 4.0, "m_1": -0.5}
VALUES = {**SINH, **HARDENING, "A_3": 1e-12, "n_3": 3.0, "m_2": -0.4}


def run(law, values, driving, times, stiffness=0.0, constant_load=False, **kwargs):
    kernel = lower(law, "compiled")
    test = PointTest(driving, ROOM, np.asarray(times, float), stiffness, constant_load)
    return integrate(kernel, law.to_internal(values), [test], **kwargs)


def test_values_of_another_number_of_tests_are_refused() -> None:
    theta = np.tile(NORTON.to_internal({"A": 1e-14, "n": 4.0}), (1, 2, 1))
    test = PointTest(Program.constant(100.0), ROOM, np.array([1.0]), 0.0, False)
    with pytest.raises(SolveError, match=r"shape \(1, 2, 2\) are not \(candidates, 1 tests, parameters\)"):
        integrate(lower(NORTON, "compiled"), theta, [test])


def test_constant_load_bursts_when_the_closed_form_says() -> None:
    """Norton under constant load: p = -ln(1 - n A s^n t)/n, so p = 1 at t = (1 - exp(-n))/(n A s^n)."""
    values, rate = {"A": 1e-13, "n": 4.0}, 1e-13 * 100.0**4
    times = np.linspace(0, 1 / rate, 50)
    result = run(
        NORTON, values, Program.constant(100.0), times, constant_load=True, settings=IntegrationSettings(rtol=1e-8)
    )
    burst = (1 - np.exp(-4.0)) / (4 * rate)
    assert result.terminations[0, 0] == STRAIN_LIMIT
    assert result.status[0, 0] == Status.RUPTURED
    assert result.end_times[0, 0] == pytest.approx(burst, rel=1e-6)
    alive = times < burst
    np.testing.assert_allclose(result.strain[0, alive], -np.log1p(-4 * rate * times[alive]) / 4, rtol=1e-6)
    assert np.isnan(result.strain[0, ~alive]).all()


def test_a_rate_that_diverges_is_a_burst_not_an_error() -> None:
    """With the strain limit out of reach the point still ends where 1/(n A s^n) says."""
    values, rate = {"A": 1e-13, "n": 4.0}, 1e-13 * 100.0**4
    result = run(
        NORTON,
        values,
        Program.constant(100.0),
        [1 / rate],
        constant_load=True,
        settings=IntegrationSettings(strain_limit=50.0),
    )
    assert result.terminations[0, 0] == DIVERGED
    assert result.end_times[0, 0] == pytest.approx(1 / (4 * rate), rel=1e-4)


def test_an_instant_burst_ends_within_the_cap() -> None:
    values = {"A": 1e-5, "n": 8.0}
    for load in (False, True):
        result = run(NORTON, values, Program.constant(1000.0), [1e6], constant_load=load)
        assert result.status[0, 0] == Status.RUPTURED
        assert result.end_times[0, 0] < 1e-10
        assert result.steps.sum() < 100


def test_damage_ends_at_its_limit_when_the_closed_form_says() -> None:
    """d = 1 - (1 - t/t_r)^(1/(v+1)), t_r = 1/((v+1) C s^v); p follows by quadrature (Kachanov, Rabotnov)."""
    values, s = {"A": 2e-16, "n": 4.0, "C": 1e-14, "v": 3.5}, 120.0
    rupture = 1 / (4.5 * 1e-14 * s**3.5)
    times = np.linspace(0, rupture, 40)
    result = run(KACHANOV, values, Program.constant(s), times, settings=IntegrationSettings(rtol=1e-9), jacobian=True)
    power = 1 - 4.0 / 4.5
    exact = 2e-16 * s**4 * rupture / power * (1 - (1 - times / rupture) ** power)
    end = rupture * (1 - 0.1**4.5)
    assert result.terminations[0, 0] == STATE_LIMIT
    assert result.end_times[0, 0] == pytest.approx(end, rel=1e-6)
    alive = times < end
    np.testing.assert_allclose(result.strain[0, alive], exact[alive], rtol=1e-6)
    assert result.jacobian is not None
    np.testing.assert_allclose(result.jacobian[0, alive, 0], exact[alive], rtol=1e-6)
    nudge, fine = 1e-4, IntegrationSettings(rtol=1e-11)
    up, down = (
        run(KACHANOV, {**values, "v": 3.5 + d}, Program.constant(s), times[:30], settings=fine).strain[0]
        for d in (nudge, -nudge)
    )
    np.testing.assert_allclose(result.jacobian[0, :30, 3], (up - down) / (2 * nudge), rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize(("steepness", "rtol"), [(6.0, 1e-12), (14.0, 1e-9), (30.0, 1e-9)])
def test_a_limit_that_is_met_faster_than_any_step_is_a_rupture(steepness: float, rtol: float) -> None:
    """w = 1 - (1 - t/t_r)^(1/(1+phi)), t_r = 1/(C s^v): past w = 0.9 less is left than doubles tell from t_r."""
    values = {"A": 1e-15, "n": 3.0, "C": 1e-14, "v": 4.0, "phi": steepness}
    fine = IntegrationSettings(rtol=rtol, max_steps=100_000)
    result = run(RABOTNOV, values, Program.constant(100.0), [1.0, 2e6], settings=fine, jacobian=True)
    assert result.terminations[0, 0] == STATE_LIMIT
    assert result.end_times[0, 0] == pytest.approx(1e6, rel=1e-8)
    assert result.end_jacobian is not None
    np.testing.assert_allclose(result.end_jacobian[0, 0], [0, 0, -1, -np.log(100.0), 0], rtol=1e-5, atol=1e-5)


def test_many_tests_and_candidates_in_one_call_equal_one_by_one() -> None:
    kernel = lower(COMBINED, "compiled")
    theta = COMBINED.to_internal({**VALUES, "n_1": np.array([1.5, 2.0, 2.5])})
    tests = [PointTest(Program.constant(s), ROOM, np.linspace(0, 1e5, count)) for s, count in ((60.0, 11), (100.0, 7))]
    together = integrate(kernel, theta, tests, jacobian=True)
    assert together.strain.shape == (3, 18)
    assert together.jacobian is not None
    for c in range(3):
        for k, test in enumerate(tests):
            alone = integrate(kernel, theta[c : c + 1], [test], jacobian=True)
            assert alone.jacobian is not None
            np.testing.assert_array_equal(together.of(k)[c], alone.strain[0])
            frames = slice(together.starts[k], together.starts[k + 1])
            np.testing.assert_array_equal(together.jacobian[c, frames], alone.jacobian[0])


def test_the_cap_on_steps_is_that_of_a_tests_own_programs() -> None:
    kernel, theta = lower(NORTON, "compiled"), NORTON.to_internal({"A": 1e-12, "n": 3.0})
    times = np.linspace(0.0, 1e4, 60)
    plain = PointTest(Program.constant(100.0), ROOM, times)
    pieces = Program(times, 100.0 + np.arange(60.0))
    logged = PointTest(pieces, ROOM, times)
    settings = IntegrationSettings(max_steps=2)
    together = integrate(kernel, theta, [plain, logged], settings=settings)
    alone = integrate(kernel, theta, [plain], settings=settings)
    assert alone.terminations[0, 0] == TOO_MANY_STEPS
    assert together.end_times[0, 0] == alone.end_times[0, 0]
    assert together.status[0, 1] == Status.COMPLETE, "each further piece may take steps of its own"


def test_answers_do_not_depend_on_when_they_are_asked_for() -> None:
    times = np.geomspace(1.0, 1e5, 60)
    dense = run(COMBINED, VALUES, Program.constant(100.0), times).strain[0]
    for k in range(0, 60, 7):
        alone = run(COMBINED, VALUES, Program.constant(100.0), times[k : k + 1]).strain[0, 0]
        assert dense[k] == pytest.approx(alone, rel=1e-4)


def test_the_cap_on_steps_keeps_the_history_so_far() -> None:
    times = np.linspace(0, 1e5, 100)
    result = run(
        COMBINED, VALUES, Program.constant(100.0), times, settings=IntegrationSettings(rtol=1e-10, max_steps=60)
    )
    assert result.terminations[0, 0] == TOO_MANY_STEPS
    assert result.status[0, 0] == Status.NOT_CONVERGED
    alive = np.isfinite(result.strain[0])
    assert 0 < alive.sum() < 100
    assert times[alive].max() <= result.end_times[0, 0] < 1e5


def test_a_candidate_that_is_not_a_number_ends_as_not_converged() -> None:
    kernel = lower(NORTON, "compiled")
    theta = np.array([[np.nan, 4.0], [np.log(1e-15), np.nan], [np.log(1e-15), 4.0]])
    result = integrate(kernel, theta, [PointTest(Program.constant(100.0), ROOM, np.array([10.0]))])
    assert result.status[:2, 0].tolist() == [Status.NOT_CONVERGED] * 2
    assert result.terminations[2, 0] == REACHED_END


def test_derivatives_without_output_times() -> None:
    """Norton: p = A s^n t, so that ln t at a strain, and at the strain limit, falls by 1 a ln A and by ln s an n."""
    kernel, theta = lower(NORTON, "compiled"), NORTON.to_internal({"A": 1e-12, "n": 3.0})
    test = PointTest(Program.constant(100.0), ROOM, np.zeros(0), levels=np.array([1e-3, 0.1]), until=1e9)
    result = integrate(kernel, theta, [test], jacobian=True)
    expected = [-1.0, -np.log(100.0)]
    assert result.terminations[0, 0] == STRAIN_LIMIT
    np.testing.assert_allclose(result.level_times[0], [1e3, 1e5], rtol=1e-9)
    np.testing.assert_allclose(result.level_time_jacobian[0], [expected, expected], rtol=1e-9)
    np.testing.assert_allclose(result.end_jacobian[0, 0], expected, rtol=1e-9)


def test_threads_and_single_calls_agree_to_the_last_digit() -> None:
    """A call keeps nothing: batches in four threads are the batch of one thread and the candidates one by one."""
    kernel, theta = (
        lower(COMBINED, "compiled"),
        COMBINED.to_internal(VALUES)[0] + np.linspace(-0.5, 0.5, 64)[:, None] * 0.1,
    )
    test = PointTest(Program.constant(100.0), ROOM, np.linspace(0.0, 1e5, 50))

    def strain(rows: slice) -> np.ndarray:
        return integrate(kernel, theta[rows], [test], jacobian=True).jacobian

    whole, quarters = strain(slice(None)), [slice(k, k + 16) for k in range(0, 64, 16)]
    with ThreadPoolExecutor(4) as pool:
        np.testing.assert_array_equal(np.concatenate(list(pool.map(strain, quarters))), whole)
    np.testing.assert_array_equal(strain(slice(5, 6)), whole[5:6])
