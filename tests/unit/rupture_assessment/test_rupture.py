"""Assessments of planted rupture tests: constants, ranking, strengths with bounds, flags, and what is refused."""

import csv
import ctypes
import json
from functools import partial

import numpy as np
import pytest
from scipy.stats import t as student

import creepkit as ck
from creepkit.errors import FitError
from creepkit.reports.answer import rupture_figures
from creepkit.rupture_assessment.checks import physical_realism
from creepkit.rupture_assessment.methods import Conditions
from creepkit.rupture_assessment.observed_tests import rupture_tests
from creepkit.rupture_assessment.strength import _bound
from helpers.compilers import compiler_or_skip, shared_library
from helpers.mistakes import said_otherwise
from helpers.planted_rupture import (
    HOUR,
    TENSILE,
    larson_miller,
    manson_haferd,
    orr_sherby_dorn,
    planted,
    rupture_test,
    wilshire,
)

NO_POLYNOMIAL_BUT_2 = ck.RuptureSettings(degrees=(2,))


@pytest.fixture(scope="module")
def with_heats():
    """Seven heats with run-outs; their effects are such that the average heat has none."""
    effects = np.array([-0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15])
    tests = planted(larson_miller, count=84, heats=7, effects=effects, end=4000.0, seed=2)
    return ck.rupture(tests, "larson-miller", settings=NO_POLYNOMIAL_BUT_2)


def test_planted_constants_and_heats_are_recovered(with_heats):
    assert int(with_heats.tests.censored.sum()) > 3
    for name, value in {"C": 20.0, "a_0": 32000.0, "a_1": -2000.0, "a_2": -1900.0}.items():
        estimate = with_heats.best[name]
        assert estimate.low < value < estimate.high
    assert with_heats.best.scale == pytest.approx(0.08, rel=0.25)
    assert with_heats.best.scatter["heat"] == pytest.approx(0.1, rel=0.25)
    effects = with_heats.best.effects["heat"]
    assert [effects[f"H{k}"] for k in range(7)] == pytest.approx(np.linspace(-0.15, 0.15, 7), abs=0.06)


@pytest.mark.parametrize(
    ("mean", "method", "truth"),
    [
        (orr_sherby_dorn, "orr-sherby-dorn", {"Q": 330e3}),
        (manson_haferd, "manson-haferd", {"T_a": 500.0, "log10 t_a": 14.0, "a_0": 0.02, "a_1": -0.024}),
        (wilshire, "wilshire", {"Q": 280e3, "u": 0.16, "ln k_1": 6.0}),
    ],
)
def test_planted_methods_are_found(mean, method, truth):
    tests = planted(mean, count=60, scatter=0.02)
    degrees = (1,) if method == "manson-haferd" else (2,)
    settings = ck.RuptureSettings(degrees=degrees)
    found = ck.rupture(tests, hours=[1e4], temperatures=[873.15], tensile_strength=TENSILE, settings=settings)
    assert found.best.method == method
    assert found.methods[method] > 0.95
    for name, value in truth.items():
        assert found[method][name].low < value < found[method][name].high, name


def test_bounds_of_a_strength_are_those_of_a_regression():
    """Without heats: where the limits of the mean, and of one observation, of ordinary least squares are the time."""
    assessment = ck.rupture(planted(larson_miller, count=40), "larson-miller", settings=NO_POLYNOMIAL_BUT_2)
    tests = assessment.tests

    def row(stress, T):
        x = np.log10(stress)
        return np.array([-np.ones(np.shape(T)), 1 / T, x / T, x**2 / T])

    X = row(tests.stress, tests.temperature).T
    coefficients, (squares,), *_ = np.linalg.lstsq(X, tests.log_time, rcond=None)
    variance, inverse = (squares + 2 * 0.1**2) / 38, np.linalg.inv(X.T @ X)  # the usual scatter counts as two tests
    strength = assessment.strength(873.15, hours=1e4)
    for bounds, own in ((strength.bounds_of_mean, 0.0), (strength.bounds_of_test, 1.0)):
        for stress, sign in zip(bounds, (-1.0, 1.0), strict=True):
            at = row(np.array(stress), np.array(873.15))
            deviation = np.sqrt(variance * (own + at @ inverse @ at))
            limit = at @ coefficients + sign * student.ppf(0.975, 38) * deviation
            assert limit == pytest.approx(4.0, abs=1e-3)
    assert row(np.array(strength.value), np.array(873.15)) @ coefficients == pytest.approx(4.0, abs=1e-6)
    median, low, high = assessment.rupture_time(strength.value, 873.15)
    assert median == pytest.approx(1e4 * HOUR, rel=1e-5)
    assert low < median < high


