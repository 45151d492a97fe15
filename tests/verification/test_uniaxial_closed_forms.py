"""Uniaxial creep against closed forms, and against an independent integration where there is none.

Tolerances: 1e-6 at a tight tolerance and 1e-4 at the default one, as the project's first issue demands. Strains
below a millionth are compared absolutely, as such. Laws' bounds are covered by Sobol points, each rate coefficient
chosen so that the strain at the end is 1e-6 to 0.5.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import qmc

from creepkit.integration import IntegrationSettings, PointTest, integrate
from creepkit.kernels import lower
from creepkit.laws.combined import COMBINED
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import Program

ROOM = Program.constant(1000.0)
GRID = np.concatenate([np.geomspace(1e-3, 1e-2, 8, endpoint=False), np.linspace(0.01, 1.0, 50)])
TIGHT, DEFAULT = IntegrationSettings(rtol=1e-9, smallest=1e-9), IntegrationSettings()


def strain_of(law, theta, stress, times, settings, **kwargs):
    kernel = lower(law, "compiled")
    driving = stress if isinstance(stress, Program) else Program.constant(stress)
    result = integrate(kernel, theta, [PointTest(driving, ROOM, times, **kwargs)], settings=settings)
    assert (result.status == 0).all()
    return result.strain[0]


def cases(count: int, seed: int):
    """(stress, end time, n, m of strain, m of time, ln of the strain at the end) over the bounds."""
    for u in qmc.Sobol(6, seed=seed).random(count):
        reach = np.log(10.0) * (-6 + 5.69 * u[5])
        yield 10 ** (1 + 1.3 * u[0]), 10 ** (3 + 4 * u[1]), 1 + 7 * u[2], -u[3], -0.95 * u[4], reach


@pytest.mark.parametrize(("settings", "rtol"), [(TIGHT, 1e-6), (DEFAULT, 1e-4)], ids=["tight", "default"])
class TestConstantStress:
    def test_norton(self, settings, rtol):
        for stress, end, n, _, _, reach in cases(32, 1):
            theta = [reach - np.log(end) - n * np.log(stress), n]
            found = strain_of(NORTON, theta, stress, end * GRID, settings)
            np.testing.assert_allclose(found, np.exp(reach) * GRID, rtol=rtol)

    def test_time_hardening(self, settings, rtol):
        """p = A s^n t^(1+m)/(1+m)."""
        for stress, end, n, _, m, reach in cases(64, 2):
            theta = [reach + np.log1p(m) - (1 + m) * np.log(end) - n * np.log(stress), n, m]
            found = strain_of(TIME_HARDENING, theta, stress, end * GRID, settings)
            np.testing.assert_allclose(found, np.exp(reach) * GRID ** (1 + m), rtol=rtol)

    def test_strain_hardening(self, settings, rtol):
        """p = [(1-m) A s^n t]^(1/(1-m))."""
        for stress, end, n, m, _, reach in cases(64, 3):
            theta = [(1 - m) * reach - np.log1p(-m) - np.log(end) - n * np.log(stress), n, m]
            found = strain_of(STRAIN_HARDENING, theta, stress, end * GRID, settings)
            np.testing.assert_allclose(found, np.exp(reach) * GRID ** (1 / (1 - m)), rtol=rtol)

    def test_strain_hardening_after_a_step_of_stress(self, settings, rtol):
        """The rate goes on from the strain reached: p^(1-m) is a straight line in each step."""
        for stress, end, n, m, _, reach in cases(32, 4):
            theta = [(1 - m) * reach - np.log1p(-m) - np.log(end) - n * np.log(stress), n, m]
            ratio = 1.3
            found = strain_of(
                STRAIN_HARDENING, theta, Program.steps([(0, stress), (0.4 * end, ratio * stress)]), end * GRID, settings
            )
            grown = np.where(GRID < 0.4, GRID, 0.4 + ratio**n * (GRID - 0.4))
            exact = np.exp(reach) * grown ** (1 / (1 - m))
            np.testing.assert_allclose(found[exact < 1], exact[exact < 1], rtol=rtol)

    def test_time_hardening_after_a_step_of_stress(self, settings, rtol):
        for stress, end, n, _, m, reach in cases(32, 5):
            theta = [reach + np.log1p(m) - (1 + m) * np.log(end) - n * np.log(stress), n, m]
            program = Program.steps([(0, stress), (0.4 * end, 1.1 * stress)])
            found = strain_of(TIME_HARDENING, theta, program, end * GRID, settings)
            power = GRID ** (1 + m)
            exact = np.exp(reach) * np.where(GRID < 0.4, power, 0.4 ** (1 + m) * (1 - 1.1**n) + 1.1**n * power)
            np.testing.assert_allclose(found, exact, rtol=rtol)

    def test_constant_load(self, settings, rtol):
        """Norton: p = -ln(1 - n A s^n t)/n."""
        for stress, end, n, _, _, reach in cases(32, 6):
            rate = -np.expm1(-n * np.exp(reach)) / n
            theta = [np.log(rate / end) - n * np.log(stress), n]
            found = strain_of(NORTON, theta, stress, end * GRID, settings, constant_load=True)
            np.testing.assert_allclose(found, -np.log1p(-n * rate * GRID) / n, rtol=rtol)

    def test_a_ramp_of_stress_from_zero(self, settings, rtol):
        """Norton: p = A r^n t^(n+1)/(n+1) at stress r t."""
        for stress, end, n, _, _, reach in cases(16, 7):
            theta = [reach + np.log1p(n) - np.log(end) - n * np.log(stress), n]
            ramp = Program(np.array([0.0, end]), np.array([0.0, stress]))
            exact = np.exp(reach) * GRID ** (n + 1)
            found = strain_of(NORTON, theta, ramp, end * GRID, settings)
            np.testing.assert_allclose(found, exact, rtol=rtol, atol=1e-6 * rtol)

    def test_against_an_independent_integration_of_the_combined_law(self, settings, rtol):
        for theta, stress, end in combined_cases(64):
            reference = combined_reference(theta, stress, end * GRID)
            found = strain_of(COMBINED, theta, stress, end * GRID, settings._replace(strain_limit=10.0))
            np.testing.assert_allclose(found, reference, rtol=rtol, atol=1e-6 * rtol)


def combined_cases(count: int):
    """Parameters of Eq. (2) in internal form, each term alone giving 1e-9 to 0.3 at the end, or switched off."""
    for u in qmc.Sobol(14, seed=7).random(count):
        stress, end = 10 ** (1 + 1.3 * u[0]), 10 ** (3 + 4 * u[1])
        n = 1 + 7 * u[2:5]
        log_breakdown, m_strain, m_time = np.log(10.0) * 3 * u[5], -u[6], -0.95 * u[7]
        reach = np.log(10.0) * (-9 + 8.5 * u[8:11])
        coefficients = np.array(
            [
                reach[0] - np.log(end) - n[0] * log_sinh(stress / np.exp(log_breakdown)),
                (1 - m_strain) * reach[1] - np.log1p(-m_strain) - np.log(end) - n[1] * np.log(stress),
                reach[2] + np.log1p(m_time) - (1 + m_time) * np.log(end) - n[2] * np.log(stress),
            ]
        )
        off = u[11:14] < 0.15
        if np.logaddexp.reduce(np.where(off, -np.inf, reach)) < np.log(1e-6):
            continue
        a = np.where(off, -np.inf, coefficients)
        yield np.array([a[0], n[0], log_breakdown, a[1], n[1], m_strain, a[2], n[2], m_time]), stress, end


def log_sinh(x: float) -> float:
    return float(x + np.log1p(-np.exp(-2 * x)) - np.log(2.0))


def combined_reference(theta: np.ndarray, stress: float, times: np.ndarray) -> np.ndarray:
    """Strain from ln p over ln t, which is smooth and starts as a straight line, by LSODA at 1e-11."""
    active = np.isfinite(theta[[0, 3, 6]])
    beta = np.array([1.0, 1 / (1 - theta[5]), 1 + theta[8]])[active].min()
    sinh, log_stress = log_sinh(stress / np.exp(theta[2])), np.log(stress)

    def log_rate(log_strain, log_time):
        terms = [
            theta[0] + theta[1] * sinh,
            theta[3] + theta[4] * log_stress + theta[5] * log_strain,
            theta[6] + theta[7] * log_stress + theta[8] * log_time,
        ]
        return np.logaddexp.reduce(terms)

    end = np.log(times[-1])
    start = end - min(40 / beta, 690 + end)
    first = -5.0
    for _ in range(300):
        first = 0.5 * (first + start + log_rate(first, start) - np.log(beta))
    solution = solve_ivp(
        lambda u, y: [np.exp(u + log_rate(y[0], u) - y[0])],
        (start, end),
        [first],
        method="LSODA",
        rtol=1e-11,
        atol=1e-12,
        t_eval=np.log(times),
        max_step=2.0 / beta,
    )
    return np.exp(solution.y[0])


@pytest.mark.parametrize(("settings", "rtol"), [(TIGHT, 1e-6), (DEFAULT, 1e-4)], ids=["tight", "default"])
class TestRelaxation:
    """Stress at constant total strain, sigma = E (e - p): textbook forms, from k = E in the stage."""

    E, start = 1.6e5, 180.0

    def stress(self, law, theta, times, settings):
        creep = strain_of(law, theta, self.start, times, settings, stiffness=self.E)
        return self.start - self.E * creep

    def test_norton(self, settings, rtol):
        """sigma = [s0^(1-n) + (n-1) E A t]^(-1/(n-1))."""
        for n in (1.5, 3.0, 5.0, 8.0):
            coefficient = 1e-3 / (self.E * self.start ** (n - 1))
            times = np.geomspace(1, 1e6, 40)
            exact = (self.start ** (1 - n) + (n - 1) * self.E * coefficient * times) ** (-1 / (n - 1))
            found = self.stress(NORTON, [np.log(coefficient), n], times, settings)
            np.testing.assert_allclose(found, exact, rtol=rtol)

    def test_time_hardening(self, settings, rtol):
        """Norton's form with t^(1+m)/(1+m) for t."""
        for n, m in ((3.0, -0.3), (5.0, -0.7), (2.0, -0.9)):
            coefficient = 1e-2 / (self.E * self.start ** (n - 1))
            times = np.geomspace(1, 1e6, 40)
            aged = times ** (1 + m) / (1 + m)
            exact = (self.start ** (1 - n) + (n - 1) * self.E * coefficient * aged) ** (-1 / (n - 1))
            found = self.stress(TIME_HARDENING, [np.log(coefficient), n, m], times, settings)
            np.testing.assert_allclose(found, exact, rtol=rtol)

    def test_hyperbolic_sine(self, settings, rtol):
        """Rate A sinh(sigma/B): tanh(sigma/2B) = tanh(s0/2B) exp(-E A t/B)."""
        for breakdown in (15.0, 40.0, 120.0):
            coefficient = 1e-3 * breakdown / self.E
            times = np.geomspace(0.1, 1e4, 40)
            ratio = np.tanh(self.start / (2 * breakdown)) * np.exp(-self.E * coefficient * times / breakdown)
            found = self.stress(HYPERBOLIC_SINE, [np.log(coefficient), 1.0, np.log(breakdown)], times, settings)
            np.testing.assert_allclose(found, 2 * breakdown * np.arctanh(ratio), rtol=rtol, atol=rtol * 1e-2)


