"""Whole-life identification: planted damage laws, rupture times with intervals, tests that were stopped."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitWarning
from creepkit.inverse.composite_predictor import CompositePredictor, predict_to_rupture
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.cross_validation import cross_validate
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import Elastic
from creepkit.laws.norton import NORTON
from creepkit.records import History, constant_strain, constant_stress
from creepkit.specimens.relaxation import Relaxation
from helpers.literature_laws import EQUATIONS
from helpers.rupture_tests import BAR, OMEGA, campaign

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


def test_the_answer_says_how_tests_ended(planted, tmp_path):
    _, _, tests, fit = planted
    ends = [m.rupture for m in fit.tests]
    assert [r.censored for r in ends] == [k in (0, 6) for k in range(8)]
    assert [r.measured for r in ends] == [h.rupture_time or h.times[-1] for h in tests]
    assert "rupture: 6 of 8 tests broke; time predicted over measured" in fit.details()
    assert "2 stopped before, of which none should have broken" in fit.details()
    assert len([a for a in fit.plot(tmp_path / "fit.png").axes if a.get_xlabel()]) == 3
    back = ck.load(fit.save(tmp_path / "fit.json"))
    assert [m.rupture for m in back.tests] == ends
    np.testing.assert_array_equal(back.rupture_time(80.0), fit.rupture_time(80.0))


def z_factor(ends):
    """10^(2.5 spread) of measured over predicted rupture times."""
    return 10 ** (2.5 * np.std([np.log10(end.measured / end.predicted) for end in ends], ddof=1))


def test_rupture_times_scatter_as_planted(planted):
    """Rate and life scatter by .15 and .08 in ln: Z = 10^(2.5 x .17/ln 10) = 1.5 for any law."""
    _, _, tests, fit = planted
    ruptured = {m.name: m.rupture for m in fit.tests if m.rupture is not None and not m.rupture.censored}
    assert [*ruptured] == [h.name for h in tests if h.rupture_time]
    assert z_factor(ruptured.values()) < 2.0


@pytest.mark.parametrize("planted", ["Liu-Murakami"], indirect=True)
def test_what_tension_cannot_tell_costs_the_other_parameters_nothing(planted):
    """The share of the largest principal stress moves nothing in tension: freeing it says that, and no more."""
    law, _, tests, fit = planted
    free = ck.identify(EQUATIONS["Liu-Murakami"], tests, using=BAR, starts=3, frames=20)
    assert free.converged
    found = {e.name: e for e in free.estimates}
    share = found.pop("a")
    assert (share.low, share.high, share.verdict) == (0.0, 1.0, "not determined")
    assert free.freedom == pytest.approx(fit.freedom, rel=0.02)
    assert max(ranked.excess for ranked in ck.rank([fit, free]).laws) < 0.1
    for e in fit.estimates:
        inner, free_one = law.table[e.name].to_internal, found[e.name]
        width = inner(free_one.high) - inner(free_one.low)
        assert width == pytest.approx(inner(e.high) - inner(e.low), rel=0.05)


def test_a_condition_left_out_is_predicted():
    tests = campaign(OMEGA, {"A": 1e-16, "n": 4.0, "m": 20.0}, [60, 80, 100, 120], 3)
    fit = ck.identify(OMEGA, tests, using=BAR, starts=3, frames=16)
    folds = cross_validate(fit, by="condition")
    held = {name: values["rupture time"] for name, values in folds.single_values.items()}
    assert len(folds.folds) == 4
    assert z_factor(held.values()) < 3.5
    assert {name: one.measured for name, one in held.items()} == {h.name: h.rupture_time for h in tests}


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


def test_histories_that_say_nothing_of_their_end_are_compared_as_ever():
    law, values = PLANTED["Kachanov-Rabotnov"]
    tests = campaign(law, values, [60, 80], 1)
    cut = [h.up_to("strain", 0.01) for h in tests]
    assert not any(h.end_known for h in cut)
    assert RUPTURE_OUTPUT not in problem(law, cut).observations.outputs
    assert RUPTURE_OUTPUT in problem(law, tests).observations.outputs


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
    found = predict_to_rupture(
        both, law, law.to_internal(given), [bars[0], held, bars[1]], sensitivities=True
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
