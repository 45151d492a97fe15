"""The uniaxial specimen: shapes, observation operators, endings, and errors in one clear sentence."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.errors import LawError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.language import Elastic, arrhenius, wachtman
from creepkit.laws.norton import NORTON
from creepkit.records import History, Program, Status, StressSteps, constant_stress
from creepkit.specimens.bar import elastic_strain
from creepkit.specimens.uniaxial import Uniaxial
from helpers.literature_laws import EQUATIONS
from helpers.narrow_predictor import Narrow

TIMES = np.array([0.0, 10.0, 100.0, 1000.0])
VALUES = {"A": 1e-13, "n": 4.0}
RATE = 1e-13 * 100.0**4


def history(**changes) -> History:
    held = constant_stress(100.0, "stress")
    return History(**{"name": "test", "times": TIMES, "outputs": {}, "loading": held, "temperature": 1000.0, **changes})


def predicted(*histories: History, values=VALUES, **kwargs):
    return Uniaxial(tolerance=1e-9).predict(NORTON, NORTON.to_internal(values), histories, **kwargs)


def test_predictions_are_padded_to_the_longest_test() -> None:
    short = history(times=TIMES[:2], loading=constant_stress(50.0, "stress"))
    result = predicted(history(), short, values={"A": np.array([1e-13, 2e-13, 0.0]), "n": 4.0}, sensitivities=True)
    assert result.values.shape == (3, 2, 4, 1)
    assert result.jacobian is not None
    assert result.jacobian.shape == (3, 2, 4, 1, 2)
    assert result.lengths.tolist() == [4, 2]
    assert (result.status == Status.COMPLETE).all()
    np.testing.assert_allclose(result.of(0, 1)[:, 0], 2 * RATE * TIMES, rtol=1e-9)
    np.testing.assert_allclose(result.of(1)[:, 0], RATE / 16 * TIMES[:2], rtol=1e-9)
    assert (result.of(0, 2) == 0).all(), "0 switches the term off"
    assert np.isnan(result.values[:, 1, 2:]).all()
    np.testing.assert_allclose(result.jacobian[0, 0, :, 0, 0], RATE * TIMES, rtol=1e-9)
    np.testing.assert_allclose(result.jacobian[0, 0, :, 0, 1], RATE * TIMES * np.log(100), rtol=1e-9)


def test_tests_with_values_of_their_own_are_one_prediction() -> None:
    """Of bars in one call, of Narrow test by test, alone or as a part: each test as with its values alone."""
    own, narrow = Uniaxial(tolerance=1e-9), Narrow(unknown=())
    tests = [history(), history(times=TIMES[:3], loading=constant_stress(50.0, "load"), specimen="narrow")]
    theta = NORTON.to_internal({"A": np.array([1e-13, 3e-13, 2e-13, 0.0]), "n": 4.0}).reshape(2, 2, 2)
    for predictor in (own, narrow, CompositePredictor({"uniaxial": own, "narrow": narrow})):
        for nuisances in ({}, {"rate drift": np.array([[0.1, -0.2]])}):
            joint = predictor.predict(NORTON, theta, tests, nuisances=nuisances, sensitivities=True)
            for k, test in enumerate(tests):
                of_test = {key: values[:, [k]] for key, values in nuisances.items()}
                single = predictor.predict(NORTON, theta[:, k], [test], nuisances=of_test, sensitivities=True)
                for name in ("values", "jacobian"):
                    found, expected = getattr(joint, name)[:, k], getattr(single, name)[:, 0]
                    np.testing.assert_array_equal(found[:, : test.times.size], expected)


def test_engineering_strain_and_constant_load() -> None:
    """Norton under constant load: p = -ln(1 - n A s^n t)/n; the instrument shows exp(p) - 1."""
    load = history(loading=constant_stress(100.0, "load"))
    creep = -np.log1p(-4 * RATE * TIMES) / 4
    np.testing.assert_allclose(predicted(load).of(0)[:, 0], creep, rtol=1e-8)
    result = predicted(load.replace(strain_measure="engineering"), sensitivities=True)
    np.testing.assert_allclose(result.of(0)[:, 0], np.expm1(creep), rtol=1e-8)
    assert result.jacobian is not None
    by_log_A = np.exp(creep) * RATE * TIMES / (1 - 4 * RATE * TIMES)
    np.testing.assert_allclose(result.jacobian[0, 0, :, 0, 0], by_log_A, rtol=1e-7)


def test_elastic_strain_follows_the_program_and_the_modulus() -> None:
    steps = StressSteps(((0.0, 100.0), (50.0, 120.0)), "stress")
    heating = Program(np.array([0.0, 1000.0]), np.array([900.0, 1100.0]))
    elastic = Elastic(E=wachtman(200e3, 60.0, 300.0))
    moved = history(loading=steps, temperature=heating, elastic=elastic, includes_elastic=True)
    moduli = 200e3 - 60.0 * heating.at(TIMES) * np.exp(-300.0 / heating.at(TIMES))
    expected = np.array([100.0, 100.0, 120.0, 120.0]) / moduli
    np.testing.assert_allclose(elastic_strain(moved), expected, rtol=1e-12)
    creep = predicted(moved.replace(includes_elastic=False)).of(0)[:, 0]
    np.testing.assert_allclose(predicted(moved).of(0)[:, 0], creep + expected, rtol=1e-12)
    grown = RATE * np.where(TIMES < 50, TIMES, 50 + 1.2**4 * (TIMES - 50))
    np.testing.assert_allclose(creep, grown, rtol=1e-9)


def test_temperature_steps_reach_the_law() -> None:
    law = NORTON.times(arrhenius(T_ref=1000.0))
    warm = Program.steps([(0.0, 1000.0), (100.0, 1050.0)])
    result = Uniaxial(tolerance=1e-9).predict(law, law.to_internal({**VALUES, "Q": 3e5}), [history(temperature=warm)])
    faster = np.exp(-3e5 / 8.314462618 * (1 / 1050 - 1 / 1000))
    expected = RATE * np.array([0, 10, 100, 100 + 900 * faster])
    np.testing.assert_allclose(result.of(0)[:, 0], expected, rtol=1e-9)


def test_a_heating_ramp_is_integrated() -> None:
    """exp(c (T - T0)) is nearly Arrhenius; the reference is Gauss quadrature of the Arrhenius factor."""
    law = NORTON.times(arrhenius(T_ref=1000.0))
    ramp = Program(np.array([0.0, 1000.0]), np.array([1000.0, 1100.0]))
    result = Uniaxial(tolerance=1e-10).predict(law, law.to_internal({**VALUES, "Q": 3e5}), [history(temperature=ramp)])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    times = 500 * (nodes + 1)
    factor = np.exp(-3e5 / 8.314462618 * (1 / (1000 + 0.1 * times) - 1 / 1000))
    assert result.of(0)[-1, 0] == pytest.approx(RATE * 500 * (weights @ factor), rel=1e-8)


def test_a_burst_keeps_the_history_so_far() -> None:
    fast = {"A": 1e-9, "n": 4.0}
    run = ck.simulate(NORTON, Uniaxial(), fast, loading=constant_stress(100.0), times=[1.0, 2.0, 1e3])
    assert run.status is Status.RUPTURED
    assert run.end_time == pytest.approx((1 - np.exp(-4)) / (4 * 0.1), rel=1e-4)
    np.testing.assert_allclose(run.outputs["strain"], -np.log1p(-0.4 * run.times) / 4, rtol=1e-4)
    assert run.times.tolist() == [1.0, 2.0]
    assert run.reason == "creep strain reached the strain limit"
    assert (run.labels, run.rupture_time) == ({"ended": run.reason}, run.end_time)
    result = Uniaxial().predict(
        NORTON, NORTON.to_internal(fast), [history(loading=constant_stress(100.0), times=[1.0, 2.0, 1e3])]
    )
    assert result.status[0, 0] == Status.RUPTURED
    assert np.isfinite(result.of(0)[:2]).all()
    assert np.isnan(result.of(0)[2]).all()


def test_a_missing_value_is_named() -> None:
    with pytest.raises(LawError, match="needs a value for n"):
        ck.simulate(NORTON, Uniaxial(), {"A": 1e-13}, loading=constant_stress(100.0), times=TIMES)


# ---- uniaxial rupture ------------------------------------------------------------------------------------------------

# Bars followed to rupture: arrival and rupture times in closed form, and their derivatives.


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


# ---- bar states ------------------------------------------------------------------------------------------------------

# Internal variables of a simulated bar, against the closed form of Kachanov's damage at constant true stress.


# ---- threshold forms -------------------------------------------------------------------------------------------------

# A threshold written with Max or with Piecewise is one law: every specimen and reduced model predicts the same.


def threshold(form: str) -> ck.CreepLaw:
    A, n, s0 = ck.parameters("A n s0")
    excess = (
        sympy.Max(ck.stress - s0, 0) if form == "Max" else sympy.Piecewise((ck.stress - s0, ck.stress > s0), (0, True))
    )
    return ck.CreepLaw(
        name="threshold",
        title="A stress below which nothing creeps",
        terms={"threshold": A * excess**n},
        params={
            A: ck.Param("rate coefficient", unit="1/s", bounds=(1e-30, 1e-3), scale="log", off=0.0),
            n: ck.Param("stress exponent", bounds=(1, 10)),
            s0: ck.Param("threshold stress", unit="MPa", bounds=(0, 100)),
        },
    )


PRESSURES = ck.History(
    "dimple", np.linspace(100, 14400, 9), {}, ck.PressureJump(8, 10, 7200), 1073.0, "bulge", ck.Elastic(150e3)
)
BAR = ck.History("bar", np.linspace(100, 14400, 9), {}, ck.constant_stress(60.0), 1073.0)


@pytest.mark.parametrize(
    ("using", "history"),
    [(ck.specimen("bulge"), PRESSURES), (ck.specimen("bulge").reduced_order_model(), PRESSURES),
     (ck.specimen("uniaxial"), BAR)],
    ids=["finite elements", "reduced-order model", "bar"],
)  # fmt: skip
def test_both_forms_predict_the_same(using: ck.Predictor, history: ck.History) -> None:
    one, other = (
        using.predict(law, law.to_internal({"A": 1e-12, "n": 3.0, "s0": 40.0}), [history]).of(0)
        for law in map(threshold, ("Max", "Piecewise"))
    )
    assert np.ptp(one[:, 0]) > 0
    np.testing.assert_allclose(other, one, rtol=1e-12)


def test_a_loading_of_ones_own_that_does_not_say_holds_the_load_as_its_file_does(tmp_path):
    own = type("Own", (), {"quantity": "stress", "program": lambda _: Program.constant(80.0)})()
    run = ck.simulate("norton", "uniaxial", {"A": 1e-16, "n": 5.0}, loading=own, times=[1e4, 5e5])
    ck.write_history(run, tmp_path / "run.csv")
    held = ck.read_histories(tmp_path / "run.csv")[0].loading
    again = ck.simulate("norton", "uniaxial", {"A": 1e-16, "n": 5.0}, loading=held, times=[1e4, 5e5])
    np.testing.assert_allclose(run.outputs["strain"], again.outputs["strain"], rtol=1e-9)
