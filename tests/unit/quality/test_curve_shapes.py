"""Tertiary creep is seen where it is, and noise on curves without it is not taken for it.

Measured with `share` of this file, 30 draws of each curve, number of frames and size of noise (2,250 tests each): of
tests without tertiary creep 0.1 % are taken for it with white noise, 1.1 % with a correlation of 0.5 from frame to
frame and 4.8 % with one of 0.9; of tests with tertiary creep 96 % are seen where noise is at most 3 % of the strain.
"""

from itertools import product

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.candidates import measured_exponent
from creepkit.quality import check_data_quality, repeated_row_notes, without_copies
from creepkit.quality.curve_shapes import falls_logarithmically, shows_primary_creep, shows_tertiary_creep
from creepkit.quality.repeats import agreement_by_chance, copied_tests, repeated_rows
from creepkit.records import History, PressureJump, StressSteps, constant_stress
from helpers.paths import SHARED, needs_shared_data

CONCAVE = {
    "straight": lambda x: x,
    "cube root": np.cbrt,
    "primary and secondary": lambda x: 0.3 * (1.0 - np.exp(-10.0 * x)) + 0.7 * x,
}
TERTIARY = {
    "omega": lambda x: np.log(1.0 - 0.98 * x) / np.log(0.02),
    "cubic": lambda x: x + 0.6 * x**3,
    "primary and tertiary": lambda x: 0.3 * (1.0 - np.exp(-10.0 * x)) + 0.3 * x + 0.4 * x**6,
}
FRAMES = (15, 25, 50, 200, 1000)
SIZES = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Of the noise, over the strain at the end."""


def planted(curve, frames, size, correlation, rng):
    """A test whose strain is a curve of time over its duration with AR(1) noise from frame to frame."""
    x = np.linspace(1.0 / frames, 1.0, frames)
    steps = rng.standard_normal(frames)
    noise = steps.copy()
    for k in range(1, frames):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1.0 - correlation**2) * steps[k]
    return ck.History(
        loading=StressSteps(((0.0, 50.0),)),
        temperature=1100.0,
        times=1e6 * x,
        outputs={"strain": 0.02 * (curve(x) + size * noise)},
        name="planted",
    )


def share(curves, draws, correlation, sizes=SIZES):
    rng = np.random.default_rng(0)
    plans = product(curves.values(), FRAMES, sizes, range(draws))
    return float(np.mean([shows_tertiary_creep(planted(*plan, correlation, rng)) for *plan, _ in plans]))


@pytest.mark.parametrize(("correlation", "allowed"), [(0.0, 0.01), (0.5, 0.03), (0.9, 0.08)])
def test_noise_is_not_taken_for_tertiary_creep(correlation, allowed):
    assert share(CONCAVE, 3, correlation) <= allowed


def test_tertiary_creep_is_seen_through_noise():
    assert share(TERTIARY, 2, 0.0, SIZES[:3]) >= 0.9


def test_a_rate_that_rises_and_falls_again_is_tertiary_creep():
    def s_shaped(x):
        return 0.4 * x + 0.6 / (1.0 + np.exp(-8.0 * (x - 0.5)))

    rng = np.random.default_rng(0)
    assert all(shows_tertiary_creep(planted(s_shaped, 60, 0.005, 0.0, rng)) for _ in range(10))


@needs_shared_data
@pytest.mark.parametrize("folder", ["cmsx6", "alloy617"])
def test_measured_tests_to_rupture_show_tertiary_creep(folder):
    tests = [h for h in ck.read_histories([SHARED / "uniaxial" / folder]) if h.rupture_time is not None and h.outputs]
    assert tests
    assert all(shows_tertiary_creep(history) for history in tests)
    assert np.mean([shows_tertiary_creep(history, measured_exponent(tests)) for history in tests]) > 0.9


def thinned(stress, exponent, control="load"):
    """Norton's law to 12 % of strain: under a constant load t = (1 - exp(-n e)) / (n A stress^n)."""
    strain = np.linspace(0.0, 0.12, 50)
    speed = 1e-6 * (stress / 50.0) ** exponent
    times = strain / speed if control == "stress" else -np.expm1(-exponent * strain) / (exponent * speed)
    noise = 2e-5 * np.random.default_rng(int(stress)).standard_normal(50)
    return ck.History(f"{stress:g}", times, {"strain": strain + noise}, StressSteps(((0.0, stress),), control), 1100.0)


@pytest.mark.parametrize("exponent", [5.0, 9.0])
def test_loss_of_section_under_a_constant_load_is_no_tertiary_creep(exponent):
    tests = [thinned(stress, exponent) for stress in (40.0, 50.0, 65.0)]
    assert all(shows_tertiary_creep(one) for one in tests)
    assert not any(shows_tertiary_creep(one, measured_exponent(tests)) for one in tests)
    assert not any(shows_tertiary_creep(thinned(stress, exponent, "stress")) for stress in (40.0, 65.0))
    assert {"norton", "hyperbolic-sine"} <= {law.name for law in ck.candidates(tests)}


