"""On which scale an output is compared: logarithmic for strains that span decades, linear otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.records import History


@dataclass(frozen=True)
class LogScale:
    """g(y) = asinh(y / 2 floor): ln(y / floor) well above the floor, linear below it, finite for y <= 0."""

    floor: float

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return np.arcsinh(y / (2.0 * self.floor))

    def backward(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        return 2.0 * self.floor * np.sinh(g)

    def slope(self, y: Floats) -> Floats:
        """dg/dy; 1/y well above the floor."""
        return 1.0 / np.hypot(y, 2.0 * self.floor)


def log_scale_for(histories: Sequence[History], output: str) -> LogScale:
    """A floor at 1 % of the median end value, and never below three times the frame-to-frame noise."""
    ends = [float(np.max(h.outputs[output][h.used], initial=0.0)) for h in histories]
    noise = np.median([frame_noise(h, output) for h in histories])
    typical = float(np.median(ends))
    return LogScale(max(0.01 * typical, 3.0 * float(noise), 1e-14))


def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame; 0 for under 6 frames.

    From third differences, robustly, in time or in its logarithm, whichever calls less of the curve noise.
    """
    late = history.used & (history.times > 0)
    t, y = history.times[late], history.outputs[output][late]
    if t.size < 6:
        return 0.0
    return min(_third_differences(x, y) for x in (t, np.log(t)))


def _third_differences(x: Floats, y: Floats) -> float:
    """Spread of what is left of four neighbours once a parabola is taken off, in units of one frame's error."""
    four = np.lib.stride_tricks.sliding_window_view(x, 4)
    apart = four[:, :, None] - four[:, None, :] + np.eye(4)
    weights = 1.0 / apart.prod(axis=2)
    left = (weights * np.lib.stride_tricks.sliding_window_view(y, 4)).sum(axis=1)
    return float(1.4826 * np.median(np.abs(left / np.sqrt((weights**2).sum(axis=1)))))
