"""identify(): planted values come back inside their intervals, and what is not determined is said."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.errors import FitError, FitWarning
from creepkit.inverse.candidates import candidates, named_candidates
from creepkit.inverse.cross_validation import cross_validate
from creepkit.inverse.extrapolation import extrapolation_text, outside_combinations
from creepkit.inverse.history_checks import suspect_frames_note, without_suspect_frames
from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.inverse.reference_conditions import frame_noise
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.ranking import ModelAverage
from creepkit.language import arrhenius
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.records import History, Nuisance, StressSteps, constant_stress
from helpers.steady_rate_predictor import Steady, planted

LAW = NORTON.times(arrhenius(T_ref=1073.15))
TRUTH = {"A": 1e-16, "n": 5.2, "Q": 350e3}
CONDITIONS = [(s, T) for T in (1000.0, 1050.0, 1100.0) for s in (30.0, 50.0, 80.0)]
QUICK = IdentificationSettings(starts=3, sobol_points=16, frames=20)


@pytest.fixture(scope="module")
def tests():
    return planted(LAW, TRUTH, CONDITIONS, seed=5, rate=0.2, offset=5e-5, noise=1e-5)


@pytest.fixture(scope="module")
def fit(tests):
    return identify(LAW, tests, Steady(), settings=QUICK)


def test_planted_values_lie_in_their_intervals(fit):
    for e in fit.estimates:
        assert e.low <= TRUTH[e.name] <= e.high
        is_within_a_decade = e.name != "A" or e.high <= 10 * e.low
        assert e.verdict == ("determined" if is_within_a_decade else "poorly determined")


def test_without_scatter_the_values_are_exact():
    """No noise at all: least squares must return the planted numbers to the tolerance of the search."""
    fit = identify(LAW, planted(LAW, TRUTH, CONDITIONS, seed=0), Steady(), settings=QUICK)
    for e in fit.estimates:
        assert e.value == pytest.approx(TRUTH[e.name], rel=1e-4 if e.name != "A" else 2e-3)


def test_rate_band_contains_the_truth(fit):
    stress = np.array([30.0, 50.0, 80.0])
    rate, low, high = fit.rate(stress, 1050.0)
    truth = TRUTH["A"] * stress ** TRUTH["n"] * np.exp(-TRUTH["Q"] / 8.314462618 * (1 / 1050 - 1 / 1073.15))
    assert ((low < truth) & (truth < high)).all()
    assert ((low < rate) & (rate < high)).all()


def test_one_stress_leaves_the_exponent_undetermined():
    tests = planted(NORTON, {"A": 1e-16, "n": 5.2}, [(50.0, 1050.0)] * 4, seed=2, rate=0.1, noise=1e-5)
    fit = identify(NORTON, tests, Steady(), settings=QUICK)
    verdicts = {e.name: e.verdict for e in fit.estimates}
    assert verdicts["n"] == "not determined"
    assert any("one stress" in note for note in fit.notes)
    assert "not determined" in fit.details()
    _, low, high = fit.rate(50.0, 1050.0)
    assert low < 1e-16 * 50**5.2 < high
    assert float(high / low) < 2


def test_power_law_and_sinh_over_a_narrow_stress_range_are_one_function():
    """A sinh at x << 1 is a power law: it is no other answer, and a threshold is not excluded by these stresses."""
    tests = planted(
        NORTON, {"A": 1e-14, "n": 4.0}, [(s, 1050.0) for s in (50, 55, 60, 50, 55, 60)], seed=4, rate=0.1, noise=1e-5
    )
    fits = [identify(law, tests, Steady(), settings=QUICK) for law in (NORTON, HYPERBOLIC_SINE)]
    ranking = rank(fits)
    assert [(r.fit.law.name, r.same_as) for r in ranking.laws] == [("norton", ""), ("hyperbolic-sine", "norton")]
    assert ranking.verdict.startswith("not decisive")
    assert "norton above a threshold" in ranking.verdict


def test_leaving_conditions_out_predicts_each_once(fit, tests):
    folds = cross_validate(fit, tests, by="condition")
    assert sorted(folds.errors) == sorted(h.name for h in tests)
    assert len(folds.folds) == 9
    assert folds.pooled_error("strain") < 0.4


def test_a_given_offset_prior_is_used(tests):
    fit = identify(
        LAW, tests, Steady(), settings=replace(QUICK, nuisances=(Nuisance("offset", sd=5e-5), Nuisance("rate", sd=0.2)))
    )
    assert fit.noise_model["strain"].offset == 5e-5
    assert fit.noise_model.rate == 0.2


# ---- found by hand, and kept ---------------------------------------------------------------------------------------


def test_activation_energy_at_one_temperature_is_not_determined():
    """The data do not touch Q at all: its interval is that of its bounds, not of zero width."""
    conditions = [(s, 1073.15) for s in (30.0, 50.0, 80.0, 120.0)]
    fit = identify(LAW, planted(LAW, TRUTH, conditions, seed=1, rate=0.1, noise=1e-5), Steady(), settings=QUICK)
    (energy,) = (e for e in fit.estimates if e.name == "Q")
    assert energy.verdict == "not determined"
    assert energy.high - energy.low > 5e5


def test_two_tests_cannot_show_how_rates_scatter_and_intervals_hold_it_nearly_always():
    """Two tests that scatter by 25 %: over 20 campaigns the interval of n must cover the truth nearly always."""
    covered = 0
    for seed in range(20):
        tests = planted(
            NORTON, {"A": 1e-14, "n": 4.0}, [(40.0, 1050.0), (90.0, 1050.0)], seed=seed, rate=0.25, noise=1e-5
        )
        fit = identify(NORTON, tests, Steady(), settings=IdentificationSettings(starts=1, sobol_points=8, frames=12))
        (n,) = (e for e in fit.estimates if e.name == "n")
        covered += n.low <= 4.0 <= n.high
    assert covered >= 17
    assert any("how their rates scatter cannot be seen" in note for note in fit.notes)


def test_scatter_of_rates_is_found_when_the_coefficient_is_fixed():
    """With A fixed, the effect of a test's rate is the slope in ln t: planted tests without scatter must show none."""
    tests = planted(NORTON, {"A": 1e-14, "n": 4.0}, [(s, 1050.0) for s in (40, 60, 80, 100)], seed=2, noise=1e-5)
    fit = identify(NORTON.fix(A=1e-14), tests, Steady(), settings=QUICK)
    assert fit.noise_model.rate < 0.02
    assert fit.values["n"] == pytest.approx(4.0, abs=1e-3)


