"""Designs of experiments against closed forms of linear regression, and what a test tells once it is made."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.experiments.design import design
from creepkit.experiments.rig import Rig, grid_of_rig, rigs_of
from creepkit.inverse.identify import identify
from creepkit.inverse.selection import rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.quantities import rate_at
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import History, PressureJump, StressSteps, constant_stress
from creepkit.specimens.bulge.specimen import Bulge
from helpers.log_rate_predictor import END, LogRates, known_scatter, measured
from helpers.planted_bars import BAR, SPL, bars, carried_out

TRUTH = {"A": float(np.exp(-15.0 - 5.0 * np.log(50.0))), "n": 5.0}
SD, FRAMES, HOURS = 0.02, 20, END / 3600.0
LIKELY = IdentificationSettings(starts=4, sobol_points=32, weights="likelihood", nuisances=())
RIG = Rig("uniaxial", (40.0, 80.0), HOURS, (1000.0,), setup_hours=0.0, frame_interval=END / FRAMES, load_changes=False)


@pytest.fixture(scope="module")
def line():
    """ln rate = ln A + n ln s + t / END from tests at 48 to 52 MPa, with white noise of 0.02."""
    return known_scatter(NORTON, measured(NORTON, TRUTH, (48.0, 50.0, 52.0), sd=SD, seed=1), SD)


def regression(stresses, frames):
    """(2, 2) covariance of (ln A, n) by least squares; frames : of each test."""
    x = np.repeat(np.log(stresses), frames)
    X = np.stack([np.ones_like(x), x], axis=1)
    return SD**2 * np.linalg.inv(X.T @ X)


MADE = [48.0, 50.0, 52.0]


def plans(*stresses, frames=FRAMES):
    times = np.linspace(1.0 / frames, 1.0, frames) * END
    return [History(f"{s:g} MPa", times, {}, constant_stress(s, "stress"), 1000.0) for s in stresses]


def test_information_of_a_test_is_that_of_regression(line):
    """A test tells (ln det S - ln det S') / 2 nats, S by textbook algebra."""
    found = design(line, rig=RIG, candidates=plans(40.0, 60.0, 80.0))
    for test in found.tests:
        stress = float(test.description.split()[0])
        before, after = regression(MADE, 10), regression([*MADE, stress], [10, 10, 10, FRAMES])
        expected = 0.5 * np.log(np.linalg.det(before) / np.linalg.det(after))
        assert test.expectation.information == pytest.approx(expected, rel=1e-3)
        assert test.expectation.parameter_sd["n"] == pytest.approx(np.sqrt(after[1, 1]), rel=5e-3)
    assert found.best.description == "80 MPa"  # the farther end: ln 80/50 > ln 50/40


def test_two_runs_are_made_at_both_ends_of_the_range(line):
    """The D-optimal design of a straight line: half of the observations at each end (Fedorov 1972)."""
    found = design(line, rig=RIG, budget=2.0 * HOURS, candidates=plans(40.0, 50.0, 60.0, 80.0))
    assert sorted(test.description for test in found.plan) == ["40 MPa", "80 MPa"]
    assert sum(test.hours for test in found.plan) == pytest.approx(2.0 * HOURS)


def test_the_grid_finds_the_end_that_a_rate_asks_for(line):
    """c-optimal: the rate at 40 MPa is best measured there; its expected sd is that of regression."""
    found = design(line, rig=replace(RIG, setup_hours=1e4), goal=rate_at(40.0))
    assert found.best.first_level == pytest.approx(40.0)
    c = np.array([1.0, np.log(40.0)])
    best, frames = found.best, found.best.histories[0].times.size
    after = regression([*MADE, 40.0], [10, 10, 10, frames])
    assert best.expectation.sd == pytest.approx(np.sqrt(c @ after @ c), rel=5e-3)
    _, low, high = line.rate(40.0, warn=False)  # three tests from 48 to 52 MPa hardly show what the law misses there
    assert best.expectation.current_sd == pytest.approx(np.log(high / low) / (2 * 1.959964), rel=0.02)


def test_expected_precision_is_met_when_the_test_is_made():
    """Bars: the standard deviation of ln rate after identifying all tests again is the one that was expected."""
    tests = bars(STRAIN_HARDENING, SPL, [constant_stress(s, "stress") for s in (45.0, 55.0)], seed=3)
    fit = identify(STRAIN_HARDENING, tests, BAR, settings=LIKELY)
    found = design(fit, goal=rate_at(30.0))
    made = carried_out(BAR, STRAIN_HARDENING, SPL, found.best.histories[:1], seed=0)
    after = identify(STRAIN_HARDENING, [*tests, *made], BAR, settings=LIKELY)
    _, low, high = after.interval_of(rate_at(30.0).function(after.coordinates))
    assert (high - low) / (2 * 1.959964) == pytest.approx(found.best.expectation.sd, rel=0.15)


def test_what_is_known_before_a_test_is_what_the_fit_states():
    """Also of values that were not found by likelihood, whose covariance is a sandwich."""
    tests = bars(STRAIN_HARDENING, SPL, [constant_stress(s, "stress") for s in (45.0, 50.0, 55.0, 60.0)], seed=3)
    fit = identify(STRAIN_HARDENING, tests, BAR, settings=IdentificationSettings(starts=4, sobol_points=32))
    found = design(fit, goal=rate_at(50.0))
    _, low, high = fit.rate(50.0)
    assert found.best.expectation.current_sd == pytest.approx(np.log(high / low) / (2 * 1.959964), rel=1e-3)
    known = found.best.expectation.current_parameter_sd
    to_theta = fit.coordinates.jacobian(fit.u)
    stated = np.sqrt(np.diag(to_theta @ fit.covariance @ to_theta.T))
    assert [known[name] for name in ("ln A", "n", "m")] == pytest.approx(stated, rel=1e-3)


# ---- the law ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def slopes():
    """Norton's law, and the same with n = 3, which it becomes: nested laws."""
    tests = measured(NORTON, {**TRUTH, "A": np.exp(-15.0) / 50.0**3, "n": 3.0}, (49.0, 50.0, 51.0), sd=SD, seed=1)
    fits = [known_scatter(NORTON, tests, SD), known_scatter(NORTON.fix(n=3).rename("three"), tests, SD)]
    return rank(fits, challenge=False)


def test_of_nested_laws_one_direction_has_power(slopes):
    """If n = 3 holds, Norton's law is never worse; if n is free, that law is worse by what n deviates."""
    found = design(slopes, rig=RIG, candidates=plans(40.0, 80.0))
    for test in found.tests:
        expected = {(c.reference_law, c.alternative_law): c.expected for c in test.expectation.chi_squares}
        assert expected["three", "norton"] < 0.1
        assert expected["norton", "three"] > 5.0
        assert test.expectation.wrong < 0.1


@pytest.fixture(scope="module")
def hardening():
    tests = bars(STRAIN_HARDENING, SPL, [constant_stress(s, "stress") for s in (40.0, 50.0, 60.0)], seed=0)
    return rank([identify(law, tests, BAR, settings=LIKELY) for law in (STRAIN_HARDENING, TIME_HARDENING)])


def test_a_change_of_stress_separates_hardening_by_strain_from_hardening_by_time(hardening):
    """At constant stress both are one law (n' = n/(1-m), m' = m/(1-m)); after a change they part, both ways."""
    found = hardening.further_tests()
    assert ", then " in found.best.description
    assert found.best.expectation.probability > 0.99
    directions = {(c.reference_law, c.alternative_law): c.expected for c in found.best.expectation.chi_squares}
    names = "strain-hardening", "time-hardening"
    assert min(directions[names], directions[names[::-1]]) > 100
    shares = "+".join(names), "+".join(reversed(names))
    assert set(directions) == {names, names[::-1], (names[0], shares[0]), (names[1], shares[1])}
    steady = [t for t in found.tests if ", then " not in t.description]
    assert max(t.expectation.probability for t in steady) < 0.5


def test_one_law_is_told_from_what_the_tests_allow_beside_it():
    """A small change of stress singles strain hardening out, but does not exclude a share of time hardening."""
    jump = StressSteps(((0.0, 50.0), (2e4, 52.0)), "stress")
    tests = bars(STRAIN_HARDENING, SPL, [constant_stress(45.0, "stress"), jump], seed=0)
    ranking = rank([identify(law, tests, BAR, settings=LIKELY) for law in (STRAIN_HARDENING, TIME_HARDENING)])
    assert len(ranking.credible) == 1
    assert ranking.challenges
    found = design(ranking)
    assert "strain-hardening+time-hardening" in found.altered
    assert "it tells strain-hardening from strain-hardening+time-hardening" in str(found)
    made = carried_out(BAR, STRAIN_HARDENING, SPL, found.best.histories, seed=1)
    assert found.best.expectation.probability > 0.95
    after = [identify(law, [*tests, *made], BAR, settings=LIKELY) for law in (STRAIN_HARDENING, TIME_HARDENING)]
    assert rank(after).decisive


def test_the_expected_chi_square_is_met_when_the_test_is_made(hardening):
    found = design(hardening, goal="law")
    made = carried_out(BAR, STRAIN_HARDENING, SPL, found.best.histories[:1], seed=1)
    tests = [*hardening.best.histories, *made]
    fits = [identify(law, tests, BAR, settings=LIKELY) for law in (STRAIN_HARDENING, TIME_HARDENING)]
    again = rank(fits, challenge=False)
    assert again.best.law.name == "strain-hardening"
    assert again.laws[0].weight > 0.95
    met = again.laws[1].chi_square - again.laws[0].chi_square
    expected = next(c for c in found.best.expectation.chi_squares if c.reference_law == "strain-hardening").expected
    assert 1 / 1.5 < met / expected < 1.5


# ---- bad input -------------------------------------------------------------------------------------------------------


def test_a_test_that_ruptures_or_does_not_grow_is_refused_or_left_out(hardening):
    base = hardening.best.histories[0]
    wide = Rig("uniaxial", (0.01, 5000.0), 100.0, (1000.0,))
    far = base.replace(loading=constant_stress(4000.0, "stress"), name="far", outputs={}, standard_deviation={})
    with pytest.raises(FitError, match="the planned test 'far' is of no use: by .* it would rupture"):
        design(hardening, rig=wide, candidates=[far])
    weak = far.replace(loading=constant_stress(0.1, "stress"), name="weak")
    with pytest.raises(FitError, match="'weak' is of no use: it would grow by .* noises of a frame only"):
        design(hardening, rig=wide, candidates=[weak])
    found = design(hardening, rig=Rig("uniaxial", (5.0, 4000.0), 28.0, (1000.0,)))
    assert any("rupture" in reason for _, reason in found.left_out)
    assert all(max(h.loading.program().values) < 1000 for t in found.tests for h in t.histories)


def test_a_number_in_the_map_is_one_of_the_table(hardening):
    """In each cell the probability of the first test of the table with that first load and duration."""
    found = design(hardening)
    first: dict[tuple[bool, float, float], str] = {}
    for test in found.tests:
        levels = test.histories[0].loading.program().values
        place = bool(np.ptp(levels[levels > 0]) == 0.0), round(test.first_level, 6), round(test.histories[0].times[-1])
        first.setdefault(place, f"{test.expectation.probability:.2f}")
    drawn = [text.get_text() for panel in found.plot().axes[:2] for text in panel.texts]
    assert sorted(drawn) == sorted(first.values())


# ---- candidate tests -------------------------------------------------------------------------------------------------

# What a rig can make: grids of planned tests, and what it refuses.


APEX = Bulge().geometry.apex_thickness


def bars_made(*stresses):
    return measured(NORTON, TRUTH, stresses, sd=0.2)


def dimple(**changes):
    return bars_made(50.0)[0].replace(loading=PressureJump(8.0, 10.0, 14400.0), specimen="bulge", **changes)


def test_a_rig_can_do_a_little_more_than_what_it_did():
    (rig,) = rigs_of(bars_made(40.0, 60.0), LogRates())
    assert rig.levels == pytest.approx((0.7 * 40.0, 1.4 * 60.0))
    assert rig.longest_hours == pytest.approx(2.0 * END / 3600.0)
    assert rig.temperatures == (1000.0,)
    assert rig.dimensions == {}
    (bulge,) = rigs_of([dimple()], Bulge())
    assert bulge.dimensions["apex_thickness"] == pytest.approx((0.9 * APEX, APEX, 1.1 * APEX))
    (stated,) = rigs_of([dimple(geometry={"apex_thickness": h}) for h in (0.44, 0.58)], Bulge())
    assert stated.dimensions["apex_thickness"] == (0.44, 0.58)
    assert pickle.loads(pickle.dumps(stated)) == stated
    assert copy.deepcopy(stated) == stated


def test_a_grid_holds_levels_changes_durations_and_dimples():
    rig = Rig("bulge", (4.0, 14.0), 12.0, (1000.0,), {"apex_thickness": (0.44, 0.5, 0.58)}, tests_per_run=3)
    found = grid_of_rig(rig, dimple())
    levels = {float(v) for c in found for h in c.histories for v in h.loading.program().values if v > 0}
    assert (min(levels), max(levels)) == (4.0, 14.0)
    assert max(c.hours for c in found) == pytest.approx(13.0)  # and an hour to set it up
    assert {len(c.histories) for c in found} == {1, 2, 3}
    assert all(c.histories[0].outputs == {} for c in found)
    assert any("a test piece of apex thickness 0.44 mm at 4 MPa" in c.description for c in found)
    assert any("3 test pieces of apex thickness 0.44, 0.5 and 0.58 mm" in c.description for c in found)
    assert len({c.description for c in found}) == len(found)
    short = grid_of_rig(rig, dimple(), budget=4.0)
    assert max(c.hours for c in short) == pytest.approx(4.0)
    with pytest.raises(FitError, match="a budget of 0.5 h leaves no time for a test beside 1 h"):
        grid_of_rig(rig, dimple(), budget=0.5)


def test_temperatures_are_varied_where_the_laws_know_them():
    rig = Rig("uniaxial", (40.0, 80.0), 10.0, (1000.0, 1050.0))
    (base,) = bars_made(50.0)
    assert {c.histories[0].temperature for c in grid_of_rig(rig, base)} == {1000.0, 1050.0}
    assert {c.histories[0].temperature for c in grid_of_rig(rig, base, by_temperature=False)} == {1000.0}


def test_any_load_is_varied_in_its_unit_after_the_ramp_that_was_made():
    base = ck.History(
        "beam", np.linspace(3600.0, 36000.0, 10), {}, ck.constant_load("force", 200.0, ramp=30.0), 1000.0,
        "three-point-bend", ck.Elastic(150e3),
    )  # fmt: skip
    found = grid_of_rig(Rig("three-point-bend", (100.0, 400.0), 20.0, (1000.0,)), base)
    assert any(c.description.startswith("400 N for ") for c in found)
    assert any("100 N to " in c.description and " h, then 141 N to " in c.description for c in found)
    for candidate in found:
        loading = candidate.histories[0].loading
        assert loading.quantity == "force"
        assert loading.program().values[0] == 0.0
        assert loading.program().times[1] == 30.0


def test_tables_of_minimum_rates_have_a_next_test_that_tells_laws_apart():
    """Rates of sinh(s / 60 MPa)^3 at 40 to 90 MPa: with half a decade of stress a power law is hard to tell from it."""
    stresses, rng = (40.0, 50.0, 60.0, 75.0, 90.0), np.random.default_rng(2)
    rates = 1e-9 * np.sinh(np.array(stresses) / 60.0) ** 3 * np.exp(0.05 * rng.standard_normal(5))
    tests = [
        ck.History(f"r{k}", np.array([3.6e6]), {}, ck.constant_stress(s), 873.15, minimum_rate=float(r))
        for k, (s, r) in enumerate(zip(stresses, rates, strict=True))
    ]
    designed = ck.design(ck.select(["norton", "hyperbolic-sine"], tests, further_laws=0, starts=2))
    assert designed.goal == "law"
    assert len(designed.tests) >= 1
