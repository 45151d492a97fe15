"""What is suspect in histories: verdicts on the measured bulges, planted faults, and silence on clean noise."""

from itertools import product

import numpy as np
import pytest

import creepkit as ck
from creepkit.language import Elastic
from creepkit.quality import FRAME_FLAG_KINDS, check_data_quality, exclude_suspect_frames
from creepkit.quality.idle_time import idle_parts
from creepkit.quality.loading_strain import unstated_loading_strain
from creepkit.readers.reading import creepkit_readers, read_histories
from creepkit.records import History, PressureJump, StressSteps
from helpers.paths import SHARED, needs_shared_data

DATA = SHARED
NOISE = 1.5e-3
HOUR = 3600.0
TIMES = np.arange(1, 97) * 150.0


def bulge(rng, *, celsius=770.0, P2=8.0, amplitude=None, noise=NOISE, name="planted", offset=0.0, rate=1.0):
    """A bulge that begins elastically and grows as t^.8, faster after a raise to P2 MPa at 2 h."""
    T = celsius + 273.15
    growth = rate * 0.25 * np.exp(-30000.0 * (1 / T - 1 / 1043.15)) * (TIMES / (4 * HOUR)) ** 0.8
    later = np.maximum(TIMES - 2 * HOUR, 0.0)
    growth = growth * (1 + (P2 / 8 - 1) * 3 * later / (4 * HOUR))
    clean = 0.055 * np.where(TIMES > 2 * HOUR, P2 / 8, 1.0) + offset + growth if amplitude is None else amplitude
    return History(
        name,
        TIMES,
        {"amplitude": clean + noise * rng.normal(size=TIMES.size)},
        PressureJump(8.0, P2, 2 * HOUR),
        T,
        specimen="bulge",
        elastic=Elastic(180e3 - 100 * celsius),
    )


def bar(rng, *, times=None, noise=2e-5, amount=0.02, steps=((0.0, 100.0),)):
    """A bar with primary and tertiary creep, read over decades of time."""
    t = np.geomspace(60.0, 1e6, 80) if times is None else times
    strain = amount * (0.3 * (t / 1e6) ** 0.3 + 0.7 * t / 1e6 / (1.05 - t / 1e6))
    return History("bar", t, {"strain": strain + noise * rng.normal(size=t.size)}, StressSteps(steps), 1123.15)


def kinds(found):
    return {(s.history, s.kind) for s in found}


# ---- measured ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def measured():
    return read_histories(DATA / "dabi/in625", creepkit_readers())


@needs_shared_data
def test_verdict_on_the_nine_bulges(measured):
    """Test 11 after its jump, test 12 beside its twin test 08; every last frame is unloading."""
    found = check_data_quality(measured)
    unloaded = {(h.name, "unloading") for h in measured}
    others = {("test_11", "falling"), ("test_08, test_12", "replicate")}
    assert kinds(found) == unloaded | others
    assert any("test_08 grows 1.80 times as much as its replicate test_12" in str(flag) for flag in found)


@needs_shared_data
def test_the_second_part_of_test_11_can_be_left_out(measured):
    """The jump is at 4.05 h; 28950 and 29100 s are after the end of that test."""
    (jumped,) = (h for h in exclude_suspect_frames(measured) if h.name == "test_11")
    assert jumped.times[jumped.used].max() == 14550.0
    assert jumped.labels["suspect"] == "unloading, frames 192-193; falling, frames 97-191"


@needs_shared_data
def test_unloading_is_seen_without_being_told(measured):
    """Without the end times of the headers: the last frame of all but tests 05 and 11."""
    naive = [h.replace(used=np.ones(h.times.size, bool), labels={}) for h in measured]
    found = {s.history: s.frames for s in check_data_quality(naive) if s.kind == "unloading"}
    assert found == {f"test_{k:02d}": (96,) for k in (1, 2, 3, 4, 6, 8, 9, 12)}


@needs_shared_data
def test_uniaxial_curves_are_mostly_believed():
    """Some tens of frames of 94 tests with 14 thousand frames; no falling strain, no outliers in the smooth CMSX-6."""
    steel = read_histories(DATA / "uniaxial/alloy617", creepkit_readers())
    found = [s for s in check_data_quality(steel) if s.kind in FRAME_FLAG_KINDS]
    assert sum(h.times.size for h in steel) > 10_000
    assert len(found) < 60
    smooth = read_histories(DATA / "uniaxial/cmsx6", creepkit_readers())
    assert not [s for s in check_data_quality(smooth) if s.frames]


# ---- planted -------------------------------------------------------------------------------------------------------