@pytest.mark.parametrize("loading", ["stress", "load", "steps and a ramp"])
def test_sensitivities_are_the_derivatives_of_the_solution(loading):
    """Against Richardson differences of tight runs: 1e-5 of the strain, or of the largest sensitivity."""
    kernel = lower(COMBINED, "compiled")
    for theta, stress, end in combined_cases(32):
        program = Program.constant(stress)
        if loading == "steps and a ramp":
            marks = end * np.array([0.0, 0.3, 0.3, 0.6, 0.7, 1.0])
            program = Program(marks, stress * np.array([1.0, 1.0, 1.15, 1.15, 0.8, 0.8]))
        test = PointTest(program, ROOM, end * GRID, constant_load=loading == "load")
        result = integrate(
            kernel, theta, [test], settings=IntegrationSettings(rtol=1e-8, strain_limit=10.0), jacobian=True
        )
        if result.status[0, 0] != 0:
            continue  # differences mean nothing where a neighbour bursts
        reached = result.strain[0] < 0.3
        assert result.jacobian is not None
        found = result.jacobian[0]
        for p in np.flatnonzero(np.isfinite(theta)):
            expected = _difference(kernel, test, theta, int(p))
            reached &= np.isfinite(expected)
            scale = max(np.abs(expected[reached]).max(), result.strain[0][reached].max())
            np.testing.assert_allclose(found[reached, p], expected[reached], rtol=0, atol=1e-5 * scale)


def _difference(kernel, test, theta, p):
    """Fourth-order central difference; the step stays small where sinh magnifies the breakdown stress."""
    step = 1e-3 / max(1.0, np.exp(-theta[2]) * test.driving.values.max() * theta[1] if p == 2 else 1.0)
    shifts = np.array([-2, -1, 1, 2]) * step
    nudged = np.repeat(theta[None], 4, axis=0)
    nudged[:, p] += shifts
    far_down, down, up, far_up = integrate(
        kernel, nudged, [test], settings=IntegrationSettings(rtol=1e-11, smallest=1e-9, strain_limit=20.0)
    ).strain
    return (8 * (up - down) - (far_up - far_down)) / (12 * step)
