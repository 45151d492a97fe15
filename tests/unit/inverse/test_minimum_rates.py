"""Tables of minimum creep rates and rupture times: closed forms, planted values, and tests beside curves."""

import numpy as np
import pytest
from scipy.stats import binom, ttest_1samp

import creepkit as ck
from creepkit.inverse.identified_values import minimum_rates_of
from creepkit.inverse.identify import identify
from creepkit.inverse.minimum_rates import apparent_energy, apparent_exponent, least_slope, with_minimum_rates
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.single_values import SingleValue, contradicting_values
from creepkit.laws.norton import NORTON
from creepkit.limits import SIGNIFICANCE
from creepkit.records import UNKNOWN_DURATION, History, Nuisance, constant_stress
from creepkit.specimens.uniaxial import Uniaxial
from helpers.literature_laws import EQUATIONS
from helpers.rate_tables import GAS_CONSTANT, KACHANOV_VALUES, rate_table, whole_life_table
from helpers.steady_rate_predictor import Steady, planted

BAR = Uniaxial()
KACHANOV = EQUATIONS["Kachanov-Rabotnov"]


def minimum_rate(law, values, history, bar=BAR):
    """The minimum rate that is predicted, and its derivatives to the internal parameters."""
    theta = law.to_internal(values)
    prediction = bar.predict(law, theta, [history], sensitivities=True)
    found = with_minimum_rates(prediction, bar, law, theta, [history], sensitivities=True)
    return found.values[0, 0, 0, -1], found.jacobian[0, 0, 0, -1]


def stated(stress=80.0, duration=UNKNOWN_DURATION, control="stress", rate=1e-9, **further):
    return History("test", np.array([duration]), {}, constant_stress(stress, control), 1000.0, minimum_rate=rate,
                   **further)  # fmt: skip


# ---- the rate of a test -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("control", ["load", "stress"])
def test_rate_of_steady_creep_is_that_of_the_law(control):
    """Under a constant load the bar thins: the rate is smallest at once, A s^n."""
    rate, jacobian = minimum_rate(NORTON, {"A": 1e-16, "n": 4.0}, stated(control=control))
    assert rate == pytest.approx(1e-16 * 80.0**4, rel=1e-6)
    np.testing.assert_allclose(jacobian / rate, [1.0, np.log(80.0)], rtol=1e-5)


def test_rate_of_creep_that_only_slows_down_is_that_at_the_end():
    """Time hardening: A s^n t^m falls for ever, so that the duration decides."""
    law, values = ck.law("time-hardening"), {"A": 1e-15, "n": 4.0, "m": -0.4}
    for duration in (1e5, 1e7):
        rate, _ = minimum_rate(law, values, stated(duration=duration))
        assert rate == pytest.approx(1e-15 * 80.0**4 * duration**-0.4, rel=2e-3)


def test_rate_between_primary_and_tertiary_stage_is_the_minimum_of_the_curve():
    """Primary A t^m beside steady B exp(strain k): a quadrature of time over strain, independent of the integrator."""
    law = EQUATIONS["MPC Omega"] + ck.law("strain-hardening")
    values = dict(zip(law.names, (1e-16, 4.0, 20.0, 1e-18, 4.0, -0.9), strict=True))
    strain = np.geomspace(1e-6, 0.3, 20001)
    rates = 80.0**4 * (1e-16 * np.exp(20.0 * strain) + 1e-18 * strain**-0.9)
    for duration in (1e8, 3e7):
        rate, jacobian = minimum_rate(law, values, stated(duration=duration))
        assert rate == pytest.approx(rates.min(), rel=2e-3)
    assert jacobian[0] + jacobian[3] == pytest.approx(rate, rel=2e-2)  # a factor on all rates is one on the rate


def test_derivatives_are_those_of_the_rate():
    law = KACHANOV + ck.law("strain-hardening")
    values = dict(zip(law.names, (1e-16, 4.0, 1e-15, 3.5, 4.0, 1e-18, 4.0, -0.9), strict=True))
    test, theta, exact = stated(duration=2e7), law.to_internal(values)[0], Uniaxial(tolerance=1e-8)
    _, jacobian = minimum_rate(law, values, test, exact)
    step = 1e-4 * np.eye(theta.size)
    ends = np.concatenate([theta + step, theta - step])
    moved = with_minimum_rates(exact.predict(law, ends, [test]), exact, law, ends, [test]).values[:, 0, 0, -1]
    np.testing.assert_allclose(jacobian, (moved[: theta.size] - moved[theta.size :]) / 2e-4, rtol=1e-3)
    _, rough = minimum_rate(law, values, test)
    np.testing.assert_allclose(rough, jacobian, rtol=0.02)