def test_no_false_alarms_on_clean_bulges():
    """A hundred noisy tests of one campaign, temperatures from 720 to 810 C, every fourth with a raised pressure."""
    rng = np.random.default_rng(0)
    tests = [
        bulge(rng, name=f"t{k}", celsius=720 + 90 * rng.random(), P2=10.0 if k % 4 == 0 else 8.0) for k in range(100)
    ]
    assert not list(check_data_quality(tests))
    assert all(a is b for a, b in zip(exclude_suspect_frames(tests), tests, strict=True))


def test_no_false_alarms_on_clean_bars():
    rng = np.random.default_rng(1)
    for k in range(100):
        times = np.linspace(1e3, 1e6, 60) if k % 2 else None
        assert not list(check_data_quality([bar(rng, times=times, noise=10 ** rng.uniform(-6, -4))]))


@pytest.mark.parametrize("frames", [1, 3, 5])
def test_unloading_at_the_end(frames):
    test = bulge(np.random.default_rng(3))
    D = test.outputs["amplitude"].copy()
    D[-frames:] -= 0.03
    (found,) = check_data_quality([test.replace(outputs={"amplitude": D})])
    assert found.kind == "unloading"
    assert found.frames == tuple(range(96 - frames, 96))


def test_rows_read_after_fracture_are_left_out():
    """Strain that goes to infinity as -ln(1 - t/t_r) is creep to 1 - 1e-4 of the life; what steps up is not."""
    life = np.append(np.linspace(0.01, 0.99, 60), 1.0 - np.geomspace(5e-3, 1e-4, 2))
    strain = -0.01 * np.log1p(-life) + 1e-6 * np.random.default_rng(2).normal(size=life.size)
    test = bar(np.random.default_rng(2), times=1e6 * life).replace(outputs={"strain": strain})
    assert not list(check_data_quality([test]))
    broken = np.where(np.arange(life.size) >= 60, 3.0 * strain[59], strain)
    (marked,) = exclude_suspect_frames([test.replace(outputs={"strain": broken})])
    assert marked.labels["suspect"].startswith("fracture, frame")
    assert np.flatnonzero(~marked.used).tolist() == [60, 61]


def test_an_amplitude_that_falls_under_a_held_pressure():
    rng = np.random.default_rng(5)
    shape = np.where(TIMES < 9000, TIMES / 9000, 2 - TIMES / 9000)
    (found,) = check_data_quality([bulge(rng, amplitude=0.055 + 0.2 * shape)])
    assert found.kind == "falling"
    assert abs(found.frames[0] - 59) <= 4  # 9000 s is frame 59
    assert found.frames[-1] == 95


@pytest.mark.parametrize("frame", [2, 40, 93])
def test_single_frames_that_jump(frame):
    """20 um of 1.5 um noise; the outermost two frames at each end have no neighbours on both sides."""
    test = bulge(np.random.default_rng(7))
    D = test.outputs["amplitude"].copy()
    D[frame] += 0.02
    (found,) = check_data_quality([test.replace(outputs={"amplitude": D})])
    assert (found.kind, found.frames) == ("outlier", (frame,))
    (marked,) = exclude_suspect_frames([test.replace(outputs={"amplitude": D})])
    assert np.flatnonzero(~marked.used).tolist() == [frame]


# ---- use -----------------------------------------------------------------------------------------------------------


def test_histories_with_next_to_nothing():
    empty = History("few", np.array([1.0, 2.0]), {"strain": np.array([np.nan, 0.1])}, StressSteps(((0, 50.0),)), 900.0)
    silent = empty.replace(outputs={})
    assert not list(check_data_quality([empty, silent]))


# ---- idle time -------------------------------------------------------------------------------------------------------

# Idle time is found with its length where it was planted, and nowhere else.


def curve(hours: np.ndarray, kind: int) -> np.ndarray:
    """Strain by the time under load: hardening, steady after primary creep, or softening."""
    if kind == 0:
        return 1e-3 * hours**0.4
    if kind == 3:
        return 2e-2 * (0.3 * (hours / 101) ** 0.3 + 0.7 * hours / 101 / (1.05 - hours / 101))
    if kind == 1:
        return 2e-3 * (1 - np.exp(-hours / 5)) + 1e-4 * hours
    return 1e-4 * hours + 2e-4 * (np.exp(hours / 40) - 1)


def sampled(rng: np.random.Generator, count: int) -> np.ndarray:
    """Times by the clock, h, evenly or over decades."""
    return np.linspace(0.5, 100, count) if rng.random() < 0.5 else np.geomspace(0.1, 100, count)