def ordered(strength):
    """The value and its bounds, from the lower one of a test to the upper one."""
    kinds = (strength.bounds_of_test, strength.bounds_of_heat, strength.bounds_of_mean)
    return [*(low for low, _ in kinds), strength.value, *(high for _, high in reversed(kinds))]


def test_extrapolation_is_flagged_and_what_is_not_bracketed_is_none(with_heats):
    assert with_heats.strength(873.15, hours=1e4).extrapolation == ""
    far = with_heats.strength(873.15, hours=1e5)
    assert far.extrapolation.startswith("25 times the longest test (4000 h)")
    assert "temperature outside" in with_heats.strength(1000.0, hours=1e4).extrapolation
    few = ck.rupture(planted(larson_miller, count=32, heats=4, between=0.12, seed=8)).strength(873.15, hours=1e3)
    assert all((np.diff(ordered(one)) > 0).all() for one in (far, few))
    longer = with_heats.strength(1100.0, hours=1e11)
    assert longer.value is None
    assert longer.bounds_of_mean == (None, None)
    assert "a tenth of the lowest stress tested" in longer.reason or "turn back" in longer.reason


def test_a_strength_without_an_interval_says_why_beside_it():
    far = ck.rupture(planted(larson_miller, count=8), hours=[1e6])
    said = [one.line for one in rupture_figures(far)]
    assert ["no lower bound: predicted times get shorter again below" in line for line in said] == [False, True, True]
    assert all("8 rupture tests" in line for line in said)
    assert [far.strength(t, hours=1e6).bounds_of_mean[0] is None for t in (823.15, 873.15, 923.15)] == [
        False,
        True,
        True,
    ]


def test_a_page_of_ruptures_begins_with_the_strengths_and_their_picture(tmp_path):
    page = ck.report(ck.rupture(planted(larson_miller, count=20)), tmp_path / "page.html").read_text()
    assert page.index("rupture strength</dt>") < page.index("<table>")
    assert page.index("time to rupture, h</text>") < page.index("<table>")


def test_one_temperature_has_its_own_method():
    tests = [t for t in planted(larson_miller, count=45) if t.temperature == 873.15]
    assessment = ck.rupture(tests)
    assert [*assessment.methods] == ["isothermal"]
    assert not assessment.decisive
    assert assessment.verdict == "use isothermal, the only method that was fitted"
    assert assessment.strength(900.0, hours=1e4).reason == "all tests are at 600 °C"
    assert any("no strength can be stated" in check.found for check in ck.rupture(tests, temperatures=[700.0]).checks)
    given = ck.rupture(tests, "larson-miller", settings=ck.RuptureSettings(fixed={"larson-miller": {"C": 20.0}}))
    own, by_constant = (one.strength(873.15, hours=1e4).value for one in (assessment, given))
    assert by_constant == pytest.approx(own, rel=0.02)


def test_monkman_grant_predicts_by_rates_and_by_a_rate_law():
    rng, tests = np.random.default_rng(1), []
    for k in range(30):
        T, stress = (900.0, 950.0)[k % 2], rng.uniform(60.0, 150.0)
        rate = np.exp(2.0 + 5.0 * np.log(stress) - 300e3 / (8.314462618 * T) + 0.1 * rng.standard_normal())  # 1/h
        hours = 10 ** (-1.2 - 0.9 * np.log10(rate) + 0.03 * rng.standard_normal())
        tests.append(rupture_test(f"t{k}", stress, T, hours, minimum_rate=rate / HOUR))
    assessment = ck.rupture(tests, hours=[1e3], settings=ck.RuptureSettings(degrees=(1,)))
    times, rates = assessment.relation.times, assessment.relation.rates
    assert (times["c"].value, times["m"].value) == pytest.approx((-1.2, 0.9), abs=0.05)
    assert rates["n"].low < 5.0 < rates["n"].high
    assert rates["Q"].low < 300e3 < rates["Q"].high
    assert "monkman-grant" not in assessment.methods
    assert assessment.strength(900.0, hours=1e3, method="monkman-grant").value == pytest.approx(
        assessment.strength(900.0, hours=1e3).value, rel=0.03
    )


