"""Whole-life identification: planted damage laws, rupture times with intervals, tests that were stopped."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.stats import norm, t

import creepkit as ck
from creepkit.errors import ArgumentError, FitError, FitWarning
from creepkit.inverse.compared_tests import (
    UNTESTABLE,
    common_rupture_times,
    compared_tests,
    has_tertiary_creep,
    rests_on_durations,
)
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identified_values import state_at_strain
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import Elastic
from creepkit.laws.norton import NORTON
from creepkit.records import History, constant_strain, constant_stress
from creepkit.records.units import time_text
from creepkit.reports.advice import cautions
from creepkit.reports.answer import key_figures
from creepkit.specimens.relaxation import Relaxation
from helpers.literature_laws import EQUATIONS
from helpers.rate_tables import GAS_CONSTANT, KACHANOV_VALUES, rate_table, whole_life_table
from helpers.rupture_tests import BAR, campaign

KACHANOV, LIU = (EQUATIONS[name] for name in ("Kachanov-Rabotnov", "Liu-Murakami"))
LIU = LIU.fix(a=1)  # in tension the largest principal stress is the stress: its share cannot be seen
PLANTED = {
    "Kachanov-Rabotnov": (KACHANOV, {"A": 1e-16, "n": 4.0, "B": 1e-15, "k": 3.5, "r": 4.0}),
    "Liu-Murakami": (LIU, {"A": 1e-16, "n": 4.0, "B": 2e-15, "k": 3.5, "r": 4.0}),
}


@pytest.fixture(scope="module", params=PLANTED)
def planted(request):
    law, values = PLANTED[request.param]
    tests = campaign(law, values, [55, 65, 75, 85, 100, 120, 65, 100], 7, stopped=(0, 6))
    return law, values, tests, ck.identify(law, tests, using=BAR, starts=3, frames=20)


def test_planted_values_lie_within_their_intervals(planted):
    _, values, _, fit = planted
    for e in fit.estimates:
        assert e.low <= values[e.name] <= e.high, (e, values[e.name])
    assert fit.noise_model.rate == pytest.approx(0.15, abs=0.1)  # eight tests: give or take a quarter, and life's own


def test_by_likelihood_ruptures_have_a_scatter_of_their_own_and_laws_are_ranked():
    """Planted: lives that scatter by .08 beside the rates, one stopped test, which only some laws need to hear of."""
    law, values = PLANTED["Kachanov-Rabotnov"]
    tests = campaign(law, values, [55, 75, 100, 65, 100], 7, stopped=(0,))
    how = {"using": BAR, "weights": "likelihood", "nuisances": [], "starts": 2, "frames": 20}
    fits = [ck.identify(one, tests, **how) for one in (law, NORTON)]
    assert fits[0].noise_model[RUPTURE_OUTPUT].drift == 0.0
    assert fits[0].noise_model[RUPTURE_OUTPUT].misfit == pytest.approx(
        np.hypot(0.15, 0.08), rel=0.6
    )  # of four lives, rates in it
    ends = [m.rupture for m in fits[0].tests if not m.rupture.censored]
    assert all(one.low < one.measured < one.high for one in ends)
    assert ck.rank(fits).best.law.name == law.name


def test_bars_that_break_before_the_law_runs_away_do_not_move_its_values():
    """Rate A s^n (1 + C e) under a constant load, by quadrature; bars break at 12 %, rates scatter, strains to 1e-4."""
    A, n, C = ck.parameters("A n C")
    table = {
        A: ck.Param("rate", unit="1/s", bounds=(1e-45, 1e-5), scale="log", off=0.0),
        n: ck.Param("exponent", bounds=(1, 12)),
        C: ck.Param("growth", unit="1", bounds=(1, 500), scale="log"),
    }
    law = ck.CreepLaw("growing", {"growing": A * ck.stress**n * (1 + C * ck.strain)}, table)
    strain = np.linspace(0.0, 0.12, 400)
    slowness = np.exp(-6 * strain) / (1 + 60 * strain)  # over that at the first moment
    passed = np.concatenate([[0.0], np.cumsum(np.diff(strain) * (slowness[1:] + slowness[:-1]) / 2)])
    rng, tests = np.random.default_rng(2), []
    for number, stress in enumerate((100.0, 115.0, 130.0, 150.0, 170.0, 200.0, 115.0, 150.0)):
        rate = 2e-8 * (stress / 200) ** 6 * np.exp(rng.normal(0, 0.15))
        life = passed[-1] / rate
        times = life * np.linspace(0.01, 0.99, 55)
        outputs = {"strain": np.interp(times * rate, passed, strain) + rng.normal(0, 1e-4, 55)}
        tests.append(History(f"bar {number}", times, outputs, constant_stress(stress), 1273.15, rupture_time=life))
    found = {e.name: e for e in ck.identify(law, tests, using=BAR).estimates}
    for name, truth, width in (("n", 6.0, 0.1), ("C", 60.0, 1.0)):
        assert found[name].low <= truth <= found[name].high
        assert abs(found[name].value - truth) < width


def runaway_tests(life_and_curve, scatter, off, seed):
    """Nine bars under constant load at three temperatures, n 6 and Q 480 kJ/mol, to a strain of 12 %, without an end.

    life_and_curve : (strains,) over (times,) at unit rate. scatter : of ln rates. off : K, of the fifth furnace.
    """
    (passed, curve), rng, tests = life_and_curve, np.random.default_rng(seed), []
    for number in range(9):
        T, hotter = (1073.15, 1123.15, 1173.15)[number // 3], off * (number == 4)
        stress = (360.0, 250.0, 170.0)[number // 3] * (0.83, 1.0, 1.22)[number % 3]
        arrhenius = np.exp(-480e3 / GAS_CONSTANT * (1 / (T + hotter) - 1 / 1123.15) + rng.normal(0, scatter))
        rate = 1e-8 * (stress / 250.0) ** 6 * arrhenius
        times = passed[-1] * np.geomspace(3e-3, 1.0, 55)
        strain = np.interp(times, passed, curve) + rng.normal(0, 5e-5, 55)
        tests.append(History(f"bar {number}", times / rate, {"strain": strain}, constant_stress(stress, "load"), T))
    return tests


STRAINS = np.linspace(0.0, 0.12, 4001)


def test_curves_that_run_away_need_no_rupture_line():
    """MPC Omega under constant load, by its closed form; one of the furnaces is 12 K hotter than stated.

    That test creeps 1.8 times as fast, and every curve breaks within its duration at a rate a hundredth higher.
    """
    tests = runaway_tests((-np.expm1(-46.0 * STRAINS) / 46.0, STRAINS), 0.05, 12.0, 5)
    fit = ck.identify(ck.law("mpc-omega").times(ck.arrhenius(T_ref=1123.15)), tests, using=BAR)
    assert fit.converged
    assert fit.adequacy.chi_square < fit.adequacy.critical_chi_square
    assert fit.noise_model["strain"].noise == pytest.approx(5e-5, rel=0.15)
    found = {e.name: e for e in fit.estimates}
    assert all(found[k].low < v < found[k].high for k, v in (("n", 6.0), ("Q", 480e3), ("Omega", 40.0)))
    assert not any(e.is_of_curves for e in fit.adequacy.explanations)


def test_a_damage_law_whose_lives_follow_the_shape_of_curves_is_contradicted_by_the_lives_of_tests():
    """Rates (1 + 30 e) s^n under constant load, by quadrature, so that rates and lives follow one exponent, 6."""
    passed = cumulative_trapezoid(np.exp(-6 * STRAINS) / (1 + 30 * STRAINS), STRAINS, initial=0.0)
    tests = runaway_tests((passed, STRAINS), 0.05, 0.0, 5)
    fit = ck.identify(ck.law("kachanov-rabotnov").times(ck.arrhenius(T_ref=1123.15)), tests, using=BAR)
    cause = fit.adequacy.explanations[0]
    assert cause.kind == "life exponent"
    assert fit.values["chi"] + cause.size == pytest.approx(6.0, abs=0.4)
    assert fit.headline.endswith("the tests reject it as exact")
    assert "it is not exact: lives of the tests fall faster with stress than the law's" in cautions(fit)[0]
    found = {e.name: e for e in fit.estimates}
    assert all(found[name].low < truth < found[name].high for name, truth in (("n", 6.0), ("Q", 480e3)))


def test_heats_do_not_hide_that_time_hardening_bends_its_exponent_to_curves_of_strain_hardening():
    """Rates s^6 e^-0.55 under constant load, which by time are of n = 6 / 1.55; heats differ by factors of two."""
    strains, heats = STRAINS / 2, [0, 1, 2, 1, 2, 0, 2, 0, 1]
    passed = cumulative_trapezoid(strains**0.55 * np.exp(-6 * strains), strains, initial=0.0)
    bars = zip(runaway_tests((passed, strains), 0.05, 0.0, 5), heats, strict=True)
    tests = [h.replace(times=h.times / 2.0**heat, labels={"heat": f"{heat}"}) for h, heat in bars]
    fit = ck.identify(ck.law("time-hardening").times(ck.arrhenius(T_ref=1123.15)), tests, using=BAR)
    assert fit.adequacy.mentioned.ends[1] == pytest.approx(6.0 / 1.55, abs=0.2)


def test_rupture_at_new_conditions_is_predicted_with_its_interval(planted):
    law, values, _, fit = planted
    stresses = np.array([50.0, 80.0, 130.0])
    plans = [History(f"{s}", np.array([1e8]), {}, constant_stress(s), 1000.0) for s in stresses]
    truth = BAR.predict_to_rupture(law, law.to_internal(values), plans).times_to_strain.rupture_times[0]
    with pytest.warns(FitWarning, match=r"stress 50 to 130 MPa \(the tests cover 55 to 120 MPa; 1.1 times beyond\)"):
        time, less, more = fit.rupture_time(stresses, 1000.0)
    assert ((less < truth) & (truth < more)).all()
    np.testing.assert_allclose(time, truth, rtol=0.35)
    with pytest.warns(FitWarning):
        _, low, high = fit.rupture_time(stresses, 1000.0, test_scatter=False)
    assert ((less < low) & (high < more)).all()  # a single test has its own rate on top
    again = fit.rupture_times(plans)[0]
    np.testing.assert_allclose(again, time, rtol=1e-3)


@pytest.mark.parametrize("planted", ["Liu-Murakami"], indirect=True)
def test_what_tension_cannot_tell_costs_the_other_parameters_nothing(planted):
    """The share of the largest principal stress moves nothing in tension: freeing it says that, and no more."""
    law, _, tests, fit = planted
    free = ck.identify(EQUATIONS["Liu-Murakami"], tests, using=BAR, starts=3, frames=20)
    assert free.converged
    found = {e.name: e for e in free.estimates}
    share = found.pop("a")
    assert (share.low, share.high, share.verdict) == (0.0, 1.0, "not determined")
    assert t.ppf(0.975, free.freedom) == pytest.approx(t.ppf(0.975, fit.freedom), rel=0.01)
    assert max(ranked.excess for ranked in ck.rank([fit, free]).laws) < 0.1
    for e in fit.estimates:
        inner, free_one = law.table[e.name].to_internal, found[e.name]
        width = inner(free_one.high) - inner(free_one.low)
        assert width == pytest.approx(inner(e.high) - inner(e.low), rel=0.05)


# ---- the objective ------------------------------------------------------------------------------------------------


def problem(law, tests):
    return LeastSquaresProblem.from_histories(law, tests, BAR, IdentificationSettings(frames=100))


@pytest.mark.parametrize(("A", "B"), [(1.0, 1.0), (1.0, 5.0), (0.01, 0.02), (1.0, 1e-4), (30.0, 1e-4), (20.0, 0.5)])
def test_derivatives_of_candidates_that_break_early_late_or_never(A, B):
    law, values = PLANTED["Kachanov-Rabotnov"]
    found = problem(law, campaign(law, values, [60, 80, 110], 1, stopped=(1,)))
    theta = np.array([np.log(A * 1e-16), 4.0, np.log(B * 1e-15), 3.5, 4.0])
    u = found.coordinates.u(theta)
    exact, step = found.residuals(u).jacobian, 1e-5
    for k in range(u.size):
        h = step * np.eye(u.size)[k]
        slope = (found.residuals(u + h).values - found.residuals(u - h).values) / (2 * step)
        assert np.isfinite(slope).all()
        np.testing.assert_allclose(exact[..., k], slope, rtol=0.01, atol=0.01 * max(1.0, np.abs(slope).max()))
    np.testing.assert_allclose(found.candidate_residuals(u[None])[0], found.residuals(u).values, rtol=1e-3, atol=1e-3)


def test_ruptures_count_in_ln_time_and_stopped_tests_only_where_they_outlasted():
    law, values = PLANTED["Kachanov-Rabotnov"]
    tests = campaign(law, values, [60, 80], 1, stopped=(1,))
    found = problem(law, tests)
    last = found.observations.rupture_mask
    assert last.sum() == 2
    theta = np.array([np.log(1e-20), 4.0, np.log(1e-15), 3.5, 4.0])  # little creep: constant load hardly thins the bar
    for faster in (0.3, 20.0):
        theta[2] = np.log(faster * 1e-15)
        residuals = found.residuals(found.coordinates.u(theta))
        life = {s: (1 - 0.01**5) / (5 * faster * 1e-15 * s**3.5) for s in (60.0, 80.0)}
        assert residuals.values[0, last[0]] == pytest.approx(np.log(tests[0].rupture_time / life[60.0]), abs=0.01)
        outlasted = np.log(tests[1].times[-1] / life[80.0])
        assert residuals.values[1, last[1]] == pytest.approx(max(outlasted, 0.0), abs=0.01)
        assert residuals.present[1, last[1]] == (outlasted > 0)
    np.testing.assert_allclose(residuals.log_rate_sensitivity[last], 1.0, atol=0.01)


def test_run_outs_count_by_the_probability_that_they_last_and_bias_no_life():
    """Lives of one condition, half of them stopped at the median: the score of the likelihood of Tobit vanishes."""
    law, values = PLANTED["Kachanov-Rabotnov"]
    law = law.fix(**{name: value for name, value in {**values, "A": 1e-20}.items() if name != "B"})
    life, tests = 1 / (5 * 1e-15 * 80.0**3.5), []
    log_lives = np.minimum(0.3 * np.random.default_rng(4).standard_normal(16), 0.0)
    for k, log_life in enumerate(log_lives):
        time, loading = life * np.exp(log_life), constant_stress(80.0, "stress")
        known = {"unruptured": True} if log_life == 0.0 else {"rupture_time": time}
        tests.append(History(f"t{k}", np.array([time]), {}, loading, 1000.0, **known))
    fit = ck.identify(law, tests, using=BAR, starts=1, usual_errors="none")
    assert fit.noise_model[RUPTURE_OUTPUT].misfit == 0.0  # all scatter of single lives is that of rates
    s = fit.scatter_of_rates.posterior.mean_square("test") ** 0.5
    z = (log_lives + np.log(fit.values["B"] / 1e-15)) / s
    score = np.where(log_lives == 0.0, norm.pdf(z) / norm.sf(z), z)
    assert 4 < (log_lives == 0.0).sum() < 12
    assert score.mean() == pytest.approx(0.0, abs=0.02)
    assert fit.estimates[0].low < 1e-15 < fit.estimates[0].high
    assert s == pytest.approx(0.3, rel=0.5)


def test_a_coordinate_is_the_log_of_the_rate_of_damage():
    law = PLANTED["Kachanov-Rabotnov"][0]
    coordinates = Coordinates(law, ReferencePoint(80.0, 0.1, 1e6, 1000.0))
    theta = np.array([np.log(1e-16), 4.0, np.log(1e-15), 3.5, 4.0])
    u = coordinates.u(theta)
    assert (coordinates.term_rates, coordinates.state_rates) == ((0,), (2,))
    assert u[2] == pytest.approx(np.log(1e-15) + 3.5 * np.log(80.0))


def test_bars_are_followed_to_rupture_beside_tests_that_are_not():
    law, values = PLANTED["Kachanov-Rabotnov"]
    bars = campaign(law, values, [60, 80], 1)
    held = History(
        "held", np.array([10.0, 1e6]), {"stress": [100.0, 90.0]}, constant_strain(0.001), 1000.0, "relaxation",
        Elastic(E=150e3), rupture_time=2e6,
    )  # fmt: skip
    both = CompositePredictor({"uniaxial": BAR, "relaxation": Relaxation()})
    given = {name: np.array([value]) for name, value in values.items()}
    found = both.predict_to_rupture(
        law, law.to_internal(given), [bars[0], held, bars[1]], sensitivities=True
    ).times_to_strain
    alone = BAR.predict_to_rupture(law, law.to_internal(given), bars, sensitivities=True).times_to_strain
    np.testing.assert_array_equal(found.rupture_times[0, [0, 2]], alone.rupture_times[0])
    for name in ("times", "log_time_derivatives", "time_jacobian"):
        joined, own = (getattr(life, name)[0] for life in (found, alone))
        np.testing.assert_array_equal(joined[[0, 2], : own.shape[1]], own)
    assert np.isnan(found.rupture_times[0, 1])
    entries = ObservationVector.from_histories([bars[0], held, bars[1]], both)
    assert entries.followed_to_rupture.tolist() == [True, False, True]


def test_a_plan_is_followed_to_its_rupture_however_short_it_is():
    """Ends 300 to 10^4 times beyond the last time given, as where a law is far from a test: late, and not never."""
    values = {"A": 1e-14, "n": 4.0}
    fit = ck.identify(NORTON, campaign(NORTON, values, [60, 80, 110], 1), using=BAR, starts=2, frames=10)
    expected = fit.rupture_time(80.0)[0]
    plans = [History(f"{k}", expected / [k], {}, constant_stress(80.0), 1000.0) for k in (3e2, 1e4)]
    np.testing.assert_allclose(fit.rupture_times(plans)[0], expected, rtol=1e-3)


# ---- bad input ----------------------------------------------------------------------------------------------------


def test_percent_taken_for_strain_shows_in_tests_followed_to_their_end_as_well():
    tests = campaign(NORTON, {"A": 1e-14, "n": 4.0}, [60, 80, 110], 1)
    percent = [h.replace(outputs={"strain": 100 * h.outputs["strain"]}) for h in tests]
    for wrong, given in ((True, percent), (False, tests)):
        fit = ck.identify(NORTON, given, using=BAR, starts=2, frames=8)
        assert any("a column in percent must say so" in note for note in fit.notes) == wrong


# ---- compared tests --------------------------------------------------------------------------------------------------

# Rupture times of tables and laws that have no mechanism for them, on planted tables whose rates and lives differ.


DAMAGE_LAW = EQUATIONS["Kachanov-Rabotnov"]
REFERENCE = 873.15


def damaged_table(seed, exponent, energy, product, power, scatter):
    """18 tests by closed forms: rate a power law, life product / rate^power (h), lives alone of every fifth test."""
    rng, tests = np.random.default_rng(seed), []
    for T, stresses in ((823.15, (200, 220, 240, 260, 280, 300)), (873.15, (110, 125, 140, 160, 180, 200)),
                        (923.15, (60, 70, 80, 95, 110, 125))):  # fmt: skip
        for stress in stresses:
            factor = np.exp(-energy / GAS_CONSTANT * (1.0 / T - 1.0 / REFERENCE))
            rate = 1e-5 * (stress / 150.0) ** exponent * factor * np.exp(scatter * rng.standard_normal())
            life = 3600.0 * product / rate**power * np.exp(scatter * rng.standard_normal())
            known = {} if len(tests) % 5 == 4 else {"minimum_rate": float(rate / 3600.0)}
            loading = constant_stress(float(stress), "load")
            tests.append(History(f"T{len(tests)}", np.array([life]), {}, loading, T, rupture_time=float(life), **known))
    return tests


def test_which_laws_have_tertiary_creep():
    """By their formulas: rates that are constant or only fall, and those of damage, of exp(strain) and exp(time)."""
    steady = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "combined")
    assert not any(has_tertiary_creep(ck.law(name)) for name in steady)
    assert not has_tertiary_creep(NORTON.times(ck.arrhenius(T_ref=900.0)))
    assert all(has_tertiary_creep(EQUATIONS[name]) for name in ("Kachanov-Rabotnov", "MPC Omega"))
    assert has_tertiary_creep(ck.law("norton") + DAMAGE_LAW)
    assert has_tertiary_creep(ck.law("strain-hardening").with_bounds(m=(-0.5, 0.5)))


def test_rates_hold_the_truth_whatever_the_lives_are():
    """At a constant load a power law breaks after 1 / (n rate); these break up to ten times before, or after."""
    law, held = NORTON.with_bounds(n=(1.0, 15.0)).times(ck.arrhenius(T_ref=REFERENCE)), np.zeros(3)
    cases = np.array([(6.5, 430e3, 0.06, 0.9, 0.12), (4.0, 300e3, 0.02, 1.0, 0.3), (8.5, 550e3, 0.15, 0.85, 0.05)])
    for seed, (exponent, energy, product, power, scatter) in enumerate([*cases, cases[0]]):
        fit = ck.identify(law, damaged_table(seed, exponent, energy, product, power, scatter), starts=1)
        values = {e.name: e for e in fit.estimates}
        _, low, high = fit.rate(150.0, REFERENCE)
        held += [
            values["n"].low <= exponent <= values["n"].high,
            values["Q"].low <= energy <= values["Q"].high,
            low <= 1e-5 / 3600.0 <= high,
        ]
        assert not fit.adequacy.rejects
        assert "the ends of 18 tests without curves (rupture times and run-outs) were not used" in fit.notes[0]
        assert "left out, for they state nothing else: 'T4', 'T9', 'T14'" in fit.notes[0]
    assert (held >= 3).all()


def test_rates_and_lives_that_contradict_one_another_reject_a_law():
    law = NORTON.times(ck.arrhenius(T_ref=REFERENCE))
    fit = ck.identify(law, damaged_table(0, 6.5, 430e3, 0.06, 0.9, 0.12), starts=1, rupture_times="use")
    assert fit.adequacy.rejects
    assert fit.adequacy.contradicting.p_value < 1e-6
    assert "contradict one another by this law: predicted over measured is" in " ".join(fit.details().split())
    assert "it is not exact: by it minimum rates contradict rupture times" in cautions(fit)


def test_laws_are_compared_from_the_same_values():
    """Norton's law is rejected beside damage by lives of its tests, and alone identified from rates."""
    tests = whole_life_table(np.random.default_rng(2))
    ranking = ck.select([NORTON, DAMAGE_LAW.fix(r=KACHANOV_VALUES["r"])], tests, starts=1, sums=False)
    best, other = (ranked.fit for ranked in ranking.laws)
    assert best.law.name.startswith(DAMAGE_LAW.name)
    assert not best.adequacy.rejects
    for e in best.estimates:
        assert e.low <= KACHANOV_VALUES[e.name] <= e.high
    assert other.settings.rupture_times == "use"
    with pytest.raises(FitError, match="rupture_times='use' or 'ignore' for all laws"):
        ck.rank([ck.identify(NORTON, tests, starts=1), best])


