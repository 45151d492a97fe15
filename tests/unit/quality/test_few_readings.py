"""Slips in tests of few readings: planted ones are flagged, and clean curves with noise are not."""

import numpy as np
import pytest

from creepkit.quality import check_data_quality
from creepkit.records import History, StressSteps

HOUR = 3600.0


def curve(rng, noise, count, digits=5):
    """Readings of primary, steady and tertiary creep in unlike parts, as fractions of their range, with their times."""
    x = np.geomspace(10.0 ** rng.uniform(-3, -1), 1.0, count) if rng.random() < 0.5 else np.arange(1, count + 1) / count
    a, b, c = rng.dirichlet(np.ones(3))
    y = a * x ** rng.uniform(0.2, 0.5) + b * x + c * 0.05 * x / (1.05 - x)
    return 300.0 * HOUR * x, np.round(y / np.ptp(y) + noise * rng.standard_normal(count), digits)


def flagged(times, readings, stress=((0.0, 120.0),)):
    """Frames that are flagged of a bar of 1 % strain."""
    found = check_data_quality([History("bar", times, {"strain": 0.01 * readings}, StressSteps(stress), 873.15)])
    return {frame for one in found for frame in one.frames}


@pytest.mark.parametrize(("noise", "most"), [(0.003, 0.0), (0.02, 0.01), (0.1, 0.04)])
def test_few_clean_readings_are_believed(noise, most):
    rng = np.random.default_rng(3)
    alarms = [bool(flagged(*curve(rng, noise, rng.integers(5, 12)))) for _ in range(300)]
    assert np.mean(alarms) <= most


@pytest.mark.parametrize("count", [6, 8, 10, 12])
@pytest.mark.parametrize("factor", [10.0, 0.1, -1.0])
def test_a_slip_of_the_pen_among_few_readings(count, factor):
    """A decimal sign that moved, a minus: of any reading but the outer ones that is no small part of the range."""
    rng, found = np.random.default_rng(count), list[bool]()
    for _ in range(60):
        times, readings = curve(rng, 0.003, count)
        inner = [k for k in range(1, count - 1) if readings[k] > 0.3 * readings.max()]
        if inner:
            frame = int(rng.choice(inner))
            readings[frame] *= factor
            found.append(frame in flagged(times, readings))
    assert np.mean(found) >= 0.95


def test_a_reading_that_was_copied_from_the_row_above():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        times = 20.0 * HOUR * np.arange(1, 11)
        readings = np.round(
            0.5 * (times / times[-1]) ** 0.6 + 0.5 * times / times[-1] + 0.001 * rng.standard_normal(10), 4
        )
        frame = int(rng.integers(1, 10))
        readings[frame] = readings[frame - 1]
        assert flagged(times, readings) == {frame}


@pytest.mark.parametrize("frame", [1, -1])
def test_a_copy_at_an_end_of_hours_that_double(frame):
    hours = np.array([1.0, 2, 5, 10, 20, 50, 100])
    readings = np.round(0.2 * hours**0.4, 4)
    readings[frame] = readings[frame - 1]
    assert flagged(HOUR * hours, readings) == {frame % hours.size}


def test_readings_repeat_without_a_copy():
    """Coarse ones, those of creep that dies away, and those before it begins."""
    times = 20.0 * HOUR * np.arange(1, 11)
    assert flagged(times, np.round(0.3 * times / times[-1], 1)) == set()
    for tau in (0.3, 1.0, 3.0, 10.0, 30.0):
        hours = np.array([1.0, 2, 5, 10, 20, 50, 100, 200])
        assert flagged(HOUR * hours, np.round(1.0 - np.exp(-hours / tau), 4)) == set()
        assert flagged(HOUR * hours, np.round(np.expm1(hours / (7 * tau)) / np.expm1(200 / (7 * tau)), 4)) == set()


def test_a_lower_stress_lets_a_bar_recover():
    """The elastic strain that a smaller load takes back is no slip."""
    times = 20.0 * HOUR * np.arange(1, 11)
    readings = 0.1 * np.arange(1, 11) - 0.3 * (times > 100.0 * HOUR)
    assert flagged(times, readings, ((0.0, 120.0), (100.0 * HOUR, 60.0))) == set()