def test_laboratories_scatter_beside_heats():
    rng = np.random.default_rng(4)
    effect = {"north": -0.2, "south": 0.0, "west": 0.2}
    tests = []
    for k in range(54):
        T, stress, laboratory = (850.0, 900.0)[k % 2], rng.uniform(80.0, 160.0), [*effect][k % 3]
        log_time = larson_miller(np.log10(stress), T) + effect[laboratory] + 0.05 * rng.standard_normal()
        labels = {"heat": f"H{k // 9}", "laboratory": laboratory}
        tests.append(rupture_test(f"t{k}", stress, T, 10**log_time, labels=labels))
    fit = ck.rupture(
        tests, "larson-miller", hours=[1e3], temperatures=[850.0], settings=ck.RuptureSettings(degrees=(1,))
    ).best
    assert fit.scatter["laboratory"] == pytest.approx(np.sqrt(2 / 3) * 0.2, rel=0.15)
    assert fit.scatter["heat"] < 0.05


def test_a_method_is_not_decisive_where_a_check_fails():
    """Most tests are short, and the long ones break far too early: a tenth of the tests decides over the strength."""
    tests = planted(larson_miller, count=60, scatter=0.02, seed=3)
    early = [t.replace(times=[1.0], outputs={}, rupture_time=_shortened(t)) for t in tests]
    assessment = ck.rupture(early, "larson-miller", settings=ck.RuptureSettings(degrees=(1,)))
    assert not assessment.decisive
    failed = [check for check in assessment.checks if check.passed is False]
    assert failed
    assert failed[0].fault in assessment.verdict


def _shortened(test):
    hours = test.rupture_time / HOUR
    return HOUR * (hours if hours < 300 else 300 * (hours / 300) ** 0.2)


@pytest.mark.parametrize(("less", "named"), [(0.7, 6), (1.0, 0)])
def test_a_product_form_that_lasts_less_long_is_named(less, named):
    sets = (
        planted(larson_miller, count=40, heats=2, effects=[0, np.log10(less)], end=4000.0, seed=k) for k in range(6)
    )
    verdicts = [
        ck.rupture([t.replace(labels={"form": t.labels["heat"]}) for t in tests], "larson-miller").verdict
        for tests in sets
    ]
    assert sum("tests of form 'H1' last 0." in one for one in verdicts) == named


def test_isotherms_that_turn_back_within_the_tests_are_not_ranked():
    x = np.linspace(1.7, 2.3, 12)
    rising = 3.0 - 20.0 * (x - 1.9) ** 2 + 0.03 * np.cos(40.0 * x)
    tests = [
        rupture_test(f"{T:g} {k}", 10 ** x[k], T, 10 ** (rising[k] + 20000.0 * (1 / T - 1 / 900.0)))
        for T in (880.0, 920.0)
        for k in range(12)
    ]
    assessment = ck.rupture(tests, settings=ck.RuptureSettings(degrees=(1, 2)))
    assert "rises with stress at" in assessment.rejected["larson-miller, degree 2"]
    assert all(one.fit.degree == 1 for one in assessment.ranked)


def test_crossing_isotherms_fail_a_check():
    """T_a = 850 K lies among the temperatures tested: above it times rise with temperature."""
    tests, _, _ = rupture_tests(planted(larson_miller, count=30))
    assessment = ck.rupture(planted(manson_haferd, count=30), "manson-haferd", settings=SETTINGS)
    fit = assessment.best
    object.__setattr__(fit, "curvature", 1.0 / (fit.centre.temperature - 850.0))
    checks = physical_realism(fit, tests, lambda T: np.full(np.shape(T), np.nan), None)
    assert not all(check.passed for check in checks)


def test_what_cannot_be_assessed_is_refused():
    weak = dict.fromkeys(TENSILE, 50.0)
    cases = (
        ({"methods": "larson-miler"}, "no method 'larson-miler' of rupture times; did you mean 'larson-miller'"),
        ({"methods": "wilshire"}, "the tensile strength at 550 °C, 600 °C, 650 °C: give tensile_strength="),
        ({"methods": "monkman-grant"}, "no test has a minimum creep rate, which monkman-grant needs"),
        ({"methods": "isothermal"}, "isothermal is for tests of one temperature; these have 3"),
        ({"methods": "wilshire", "tensile_strength": weak}, "not below the tensile strength"),
        ({"hours": []}, "hours is empty; give numbers, in h"),
        ({"temperatures": [20000.0]}, "temperatures holds 20000.0; give K, above 0"),
        ({"tensile_strength": {900.0: -5.0}}, "give numbers above zero: MPa by temperature"),
    )
    assert said_otherwise((partial(ck.rupture, TESTS, **given), sentence) for given, sentence in cases) == []