def test_straight_lines_under_load_have_the_exponent_of_their_rates():
    """Under load Norton's curves bend by n times strain; where none does, rates as s^4 still say 4, not the bend 1."""
    rng, tests = np.random.default_rng(3), []
    for stress in (80.0, 110.0, 150.0, 200.0):
        rate = 1e-9 * (stress / 100.0) ** 4
        times = np.linspace(0.05, 1.0, 20) * 0.02 / rate
        strain = rate * times * np.exp(0.003 * rng.standard_normal(20))
        tests.append(History(f"{stress:g}", times, {"strain": strain}, ck.constant_stress(stress), 900.0))
    fit = ck.identify("norton", tests)
    (exponent,) = (one for one in fit.estimates if one.name == "n")
    assert exponent.value == pytest.approx(4.0, abs=0.05)
    assert 2.0 < exponent.low < 4.0 < exponent.high < 6.0
    assert "by the rates" not in str(fit)


def test_noise_of_a_smooth_sparse_curve_is_small():
    """Primary creep t^0.1 without noise at 12 frames even in ln t: under 0.1 % of the end strain is taken for noise."""
    times = np.geomspace(1e2, 1e6, 12)
    curve = History("smooth", times, {"strain": 0.01 * (times / 1e6) ** 0.1}, constant_stress(100.0), 1000.0)
    assert frame_noise(curve, "strain") < 1e-5


# ---- suspect frames --------------------------------------------------------------------------------------------------

# Suspect frames are left out once, where the settings say so, and named with their tests.