# ---- identification -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("weights", ["equal", "likelihood"])
def test_rates_alone_are_a_linear_regression(weights):
    """ln rate = ln A + n ln s - Q/R (1/T - 1/T0): values, and intervals with Student's t of tests less parameters."""
    from scipy.stats import t as student

    tests = rate_table(np.random.default_rng(1))
    fit = ck.identify(NORTON.times(ck.arrhenius(T_ref=1100.0)), tests, weights=weights, starts=1, usual_errors="none")
    stress = np.array([h.loading.program().values[0] for h in tests])
    inverse = np.array([1.0 / h.temperature - 1.0 / 1100.0 for h in tests]) / GAS_CONSTANT
    design = np.stack([np.ones_like(stress), np.log(stress), -inverse], axis=1)
    y = np.log([h.minimum_rate for h in tests])
    solution, squares, *_ = np.linalg.lstsq(design, y, rcond=None)
    assert np.log(fit.values["A"]) == pytest.approx(solution[0], abs=1e-6)
    assert fit.values["n"] == pytest.approx(solution[1], rel=1e-6)
    assert fit.values["Q"] == pytest.approx(solution[2], rel=1e-6)
    freedom = len(y) - 3
    sd = np.sqrt(float(squares[0]) / freedom * np.linalg.inv(design.T @ design)[1, 1])
    exponent = {e.name: e for e in fit.estimates}["n"]
    assert 0.5 * (exponent.high - exponent.low) == pytest.approx(student.ppf(0.975, freedom) * sd, rel=0.03)


def test_stated_standard_deviations_weigh_the_rates():
    """One rate known to 1 % beside others known to 50 %: the weighted regression, without scatter between tests."""
    stresses, sds = np.array([60.0, 80.0, 100.0, 140.0]), np.array([0.01, 0.5, 0.5, 0.01])
    factors = np.array([1.0, 1.6, 0.7, 1.0])
    tests = [
        History(f"{s}", np.array([1e7]), {}, constant_stress(s, "stress"), 1000.0, minimum_rate=1e-16 * s**4 * f,
                minimum_rate_sd=sd * 1e-16 * s**4 * f)
        for s, sd, f in zip(stresses, sds, factors, strict=True)
    ]  # fmt: skip
    fit = ck.identify(NORTON, tests, nuisances=[], weights="likelihood", starts=2)
    assert fit.values["n"] == pytest.approx(4.0, abs=0.02)
    assert fit.noise_model[MINIMUM_RATE_OUTPUT].stated > 0


@pytest.fixture(scope="module")
def whole_life():
    tests = whole_life_table(np.random.default_rng(2))
    return tests, ck.identify(KACHANOV.fix(r=KACHANOV_VALUES["r"]), tests, starts=1)


def test_planted_rates_and_rupture_times_give_creep_and_damage(whole_life):
    """Closed forms under constant stress: rate A s^n, life (1 - 0.01^(r+1)) / ((r + 1) B s^k)."""
    _, fit = whole_life
    for e in fit.estimates:
        assert e.low <= KACHANOV_VALUES[e.name] <= e.high, e
        assert e.verdict == ("poorly determined" if e.name == "B" else "determined"), e
        assert (e.high > 10 * e.low) == (e.name == "B"), e


def test_the_answer_says_rates_and_ends(whole_life, tmp_path):
    tests, fit = whole_life
    compared = [m.minimum_rate for m in fit.tests]
    assert [r.measured for r in compared] == [h.minimum_rate for h in tests]
    assert all(r.low < r.predicted < r.high for r in compared)
    assert sum(r.low <= r.measured <= r.high for r in compared) >= len(tests) - 2
    assert "10 minimum rates of tests without curves: predicted over measured" in fit.details()
    assert "8 rupture times: predicted over measured" in fit.details()
    assert not any("nothing is predicted" in note for note in fit.notes)
    assert len([a for a in fit.plot(tmp_path / "fit.png").axes if a.get_xlabel()]) == 2
    back = ck.load(fit.save(tmp_path / "fit.json"))
    assert [m.minimum_rate for m in back.tests] == compared
    assert back.with_histories(tests).least_squares_problem.observations.count == 20


