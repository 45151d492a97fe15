"""On which scale an output is compared: logarithmic for strains that span decades, linear otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.records import History

LOGARITHMIC = ("strain",)
"""Outputs that span decades."""


RUPTURE = "rupture"
"""The output of tests that were followed to their end: the time of rupture, s. It has no frames of its own."""


class Scale(Protocol):
    """A monotone map g from an output to the quantity in which it is compared."""

    @property
    def floor(self) -> float:
        """The size, in the output's unit, below which a difference is nothing."""
        ...

    @property
    def ceiling(self) -> float:
        """The compared quantity at which a test that burst goes on."""
        ...

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        ...

    def backward(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        ...

    def slope(self, y: Floats) -> Floats:
        """dg/dy."""
        ...


@dataclass(frozen=True)
class LogScale:
    """g(y) = asinh(y / 2 floor): ln(y / floor) well above the floor, linear below it, finite for y <= 0."""

    floor: float

    @property
    def ceiling(self) -> float:
        """That of a strain of one."""
        return float(np.arcsinh(1.0 / (2.0 * self.floor)))

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return np.arcsinh(y / (2.0 * self.floor))

    def backward(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        return 2.0 * self.floor * np.sinh(g)

    def slope(self, y: Floats) -> Floats:
        """dg/dy; 1/y well above the floor."""
        return 1.0 / np.hypot(y, 2.0 * self.floor)


@dataclass(frozen=True)
class LinearScale:
    """g(y) = y / size: with size the spread of what was measured, one means as wrong as the mean of all frames is.

    largest : largest value measured.
    """

    size: float
    largest: float

    @property
    def floor(self) -> float:
        """One per cent of the size."""
        return 0.01 * self.size

    @property
    def ceiling(self) -> float:
        """That of the largest value measured."""
        return self.largest / self.size

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return y / self.size

    def backward(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        return g * self.size

    def slope(self, y: Floats) -> Floats:
        """dg/dy."""
        return np.full(np.shape(y), 1.0 / self.size)


@dataclass(frozen=True)
class LifeScale:
    """g(t) = -ln t of a rupture time t in s: larger where a test breaks earlier, as strains are where it is faster."""

    floor: float = 0.0
    ceiling: float = 0.0

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return -np.log(y)

    def backward(self, g: Floats) -> Floats:
        """The rupture time whose compared quantity is g."""
        return np.exp(-g)

    def slope(self, y: Floats) -> Floats:
        """dg/dy."""
        return -1.0 / y


def scale_for(histories: Sequence[History], output: str) -> Scale:
    """The scale of one output of these histories, all of which have it."""
    if output == RUPTURE:
        return LifeScale()
    return log_scale_for(histories, output) if output in LOGARITHMIC else linear_scale_for(histories, output)


def log_scale_for(histories: Sequence[History], output: str) -> LogScale:
    """A floor at 1 % of the median end value, and never below three times the frame-to-frame noise."""
    ends = [float(np.max(h.outputs[output][usable(h, output)], initial=0.0)) for h in histories]
    noise = np.median([frame_noise(h, output) for h in histories])
    typical = float(np.median(ends))
    return LogScale(max(0.01 * typical, 3.0 * float(noise), 1e-14))


def linear_scale_for(histories: Sequence[History], output: str) -> LinearScale:
    """The standard deviation of all frames of all tests about their one mean."""
    values = np.concatenate([h.outputs[output][usable(h, output)] for h in histories])
    size = float(np.std(values)) if values.size else 0.0
    largest = float(np.max(values, initial=0.0))
    return LinearScale(max(size, 1e-6 * abs(largest), 1e-14), largest)


def usable(history: History, output: str) -> Bools:
    """(frames,) which frames of one output may be used: marked so, after time zero, and a number."""
    return np.asarray(history.used & (history.times > 0) & np.isfinite(history.outputs[output]))


def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame; 0 for under 6 frames.

    From third differences, robustly, in time or in its logarithm, whichever calls less of the curve noise.
    """
    late = usable(history, output)
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


def noise_of(history: History, output: str) -> Floats:
    """(frames,) standard deviation of one output's error: as the history states it, else from frame to frame."""
    stated = history.standard_deviation.get(output)
    measured = np.full(history.times.size, frame_noise(history, output))
    if stated is None:
        return measured
    return np.where(np.isfinite(stated) & (stated > 0), stated, measured)