EXCLUDE, KEEP = ck.IdentificationSettings(), ck.IdentificationSettings(suspect_frames="keep")


def clean_and_spoilt() -> list[History]:
    """A straight line with noise of 1e-5, one of whose 40 frames is 1e-3 off; and one without."""
    times, rng = np.linspace(1e3, 4e4, 40), np.random.default_rng(0)
    strain = [1e-7 * times + 1e-5 * rng.standard_normal(times.size) for _ in range(2)]
    strain[1][20] += 1e-3
    return [History(n, times, {"strain": s}, constant_stress(50), 1000.0) for n, s in zip("ab", strain, strict=True)]


def test_the_frame_is_left_out_and_named() -> None:
    clean, spoilt = without_suspect_frames(clean_and_spoilt(), EXCLUDE)
    assert clean.used.all()
    assert np.flatnonzero(~spoilt.used).tolist() == [20]
    assert suspect_frames_note([clean, spoilt]) == ("suspect frames were left out: 1 of 40 of 'b' (outlier, frame 20)",)
    again = without_suspect_frames([clean, spoilt], EXCLUDE)
    assert [h.used.tolist() for h in again] == [clean.used.tolist(), spoilt.used.tolist()]


# ---- extrapolation ---------------------------------------------------------------------------------------------------

# A point outside the tests is said once a call, with what the tests cover.


RANGES = {"stress": (50.0, 100.0), "temperature": (1000.0, 1050.0), "strain": (0.0, 0.02), "time": (60.0, 1e6)}


def test_what_lies_outside_is_named_with_the_range():
    for point, sentence in (
        ({"stress": [50.0, 100.0], "temperature": 1050.4}, ""),
        ({"stress": 120.0}, "extrapolated: stress 120 MPa (the tests cover 50 to 100 MPa; 1.2 times beyond)"),
        ({"stress": [20, 80.0], "time": 1e7}, "extrapolated: stress 20 to 80 MPa (the tests cover 50 to 100 MPa; 2.5 "),
        ({"temperature": 950.0}, "extrapolated: temperature 950 K (the tests cover 1000 to 1050 K; 50 K beyond)"),
        ({"strain": 0.05}, "extrapolated: strain 0.05 (the tests cover 0 to 0.02; 2.5 times beyond)"),
        ({"stress": []}, ""),
    ):
        found = extrapolation_text(RANGES, point)
        assert found.startswith(sentence) if sentence else found == ""


@pytest.fixture(scope="module")
def fit_of_two_tests():
    law = NORTON.times(ck.arrhenius(T_ref=1025.0))
    plans = [(s, T) for T in (1000.0, 1050.0) for s in (50.0, 70.0, 100.0)]
    return ck.identify(law, planted(law, {"A": 1e-16, "n": 5.0, "Q": 3e5}, plans, seed=1), using=Steady(), starts=1)


def test_rates_and_exponents_warn_once_a_call_and_may_be_told_not_to(fit_of_two_tests):
    for ask in (fit_of_two_tests.rate, fit_of_two_tests.local_exponent):
        with pytest.warns(FitWarning, match="stress 20 to 150 MPa") as caught:
            ask([20.0, 80.0, 150.0], 990.0)
        assert len(caught) == 1
        assert caught[0].filename == __file__
        ask([20.0, 150.0], 990.0, warn=False)
        ask([50.0, 100.0], 1000.0)
        np.testing.assert_array_equal(ask(80.0), ask(80.0, 1025.0))  # the median of the tests, where none is given
    assert fit_of_two_tests.adequacy.explains  # of simulated tests without noise: what they round is no bend