def test_degrees_that_few_tests_cannot_hold_are_not_offered():
    """Seven tests: four constants and the scatter leave two degrees of freedom or more, six do not."""
    assessment = ck.rupture(planted(larson_miller, count=7, seed=5), "larson-miller")
    assert {one.fit.degree for one in assessment.ranked} <= {1, 2, 3}
    fewer = ck.rupture(planted(larson_miller, count=6, seed=5), "larson-miller")
    assert "larson-miller, degree 3" in fewer.rejected
    assert "6 tests broke, and 5 constants with a scatter take 7 or more" in fewer.rejected["larson-miller, degree 3"]


# ---- rupture files ---------------------------------------------------------------------------------------------------

# Assessments as text, picture and file, and the command `creepkit rupture`.


SETTINGS = ck.RuptureSettings(degrees=(1,))


@pytest.fixture(scope="module")
def tests():
    return planted(larson_miller, count=27, heats=4, end=3000.0)


@pytest.fixture(scope="module")
def assessment(tests):
    return ck.rupture(tests, temperatures=[873.15], stresses=[90.0], tensile_strength=TENSILE, settings=SETTINGS)


def test_a_file_gives_the_same_assessment(assessment, tmp_path):
    path = assessment.save(tmp_path / "rupture.json")
    read = ck.load(path)
    assert str(read) == str(assessment)
    assert read.strength(860.0, hours=2e4) == assessment.strength(860.0, hours=2e4)
    assert read.lives == assessment.lives == (assessment.life(90.0, 873.15),)
    assert assessment.rupture_time(90.0, 873.15)[1:] == tuple(HOUR * np.array(read.lives[0].bounds_of_test))
    assert read.provenance["data"] == assessment.tests.fingerprint
    data = json.loads(path.read_text())
    data["ranked"][0]["fit"]["covariance"] = [[1.0]]
    path.write_text(json.dumps(data))
    with pytest.raises(FitError, match="does not belong to its"):
        ck.load(path)
    data["ranked"] = []
    path.write_text(json.dumps(data))
    with pytest.raises(FitError, match="no method is ranked"):
        ck.load(path)


def test_programs_and_a_table_give_the_times(tmp_path):
    """Of the best method compiled as C and Fortran, and of the average in a table with its bounds."""
    commands = {".c": ("gcc", "-std=c99"), ".f90": ("gfortran", "-std=f2003")}
    for model in (larson_miller, orr_sherby_dorn, manson_haferd):
        found = ck.rupture(planted(model, count=24), model.__name__.replace("_", "-"), temperatures=[860.0])
        stress, T = 87.0, 861.0
        hours = 10 ** found.best.location(Conditions.isotherm(np.array([stress]), T, found.tensile))[0]
        for suffix, (compiler, standard) in commands.items():
            path = found.save(tmp_path / f"{model.__name__}{suffix}")
            flags = [compiler_or_skip(compiler), standard, "-pedantic", "-Wall", "-Wextra", "-Werror", path, "-lm"]
            library, _ = shared_library(flags, tmp_path / f"{model.__name__}_{compiler}.so")
            function = getattr(library, "rupture_hours" if suffix == ".c" else "rupture_hours_")
            function.restype, numbers = ctypes.c_double, [ctypes.c_double(one) for one in (stress, T)]
            given = numbers if suffix == ".c" else map(ctypes.byref, numbers)
            assert function(*given) == pytest.approx(hours, rel=1e-9), path
        rows = list(csv.DictReader(found.save(tmp_path / "times.csv").read_text().splitlines()))
        life = found.life(float(found.tests.stress.min()), 860.0)
        read = (float(rows[0]["median_h"]), float(rows[0]["high_of_one_test_h"]))
        assert read == pytest.approx((life.hours, life.bounds_of_test[1]), rel=1e-5)


# ---- odd tables ------------------------------------------------------------------------------------------------------

# Odd tables and arguments of ck.rupture: an answer or one sentence, and no strength without its flag.


TESTS = planted(larson_miller, count=18)


def test_tests_that_stand_twice_are_told() -> None:
    assert any("18 tests have the stress" in note for note in ck.rupture([*TESTS, *TESTS], "larson-miller").notes)
    run_outs = [rupture_test(k, 80.0, 873.15, 2e4, end=1e4, labels={"type": k}) for k in "wb"]
    assert not any("have the stress" in note for note in rupture_tests([*TESTS, *run_outs])[2])


