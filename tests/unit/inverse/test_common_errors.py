"""Errors common to all tests, against identifications in which every test has them."""

from dataclasses import replace

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.iterative_estimation import linearised
from creepkit.inverse.perturbations import USUAL_ACTIVATION_ENERGY, common_errors
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import USUAL_ERRORS, IdentificationSettings
from creepkit.language import arrhenius
from creepkit.laws.norton import NORTON
from creepkit.records import Nuisance, constant_stress
from creepkit.specimens.uniaxial import Uniaxial
from helpers.steady_rate_predictor import Steady, planted

T_REF, R = 1000.0, 8.314462618
AT_TEMPERATURES = NORTON.times(arrhenius(T_ref=T_REF))
VALUES = {"A": 1e-15, "n": 4.0, "Q": 316e3}
CONDITIONS = [(60.0, 1000.0), (70.0, 980.0), (80.0, 1000.0), (70.0, 1020.0), (65.0, 1010.0)]
RATE = Nuisance("rate")
SETTINGS = IdentificationSettings(starts=1, sobol_points=8, weights="likelihood", nuisances=(RATE,))


def identified(tests, law=AT_TEMPERATURES, settings=SETTINGS):
    return identify(law, tests, Steady(), settings=settings)


def planted_at(conditions=CONDITIONS, law=AT_TEMPERATURES, values=VALUES):
    return planted(law, values, conditions, seed=4, rate=0.05, noise=2e-5)


def common(fit):
    return {e.kind: e for e in fit.unmodelled if e.common}


@pytest.mark.parametrize("weights", ["likelihood", "noise"])
def test_temperatures_and_loads_that_are_off_in_all_tests_move_the_rate_as_identifications_say(weights):
    settings = replace(SETTINGS, weights=weights)
    tests = planted_at()
    fit = identified(tests, settings=settings)
    stress, T = fit.reference.stress, fit.reference.temperature
    hotter = [h.replace(temperature=h.temperature + USUAL_ERRORS["temperature"]) for h in tests]
    heavier = [
        h.replace(loading=constant_stress(h.loading.program().values[0] * (1 + USUAL_ERRORS["load"]), "stress"))
        for h in tests
    ]
    for kind, altered in (("temperature", hotter), ("load", heavier)):
        again = identified(altered, settings=settings)
        moved = np.log(again.rate(stress, temperature=T)[0] / fit.rate(stress, temperature=T)[0])
        assert common(fit)[kind].rate_change == pytest.approx(moved, rel=0.02)


def test_a_law_without_temperature_takes_the_usual_energy_and_says_so():
    tests = planted_at([(60.0, 1020.0), (70.0, 1020.0), (80.0, 1020.0)], NORTON, {"A": 1e-15, "n": 4.0})
    effect = common(identified(tests, NORTON))["temperature"]
    expected = -USUAL_ACTIVATION_ENERGY / (R * 1020.0**2) * USUAL_ERRORS["temperature"]
    assert effect.rate_change == pytest.approx(expected, rel=1e-3)
    assert effect.sentence == (
        "by -13 % with temperatures 3 K above those stated, in all 3 tests (4.7 % a kelvin, assumed, as the law has no "
        "temperature)"
    )


def test_a_law_with_temperature_takes_its_own_energy():
    fit = identified(planted_at())
    effect = common(fit)["temperature"]
    assert effect.per_kelvin == pytest.approx(fit.values["Q"] / (R * fit.reference.temperature**2), rel=1e-3)
    assert not effect.assumed
    assert "assumed" not in effect.sentence


def test_a_nuisance_parameter_of_all_tests_stands_for_the_temperature_and_one_of_each_test_does_not():
    bar, tests = Uniaxial(), planted_at()
    for scope, expected in (("all", {"load"}), ("test", {"load", "temperature"})):
        settings = replace(SETTINGS, nuisances=(RATE, Nuisance("temperature", scope, sd=3.0)))
        problem = LeastSquaresProblem.from_histories(AT_TEMPERATURES, tests, bar, settings)
        nuisances = problem.nuisance_parameters
        x = np.concatenate([problem.coordinates.u(AT_TEMPERATURES.to_internal(VALUES)[0]), nuisances.mean])
        linear = linearised(problem, x, problem.residuals(x))
        assert {e.kind for e in common_errors(problem, x, linear)} == expected