def test_a_run_out_moves_nothing_that_it_does_not_contradict(whole_life):
    problem = whole_life[1].least_squares_problem
    residuals = problem.residuals(whole_life[1].x)
    ends = problem.observations.stopped_ends
    assert ends.sum() == 2
    assert (np.abs(residuals.values[ends]) < 1e-3 * residuals.stopped.sd[ends]).all()


def curve(stress, factor=1.0):
    times = np.geomspace(1e3, 3e5, 12)
    return History(f"curve {stress:g}", times, {"strain": factor * 1e-16 * stress**4 * times},
                   constant_stress(stress, "stress"), 1000.0)  # fmt: skip


def test_rates_beside_curves_narrow_the_interval():
    """Curves over a factor of 1.2 in stress, rates over one of 3."""
    curves = [curve(s, f) for s, f in ((90.0, 1.1), (100.0, 0.9), (108.0, 1.05))]
    rates = [
        stated(s, rate=f * 1e-16 * s**4).replace(name=f"rate {s:g}")
        for s, f in ((50.0, 1.1), (70.0, 0.92), (120.0, 1.05), (150.0, 0.95))
    ]
    widths = []
    for tests in (curves, curves + rates):
        exponent = {e.name: e for e in ck.identify(NORTON, tests, starts=2).estimates}["n"]
        assert exponent.low < 4.0 < exponent.high
        widths.append(exponent.high - exponent.low)
    assert widths[1] < 0.5 * widths[0]


def test_a_rate_beside_the_readings_of_its_test_is_not_counted_twice():
    tests = [curve(s) for s in (80.0, 100.0, 120.0)]
    with_rates = [h.replace(minimum_rate=3e-9) for h in tests]
    plain, both = (ck.identify(NORTON, each, starts=1) for each in (tests, with_rates))
    assert both.values == plain.values
    assert any("minimum rate" in note and "readings" in note for note in both.notes)
    assert not any("minimum rate" in note for note in plain.notes)


def test_explicit_nuisances_move_the_rate():
    """A test 10 K too warm creeps faster by Q/R (1/T - 1/(T + 10))."""
    law = NORTON.times(ck.arrhenius(T_ref=1000.0)).fix(Q=4e5)
    tests = [stated(s, rate=1e-16 * s**4).replace(name=f"{s:g}") for s in (60.0, 80.0, 100.0, 120.0)]
    settings = IdentificationSettings(nuisances=(Nuisance("temperature", sd=5.0),))
    problem = LeastSquaresProblem.from_histories(law, tests, BAR, settings)
    u = problem.coordinates.u(law.to_internal({"A": 1e-16, "n": 4.0})[0])
    warm = np.concatenate([u, [10.0, 0.0, 0.0, 0.0]])
    change = problem.residuals(warm).values - problem.residuals(np.concatenate([u, np.zeros(4)])).values
    expected = 4e5 / GAS_CONSTANT * (1.0 / 1000.0 - 1.0 / 1010.0)
    np.testing.assert_allclose(change[:, 0], [expected, 0.0, 0.0, 0.0], atol=1e-4)
    slope = problem.residuals(warm).jacobian[0, 0, u.size]
    assert slope == pytest.approx(4e5 / GAS_CONSTANT / 1010.0**2, rel=1e-2)


