"""Conditions: numbers that tests state beside load and temperature, in laws, fits, forecasts and exports."""

import json
import pickle

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.language import CreepLaw, Param, conditions, parameters, stress
from creepkit.language.law_codec import law_from_json, law_to_json
from helpers.exported_programs import LANGUAGES, rates

A, n, p = parameters("A n p")
d, dose = *conditions("grain_size", unit="mm"), *conditions("dose", unit="dpa")
TABLE = {A: Param("rate", (1e-25, 1e-8), "1/s", "log"), n: Param("exponent", (1, 10)), p: Param("of grains", (0, 4))}
LAW = CreepLaw("grains", {"power": A * stress**n * (d / 0.05) ** -p}, TABLE)
PLANTED = {"A": 1e-16, "n": 4.2, "p": 2.0}


def bar(size: str, load: float, rng: np.random.Generator) -> ck.History:
    """Under a constant load, integrated by scipy; its rate scatters by 5 %."""
    rate = 1e-16 * (float(size) / 50) ** -2 * np.exp(0.05 * rng.normal())
    times = np.linspace(0, 0.02 / (rate * load**4.2), 41)[1:]
    run = solve_ivp(lambda _, e: rate * (load * np.exp(e)) ** 4.2, (0, times[-1]), [0.0], t_eval=times, rtol=1e-9)
    readings, labels = {"strain": run.y[0] + 2e-5 * rng.normal(size=40)}, {"grain": "x", "grain size (um)": size}
    return ck.History(f"{size} {load}", times, readings, ck.constant_stress(load), 1000.0, labels=labels)


def test_a_planted_grain_size_exponent_is_found_and_its_forecast_asks_for_the_size(tmp_path):
    rng = np.random.default_rng(1)
    fit = ck.identify(LAW, [bar(size, load, rng) for size in ("20", "50", "120") for load in (60.0, 80.0, 110.0)])
    exponent = fit.estimates[2]
    assert exponent.low < 2.0 < exponent.high < exponent.low + 0.4
    assert ck.design(fit).tests[0].histories[0].labels["grain size (um)"] != "50"  # where p changes nothing
    fit.save(tmp_path / "fit.json")
    plan = ck.History("plan", [1e5, 1e6], {}, ck.constant_stress(70.0), 1000.0)
    with pytest.raises(ck.errors.HistoryError, match="states no grain size.*label grain size: 1 mm"):
        ck.forecast(fit, plan)
    (test,) = ck.forecast(ck.load(tmp_path / "fit.json"), plan.replace(labels={"grain_size": "0,2 mm"})).tests
    assert "grain_size 0.2 (the tests cover 0.02 to 0.12" in test.extrapolation


def test_a_test_counts_by_the_error_that_it_states_of_its_size():
    """A bar of 120 um stated as 75 ± 40 um leaves the exponent that the others give."""
    rng = np.random.default_rng(3)
    *others, last = [bar(size, load, rng) for size in ("20", "50", "120") for load in (60.0, 80.0, 110.0)]
    labels = [{"grain_size": text} for text in ("75 um", "75 ± 40 um")]
    found = [
        ck.identify(LAW, [*others, *more]).values["p"] for more in ([], *([last.replace(labels=s)] for s in labels))
    ]
    assert abs(found[2] - found[0]) < 0.05 * abs(found[1] - found[0]) > 0.005


IRRADIATED = CreepLaw(
    "irradiated", {"power": A * stress**n * d**-p * (1 + dose)}, TABLE, "With dose", references="here"
)


def test_two_conditions_survive_files_and_have_a_place_in_solvers_or_need_a_number():
    law = IRRADIATED
    assert law_from_json(json.loads(json.dumps(law_to_json(law)))) == law == pickle.loads(pickle.dumps(law))
    assert "@ExternalStateVariable real grain_size;" in ck.export(law, "mfront", PLANTED)
    assert "outside(1, 3) = predef(2) - dpred(2)" in ck.export(law, "abaqus", PLANTED)
    with pytest.raises(ck.errors.ExportError, match="no place for conditions.*give dose, grain_size"):
        ck.export(law, "calculix", PLANTED)
    assert "coefficient = 1.666666666667e-13" in ck.export(law, "moose", PLANTED | {"grain_size": 0.03, "dose": 0.5})
    assert ck.check_law(law).passed


@pytest.mark.parametrize("language", LANGUAGES)
def test_conditions_are_inputs_of_programs(language, tmp_path):
    """A s^n d^-p (1 + dose) in 50 digits."""
    points = [{"stress": s, "grain_size": size, "dose": 0.7} for s in (5.0, 300.0) for size in (0.003, 0.4)]
    found = rates(language, tmp_path, ck.law_with_values(IRRADIATED, PLANTED), points)[:, 0]
    with mpmath.workdps(50):
        s, size = (np.array([mpmath.mpf(point[name]) for point in points]) for name in ("stress", "grain_size"))
        exact = mpmath.mpf(1e-16) * s ** mpmath.mpf(4.2) * size**-2 * (1 + mpmath.mpf(0.7))
    assert max(abs(found / exact - 1)) < 1e-14
