"""Tertiary creep is seen where it is, and noise on curves without it is not taken for it.

Measured with `share` of this file, 30 draws of each curve, number of frames and size of noise (2,250 tests each): of
tests without tertiary creep 0.1 % are taken for it with white noise, 1.1 % with a correlation of 0.5 from frame to
frame and 4.8 % with one of 0.9; of tests with tertiary creep 96 % are seen where noise is at most 3 % of the strain.
"""

import numpy as np
import pytest

import creepkit as ck
from creepkit.quality.curve_shapes import shows_primary_creep, shows_tertiary_creep
from creepkit.records import StressSteps
from tests.helpers.paths import SHARED, needs_shared_data

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
    found = [
        shows_tertiary_creep(planted(curve, frames, size, correlation, rng))
        for curve in curves.values()
        for frames in FRAMES
        for size in sizes
        for _ in range(draws)
    ]
    return float(np.mean(found))


@pytest.mark.parametrize(("correlation", "allowed"), [(0.0, 0.01), (0.5, 0.03), (0.9, 0.08)])
def test_noise_is_not_taken_for_tertiary_creep(correlation, allowed):
    assert share(CONCAVE, 3, correlation) <= allowed


def test_tertiary_creep_is_seen_through_noise():
    assert share(TERTIARY, 2, 0.0, SIZES[:3]) >= 0.9


def test_a_steady_curve_without_noise_is_not_tertiary():
    rng = np.random.default_rng(0)
    assert not shows_tertiary_creep(planted(CONCAVE["straight"], 40, 0.0, 0.0, rng))


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


def test_primary_creep_is_seen_where_the_rate_falls_and_not_in_noise():
    rng = np.random.default_rng(1)
    primary = ("cube root", "primary and secondary", "primary and tertiary")
    curves = {**CONCAVE, **TERTIARY}
    for name, curve in curves.items():
        found = [
            shows_primary_creep(planted(curve, frames, 0.01, correlation, rng))
            for frames in (25, 50, 200)
            for correlation in (0.0, 0.5)
            for _ in range(5)
        ]
        assert np.mean(found) >= 0.9 if name in primary else np.mean(found) <= 0.1, name


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
