"""discover() and refit() from creep curves to an ordinary law, on a closed-form predictor and on one dimple."""

import sys
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

import creepkit as ck
from creepkit.discovery.discover import discover, group_by_temperature, isothermal_tests, temperature_study
from creepkit.discovery.regression import check_identifications
from creepkit.errors import FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.reference_conditions import spans_temperatures
from creepkit.inverse.settings import IdentificationSettings
from creepkit.kernels import lower
from creepkit.language import arrhenius, linear, temperature
from creepkit.laws.norton import NORTON
from creepkit.records import History, Program, constant_stress
from helpers.steady_rate_predictor import Steady, planted

T_REF = 1023.15
TRUE = NORTON.with_temperature(n=linear(T_REF)).times(arrhenius(T_REF))
TRUTH = {"A": 1.5e-16, "n": 4.6, "n_T": -8e-3, "Q": 4.2e5}
FIVE = (973.0, 1000.5, 1028.0, 1055.5, 1083.0)
QUICK = IdentificationSettings(starts=1, sobol_points=8, frames=12)
FEW = {"A": ("arrhenius", "logarithmic"), "n": ("constant", "linear", "inverse")}


@pytest.fixture(scope="module")
def tests():
    conditions = [(stress, T) for T in FIVE for stress in (60.0, 90.0, 120.0)]
    return planted(TRUE, TRUTH, conditions, seed=4, rate=0.01, noise=1e-5, frames=16)


@pytest.fixture(scope="module")
def alone(tests):
    return [identify(NORTON, group, Steady(), settings=QUICK) for group in group_by_temperature(tests)]


@pytest.fixture(scope="module")
def trend(alone, tests):
    return discover(alone, forms=FEW, histories=tests)


def inside(trend):
    return {e.name: e.low <= TRUTH[e.name] <= e.high for e in trend.estimates}


# ---- from curves to a law ------------------------------------------------------------------------------------------


def test_estimates_alone_hold_the_planted_form_and_energy(alone):
    found = discover(alone, forms=FEW)
    assert found.criterion_data == "points"
    assert found.fit is None
    assert {"arrhenius"} <= {form.name for form in found.plausible_forms["A"]}
    assert {"linear"} <= {form.name for form in found.plausible_forms["n"]}
    assert inside(found)["Q"]
    assert sum(one.weight for one in found.candidates) == pytest.approx(1.0)


def test_the_curves_themselves_decide(trend):
    assert trend.criterion_data == "histories"
    assert trend.forms == {"A": "arrhenius", "n": "linear"}
    assert trend.candidates[0].weight > 0.9
    assert all(inside(trend).values())
    assert trend.fit.law == trend.law
    plain = next(one for one in trend.candidates if one.forms["n"] == "constant")
    assert plain.criterion_difference > 50


def test_the_law_is_an_ordinary_one(trend, tmp_path):
    assert trend.law.names == ("A", "Q", "n", "n_T")
    assert trend.law.uses(temperature)
    text = ck.export(trend, "python", to=tmp_path / "law.py")
    space = {}
    exec(compile(text, "law.py", "exec"), space)
    for T in (980.0, 1050.0):
        expected = float(lower(trend.law, "numpy").rate(trend.values, stress=80.0, temperature=T))
        assert space["rate"](80.0, temperature=T) == pytest.approx(expected, rel=1e-12)
        now = {name: float(v[0]) for name, v in trend.parameters_at(T).items()}
        assert float(lower(NORTON, "numpy").rate(now, stress=80.0)) == pytest.approx(expected, rel=1e-9)
    assert "valid between 973 and 1083 K" in ck.export(trend.valued, "latex")


def test_parameters_that_may_not_depend_on_temperature(alone):
    found = discover(alone, forms=FEW, parameters=("A",))
    assert found.forms["n"] == "constant"


def test_beyond_its_range_a_law_is_not_asked(trend):
    with pytest.raises(FitError, match="holds between 973 and 1083 K; it was evaluated outside"):
        trend.parameters_at(1100.0)
    with pytest.raises(FitError, match="has no parameter 'n_t': did you mean 'n_T'"):
        trend.estimate("n_t")


def test_a_study_groups_tests_and_finds_the_same(tests, trend):
    found = temperature_study(NORTON, tests, Steady(), settings=QUICK, forms=FEW)
    assert found.moduli_fit is None
    assert len(found.isothermal_fits) == 5
    assert found.joint_fit.law.names == ("A", "n", "Q")
    assert found.temperature_law.forms == trend.forms
    assert "use norton*arrhenius for " in str(found)


def test_moduli_are_found_with_the_settings_of_the_study(tests, monkeypatch):
    asked = {}

    def moduli(law, histories, using, **how):
        asked.update(how)
        raise FitError("no more")

    monkeypatch.setattr(sys.modules["creepkit.discovery.discover"], "moduli", moduli)
    with pytest.raises(FitError, match="no more"):
        temperature_study(NORTON, tests, Steady(), settings=QUICK, moduli=True)
    assert asked == {"settings": QUICK}


