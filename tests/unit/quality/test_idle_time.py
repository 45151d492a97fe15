"""Idle time is found with its length where it was planted, and nowhere else."""

import numpy as np
import pytest

from creepkit.quality.idle_time import idle_parts


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
