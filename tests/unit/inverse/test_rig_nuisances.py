"""Steps and drifts of temperature, rate and load: against closed forms and differences, planted ones found, groups."""

import re
from dataclasses import replace

import numpy as np
import pytest

from creepkit.errors import FitError
from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify, refit
from creepkit.language import Elastic, arrhenius
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import History, Nuisance, PressureJump, constant_stress
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.uniaxial import Uniaxial

T_REF, R = 1048.15, 8.314462618
LAW = NORTON.times(arrhenius(T_ref=T_REF))
VALUES = {"A": 3e-16, "n": 4.5, "Q": 420e3}
THETA = LAW.to_internal(VALUES)[0]
START = 8250.0
BAR, FINE = Uniaxial(), Uniaxial(tolerance=1e-9)
STEPS = {
    **{"temperature step@8250": (-11.0, 1.0), "temperature drift": (5.0, 1.0), "load step@8250": (0.05, 2e-3)},
    **{"rate step@8250": (-0.4, 0.01), "rate drift": (0.3, 0.01)},
}
"""{key: (value, step of a central difference)}."""


def bar(name, stress=90.0, temperature=1040.0, end=14400.0, frames=24):
    return History(name, np.linspace(600.0, end, frames), {}, constant_stress(stress, "stress"), temperature)


def rate(stress=90.0, temperature=1040.0):
    """1/s, by hand."""
    return VALUES["A"] * stress ** VALUES["n"] * np.exp(-VALUES["Q"] / R * (1 / temperature - 1 / T_REF))


def strain(nuisances, test=None, predictor=FINE, law=LAW, theta=THETA):
    test = test or bar("one")
    given = {key: np.array([[value]]) for key, value in nuisances.items()}
    return predictor.predict(law, theta[None], [test], nuisances=given).values[0, 0, :, 0]


# ---- values ------------------------------------------------------------------------------------------------------


def test_steps_and_drifts_of_a_steady_rate_have_closed_forms():
    """Norton at one stress: the strain is the rate's integral; a step's ramp of 5 s counts by its mean (1e-4 here)."""
    t = bar("one").times
    after, before = np.maximum(t - START - 2.5, 0.0), np.minimum(t, START + 2.5)
    away = np.abs(t - START) > 10
    cases = {
        "temperature step@8250": (-11.0, rate(temperature=1029.0)),
        "rate step@8250": (-0.4, rate() * np.exp(-0.4)),
        "load step@8250": (0.05, rate() * 1.05 ** VALUES["n"]),
    }
    for key, (value, later) in cases.items():
        expected = rate() * before + later * after
        np.testing.assert_allclose(strain({key: value})[away], expected[away], rtol=2e-5)
    growth = 0.3 / t[-1]
    np.testing.assert_allclose(strain({"rate drift": 0.3}), rate() * np.expm1(growth * t) / growth, rtol=1e-6)


def test_a_rate_step_reaches_internal_variables_and_hardening_laws():
    """Strain hardening, rate = A s^n e^m: e^(1-m)/(1-m) grows as A s^n times the integral of the factor."""
    law = STRAIN_HARDENING
    values = dict(zip(law.names, (1e-15, 4.0, -0.5), strict=True))
    t, factor = bar("one").times, np.exp(0.7)
    found = strain({"rate step@8250": 0.7}, law=law, theta=law.to_internal(values)[0])
    time = np.minimum(t, START + 2.5) + factor * np.maximum(t - START - 2.5, 0.0)
    away = np.abs(t - START) > 10
    expected = (1.5 * 1e-15 * 90.0**4 * time) ** (1 / 1.5)
    np.testing.assert_allclose(found[away], expected[away], rtol=2e-4)


# ---- derivatives -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", STEPS)
def test_derivatives_of_bars_are_those_of_differences(key):
    tests, (value, step) = [bar("one"), bar("two", 70.0, 1060.0, 12000.0, 20)], STEPS[key]
    values = {key: np.array([[value, 0.5 * value]])}
    found = BAR.predict(LAW, THETA[None], tests, nuisances=values, sensitivities=True)
    up, down = (FINE.predict(LAW, THETA[None], tests, nuisances={key: values[key] + s}).values for s in (step, -step))
    expected = (up - down) / (2 * step)
    largest = np.nanmax(np.abs(expected))
    assert largest > 0
    present = np.isfinite(expected)
    np.testing.assert_allclose(found.nuisance_jacobian[key][present], expected[present], atol=1e-3 * largest)
    plain = BAR.predict(LAW, THETA[None], tests, nuisances={key: 0.0 * values[key]}, sensitivities=True)
    assert plain.jacobian.shape == found.jacobian.shape == (1, 2, 24, 1, 3)