def test_primary_creep_is_seen_where_the_rate_falls_and_not_in_noise():
    rng = np.random.default_rng(1)
    primary = ("cube root", "primary and secondary", "primary and tertiary")
    curves = {**CONCAVE, **TERTIARY}
    for name, curve in curves.items():
        plans = product((25, 50, 200), (0.01,), (0.0, 0.5), range(5))
        found = [shows_primary_creep(planted(curve, *plan, rng)) for *plan, _ in plans]
        assert np.mean(found) >= 0.9 if name in primary else np.mean(found) <= 0.1, name


def test_logarithmic_creep_and_a_short_transient_are_told_from_other_curves():
    rng, short = np.random.default_rng(2), {"short": lambda x: 0.07 * (1.0 - np.exp(-25.0 * x)) + 0.93 * x}
    for name, curve in {**CONCAVE, **short, "logarithmic": lambda x: np.log1p(20.0 * x)}.items():
        tests = [planted(curve, 50, 0.003, 0.0, rng) for _ in range(8)]
        assert np.mean(list(map(falls_logarithmically, tests))) == (name == "logarithmic")
        assert np.mean(list(map(shows_primary_creep, tests))) == (name != "straight")


def test_primary_creep_that_is_short_in_time_is_seen():
    """Rate r (1 + 10 exp(-e/0.002)) to 3 %: it falls to a tenth within 5 % of the time, under a rising true stress."""
    strains = np.linspace(0.0, 0.03, 3001)
    rate = 1e-7 * np.exp(9.0 * strains) * (1.0 + 10.0 * np.exp(-strains / 0.002))
    times = np.concatenate([[0.0], np.cumsum(np.diff(strains) * 0.5 * (1 / rate[1:] + 1 / rate[:-1]))])
    shown = np.concatenate(
        [times[-1] * np.array([1e-3, 3e-3, 0.01, 0.03, 0.06]), np.linspace(0.1, 1.0, 55) * times[-1]]
    )
    rng = np.random.default_rng(3)
    for _ in range(10):
        strain = np.round(np.interp(shown, times, strains) + 3e-5 * rng.standard_normal(shown.size), 5)
        test = ck.History("short", shown, {"strain": strain}, ck.constant_stress(150.0), 873.15)
        assert shows_primary_creep(test)
        assert not shows_primary_creep(test.replace(outputs={"strain": 0.03 * shown / shown[-1] + 3e-5}))


# ---- jumps -----------------------------------------------------------------------------------------------------------


TIMES = 150.0 * np.arange(1, 97)
NOISE = 1.5e-3


def dimple(rng, k, *, jump=0.0, P2=8.0):
    """Primary and steady growth with a step at 6000 s; a raise of the pressure at 2 h doubles the rate."""
    rate = (0.1 + 0.05 * k) * 1e-4 * (1 + 2.0 * np.exp(-TIMES / 2500.0)) * np.where(TIMES > 7200, (P2 / 8) ** 3, 1.0)
    clean = 0.06 + np.cumsum(150.0 * rate) + 0.01 * (P2 / 8 - 1) * (TIMES > 7200) + jump * (TIMES > 6000.0)
    values = {"amplitude": clean + NOISE * rng.standard_normal(TIMES.size)}
    return History(f"t{k}", TIMES, values, PressureJump(8.0, P2, 7200.0), 1040.0 + 5 * k, specimen="bulge")


def test_a_raise_of_the_pressure_is_no_jump():
    rng = np.random.default_rng(4)
    for _ in range(5):
        assert not [f for f in check_data_quality([dimple(rng, k, P2=10.0) for k in range(2, 8)]) if f.kind == "jump"]


def test_a_knocked_extensometer_is_found_in_few_readings_and_not_where_there_was_none():
    """Strain as t^0.4, read at 1, 2, 4 ... 32 h and then daily: a step of 12 times the noise, and none."""
    hours, rng = np.r_[2.0 ** np.arange(6), 24.0 * np.arange(2, 22)], np.random.default_rng(8)
    found = []
    for _ in range(30):
        strain = 2.6e-3 * (hours / 480.0) ** 0.4 + 3e-5 * rng.standard_normal(hours.size)
        for step in (0.0, 3.6e-4):
            values = {"strain": strain + step * (hours > 140.0)}
            test = History("b", 3600.0 * hours, values, constant_stress(300.0), 673.0)
            found += [(step, flag) for flag in check_data_quality([test]) if flag.kind == "jump"]
    assert {step for step, _ in found} == {3.6e-4}
    assert len(found) > 18
    assert {flag.time for _, flag in found} == {3600.0 * 144.0}
    assert np.mean([flag.jumps["b"] for _, flag in found]) == pytest.approx(3.6e-4, rel=0.1)


