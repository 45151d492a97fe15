"""The uniaxial specimen: shapes, observation operators, endings, and errors in one clear sentence."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import LawError, SolveError
from creepkit.language import Elastic, arrhenius, wachtman
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import History, Program, Status, StressSteps, constant_stress
from creepkit.specimens.bar import elastic_strain
from creepkit.specimens.uniaxial import Uniaxial

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


def test_a_logged_temperature_of_thousands_of_rows_is_integrated() -> None:
    """A thermocouple's zigzag of +- 3 K: each leg takes the mean of the Arrhenius factor, by Gauss quadrature."""
    law = NORTON.times(arrhenius(T_ref=1000.0))
    ends = np.linspace(0.0, 1000.0, 3001)
    logged = Program(ends, 1000.0 + 3.0 * (-1.0) ** np.arange(ends.size))
    nodes, weights = np.polynomial.legendre.leggauss(10)
    factor = 0.5 * (weights @ np.exp(-3e5 / 8.314462618 * (1 / (1000 + 3 * nodes) - 1 / 1000)))
    result = Uniaxial().predict(law, law.to_internal({**VALUES, "Q": 3e5}), [history(temperature=logged)])
    assert result.of(0)[-1, 0] == pytest.approx(RATE * 1000 * factor, rel=1e-5)


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


def test_simulate_adds_the_elastic_strain_when_elastic_data_are_given() -> None:
    held = constant_stress(100.0, "stress")
    run = ck.simulate(NORTON, Uniaxial(), VALUES, loading=held, times=TIMES, elastic=Elastic(E=150e3))
    np.testing.assert_allclose(run.outputs["strain"], RATE * TIMES + 100 / 150e3, rtol=1e-9)
    assert (run.status, run.reason, run.end_time) == (Status.COMPLETE, "", 1000.0)
    assert run.includes_elastic
    np.testing.assert_array_equal(Uniaxial().run(NORTON, VALUES, run).outputs["strain"], run.outputs["strain"])


def test_tolerance_tightens_the_answer() -> None:
    times = np.linspace(100, 1e5, 20)
    law = NORTON + STRAIN_HARDENING
    values = {"A_1": 1e-16, "n_1": 4.0, "A_2": 1e-18, "n_2": 4.0, "m": -0.8}
    exact = Uniaxial(tolerance=1e-11).predict(law, law.to_internal(values), [history(times=times)]).of(0)
    errors = [
        np.abs(
            Uniaxial(tolerance=tolerance).predict(law, law.to_internal(values), [history(times=times)]).of(0) / exact
            - 1
        ).max()
        for tolerance in (1e-4, 1e-6, 1e-8)
    ]
    assert errors[0] < 1e-3
    assert errors[1] < 1e-5
    assert errors[2] < 1e-7


def test_a_missing_value_is_named() -> None:
    with pytest.raises(LawError, match="needs a value for n"):
        ck.simulate(NORTON, Uniaxial(), {"A": 1e-13}, loading=constant_stress(100.0), times=TIMES)


def test_an_early_end_names_values_outside_their_bounds_and_a_modulus_in_gpa() -> None:
    import creepkit as ck

    times = np.linspace(1.0, 7200.0, 10)
    with pytest.raises(SolveError, match="; n = 40 lies outside its bounds, 1 to 8$"):
        ck.simulate("norton", "uniaxial", {"A": 1e-16, "n": 40.0}, loading=constant_stress(100.0), times=times)
    soft = ck.simulate(
        "norton", "bulge", {"A": 1e-16, "n": 5.0}, loading=ck.PressureJump(8, 10, 3600), times=times,
        temperature=1073.0, elastic=ck.Elastic(E=150.0),
    )  # fmt: skip
    assert soft.reason.endswith("; E is 150 MPa (write 150000 if GPa were meant)")
    assert soft.labels["ended"] == soft.reason