@pytest.mark.parametrize("kind", range(3))
def test_idle_time_that_was_planted(kind: int) -> None:
    """An interruption of 8 to 20 h, seen by frames taken in it or not, is found within a tenth or an interval."""
    rng = np.random.default_rng(kind)
    for trial in range(20):
        idle, start = rng.uniform(8, 20), rng.uniform(30, 60)
        clock = np.linspace(0.5, 120, 81)
        if trial % 2:
            clock = clock[(clock < start) | (clock > start + idle)]  # the logger was off, too
        loaded = np.where(clock < start, clock, np.maximum(clock - idle, start))
        strain = curve(loaded, kind) + rng.normal(0.0, 3e-6, clock.size)
        (part,) = idle_parts(3600 * clock, strain)
        assert part.idle / 3600 == pytest.approx(idle, abs=max(0.1 * idle, 1.6)), (trial, idle)
        assert clock[part.first] - 1.6 <= start + 1e-9 <= clock[part.last], trial


def test_no_idle_time_where_none_was() -> None:
    """Of 600 curves, with noise from none to a hundredth of their range and gaps of frames, none is flagged."""
    rng = np.random.default_rng(7)
    flagged = 0
    for trial in range(600):
        clock = sampled(rng, int(rng.integers(15, 200)))
        strain = curve(clock, trial % 4)
        if trial % 5 == 0:
            clock = clock[(clock < 40) | (clock > 60)]
            strain = curve(clock, trial % 4)
        noise = np.ptp(strain) * 10.0 ** rng.uniform(-5, -2)
        flagged += bool(idle_parts(3600 * clock, strain + rng.normal(0.0, noise, clock.size)))
    assert flagged == 0


# ---- loading strain --------------------------------------------------------------------------------------------------

# Strain of loading that nothing states: planted jumps are questioned, primary creep of ordinary laws is not.


HOURS = {
    "dense": np.r_[0.0, np.geomspace(0.01, 500, 80)],
    "sparse": np.r_[0.0, np.geomspace(1, 500, 25)],
    "even": np.r_[0.0, np.arange(1, 500, 3.0)],
    "dense first": np.r_[0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 1, np.arange(2, 400, 2.0)],
}


CURVES = {
    "cube root": lambda t: 2e-3 * t ** (1 / 3) + 1e-5 * t,
    "strain hardening, m = -0.5": lambda t: 1e-3 * t ** (1 / 1.5),
    "strain hardening, m = -2": lambda t: 2e-3 * t ** (1 / 3),
    "quarter power": lambda t: 2e-3 * t**0.25,
    "steady": lambda t: 1e-5 * t,
    "saturating": lambda t: 5e-3 * (1 - np.exp(-t / 20)) + 1e-5 * t,
    "logarithmic": lambda t: 1e-3 * np.log(1 + t / 0.1),
    "to rupture": lambda t: 2e-3 * t ** (1 / 3) + 0.01 * np.expm1(t / 300),
}


def history(hours, strain, **fields):
    return ck.History(
        times=hours * 3600, outputs={"strain": strain}, loading=ck.StressSteps(((0.0, 145.0),)), temperature=923.15,
        specimen="uniaxial", name="x", **fields,
    )  # fmt: skip


def test_primary_creep_is_not_questioned():
    for hours, curve, noise in product(HOURS.values(), CURVES.values(), [0.0, 2e-5, 1e-4]):
        strain = curve(hours) + noise * np.random.default_rng(3).standard_normal(hours.size) * (hours > 0)
        assert unstated_loading_strain(history(hours, strain)) is None


@pytest.mark.parametrize("noise", [0.0, 2e-5])
def test_a_jump_is_questioned(noise):
    hours = np.r_[0.0, 0.05, 0.2, 0.5, np.geomspace(1, 250, 25)]
    creep = 2.75e-4 * hours ** (1 / 1.4)
    scatter = noise * np.random.default_rng(3).standard_normal(hours.size) * (hours > 0)
    total = history(hours, creep + 1.38e-3 * (hours > 0) + scatter)
    (flag,) = [one for one in ck.check_data_quality([total]) if one.kind == "loading"]
    assert flag.frames == (1,)
    assert unstated_loading_strain(total.replace(labels={"loading_strain": "0.00138"})) is None
    # 145 MPa over 165 GPa is 0.088 %: 0.05 % of the jump is plastic; a record with the elastic part alone is sound
    stiff = ck.Elastic(165e3)
    assert unstated_loading_strain(total.replace(elastic=stiff, includes_elastic=True)) is not None
    elastic = history(hours, creep + 145 / 165e3 * (hours > 0) + scatter, elastic=stiff, includes_elastic=True)
    assert unstated_loading_strain(elastic) is None


def test_a_fit_says_what_it_took_for_creep():
    hours = np.r_[0.0, 0.05, 0.2, 0.5, np.geomspace(1, 250, 25)]
    total = history(hours, 2.75e-4 * hours ** (1 / 1.4) + 1.38e-3 * (hours > 0))
    law = ck.law("strain-hardening").fix(n=5.0)
    assert any("looks like loading strain" in note for note in ck.identify(law, [total], starts=1).notes)