def test_rates_of_unknown_duration_do_not_judge_hardening():
    """Planted n = 5, Q = 400 kJ/mol. Over a duration set from the rate itself, time hardening predicts all."""
    tests = rate_table(np.random.default_rng(3))
    factor = ck.arrhenius(T_ref=1100.0)
    laws = [ck.law(name).times(factor) for name in ("norton", "strain-hardening", "time-hardening", "blackburn")]
    ranking = ck.select(laws, tests, starts=1)
    assert [ranked.fit.law.name for ranked in ranking.laws] == ["norton*arrhenius"]
    values = {e.name: e for e in ranking.best.estimates}
    assert values["n"].low < 5.0 < values["n"].high
    assert values["n"].value == pytest.approx(5.0, rel=0.05)
    assert values["Q"].low < 4e5 < values["Q"].high
    assert values["Q"].value == pytest.approx(4e5, rel=0.05)
    assert "depends on time, and minimum creep rates of tests of unknown" in ranking.failed["time-hardening*arrhenius"]
    assert "depends on strain, and minimum" in ranking.failed["strain-hardening*arrhenius"]
    assert "depends on internal variables, and minimum" in ranking.failed["blackburn*arrhenius"]
    without = laws[2].fix(m=0.0)
    assert ck.identify(without, tests, starts=1).values["n"] == pytest.approx(values["n"].value, rel=1e-3)
    lasted = [h.replace(times=np.array([1e7]), unruptured=True) for h in tests]
    assert ck.identify(laws[2], lasted, starts=1).values["A"] > 0  # stated, it can be


# ---- bad input ----------------------------------------------------------------------------------------------------


# ---- measured minimum rates ------------------------------------------------------------------------------------------

# Minimum creep rates of measured curves: closed forms, brute force over a curve with noise, and a known exponent.


END = 1e6


def measured_curve(t: np.ndarray) -> np.ndarray:
    """Primary, secondary and tertiary creep."""
    return 4e-3 * (t / END) ** (1 / 3) + 5e-3 * (t / END) + 1e-2 * (t / END) ** 4


FINE = np.linspace(0.0, END, 100_001)[1:]
EXACT = np.min(np.diff(measured_curve(FINE)) / np.diff(FINE))


def test_the_least_slope_is_that_of_the_curve_at_its_inflection() -> None:
    times = np.linspace(0.0, END, 400)[1:]
    found = least_slope(times, measured_curve(times), np.zeros(times.size))
    assert found == pytest.approx(EXACT, rel=0.03)
    assert found >= EXACT * (1 - 1e-6)  # a chord of a curve is never below its least slope


def test_noise_does_not_lower_it_by_more_than_it_is_allowed_to() -> None:
    times = np.linspace(0.0, END, 120)[1:]
    noise = 1e-4
    rng = np.random.default_rng(0)
    found = [
        least_slope(times, measured_curve(times) + noise * rng.normal(size=times.size), np.full(times.size, noise))
        for _ in range(20)
    ]
    assert np.median(found) == pytest.approx(EXACT, rel=0.1)
    assert np.abs(np.log(found) - np.log(EXACT)).max() < 0.25


def test_a_slope_that_noise_hides_is_not_known() -> None:
    times = np.linspace(0.0, END, 30)[1:]
    assert np.isnan(least_slope(times, 1e-6 * times / END, np.full(times.size, 1e-4)))


def test_of_steady_creep_measured_and_predicted_rates_are_that_of_the_law() -> None:
    values = {"A": 1e-16, "n": 5.2}
    tests = planted(NORTON, values, [(s, 1050.0) for s in (30.0, 50.0, 80.0)], seed=5, noise=1e-6)
    fit = identify(NORTON, tests, Steady(), settings=IdentificationSettings(starts=2, sobol_points=16, frames=40))
    rates = minimum_rates_of(fit)
    assert [r.stress for r in rates] == [30.0, 50.0, 80.0]
    for one in rates:
        exact = values["A"] * one.stress ** values["n"]
        assert one.measured == pytest.approx(exact, rel=0.01)
        assert one.predicted == pytest.approx(float(fit.rate(one.stress, 1050.0)[0]), rel=1e-6)
        assert one.low < one.predicted < one.high


def test_the_apparent_exponent_is_that_of_a_power_law_at_each_temperature() -> None:
    stresses = np.array([50.0, 80.0, 120.0, 60.0, 90.0])
    temperatures = np.array([900.0, 900.0, 900.0, 1000.0, 1000.0])
    rates = 1e-18 * stresses**6.5 * np.where(temperatures > 950.0, 40.0, 1.0)
    assert apparent_exponent(stresses, rates, temperatures) == pytest.approx((6.5, 0.0), abs=1e-9)
    assert np.isnan(apparent_exponent(np.full(3, 50.0), rates[:3], temperatures[:3])).all()
    energy = 8.314462618 * np.log(40.0) / (1 / 900 - 1 / 1000)
    assert apparent_energy(stresses, rates, temperatures) == pytest.approx((energy, 0.0), abs=1e-3)
    assert np.isnan(apparent_energy(stresses[:3], rates[:3], temperatures[:3])).all()
    assert np.isnan(apparent_energy(stresses[2:4], rates[2:4], temperatures[2:4])).all()


