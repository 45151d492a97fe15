"""The law to try and the test to make, and the line of one alloy of several, from bars whose law was planted."""

import re

import numpy as np
import pytest

import creepkit as ck
from creepkit.reports.advice import LACKING, cautions, further_test, law_to_try, next_step
from creepkit.reports.answer import codes_text, key_figures, table_of_groups
from creepkit.reports.description import NewTestInterval
from creepkit.reports.identification_plot import curve_of_test, fitted_curves
from creepkit.reports.words import BY_REJECTED, NEXT

STRESSES = np.array([80.0, 110.0, 150.0, 200.0])
AMID = float(np.exp(np.log(STRESSES).mean()))


def bars(strain=lambda x: x, n=4.0, side=1.0):
    """Bars whose strain is 0.02 `strain` of the time over that in which 1e-9 (s/AMID)^n 1/s makes 0.02; noise 1 %.

    side : -1 of compression.
    """
    rng, shares = np.random.default_rng(3), np.linspace(0.02, 0.98, 30)
    durations = 0.02 / (1e-9 * (STRESSES / AMID) ** n)
    values = [0.02 * strain(shares) * np.exp(0.01 * rng.standard_normal(shares.size)) for _ in STRESSES]
    return [
        ck.History(
            f"b{s:g}", shares * end, {"strain": side * one}, ck.StressSteps(((0, side * s),), control="stress"), 900.0
        )
        for s, end, one in zip(STRESSES, durations, values, strict=True)
    ]


@pytest.fixture(scope="module")
def steady():
    return ck.identify("norton", bars())


def test_the_law_to_try_has_the_part_of_the_curves_that_this_one_misses():
    early = ck.identify("norton", bars(lambda x: x + 0.5 * (1 - np.exp(-10 * x))))
    assert law_to_try(early, []) == ("norton*primary", "early")
    assert law_to_try(early, ["norton*primary"]) == ("strain-hardening", "early")
    assert "use norton for 80–200 MPa, 627 °C only: a new test's rate within a factor of " in early.headline
    assert next_step(early, searched=[one.format(law="norton") for one in LACKING["early"]]) == NEXT["within"]
    late = ck.identify("norton", bars(lambda x: -np.log(1 - x)))
    assert law_to_try(late, ["mpc-omega*arrhenius"]) == ("kachanov-rabotnov", "late")


def test_a_law_without_temperature_is_told_so_before_its_tests_are_two_groups():
    """Four bars at 627 °C, and four that creep 40 times as fast for being at 727 °C."""
    hotter = [h.replace(name=f"hot {h.name}", times=h.times / 40.0, temperature=1000.0) for h in bars()]
    fit = ck.identify("norton", [*bars(), *hotter])
    assert cautions(fit)[0] == "the tests are at 626.9 °C to 726.9 °C, and the law knows no temperature"
    assert next_step(fit) == NEXT["temperature"]
    assert not any("two groups" in one for one in cautions(fit))


def test_the_test_that_tells_most_of_a_power_law_is_farthest_from_those_that_were_made(steady):
    stress, kelvin, hours, factor = further_test(steady, None)
    assert (stress, kelvin) == pytest.approx((0.8 * 80.0, 900.0))  # 64 MPa is farther below AMID than 250 above
    assert hours == pytest.approx(steady.reference.strain / (1e-9 * (64.0 / AMID) ** 4) / 3600, rel=0.05)
    rate, _, high = steady.rate(64.0, warn=False)
    assert factor == pytest.approx(float(high / rate), rel=0.02)


def test_two_power_laws_that_cross_amid_the_tests_are_told_apart_at_their_end_and_the_same_law_nowhere(steady):
    stress, _, _, factor = further_test(steady, ck.identify("norton", bars(n=6.0)))
    assert stress == pytest.approx(64.0)
    assert factor == pytest.approx((AMID / 64.0) ** 2, rel=0.05)
    assert further_test(steady, steady) is None


def test_a_new_test_lies_as_far_from_the_law_as_a_regression_predicts(steady):
    """ln rate over ln stress by four tests whose rates scatter by 0.2: 0.04 (1 + leverage), 1/2 in the mean."""
    fit = ck.identify("norton", bars(), nuisances=[ck.Nuisance("rate", sd=0.2)], usual_errors="none")
    new = NewTestInterval.of(fit)
    assert (new.quantity, new.level) == ("rate", "test")
    assert new.half_width == pytest.approx(1.96 * 0.2 * np.sqrt(1.5), rel=0.02)
    assert f"a new test's rate within a factor of {np.exp(new.half_width):.3g} (95 %)" in fit.headline
    assert NewTestInterval.of(ck.identify("norton", bars()[:2])) is None  # which do not show how rates scatter


def test_what_is_to_be_done_names_one_test_with_its_stress_temperature_and_time(steady):
    stress, _, hours, _ = further_test(steady, None, lowest=True)
    assert stress == pytest.approx(0.8 * 80.0)
    assert f"test at 64 MPa, 627 °C, for {float(f'{hours:.2g}'):g} h" in next_step(steady)


def test_finite_element_codes_have_a_power_law_built_in_and_need_a_routine_for_damage(steady):
    assert codes_text(steady).startswith("In Abaqus: *CREEP, LAW=STRAIN; CalculiX: *CREEP, LAW=")
    assert "Ansys: TB,CREEP,1,1,3,10" in codes_text(steady)
    source = ck.export(steady, "abaqus")
    assert source.isascii()  # as Fortran is
    assert "for 80 to 200 MPa, 627 C: a new test's rate" in " ".join(source.replace("!", "").split())


def test_the_row_of_an_alloy_states_its_law_its_exponent_and_its_rate_with_intervals(steady):
    ((name, law, exponent, rate, stress, _),) = table_of_groups({"A1": (steady, True)}).rows
    assert (name, str(law)) == ("A1", "norton")
    ends = [[float(one) for one in re.findall(r"[\d.e-]+", cell)] for cell in (exponent, rate)]
    assert [values[0] for values in ends] == pytest.approx([4.0, 1e-9 * 3.6e5], rel=0.03)
    assert all(low < value < high for value, low, high in ends)
    assert float(stress) == pytest.approx(AMID, rel=0.01)


def test_a_rejected_law_shows_its_own_numbers_where_pressed_bars_show_none_and_their_strains_over_decades():
    fit = ck.identify("norton", bars(lambda x: x + 0.5 * (1 - np.exp(-10 * x)), side=-1.0))
    assert fit.adequacy.rejects
    exponent, rate = key_figures(fit)
    assert (exponent.name, exponent.remark, rate.name) == ("stress exponent", BY_REJECTED, "creep rate")
    assert exponent.low < 4.0 < exponent.high
    curve = curve_of_test(fit, fitted_curves(fit), 0, "strain")
    assert (curve.label, curve.logarithmic) == ("compressive strain, %", True)
    assert curve.measured[-1] == pytest.approx(100 * 0.02 * 1.48, rel=0.04)
    assert np.nanmax(np.abs(np.log(curve.identified / curve.measured))) < 1.0
