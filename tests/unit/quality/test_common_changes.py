"""What happened in several tests at one time: planted steps of the furnace, jumps of a camera, and clean plates."""

import numpy as np
import pytest

from creepkit.quality import check_data_quality
from creepkit.quality.rig import temperature_step
from creepkit.quality.smooth_curve import smooth_curve
from creepkit.readers.reading import creepkit_readers, read_histories
from creepkit.records import History, PressureJump
from helpers.paths import SHARED, needs_shared_data

TIMES = 150.0 * np.arange(1, 97)
NOISE = 1.5e-3


def dimple(rng, k, *, event=None, factor=1.0, jump=0.0, P2=8.0):
    """Primary and steady growth, whose rate changes at `event` s; a raise of the pressure at 2 h doubles the rate."""
    rate = (0.1 + 0.05 * k) * 1e-4 * (1 + 2.0 * np.exp(-TIMES / 2500.0)) * np.where(TIMES > 7200, (P2 / 8) ** 3, 1.0)
    if event is not None:
        rate = rate * np.where(TIMES > event, factor, 1.0)
    clean = 0.06 + np.cumsum(150.0 * rate) + 0.01 * (P2 / 8 - 1) * (TIMES > 7200)
    if event is not None:
        clean = clean + jump * (TIMES > event)
    values = {"amplitude": clean + NOISE * rng.standard_normal(TIMES.size)}
    return History(f"t{k}", TIMES, values, PressureJump(8.0, P2, 7200.0), 1040.0 + 5 * k, specimen="bulge")


def events(tests, kind="rate change"):
    return [flag for flag in check_data_quality(tests) if flag.kind == kind]


@pytest.mark.parametrize("factor", [1 / 3, 0.5, 2.0, 3.0])
def test_a_step_of_the_furnace_is_found_with_its_time_and_size(factor):
    rng = np.random.default_rng(1)
    (flag,) = events([dimple(rng, k, event=9000.0, factor=factor) for k in range(2, 8)])
    assert abs(flag.time - 9000.0) <= 150.0
    assert flag.earliest <= 9000.0 <= flag.latest
    assert len(flag.tests) >= 4
    errors = [abs(np.log(flag.rate_factors[n] / factor)) / np.log(flag.factor_errors[n]) for n in flag.tests]
    assert np.mean(np.array(errors) < 1.0) >= 0.7  # each is a 95 % error
    for k, name in ((int(n[1:]), n) for n in flag.tests):
        expected = temperature_step(1040.0 + 5 * k, flag.rate_factors[name], 400e3)
        assert flag.temperature_steps[name] == pytest.approx(expected)
    assert '"temperature step" (or "rate step")' in flag.proposal
    assert "cut the frames after" in flag.proposal


def test_a_step_of_temperature_is_that_of_arrhenius():
    """10 K at 1073.15 K and 400 kJ/mol multiply a rate by exp(Q/R (1/T1 - 1/T2))."""
    factor = np.exp(400e3 / 8.314462618 * (1 / 1073.15 - 1 / 1083.15))
    assert temperature_step(1073.15, factor, 400e3) == pytest.approx(10.0)


def test_one_test_alone_is_no_event_of_the_rig():
    rng = np.random.default_rng(2)
    tests = [dimple(rng, k, **({"event": 9000.0, "factor": 0.3} if k == 7 else {})) for k in range(2, 8)]
    assert not events(tests)


def test_changes_at_unlike_times_are_no_event_of_the_rig():
    rng = np.random.default_rng(3)
    tests = [dimple(rng, k, event=3900.0 + 1500.0 * k, factor=0.6) for k in range(1, 5)]
    assert not events(tests)


def test_a_raise_of_the_pressure_in_all_tests_is_no_event():
    rng = np.random.default_rng(4)
    for _ in range(5):
        tests = [dimple(rng, k, P2=10.0) for k in range(2, 8)]
        assert not [flag for flag in check_data_quality(tests) if flag.kind in ("rate change", "jump")]


def test_a_jump_of_the_camera_is_one_finding_for_all_tests():
    rng = np.random.default_rng(5)
    tests = [dimple(rng, k, event=6000.0, jump=0.02) for k in range(2, 8)]
    (flag,) = events(tests, "jump")
    assert set(flag.tests) == {test.name for test in tests}
    assert (flag.earliest, flag.latest) == (6000.0, 6150.0)
    assert all(abs(size - 0.02) < 4 * NOISE for size in flag.jumps.values())
    assert not events(tests)


def test_a_step_of_the_load_without_a_record_is_called_one():
    rng = np.random.default_rng(6)
    tests = [dimple(rng, k, event=9000.0, factor=2.0, jump=0.02) for k in range(2, 8)]
    (flag,) = events(tests)
    assert '"load step"' in flag.proposal


def test_slopes_and_steps_of_a_curve_are_those_planted():
    rng = np.random.default_rng(7)
    t = np.linspace(0.01, 1.0, 100)
    values = np.sqrt(t) + np.where(t > 0.6, 0.1 + 0.5 * (t - 0.6), 0.0) + 1e-4 * rng.standard_normal(t.size)
    step = smooth_curve(t, values, 0.0).rate_step(0.6)
    assert step.jump == pytest.approx(0.1, abs=4 * step.jump_sd + 1e-3)
    shifted = smooth_curve(t, values, 0.0, level_shifts=[0.605]).rate_step(0.6)
    assert shifted.before == pytest.approx(0.5 / 0.6**0.5, rel=0.1)
    assert shifted.after == pytest.approx(0.5 / 0.6**0.5 + 0.5, rel=0.1)


@needs_shared_data
def test_inconel_625_slows_at_8250_s():
    """In all warm tests, by a factor of 1.1 to 1.8 in tests 01 to 08 and of some 3 in 09, 11 and 12; nothing jumps."""
    (flag,) = events(read_histories(SHARED / "dabi/in625", creepkit_readers()))
    assert flag.time == 8250.0
    assert {f"test_{k:02d}" for k in (3, 4, 8, 11, 12)} <= set(flag.tests)  # 793 C and above
    slow = {name: 1 / factor for name, factor in flag.rate_factors.items()}
    assert all(1.1 < slow[name] < 1.8 for name in slow if int(name[-2:]) < 9)
    assert all(2.5 < slow[f"test_{k:02d}"] < 3.6 for k in (9, 11, 12))
    assert "no elastic jump" in flag.reason


@needs_shared_data
@pytest.mark.parametrize("folder", ["uniaxial/cmsx6", "uniaxial/alloy617"])
def test_no_common_change_in_creep_machines(folder):
    """Their tests ran on machines and clocks of their own."""
    assert not events(read_histories(SHARED / folder, creepkit_readers()))
