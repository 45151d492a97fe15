"""Programs of records: noise of a thermocouple is no drift of the furnace."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.quality.frames import noise_standard_deviation, rounding_step
from creepkit.records.reading_noise import noise_of_readings
from creepkit.records.recorded_programs import TEMPERATURE_RECORD_TOLERANCE, recorded_program

TIMES = np.concatenate([np.linspace(0.0, 60.0, 7), 60.0 + np.geomspace(30.0, 1.08e6, 70)])


def test_noise_of_readings_that_are_dense_at_first_makes_no_drift() -> None:
    """Of 60 furnaces at 900 K with readings off by 0.4 K nearly all stay at their mean; a real drift is kept."""
    held, drifts = 0, list[float]()
    for seed in range(60):
        noise = 0.4 * np.random.default_rng(seed).standard_normal(TIMES.size)
        held += int(np.ptp(recorded_program(TIMES, 900.0 + noise, TEMPERATURE_RECORD_TOLERANCE).values) == 0.0)
        drifting = recorded_program(TIMES, 900.0 + 1.5 * TIMES / TIMES[-1] + noise, TEMPERATURE_RECORD_TOLERANCE)
        drifts.append(float(drifting.values[-1] - drifting.values[0]))
    assert held >= 57
    assert np.median(drifts) == pytest.approx(1.5, abs=0.15)


@pytest.mark.parametrize("sd", [2e-6, 2e-5])
def test_the_noise_that_was_planted_on_a_curve_is_found_whatever_its_steps_are(sd: float) -> None:
    """A rising curve has no step below some hundred noises; rounded readings have that of their last digit."""
    noise = sd * np.random.default_rng(0).standard_normal(200)
    times = np.geomspace(60.0, 1e6, 200)
    curve = 0.05 * (times / 1e6) ** 0.4 + noise
    assert noise_standard_deviation(times, curve) == pytest.approx(sd, rel=0.25)
    assert noise_of_readings(900.0 + noise) == pytest.approx(sd, rel=0.25)
    assert rounding_step(np.round(curve, 3)) == pytest.approx(1e-3)
    assert rounding_step(curve) == 0.0