@pytest.mark.parametrize("step", [-2.4e-4, 2.4e-4])
def test_a_knock_between_uneven_readings_is_neither_an_outlier_nor_idle_time(step):
    """80 times the noise, in readings over decades, evenly and a few at random: of 30, 27 or more are steps."""
    rng, kinds = np.random.default_rng(3), []
    for _ in range(30):
        hours = np.unique(np.r_[np.geomspace(0.03, 100, 60), np.linspace(1, 100, 50), rng.uniform(1, 100, 5)])
        strain = 1e-4 * hours + 3e-6 * rng.standard_normal(hours.size) + step * (hours > rng.uniform(20, 90))
        test = History("b", 3600.0 * hours, {"strain": strain}, constant_stress(300.0), 673.0)
        kinds.append({flag.kind for flag in check_data_quality([test])})
    assert kinds.count({"jump"}) >= 26
    assert not set.union(*kinds) & {"outlier", "idle"}


def test_primary_creep_in_the_first_hundredths_of_a_curve_to_rupture():
    """1 % of hardening before 20 % of softening, readings over decades; none where the rate only rises."""
    x = np.unique(np.r_[np.geomspace(2e-4, 0.99, 60), np.linspace(0.01, 0.99, 60)])
    noise = 2e-5 * np.random.default_rng(1).standard_normal(x.size)
    for primary in (0.01, 0.0):
        strain = -0.04 * np.log(1 - x) + primary * (1 - np.exp(-x / 0.01)) + noise
        test = History("b", 3.6e5 * x, {"strain": strain}, constant_stress(300.0), 673.0)
        assert shows_primary_creep(test) == (primary > 0.0)


def test_a_jump_of_the_camera_is_one_finding_for_all_tests():
    rng = np.random.default_rng(5)
    tests = [dimple(rng, k, jump=0.02) for k in range(2, 8)]
    (flag,) = [flag for flag in check_data_quality(tests) if flag.kind == "jump"]
    assert set(flag.tests) == {test.name for test in tests}
    assert flag.time == 6150.0
    assert all(abs(size - 0.02) < 4 * NOISE for size in flag.jumps.values())


# ---- copies ----------------------------------------------------------------------------------------------------------

# Copies of tests: found in other layouts, rounding and units; repeated measurements are never taken for copies.


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
    if (decimals, every) == (4, 3):  # 15 readings to five noises: repeats may agree as well
        assert 1e-3 < agreement_by_chance(copy, original) < 1e-2
        return
    assert copied_tests([original, copy]) == {1: 0}
    if every > 1:
        assert copied_tests([copy, original]) == {0: 1}, "the one with more readings stays"


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


def test_quality_names_copies_and_all_of_four_copies_count_once():
    tests = [bar(1, name="F08"), bar(2, name="F05"), *(changed(bar(1), name=f"F08_{k}") for k in range(1, 4))]
    flags = [flag for flag in check_data_quality(tests) if flag.kind == "copy"]
    assert [flag.history for flag in flags] == ["F08_1", "F08_2", "F08_3"]
    kept, _ = without_copies(tests)
    assert [test.name for test in kept] == ["F08", "F05"]


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
    assert repeated_row_notes(rows) == (f"b: {flag.reason}",)


@pytest.mark.parametrize("change", [{"rate": 3.22e-9}, {"hours": 812.5}, {"stress": 151.0}, {"heat": "B"}])
def test_rows_that_differ_in_a_digit_or_in_the_heat_are_two(change):
    numbers = {"stress": 150.0, "hours": 812.4, "rate": 3.21e-9}
    assert repeated_rows([row("a", **numbers), row("b", **{**numbers, **change})]) == {}


@pytest.mark.parametrize("count", [6, 7, 9, 11])
def test_few_readings_show_that_a_curve_runs_away(count):
    """Kachanov's curve 1 - (1 - t)^(1/5) with 2 % of noise, and a steady one and one of primary creep with as much."""
    rng, shares = np.random.default_rng(count), np.linspace(0.0, 0.995, count)

    def seen(curve):
        strain = 0.05 * curve / curve[-1] + rng.normal(0.0, 1e-3, count) * (shares > 0)
        return shows_tertiary_creep(History("one", 1e4 * shares, {"strain": strain}, constant_stress(100.0), 900.0))

    runs_away, steady, primary = (
        sum(seen(curve) for _ in range(50)) for curve in (1 - (1 - shares) ** 0.2, shares, np.sqrt(shares))
    )
    assert runs_away > 45
    assert steady + primary <= 1
