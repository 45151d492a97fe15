"""Bars followed to rupture: arrival and rupture times in closed form, and their derivatives."""

import numpy as np
import pytest

from creepkit.laws.norton import NORTON
from creepkit.records import History, Status, StressSteps, constant_stress
from creepkit.specimens.uniaxial import Uniaxial
from helpers.literature_laws import EQUATIONS

STRAINS = np.array([0.0, 0.001, 0.05, 0.02, 0.3, np.nan])  # not in order, one not above zero, one not a number
FINE = Uniaxial(tolerance=1e-8, max_steps=20_000)
KACHANOV, OMEGA = EQUATIONS["Kachanov-Rabotnov"], EQUATIONS["MPC Omega"]


def bar(stress=80.0, control="stress", strains=STRAINS, times=None, **more):
    times = np.linspace(1.0, 1e3, strains.size) if times is None else times
    return History("bar", times, {"strain": strains}, constant_stress(stress, control), 1000.0, **more)


def test_arrivals_and_rupture_of_mpc_omega():
    """e = -ln(1 - m r t)/m with r = A s^n: strain e at (1 - exp(-m e))/(m r), 1 being the strain limit."""
    values = {"A": 1e-12, "n": 3.0, "m": 20.0}
    rate, m = 1e-12 * 80.0**3, 20.0
    life = FINE.predict_to_rupture(OMEGA, OMEGA.to_internal(values), [bar()], sensitivities=True).times_to_strain
    expected = (1 - np.exp(-m * STRAINS)) / (m * rate)
    expected[5] = (1 - np.exp(-m)) / (m * rate)  # no strain to arrive at: its rupture
    np.testing.assert_allclose(life.times[0, 0], expected, rtol=1e-6, atol=1e-300)
    np.testing.assert_allclose(life.rupture_times[0, 0], expected[5], rtol=1e-6)
    reached = STRAINS[1:5]
    by_m = -1 / m + reached * np.exp(-m * reached) / (1 - np.exp(-m * reached))
    exact = np.stack([np.full(4, -1.0), np.full(4, -np.log(80.0)), by_m], axis=1)
    np.testing.assert_allclose(life.time_jacobian[0, 0, 1:5], exact, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(life.rupture_jacobian[0, 0], [-1, -np.log(80.0), -1 / m], rtol=1e-4)
    pace = rate * np.exp(m * reached) * expected[1:5]  # de/d(ln t)
    np.testing.assert_allclose(life.log_time_derivatives[0, 0, 1:5], pace, rtol=1e-4)


def test_damage_ends_at_the_limit_of_the_state():
    """dw/dt = B s^k/(1-w)^r from 0 to 0.99: t = (1 - 0.01^(1+r))/((1+r) B s^k), whatever the strain does."""
    values = {"A": 1e-16, "n": 4.0, "B": 1e-15, "k": 3.5, "r": 4.0}
    found = FINE.predict_to_rupture(
        KACHANOV, KACHANOV.to_internal(values), [bar(times=np.geomspace(1e3, 3e7, 6))], sensitivities=True
    )
    expected = (1 - 0.01**5) / (5 * 1e-15 * 80.0**3.5)
    np.testing.assert_allclose(found.times_to_strain.rupture_times[0, 0], expected, rtol=1e-6)
    by_r = 0.01**5 * np.log(100.0) / (1 - 0.01**5) - 1 / 5
    slopes = dict(zip(KACHANOV.names, found.times_to_strain.rupture_jacobian[0, 0], strict=True))
    assert slopes == pytest.approx({"A": 0, "n": 0, "B": -1, "k": -np.log(80.0), "r": by_r}, rel=1e-4, abs=1e-5)
    assert found.status[0, 0] == Status.COMPLETE  # it breaks after the last frame
    assert found.end_times[0, 0] == 3e7


@pytest.mark.parametrize("measure", ["logarithmic", "engineering"])
def test_norton_under_constant_load_runs_away(measure):
    """e = -ln(1 - n r t)/n: Hoff's ductile rupture (J. Appl. Mech. 20 (1953) 105), here up to a strain of one."""
    values, strains = {"A": 1e-12, "n": 3.0}, STRAINS[1:5]
    shown = np.expm1(strains) if measure == "engineering" else strains
    test = bar(60.0, "load", shown, np.geomspace(1.0, 1e5, 4), strain_measure=measure)
    life = FINE.predict_to_rupture(NORTON, NORTON.to_internal(values), [test]).times_to_strain
    rate = 1e-12 * 60.0**3
    np.testing.assert_allclose(life.times[0, 0], (1 - np.exp(-3 * strains)) / (3 * rate), rtol=1e-6)
    stretch = np.exp(strains) if measure == "engineering" else 1.0
    pace = rate * np.exp(3 * strains) * life.times[0, 0] * stretch
    np.testing.assert_allclose(life.log_time_derivatives[0, 0], pace, rtol=1e-4)
    np.testing.assert_allclose(life.rupture_times[0, 0], (1 - np.exp(-3)) / (3 * rate), rtol=1e-6)


def test_what_never_comes_is_not_a_number():
    life = FINE.predict_to_rupture(NORTON, NORTON.to_internal({"A": 1e-20, "n": 3.0}), [bar()]).times_to_strain
    assert np.isnan(life.rupture_times).all()
    assert np.isnan(life.times[0, 0, 1:]).all()
    assert life.times[0, 0, 0] == 0.0
    assert life.horizon[0] == 1e5


def test_what_breaks_at_once_breaks_at_a_time_that_has_a_logarithm():
    life = FINE.predict_to_rupture(
        NORTON, NORTON.to_internal({"A": 1e30, "n": 3.0}), [bar(control="load")], sensitivities=True
    ).times_to_strain
    assert life.rupture_times[0, 0] == pytest.approx(1e-12)
    assert (life.times[0, 0, 1:] <= 1e-12).all()


def test_the_rest_is_that_of_predict():
    """Following a bar further changes nothing about its frames, those lost in a burst included."""
    values = {"A": np.array([1e-12, 1e-9]), "n": 3.0, "m": 20.0}
    tests = [bar(), bar(40.0, times=np.linspace(1.0, 1e7, 6))]
    theta = OMEGA.to_internal(values)
    plain, whole = (predict(OMEGA, theta, tests) for predict in (FINE.predict, FINE.predict_to_rupture))
    np.testing.assert_array_equal(plain.status, whole.status)
    np.testing.assert_allclose(plain.end_times, whole.end_times, rtol=1e-6)
    np.testing.assert_allclose(plain.values, whole.values, rtol=1e-6)
    assert (plain.status == Status.RUPTURED).any()


def test_a_load_program_is_followed_beyond_its_last_step():
    """Robinson's rule is exact for one damage variable of separable rate: life fractions add up to one."""
    values = {"A": 1e-18, "n": 3.0, "B": 1e-15, "k": 3.0, "r": 3.0}
    life = {s: (1 - 0.01**4) / (4 * 1e-15 * s**3) for s in (60.0, 90.0)}
    steps = StressSteps(((0.0, 60.0), (0.3 * life[60.0], 90.0)), "stress")
    plan = History("steps", np.array([1.0]), {}, steps, 1000.0)
    plan = plan.replace(times=np.array([0.4 * life[60.0]]))
    found = FINE.predict_to_rupture(KACHANOV, KACHANOV.to_internal(values), [plan]).times_to_strain
    np.testing.assert_allclose(found.rupture_times[0, 0], 0.3 * life[60.0] + 0.7 * life[90.0], rtol=1e-6)
