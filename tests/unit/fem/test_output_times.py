"""Values between the steps of a march: curves known in closed form, and runs with many more steps."""

from functools import cache

import numpy as np
import pytest

import creepkit as ck
from creepkit import kernels
from creepkit.fem.finite_element_model import finite_element_model
from creepkit.fem.simulation import LoadHistory, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.fem.time_interpolation import TimeInterpolation
from creepkit.records import Program
from creepkit.specimens.bulge.geometry import DimpleGeometry

DIMPLE = finite_element_model(DimpleGeometry().mesh(0.5))
LAWS = {
    "norton": {"A": 6e-14, "n": 4.0},
    "strain-hardening": {"A": 1e-17, "n": 4.0, "m": -0.9},
    "time-hardening": {"A": 2e-10, "n": 4.0, "m": -0.9},
}


def program(*segments):
    """Segments (start, end, pressure, end pressure); temperature, modulus and motion are not looked at."""
    rows = np.zeros((len(segments), 10))
    rows[:, :4] = segments
    return rows


def doubling(start, end, beta=1.0, share=1.0):
    """Times as a march takes them: each at most twice the one before plus 10 s, and steps of `share` in t^beta."""
    times = [0.0]
    while times[-1] < end - start:
        longest = 2 * times[-1] + 10.0
        times.append(min(longest, (times[-1] ** beta + share * (end - start) ** beta) ** (1 / beta), end - start))
    return start + np.array(times)


@pytest.mark.parametrize("beta", [0.05, 0.3, 0.8])
def test_a_power_of_time_from_zero_is_met_however_early_one_asks(beta):
    steps = doubling(0, 43200, beta, 0.05)
    line = TimeInterpolation.from_steps(steps, np.zeros(steps.size, int), program((0, 43200, 8, 8)), beta)
    asked = np.array([1e-6, 0.01, 1, 7, 60, 1000, 43200])
    np.testing.assert_allclose(line.interpolate(1 + steps**beta, asked), 1 + asked**beta, rtol=1e-2)


@pytest.mark.parametrize("decay", [3.0, 300.0, 30000.0])
def test_a_transient_after_a_jump_is_met_within_a_thousandth(decay):
    before, after = doubling(0, 14400), doubling(14400, 43200)
    times, segments = np.concatenate([before, after]), np.repeat([0, 1], [before.size, after.size])
    line = TimeInterpolation.from_steps(times, segments, program((0, 14400, 8, 8), (14400, 43200, 10, 10)))

    def relaxing(y):
        return np.log1p(y / (decay + 20.0))

    values = np.concatenate([relaxing(before), 10 + relaxing(after - 14400)])
    asked = np.array([1.0, 3, 10, 45, 170, 2000, 28800])
    np.testing.assert_allclose(line.interpolate(values, 14400 + asked), 10 + relaxing(asked), rtol=1e-3)
    np.testing.assert_allclose(line.interpolate(values, asked[:-1]), relaxing(asked[:-1]), rtol=0.02, atol=1e-3)


def test_a_jump_has_the_value_before_it_and_time_zero_the_one_after():
    times, segments = np.array([0.0, 0.0, 10, 30, 100, 100, 110, 130]), np.array([0, 0, 0, 0, 0, 1, 1, 1])
    line = TimeInterpolation.from_steps(times, segments, program((0, 100, 8, 8), (100, 130, 10, 10)))
    values = np.array([0.0, 1, 2, 3, 4, 7, 8, 9])
    np.testing.assert_allclose(line.interpolate(values, [0, 10, 100, 130]), [1, 2, 4, 9], rtol=1e-14)
    assert 7 < line.interpolate(values, 100.01)[0] < 7.1
    assert np.isnan(line.interpolate(values, 130.1)).all()


def test_a_short_last_step_does_not_turn_its_small_errors_into_a_slope():
    times = np.append(doubling(0, 40000), 40003.0)
    line = TimeInterpolation.from_steps(times, np.zeros(times.size, int), program((0, 40003, 8, 8)))
    values = np.log1p(times / 500)
    values[-2] += 1e-4
    asked = np.array([22000.0, 28000, 35000, 39000])
    np.testing.assert_allclose(line.interpolate(values, asked), np.log1p(asked / 500), rtol=5e-4)


def test_a_ramp_taken_in_one_step_is_straight():
    line = TimeInterpolation.from_steps(np.array([0.0, 5.0]), np.zeros(2, int), program((0, 5, 0, 8)), 0.1)
    asked = np.array([0, 0.1, 2.5, 5])
    np.testing.assert_allclose(line.interpolate(np.array([0.0, 1.0]), asked), asked / 5, atol=1e-15)


@cache
def run_of(law, pressure, few):
    kernel = kernels.lower(ck.law(law), "compiled")
    theta = ck.law(law).to_internal(ck.law(law).values(LAWS[law]))[0]
    course = LoadHistory(pressure, Program.constant(1000.0), Program.constant(150e3), 1200.0)
    return simulate(
        kernel, theta, DIMPLE, course, settings=SolverSettings() if few else SolverSettings(1e-3, 1e-5, 1.0)
    )


def apex(law, pressure, times, few):
    run = run_of(law, pressure, few)
    return run.at(run.displacements[:, DIMPLE.top[0], 1], times)


BLINK = Program(np.array([0.0, 1e-3]), np.array([0.0, 8.0]))
AT_ONCE = Program.constant(8.0)
JUMP = Program(np.array([0.0, 5, 600, 605]), np.array([0.0, 6, 6, 8]))


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("pressure", [BLINK, AT_ONCE, JUMP], ids=["blink", "at once", "jump"])
def test_any_time_of_twenty_minutes_is_right_within_half_a_percent(law, pressure):
    after = np.array([0.3, 1, 2, 4, 8, 15, 30, 60, 120, 200, 400, 590])
    times = np.sort(np.concatenate([5 + after, 605 + after]))
    np.testing.assert_allclose(apex(law, pressure, times, True), apex(law, pressure, times, False), rtol=5e-3)


@pytest.mark.parametrize("law", list(LAWS))
def test_the_seconds_of_a_ramp_are_right_within_two_percent_of_its_end(law):
    times = np.array([0.5, 1, 2, 3, 4, 5, 601, 602.5, 604, 605])
    few, many = apex(law, JUMP, times, True), apex(law, JUMP, times, False)
    assert np.abs(few - many)[:6].max() < 0.02 * many[5]
    assert np.abs(few - many)[6:].max() < 0.005 * many[-1]


@pytest.mark.parametrize("law", ["strain-hardening", "time-hardening"])
def test_the_first_seconds_after_loading_at_once_are_right(law):
    times = np.array([1e-3, 0.01, 0.1, 1, 3, 10])
    np.testing.assert_allclose(apex(law, AT_ONCE, times, True), apex(law, AT_ONCE, times, False), rtol=5e-3)