def test_what_says_nothing_is_left_out_and_ends_alone_are_refused():
    settings, tests = IdentificationSettings(), damaged_table(0, 5.0, 4e5, 0.06, 0.9, 0.1)
    silent = [h.replace(rupture_time=None, unruptured=False) for h in tests]
    compared, notes = compared_tests(NORTON, silent, settings)
    assert len(compared) == 15
    assert notes[0].endswith("'T4', 'T9', 'T14'")
    ends = [h.replace(minimum_rate=None) for h in tests]
    with pytest.raises(FitError, match="breaks by loss of section alone, and these tests state nothing but their ends"):
        compared_tests(NORTON, ends, settings)
    assert len(compared_tests(DAMAGE_LAW, ends, settings)[0]) == len(ends)
    assert common_rupture_times([NORTON, DAMAGE_LAW], settings).rupture_times == "use"
    assert common_rupture_times([NORTON], settings) == settings
    with pytest.raises(ArgumentError, match="rupture_times is 'never'"):
        IdentificationSettings(rupture_times="never")


# ---- state at strain -------------------------------------------------------------------------------------------------

# The stress exponent of bars compared at one strain, against closed forms of time and strain hardening.


A, N, M = 1e-13, 4.0, -0.4
TIMES = np.geomspace(360.0, 3.6e5, 30)