def stepped(test, kelvin):
    """The test with a step of temperature in the middle of its frames, which its strains do not follow."""
    middle = float(test.times[test.times.size // 2])
    T = Program.steps([(0.0, test.temperature), (middle, test.temperature + kelvin)])
    return test.replace(name=f"step of {kelvin:g} K", temperature=T)


def test_a_test_with_a_step_of_temperature_is_left_out_by_its_name(tests, trend):
    """The law is that of the other tests alone, and the note says which test is missing and why."""
    step = stepped(tests[7], 20.0)
    found = temperature_study(NORTON, [*tests, step], Steady(), settings=QUICK, forms=FEW)
    assert found.notes == ("step of 20 K (755 to 775 °C) is left out, for it is not at one temperature",)
    assert found.temperature_law.values == pytest.approx(trend.values, rel=1e-9)
    assert [h.name for h in found.tests] == [h.name for h in tests]
    with pytest.raises(FitError, match="no test is at one temperature: step of 20 K"):
        temperature_study(NORTON, [step], Steady(), settings=QUICK)


def test_what_happened_after_the_last_used_frame_does_not_count(tests):
    """A test that is cut at its step is one at a single temperature for all that is said of temperatures."""
    step = stepped(tests[7], 20.0)
    cut = step.replace(used=np.arange(step.times.size) <= step.times.size // 2)
    assert isothermal_tests([cut]) == ([cut], "")
    before = step.replace(used=np.arange(step.times.size) < step.times.size // 2)
    assert before.mean_temperature == tests[7].temperature
    assert not spans_temperatures([before])


def test_the_drift_of_furnaces_is_no_span_of_temperatures(alone):
    """Means 2 K apart, each record 4 K wide, are one temperature though readings span 6 K; a test 6 K wide is not."""
    fit = alone[0]
    for half, refused in ((2.0, False), (3.0, True)):
        records = [Program([0.0, h.times[-1]], [-half, half]) for h in fit.histories]
        means = zip(fit.histories, records, (972.0, 974.0, 974.0), strict=True)
        drift = tuple(h.replace(temperature=Program(one.times, T + one.values)) for h, one, T in means)
        fits = [replace(fit, ranges={**fit.ranges, "temperature": (969.0, 977.0)}, histories=drift), *alone[1:]]
        with pytest.raises(FitError, match="identify each temperature alone") if refused else nullcontext():
            check_identifications(fits)


# ---- the command ---------------------------------------------------------------------------------------------------


# ---- what cannot be known ------------------------------------------------------------------------------------------


# ---- a dimple ------------------------------------------------------------------------------------------------------


# ---- paper law -------------------------------------------------------------------------------------------------------

# The paper's own law, Eq. (1), over four temperatures: forms planted by quadrature are found among all forms.


REFERENCE, PAPER_TRUTH = 1033.15, {"n_0": 3.6, "n_inf": 4.4, "C": 1.0, "tau_d": 6000.0, "tau_r": 2500.0}
A, Q, SLOPE = 4e-16, 4.1e5, -4e-3


def strain(times, stress, T):
    """Integral of A exp[-(Q/R)(1/T - 1/T_ref)] s^n(t) over time, by Simpson's rule; n_inf is linear in T."""
    n_inf = PAPER_TRUTH["n_inf"] + SLOPE * (T - REFERENCE)
    n = n_inf + (PAPER_TRUTH["C"] + PAPER_TRUTH["n_0"] - n_inf) * np.exp(-times / PAPER_TRUTH["tau_d"])
    n = n - PAPER_TRUTH["C"] * np.exp(-times / PAPER_TRUTH["tau_r"])
    rate = A * np.exp(-Q / 8.314462618 * (1 / T - 1 / REFERENCE)) * stress**n
    return cumulative_simpson(rate, x=times, initial=0)


@pytest.fixture(scope="module")
def campaign():
    """What discover finds, and the steps that it reports."""
    rng, tests, fine, used = np.random.default_rng(4), [], np.linspace(0, 30000, 6001), np.geomspace(300, 30000, 24)
    for T in (973.15, 1013.15, 1053.15, 1093.15):
        for stress in (60.0, 85.0, 120.0):
            exact = np.interp(used, fine, strain(fine, stress, T))
            sd = np.full(used.size, max(1e-5, 3e-3 * exact[-1]))
            measured = {"strain": exact + rng.normal(0, 1, used.size) * sd}
            loading = constant_stress(stress, "stress")
            tests.append(
                History(f"{stress:g} MPa {T:g} K", used, measured, loading, T, standard_deviation={"strain": sd})
            )
    law, steps = ck.law("drifting-exponent").fix(m=0), []
    fits = [ck.identify(law, group) for group in group_by_temperature(tests)]
    found = discover(fits, histories=tests, progress=lambda *step: steps.append(step))
    return found, steps


def test_the_planted_forms_are_found_among_the_default_ones(campaign):
    found, _ = campaign
    for name in ("n_0", "C", "tau_d", "tau_r"):
        assert found.forms[name] == "constant"
    assert found.forms["A"] == "arrhenius"
    assert "linear" in [form.name for form in found.plausible_forms["n_inf"]]
    assert found.adequacy.verdict == "explains"


def test_the_planted_values_lie_in_their_intervals(campaign):
    found, _ = campaign
    values = {"A": A, "Q": Q, **PAPER_TRUTH} | ({"n_inf_T": SLOPE} if found.forms["n_inf"] == "linear" else {})
    outside = [name for name, value in values.items() if not _inside(found.estimate(name), value)]
    assert len(outside) <= 1  # of eight intervals at 95 %
    T = np.array([973.15, 1093.15])
    assert found.parameters_at(T)["n_inf"] == pytest.approx(PAPER_TRUTH["n_inf"] + SLOPE * (T - REFERENCE), abs=0.05)


def _inside(estimate, value):
    return estimate.low <= value <= estimate.high