@pytest.mark.parametrize("remark", ["failed outside gauge length - invalid", "Bruch außerhalb der Messlänge, ungültig"])
def test_what_a_laboratory_calls_invalid_is_left_out_and_said(remark):
    remarks = [remark, "broke near the shoulder", *16 * [""]]
    tests = [test.replace(labels={"remark": text}) for test, text in zip(TESTS, remarks, strict=True)]
    known, _, notes = rupture_tests(tests)
    assert known.names == tuple(t.name for t in TESTS[1:])
    assert [note.split()[1] for note in notes[:2]] == ["left", "broken"]


def test_a_ramp_is_loading_and_a_pause_a_step_of_load() -> None:
    """A load put on within a fiftieth of the life is that of the test; one that was taken off for a while is not."""
    first, second = (test.rupture_time for test in TESTS[:2])
    ramp = ck.StressSteps(((0.0, 0.5), (1e-3 * first, 120.0)), "stress")
    pause = ck.StressSteps(((0.0, 120.0), (0.4 * second, 1.0), (0.5 * second, 120.0)), "stress")
    known, _, notes = rupture_tests([TESTS[0].replace(loading=ramp), TESTS[1].replace(loading=pause), *TESTS[2:]])
    assert known.stress[0] == 120.0
    assert known.names == (TESTS[0].name, *(t.name for t in TESTS[2:]))
    assert f"'{TESTS[1].name}', of which the stress changes from 1 to 120 MPa" in notes[0]


def test_times_beyond_a_double_are_infinite() -> None:
    found = ck.rupture(TESTS, "larson-miller")
    assert found.rupture_time(1e-3, 20.0) == (np.inf, np.inf, np.inf)
    with pytest.raises(FitError, match="give MPa above zero"):
        found.rupture_time(0.0, 900.0)


# ---- strength bounds -------------------------------------------------------------------------------------------------

# Bounds of a strength: those of a wider kind hold those of a narrower one, whatever the quantiles do on the way.


STRESS = np.geomspace(10.0, 1000.0, 301)


def median(stress):
    """log10 h: ten times longer at half the stress, 1e5 h at 100 MPa."""
    return 5.0 - np.log2(stress / 100.0)


def brute_force(curve, hours, value, upper):
    """The end of the stresses about the value at which the quantile is on its side of the time, on a fine grid."""
    fine = np.geomspace(STRESS[0], STRESS[-1], 100_001)
    inside = (curve(fine) >= np.log10(hours)) if upper else (curve(fine) <= np.log10(hours))
    start, step = int(np.searchsorted(fine, value)), 1 if upper else -1
    while 0 <= start + step < fine.size and inside[start + step]:
        start += step
    return fine[start]


@pytest.mark.parametrize("upper", [True, False])
@pytest.mark.parametrize("hours", [1e4, 1e5, 1e6])
@pytest.mark.parametrize("dip", [0.0, 0.8])
def test_a_bound_is_the_end_of_the_stresses_that_are_not_excluded(upper, hours, dip):
    """Half widths of 0.3 decades, with a dip of the quantile at 250 MPa and its mirror image at 30 MPa."""

    def curve(stress):
        bend = np.exp(-0.5 * (np.log(stress / (250.0 if upper else 30.0)) / 0.1) ** 2)
        return median(stress) + (0.3 - dip * bend) * (1.0 if upper else -1.0)

    value = 100.0 * 2.0 ** (5.0 - np.log10(hours))
    bound, reason = _bound(STRESS, curve(STRESS), hours, value, upper=upper)
    assert reason == ""
    assert bound == pytest.approx(brute_force(curve, hours, value, upper), rel=2e-3)


def test_wider_quantiles_give_wider_bounds():
    rng = np.random.default_rng(0)
    for _ in range(50):
        phase, size = rng.uniform(0, 6, 2), rng.uniform(0.0, 0.4)
        half = 0.2 + size * (1.0 + np.sin(phase[0] + 8.0 * np.log(STRESS)))
        wider = half + 0.1 * (1.0 + np.sin(phase[1] + 5.0 * np.log(STRESS)))
        for upper, sign in ((True, 1.0), (False, -1.0)):
            narrow, wide = (
                _bound(STRESS, median(STRESS) + sign * width, 1e5, 100.0, upper=upper)[0] for width in (half, wider)
            )
            assert wide is None or (narrow is not None and sign * (wide - narrow) > -1e-9 * wide)