def boltzmann(T: float) -> float:
    return float(np.exp(-2e5 / GAS_CONSTANT * (1 / T - 1 / 1000.0)))


def curves(T: float) -> list[ck.History]:
    """Strain A s^n t^(1 + m) / (1 + m) under constant true stress, with 0.5 % of noise; Q is 200 kJ/mol."""
    rng, strain = np.random.default_rng(3), boltzmann(T) * A * TIMES ** (1 + M) / (1 + M)
    return [
        ck.History(
            f"{stress:g} MPa, {T:g} K",
            TIMES,
            {"strain": strain * stress**N * (1 + 0.005 * rng.standard_normal(TIMES.size))},
            ck.constant_stress(stress, "stress"),
            T,
            strain_measure="logarithmic",
        )
        for stress in (40.0, 60.0, 90.0)
    ]


@pytest.mark.parametrize("name", ["time-hardening", "strain-hardening"])
def test_exponent_and_energy_are_those_of_equal_times_of_a_law_of_time_and_over_one_plus_m_at_one_strain(name) -> None:
    law = ck.law(name).times(ck.arrhenius(T_ref=1000.0))
    fit = ck.identify(law, [*curves(970.0), *curves(1030.0)], starts=1, usual_errors="none")
    (exponent, energy, _), state, r = key_figures(fit), state_at_strain(fit), fit.reference
    at = f"after {time_text(r.time)}" if name == "time-hardening" else f"{100 * r.strain:.2g} % strain"
    assert exponent.where == energy.where == f"{r.stress:.4g} MPa, 727 °C, {at}"
    over = 1.0 if name == "time-hardening" else 1 + M
    assert [exponent.value, energy.value] == pytest.approx([N / over, 200.0 / over], rel=0.01)
    assert state.exponent[1] < N / (1 + M) < state.exponent[2]
    reached = (r.strain * (1 + M) / (A * r.stress**N * boltzmann(r.temperature))) ** (1 / (1 + M))
    assert [state.time[0], state.rate[0]] == pytest.approx([reached, (1 + M) * r.strain / reached], rel=0.02)
    assert ("at constant time the slope of the law's formula over stress is" in fit.details()) == (
        name == "time-hardening"
    )