@pytest.mark.parametrize("key", STEPS)
def test_derivatives_of_finite_elements_are_those_of_differences(key):
    """Against differences of runs with a hundredth of the step tolerance; the modulus depends on temperature."""
    from creepkit.language import temperature

    test = History(
        "one", np.linspace(1200.0, 14400.0, 12), {}, PressureJump(8.0, 8.0, 10800.0), 1040.0, "bulge",
        elastic=Elastic(210e3 - 100 * temperature),
    )  # fmt: skip
    (value, step), coarse, fine = STEPS[key], Bulge(refinement=0.5), Bulge(refinement=0.5, tolerance=1e-4)
    values = {key: np.array([[value]])}
    found = coarse.predict(LAW, THETA[None], [test], nuisances=values, sensitivities=True)
    found = found.nuisance_jacobian[key][0, 0, :, 0]
    up, down = (
        fine.predict(LAW, THETA[None], [test], nuisances={key: values[key] + s}).values[0, 0, :, 0]
        for s in (step, -step)
    )
    expected = (up - down) / (2 * step)
    np.testing.assert_allclose(found, expected, atol=5e-3 * np.abs(expected).max())


# ---- identification ----------------------------------------------------------------------------------------------

NAMES = tuple(f"bar_{k}" for k in range(6))
SLOW, FAST = NAMES[:4], NAMES[4:]
GROUPS = (
    Nuisance("temperature step", "all", sd=30.0, start=START, tests=SLOW),
    Nuisance("temperature step", "all", sd=30.0, start=START, tests=FAST),
)
QUICK = IdentificationSettings(starts=1, sobol_points=8, nuisances=GROUPS, weights="likelihood")


def planted(noise=2e-6):
    """Six bars whose furnace fell by 11 K, in the last two by 24 K, at 8250 s; made with another tolerance."""
    rng, tests = np.random.default_rng(3), []
    for k, name in enumerate(NAMES):
        plan = bar(name, (70.0, 90.0, 110.0)[k % 3], (1030.0, 1050.0)[k % 2])
        clean = strain({"temperature step@8250": -24.0 if name in FAST else -11.0}, plan)
        tests.append(plan.replace(outputs={"strain": clean + noise * rng.normal(size=clean.size)}))
    return tests


@pytest.fixture(scope="module")
def fit():
    return identify(LAW, planted(), BAR, settings=QUICK)


def test_planted_steps_of_two_groups_are_found(fit):
    assert [n.owner for n in fit.nuisances] == ["bar_0 and 3 more", "bar_4 and 1 more"]
    for n, truth in zip(fit.nuisances, (-11.0, -24.0), strict=True):
        assert n.key == "temperature step@8250"
        assert abs(n.value - truth) < 4 * n.sd
        assert n.sd < 3.0
    assert all(e.low <= VALUES[e.name] <= e.high for e in fit.estimates)
    assert re.search(r"temperature step@8250 +bar_4 and 1 more +-2.*K", fit.details())


def test_other_tests_are_predicted_with_the_step_of_their_group(fit):
    """A stranger has none; a named one has its group's, also where it is held out."""
    tests = planted()
    slow, fast = (n.value for n in fit.nuisances)
    values = fit.nuisance_values([tests[0], tests[5], tests[0].replace(name="stranger")], own_nuisances=False)
    np.testing.assert_allclose(values["temperature step@8250"], [[slow, fast, 0.0]])
    without_last = refit(fit, tests[:5])
    value = without_last.nuisance_values([tests[5]], own_nuisances=False)["temperature step@8250"][0, 0]
    assert value == without_last.nuisances[1].value != 0.0
    without_group = refit(fit, tests[:4])
    assert without_group.nuisance_values([tests[5]])["temperature step@8250"][0, 0] == 0.0


def test_a_prior_holds_a_step_that_the_tests_do_not_show(fit):
    """A step that comes after the last frame is refused, and one of standard deviation 0.01 K stays at its mean."""
    late = replace(GROUPS[0], start=20000.0)
    with pytest.raises(FitError, match="'temperature step@20000' means nothing to the predictor of these histories"):
        identify(LAW, planted(), BAR, settings=replace(QUICK, nuisances=(late,)))
    tight = replace(GROUPS[0], mean=-3.0, sd=0.01)
    held = identify(LAW, planted(), BAR, settings=replace(QUICK, nuisances=(tight, GROUPS[1])))
    assert abs(held.nuisances[0].value + 3.0) < 0.5


def test_a_rate_step_takes_the_place_where_a_law_has_no_temperature():
    plain = LAW.fix(Q=VALUES["Q"]).at(1040.0)
    rng, tests = np.random.default_rng(5), []
    for k, name in enumerate(NAMES):
        plan = bar(name, (70.0, 90.0, 110.0)[k % 3])
        clean = strain({"temperature step@8250": -24.0 if name in FAST else -11.0}, plan)
        tests.append(plan.replace(outputs={"strain": clean + 2e-6 * rng.normal(size=clean.size)}))
    with pytest.raises(FitError, match=r"has no temperature and cannot follow a temperature step; take a 'rate step'"):
        identify(plain, tests, BAR, settings=QUICK)
    steps = tuple(replace(n, kind="rate step", sd=1.0) for n in GROUPS)
    found = identify(plain, tests, BAR, settings=replace(QUICK, nuisances=steps))
    for n, kelvin in zip(found.nuisances, (-11.0, -24.0), strict=True):
        expected = -VALUES["Q"] / R * (1 / (1040.0 + kelvin) - 1 / 1040.0)
        assert abs(n.value - expected) < 4 * n.sd
        assert n.sd < 0.05


# ---- settings ----------------------------------------------------------------------------------------------------
