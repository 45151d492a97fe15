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
    return LogScale(max(0.01 * typical, 3.0 * float(noise), 1e-9))


def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame, from second differences (robust; 0 for under 5 frames)."""
    t, y = history.times[history.used], history.outputs[output][history.used]
    if t.size < 5:
        return 0.0
    share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    bend = y[1:-1] - (1 - share) * y[:-2] - share * y[2:]
    size = np.sqrt(1 + share**2 + (1 - share) ** 2)
    return float(1.4826 * np.median(np.abs(bend / size)))