# ---- rates and durations ---------------------------------------------------------------------------------------------

# Laws of hardening and minimum rates without curves: their shape rests on the stated durations alone.


def _table() -> list[ck.History]:
    """Rates of Norton's law with n = 4.6 and lives of Monkman and Grant, as a table states them."""
    stated = [h for h in rate_table(np.random.default_rng(4), 0.05, 4.6) if h.temperature == 1100.0]
    return [h.replace(times=np.array([t]), rupture_time=t) for h in stated for t in [0.06 / h.minimum_rate]]


def test_only_laws_of_hardening_rest_on_durations():
    for name in ("norton", "strain-hardening", "time-hardening", "blackburn"):
        assert rests_on_durations(ck.law(name), _table()) is (name != "norton")
        assert not rests_on_durations(ck.law(name), [*_table(), curves(1000.0)[0]])


def test_an_interval_that_excludes_the_planted_exponent_is_said_not_to_be_testable():
    """Durations are inverse to the rates, so that time hardening explains the same rates with another exponent."""
    fit = ck.identify(ck.law("time-hardening").fix(m=-0.3), _table(), using=BAR, starts=2)
    (n,) = (e for e in fit.estimates if e.name == "n")
    assert not n.low < 4.6 < n.high
    assert UNTESTABLE in fit.notes
    assert UNTESTABLE not in ck.identify("norton", _table(), using=BAR, starts=2).notes