def test_a_law_without_temperature_states_nothing_of_another_temperature():
    times, T = np.linspace(1e5, 1e7, 9), 873.15
    tests = [
        ck.simulate(
            "norton", "uniaxial", {"A": 1e-16, "n": 4.0}, times=times, loading=constant_stress(s), temperature=T
        )
        for s in (80.0, 100.0)
    ]
    fit = ck.identify("norton", [t.replace(name=f"t{k}") for k, t in enumerate(tests)])
    assert fit.rate(90.0, 875.0, warn=False)[0] > 0
    asks = (
        lambda: fit.rate(90.0, 893.15),
        lambda: ModelAverage.from_ranking(fit).rate(90.0, 893.15),
        lambda: fit.rupture_time(90.0, 893.15),
        lambda: fit.forecast(tests[0].replace(temperature=893.15)),
    )
    for ask in asks:
        with pytest.raises(FitError, match="has no temperature, and its tests were at 600 °C: .* of 620 °C; add tests"):
            ask()
    with pytest.warns(FitWarning, match="no fitted test broke"):
        fit.rupture_time(90.0)


# ---- candidates ------------------------------------------------------------------------------------------------------

# Which laws suit tests: by curves of known shape.


HOUR = 3600.0


def bar(stress, shape, ends_by_rupture=False):
    x = np.linspace(0.0, 1.0, 41)[1:]
    strain = 0.02 * shape(x) + 2e-6 * np.random.default_rng(int(stress)).standard_normal(40)
    end = {"rupture_time": 1000 * HOUR} if ends_by_rupture else {}
    return ck.History(f"b{stress}", 1000 * HOUR * x, {"strain": strain}, ck.constant_stress(stress), 900.0, **end)


def names(tests):
    return [law.name for law in candidates(tests)]


def primary(x):
    return 0.4 * (1.0 - np.exp(-12.0 * x)) + 0.6 * x


def tertiary(x):
    return np.log(1.0 - 0.98 * x) / np.log(0.02)


def test_curves_whose_rate_falls_ask_for_primary_creep_and_several_stresses_for_an_exponent_that_changes():
    assert names([bar(100.0, primary), bar(110.0, primary)]) == ["norton*primary", "strain-hardening", "time-hardening"]
    several = names([bar(s, primary) for s in (80.0, 120.0, 160.0)])
    assert several[:2] == ["norton*primary", "hyperbolic-sine*primary"]


def test_steady_curves_and_curves_to_rupture():
    assert names([bar(100.0, lambda x: x)]) == ["norton", "strain-hardening", "time-hardening"]
    found = names([bar(s, tertiary, ends_by_rupture=True) for s in (80.0, 120.0, 160.0)])
    assert found == ["norton", "mpc-omega", "kachanov-rabotnov", "sinh-damage"]


def test_tables_of_rates_and_lives():
    rows = [
        ck.History(f"r{s}", np.array([t]), {}, ck.constant_stress(s), 900.0, minimum_rate=1e-3 / t, rupture_time=t)
        for s, t in ((80.0, 9e6), (100.0, 3e6), (120.0, 1e6), (150.0, 3e5), (180.0, 1e5))
    ]
    assert names(rows) == ["norton", "hyperbolic-sine", "kachanov-rabotnov", "sinh-damage"]


def test_rates_over_a_threshold_stress_bend_down_at_each_temperature_those_of_two_powers_up_and_of_one_not_at_all():
    stress = np.array([150.0, 185.0, 225.0, 105.0, 140.0, 180.0, 70.0, 95.0, 140.0])
    kelvin, scatter = np.repeat([813.15, 843.15, 873.15], 3), np.random.default_rng(3).standard_normal(9)
    factors = 1e-15 * np.exp(0.05 * scatter - 3e5 / 8.314 * (1 / kelvin - 1 / 843.15))

    def named(s_0, high=0.0):
        rates = factors * ((stress - s_0) ** 4.0 + high * (stress / 140.0) ** 12)
        rows, end = zip(stress, kelvin, rates, strict=True), np.array([1e6])
        tests = [ck.History("m", end, {}, ck.constant_stress(s), T, minimum_rate=rate) for s, T, rate in rows]
        return list(named_candidates(tests))

    falling = "threshold-stress[s_0:linear(843.15)]*arrhenius(843.15)"
    assert named(40.0) == ["norton", "hyperbolic-sine", "threshold-stress"]
    assert named(65.0 - 0.7 * (kelvin - 843.15)) == ["norton", "hyperbolic-sine", falling]
    assert named(0.0) == ["norton", "hyperbolic-sine"]
    assert named(0.0, 140.0**4) == ["norton", "hyperbolic-sine", "double-power"]
    forms = ck.law("threshold-stress").with_temperature(s_0=ck.linear(T_ref=843.15))
    assert ck.law(falling).fingerprint == forms.times(ck.arrhenius(T_ref=843.15)).fingerprint


