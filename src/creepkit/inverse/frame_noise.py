"""Which frames of a test may be used, and the noise of one frame: as the test states it, or as neighbours show it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.records import History


def usable_frames(history: History, output: str) -> Bools:
    """(frames,) which frames of one output may be used: marked so, after time zero, and a number."""
    return np.asarray(history.used & (history.times > 0) & np.isfinite(history.outputs[output]))


@lru_cache(maxsize=4096)
def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame, in its unit; 0 for under 6 frames.

    From third differences, robustly, in time or in its logarithm, whichever calls less of the curve noise.
    """
    used = usable_frames(history, output)
    times, values = history.times[used], history.outputs[output][used]
    if times.size < 6:
        return 0.0
    return min(_noise_from_third_differences(x, values) for x in (times, np.log(times)))


def _noise_from_third_differences(x: Floats, y: Floats) -> float:
    """Standard deviation of one frame, in the unit of y, from residuals of parabolas through four neighbours.

    x, y : (frames,).
    """
    windows = np.lib.stride_tricks.sliding_window_view(x, 4)
    differences = windows[:, :, None] - windows[:, None, :] + np.eye(4)
    weights = 1.0 / differences.prod(axis=2)
    remainders = (weights * np.lib.stride_tricks.sliding_window_view(y, 4)).sum(axis=1)
    return float(1.4826 * np.median(np.abs(remainders / np.sqrt((weights**2).sum(axis=1)))))


def noise_standard_deviation(history: History, output: str) -> Floats:
    """(frames,) standard deviation of one output, in its unit: as the history states it, else from frame to frame."""
    stated = history.standard_deviation.get(output)
    estimated = np.full(history.times.size, frame_noise(history, output))
    if stated is None:
        return estimated
    return np.where(np.isfinite(stated) & (stated > 0), stated, estimated)
