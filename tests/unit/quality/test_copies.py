"""Copies of tests: found in other layouts, rounding and units; repeated measurements are never taken for copies."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.quality import check_data_quality, repeated_row_notes, without_copies
from creepkit.quality.copies import copied_tests, repeated_rows
from creepkit.records import History, StressSteps

HOUR = 3600.0
HOURS = np.round(np.linspace(10.0, 900.0, 45), 1)


def bar(seed, *, name="one", noise=2e-5, scatter=0.08, decimals=7, count=45, stress=150.0, celsius=600.0):
    """A bar that hardens, its rate a factor exp(N(0, scatter)) off, read with noise and rounded to decimals."""
    rng = np.random.default_rng(seed)
    hours = HOURS[:: HOURS.size // count]
    strain = 0.013 * np.exp(scatter * rng.standard_normal()) * (hours / 900.0) ** 0.66
    strain = np.round(strain + noise * rng.standard_normal(hours.size), decimals)
    return History(name, hours * HOUR, {"strain": strain}, StressSteps([(0.0, stress)]), celsius + 273.15)


def changed(history, *, every=1, decimals=None, **changes):
    strain = history.outputs["strain"][::every]
    strain = strain if decimals is None else np.round(strain, decimals)
    taken = {"times": history.times[::every], "used": history.used[::every], "outputs": {"strain": strain}}
    return history.replace(**{"name": "other", **taken, **changes})


@pytest.mark.parametrize("decimals", [7, 6, 5, 4])
@pytest.mark.parametrize("every", [1, 3])
def test_readings_of_another_test_are_found_when_rounded_or_thinned(decimals, every):
    original = bar(1)
    copy = changed(original, every=every, decimals=decimals)
    assert copied_tests([original, copy]) == {1: 0}
    if every > 1:
        assert copied_tests([copy, original]) == {0: 1}, "the one with more readings stays"


def test_conditions_that_were_converted_are_the_same():
    original = bar(1)
    kept = StressSteps([(0.0, round(150.0 / 6.894757, 2) * 6.894757)])  # written in ksi
    assert copied_tests([original, changed(original, loading=kept, temperature=round(873.15) + 0.0)]) == {1: 0}
    assert not copied_tests([original, changed(original, loading=StressSteps([(0.0, 160.0)]))])
    assert not copied_tests([original, changed(original, temperature=883.15)])


def test_total_strain_of_the_other_file_leaves_the_same_readings():
    """Total strain, written to 5 decimals of a percent, less its elastic part, is off by the rounding of both."""
    original = bar(1)
    elastic = 150.0 / 163e3
    total = np.round(100 * (original.outputs["strain"] + elastic), 5) / 100
    assert copied_tests([original, changed(original, outputs={"strain": total - elastic})]) == {1: 0}


@pytest.mark.parametrize("noise", [2e-5, 1e-4])
@pytest.mark.parametrize("decimals", [4, 5, 7, 12])
@pytest.mark.parametrize("count", [5, 9, 15, 45])
def test_repeated_measurements_are_no_copies(noise, decimals, count):
    """Of the same rate, and of rates that scatter by 2 % as little as any laboratory's do."""
    for seed in range(20):
        for scatter in (0.0, 0.02):
            how = {"noise": noise, "scatter": scatter, "decimals": decimals, "count": count}
            pair = [bar(2 * seed, name="a", **how), bar(2 * seed + 1, name="b", **how)]
            assert not copied_tests(pair), (seed, scatter)


def test_coarse_readings_of_equal_rates_are_no_copies_for_they_may_be_repeats():
    how = {"noise": 0.0, "scatter": 0.0, "decimals": 4}
    assert not copied_tests([bar(1, name="a", **how), bar(2, name="b", **how)])


def test_simulations_of_one_condition_are_one_test():
    how = {"noise": 0.0, "scatter": 0.0, "decimals": 12}
    assert copied_tests([bar(1, name="a", **how), bar(2, name="b", **how)]) == {1: 0}


def test_quality_names_copies_and_all_of_four_copies_count_once():
    tests = [bar(1, name="F08"), bar(2, name="F05"), *(changed(bar(1), name=f"F08_{k}") for k in range(1, 4))]
    flags = [flag for flag in check_data_quality(tests) if flag.kind == "copy"]
    assert [flag.history for flag in flags] == ["F08_1", "F08_2", "F08_3"]
    assert all("the same readings as F08" in flag.reason for flag in flags)
    kept, reasons = without_copies(tests)
    assert [test.name for test in kept] == ["F08", "F05"]
    assert list(reasons) == ["F08_1", "F08_2", "F08_3"]


def test_copies_change_no_value_and_no_interval_of_an_identification():
    law = ck.law("strain-hardening")
    tests = [bar(k, name=f"t{k}", stress=s) for k, s in enumerate((130.0, 140.0, 150.0, 160.0))]
    copies = [changed(tests[3], name=f"copy {k}") for k in range(3)]
    alone, beside = (ck.identify(law, some, starts=1) for some in (tests, [*tests, *copies]))
    for one, other in zip(alone.estimates, beside.estimates, strict=True):
        assert (one.value, one.low, one.high) == (other.value, other.low, other.high)
    assert sum("the same readings as t3" in note for note in beside.notes) == 3
    kept = ck.identify(law, [*tests, *copies], starts=1, suspect_frames="keep")
    assert len(kept.tests) == 7


def row(name, stress, *, hours=None, rate=None, heat="A"):
    """A test of which a table states a time to rupture, h, or a minimum rate, 1/s."""
    time = None if hours is None else hours * HOUR
    return History(
        name, [time or HOUR], {}, StressSteps([(0.0, stress)]), 873.15,
        rupture_time=time, minimum_rate=rate, labels={"heat": heat},
    )  # fmt: skip


def test_a_row_that_repeats_a_rate_and_a_time_is_told_and_kept():
    rows = [row("a", 150.0, hours=812.4, rate=3.21e-9), row("b", 150.0, hours=812.4, rate=3.21e-9)]
    assert repeated_rows(rows) == {1: 0}
    assert without_copies(rows)[0] == rows
    (flag,) = [flag for flag in check_data_quality(rows).flags if flag.kind == "replicate"]
    assert flag.tests == ("b",)
    assert "same numbers as a" in flag.reason
    assert repeated_row_notes(rows) == (f"b: {flag.reason}",)


@pytest.mark.parametrize(
    "other",
    [
        row("b", 150.0, hours=812.4, rate=3.22e-9),
        row("b", 150.0, hours=812.5, rate=3.21e-9),
        row("b", 151.0, hours=812.4, rate=3.21e-9),
        row("b", 150.0, hours=812.4, rate=3.21e-9, heat="B"),
    ],
)
def test_rows_that_differ_in_a_digit_or_in_the_heat_are_two(other):
    assert repeated_rows([row("a", 150.0, hours=812.4, rate=3.21e-9), other]) == {}


def test_one_rate_may_agree_by_chance_and_two_hardly():
    once = [row("a", 150.0, rate=3.2e-9), row("b", 170.0, rate=6.1e-9), row("c", 150.0, rate=3.2e-9)]
    assert repeated_rows(once) == {}
    assert repeated_rows([*once, row("d", 170.0, rate=6.1e-9)]) == {2: 0, 3: 1}
