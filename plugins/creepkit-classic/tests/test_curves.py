"""Laws with memory: strain curves at constant stress and after a step, through the uniaxial specimen."""

import numpy as np
import pytest
from numpy.typing import NDArray

import creepkit as ck
from creepkit.language import exponential, linear
from creepkit.records import Status, StressSteps

STRESS = 120.0
BAR = ck.specimen("uniaxial").replace(tolerance=1e-9, strain_limit=10.0, max_steps=100_000)
TIMES = np.concatenate([np.geomspace(10.0, 1e5, 9), np.linspace(2e5, 1e6, 9)])


def strain(law: str | ck.CreepLaw, values: dict[str, float], times=TIMES, loading=None, **more) -> NDArray[np.float64]:
    held = loading or ck.constant_stress(STRESS, "stress")
    return ck.simulate(law, BAR, values, loading=held, times=times, **more).outputs["strain"]


THETA = {
    **{"theta_1": 1e-3, "theta_2": 1e-6, "theta_3": 2e-3, "theta_4": 4e-7},
    **{"c_1": 0.01, "c_2": 0.02, "c_3": 0.008, "c_4": 0.015},
}


def thetas(stress: float) -> list[float]:
    return [THETA[f"theta_{i}"] * np.exp(THETA[f"c_{i}"] * stress) for i in (1, 2, 3, 4)]


def test_theta_projection() -> None:
    one, two, three, four = thetas(STRESS)
    exact = -one * np.expm1(-two * TIMES) + three * np.expm1(four * TIMES)

    np.testing.assert_allclose(strain("theta-projection", THETA), exact, rtol=1e-6)


def test_theta_projection_after_a_step() -> None:
    """Each strain goes on from where it is, towards or from the thetas of the new stress."""
    step, higher = 3e5, 150.0
    one, two, three, four = thetas(STRESS)
    p, q = -one * np.expm1(-two * step), three * np.expm1(four * step)
    one, two, three, four = thetas(higher)
    later = np.array([4e5, 6e5, 1e6])
    exact = one + (p - one) * np.exp(-two * (later - step)) - three + (q + three) * np.exp(four * (later - step))
    loading = StressSteps(((0.0, STRESS), (step, higher)), "stress")

    np.testing.assert_allclose(strain("theta-projection", THETA, later, loading), exact, rtol=1e-6)


def test_the_sixteen_constants_of_evans_and_wilshire() -> None:
    """ln theta_i = a_i + b_i T + c_i s + d_i s T, about T_ref = 800 K."""
    law = ck.law("theta-projection").with_temperature(
        **{f"theta_{i}": exponential(T_ref=800.0) for i in (1, 2, 3, 4)},
        **{f"c_{i}": linear(T_ref=800.0) for i in (1, 2, 3, 4)},
    )
    b, d, T = [0.001, 0.02, -0.002, 0.03], [1e-5, 2e-5, -1e-5, 3e-5], 825.0
    values = THETA | {f"theta_{i}_T": v for i, v in enumerate(b, 1)} | {f"c_{i}_T": v for i, v in enumerate(d, 1)}
    warm = [
        theta * np.exp(k * (T - 800) + slope * STRESS * (T - 800))
        for theta, k, slope in zip(thetas(STRESS), b, d, strict=True)
    ]
    exact = -warm[0] * np.expm1(-warm[1] * TIMES) + warm[2] * np.expm1(warm[3] * TIMES)

    assert len(law.names) == 16
    np.testing.assert_allclose(strain(law, values, temperature=T), exact, rtol=1e-6)


BLACKBURN = {"A": 1e-9 / STRESS**5, "n": 5.0, "C_f": 1e-9, "C_s": 5e-9, "a": 2.5, "K_f": 2e4, "K_s": 3e3}


def test_blackburn() -> None:
    """X_f (1 - exp(-K_f r t)) + X_s (1 - exp(-K_s r t)) + r t."""
    rate, fast, slow = 1e-9, 1e-9 * STRESS**2.5, 5e-9 * STRESS**2.5
    exact = -fast * np.expm1(-2e4 * rate * TIMES) - slow * np.expm1(-3e3 * rate * TIMES) + rate * TIMES

    np.testing.assert_allclose(strain("blackburn", BLACKBURN), exact, rtol=1e-6)


def test_the_transients_of_blackburn_do_not_recover() -> None:
    """When the stress falls to a half of itself the transients are beyond their new limits: steady creep is left."""
    loading = StressSteps(((0.0, STRESS), (5e5, STRESS / 2)), "stress")
    found = strain("blackburn", BLACKBURN, np.array([5e5, 7e5, 9e5]), loading)

    np.testing.assert_allclose(np.diff(found), 1e-9 / 32 * 2e5, rtol=1e-6)


def test_graham_walles() -> None:
    values = {"C_1": 2e-9, "n_1": 2.0, "C_2": 1e-19, "n_2": 5.0, "C_3": 1e-36, "n_3": 7.0}
    parts = ((2e-9, 2.0, 1 / 3), (1e-19, 5.0, 1.0), (1e-36, 7.0, 3.0))
    exact = sum(C * STRESS**n * TIMES**k for C, n, k in parts)

    np.testing.assert_allclose(strain("graham-walles", values), exact, rtol=1e-6)


@pytest.mark.parametrize("c", [0.0, 0.004])
def test_mpc_omega(c: float) -> None:
    """e = -ln(1 - Omega r t)/Omega; the life is 1/(Omega r), less exp(-Omega) of it at a strain limit of 1."""
    values = {"A": 1e-9 / STRESS**6, "n": 6.0, "Omega": 60.0, "c": c}
    omega = 60.0 * np.exp(-c * STRESS)
    times = np.linspace(0.05, 0.999, 20) / (omega * 1e-9)
    run = ck.simulate(
        "mpc-omega",
        BAR.replace(strain_limit=1.0),
        values,
        loading=ck.constant_stress(STRESS, "stress"),
        times=[*times, 1.1 / (omega * 1e-9)],
    )

    np.testing.assert_allclose(run.outputs["strain"], -np.log1p(-omega * 1e-9 * times) / omega, rtol=1e-6)
    assert run.status is Status.RUPTURED
    assert run.end_time * omega * 1e-9 == pytest.approx(1 - np.exp(-omega), rel=1e-7)


def test_norton_bailey_in_its_three_notations() -> None:
    """A s^n t^m with A = 4e-13, n = 4, m = 0.4, from each notation's own numbers."""
    exact = 4e-13 * STRESS**4 * TIMES**0.4
    rate_form = {"A": 4e-13 * 0.4, "n": 4.0, "m": -0.6}

    np.testing.assert_allclose(strain("norton-bailey-time", {"A": 4e-13, "n": 4.0, "m": 0.4}), exact, rtol=1e-6)
    np.testing.assert_allclose(strain("norton-bailey-rate", rate_form), exact, rtol=1e-6)
    np.testing.assert_allclose(strain("norton-bailey-strain", rate_form), exact, rtol=1e-6)