def test_the_interval_of_the_apparent_exponent_holds_it_in_95_per_cent_of_draws() -> None:
    """Seven tests at two temperatures, rates that scatter by 20 %: 2.6 % of 2000 is five standard deviations."""
    rng, stresses = np.random.default_rng(0), np.array([50.0, 80.0, 120.0, 60.0, 90.0, 110.0, 70.0])
    temperatures = np.repeat([900.0, 1000.0], (3, 4))
    rates = 1e-18 * stresses**6.5 * np.exp(0.2 * rng.standard_normal((2000, 7)))
    found = np.array([apparent_exponent(stresses, one, temperatures) for one in rates])
    assert np.mean(np.abs(found[:, 0] - 6.5) < found[:, 1]) == pytest.approx(0.95, abs=0.026)


# ---- single values ---------------------------------------------------------------------------------------------------

# The F test of minimum rates against rupture times: a t test where nothing varies, and its level by brute force.


def bars_at(stresses, temperatures):
    return [
        History(f"t{k}", np.array([1e6]), {}, constant_stress(float(s), "load"), float(T))
        for k, (s, T) in enumerate(zip(stresses, temperatures, strict=True))
    ]


def values(rate_ratios, time_ratios, **further):
    return [
        (SingleValue(1.0, t, 0.1, 10.0, **further), SingleValue(1.0, r, 0.1, 10.0))
        for r, t in zip(rate_ratios, time_ratios, strict=True)
    ]


def test_of_tests_alike_it_is_students():
    """Rates twice the measured, times right: ln of the product is 0.69 and scatters."""
    rng = np.random.default_rng(0)
    tests = bars_at([100.0] * 12, [900.0] * 12)
    rates, times = 2.0 * np.exp(0.3 * rng.standard_normal(12)), np.exp(0.3 * rng.standard_normal(12))
    found = contradicting_values(tests, values(rates, times))
    assert found.p_value == pytest.approx(ttest_1samp(np.log(rates * times), 0.0).pvalue, rel=1e-9)
    assert found.rate_ratio == pytest.approx(np.exp(np.log(rates).mean()))
    assert found.scatter == pytest.approx(np.exp(np.log(rates * times).std(ddof=1)))
    assert contradicting_values(tests, values(rates, 0.5 * times)) is None


def test_a_trend_over_stress_shows():
    rng, stresses = np.random.default_rng(1), np.geomspace(50.0, 300.0, 15)
    tests = bars_at(stresses, np.tile([850.0, 900.0, 950.0], 5))
    trend = (stresses / stresses.prod() ** (1 / 15)) ** 0.8
    noise = np.exp(0.1 * rng.standard_normal((2, 15)))
    assert contradicting_values(tests, values(noise[0], noise[1])) is None
    found = contradicting_values(tests, values(trend * noise[0], noise[1]))
    assert "their ratio changes with stress or temperature" in str(found)


def test_a_factor_on_the_rate_of_a_test_is_no_contradiction():
    """It moves rate and time of a test against one another; ends that were not used, and run-outs, say nothing."""
    tests, factors = bars_at(np.geomspace(50, 300, 10), [900.0] * 10), np.exp(np.linspace(1.0, 3.0, 10))
    scatter = np.exp(0.1 * np.random.default_rng(2).standard_normal(10))
    assert contradicting_values(tests, values(factors * scatter, 1.0 / factors)) is None
    assert contradicting_values(tests, values(100.0 * factors, factors, used=False)) is None


def test_its_level():
    """1000 draws of right laws: no more are rejected than SIGNIFICANCE says."""
    rng, tests = np.random.default_rng(3), bars_at(np.geomspace(50, 300, 12), np.tile([850.0, 900.0, 950.0], 4))
    draws = np.exp(0.3 * rng.standard_normal((1000, 2, 12)))
    rejected = sum(contradicting_values(tests, values(*draw)) is not None for draw in draws)
    assert binom.ppf(0.001, 1000, SIGNIFICANCE) <= rejected <= binom.ppf(0.999, 1000, SIGNIFICANCE)