def test_damage_with_primary_creep_follows_an_integration_of_its_equations():
    """Kachanov-Rabotnov without hardening by time, its strain rate times 1 + b exp(-e/e_p), by scipy under a load."""
    values = {"A": 1e-21, "n": 6.0, "B": 1e-21, "chi": 6.5, "phi": 5.0, "alpha": 0.0, "b": 8.0, "e_p": 0.002}

    def rates(_, y):
        stress = 100.0 * np.exp(y[0])
        steady = 1e-21 * (stress / (1.0 - y[1]) ** (1.0 / 6.0)) ** 6
        return steady * (1.0 + 8.0 * np.exp(-y[0] / 0.002)), 1e-21 * stress**6.5

    times = np.linspace(0.0, 5e7, 9)[1:]
    found = solve_ivp(rates, (0.0, 5e7), (0.0, 0.0), method="LSODA", t_eval=times, rtol=1e-10, atol=1e-12)
    run = ck.simulate("kachanov-rabotnov*primary", "uniaxial", values, times=times, loading=ck.constant_stress(100.0))
    assert found.y[1, -1] > 0.3
    np.testing.assert_allclose(run.outputs["strain"], found.y[0], rtol=2e-3)


def test_a_name_with_primary_creep_is_the_law_itself_with_the_factor():
    law = ck.law("hyperbolic-sine*primary")
    assert law.fingerprint == ck.law("hyperbolic-sine").with_primary().fingerprint
    values = {"A": 1e-9, "B": 60.0, "n": 4.0, "b": 10.0, "e_p": 0.002}
    times = np.linspace(0.0, 1000 * HOUR, 11)[1:]
    run = ck.simulate(law, "uniaxial", values, times=times, loading=ck.constant_stress(90.0, control="stress"))
    rate = 1e-9 * np.sinh(1.5) ** 4
    exact = 0.002 * np.log(11.0 * np.exp(rate * times / 0.002) - 10.0)  # the closed form of its curve
    assert run.outputs["strain"] == pytest.approx(exact, rel=3e-6)


def test_tests_without_anything_to_identify_from_are_refused():
    ends = [ck.History("e", np.array([1e5]), {}, ck.constant_stress(100.0), 900.0, rupture_time=1e5)]
    with pytest.raises(FitError, match="curve or a minimum creep rate"):
        candidates(ends)


def test_a_stress_that_falls_as_the_furnace_is_made_hotter_was_not_held_at_both_larger_values() -> None:
    """100 MPa at 873 K, then 60 MPa at 923 K, beside 60 MPa at 873 K: a triangle in 1/T and ln stress."""
    programs = StressSteps(((0.0, 100.0), (360e3, 60.0))), ck.Program.steps([(0.0, 873.0), (360e3, 923.0)])
    both = History("both", 3600.0 * np.array([10.0, 50.0, 150.0, 200.0]), {}, *programs)
    tests = (both, both.replace(name="cold", loading=constant_stress(60.0), temperature=873.0))
    fit: Any = SimpleNamespace(histories=tests, simulated_stresses=[h.load_levels for h in tests])
    T = 2.0 / (1.0 / 873.0 + 1.0 / 923.0)
    asked = [(100.0, 873.0), (60.0, 873.0), (60.0, 923.0), (6000.0**0.5, T), (100.0, 923.0), (90.0, T), (40.0, 873.0)]
    *inside, hot, between, low = (outside_combinations(fit, *np.array(point)[:, None]) for point in asked)
    assert inside == [""] * 4
    assert (hot.partition(" (")[0], low.partition(" (")[0]) == ("stress 100 MPa at 650 °C", "stress 40 MPa at 600 °C")
    assert "holds 60 to 77.46 MPa there" in between
