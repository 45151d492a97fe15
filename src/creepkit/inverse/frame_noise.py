"""Which frames of a test may be used, and the noise of one frame: as the test states it, or as neighbours show it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.records import History
from creepkit.records.reading_noise import noise_of_readings


def usable_frames(history: History, output: str) -> Bools:
    """(frames,) which frames of one output may be used: marked so, after time zero, and a number."""
    return np.asarray(history.used & (history.times > 0) & np.isfinite(history.outputs[output]))


@lru_cache(maxsize=4096)
def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame, in its unit; 0 for under 6 frames."""
    used = usable_frames(history, output)
    return 0.0 if used.sum() < 6 else noise_of_readings(history.outputs[output][used], history.times[used], order=3)


def noise_standard_deviation(history: History, output: str) -> Floats:
    """(frames,) standard deviation of one output, in its unit: as the history states it, else from frame to frame."""
    stated = history.standard_deviation.get(output)
    estimated = np.full(history.times.size, frame_noise(history, output))
    if stated is None:
        return estimated
    return np.where(np.isfinite(stated) & (stated > 0), stated, estimated)
