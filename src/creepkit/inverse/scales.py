"""On which scale an output is compared: logarithmic for strains that span decades, linear otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.records import History

LOGARITHMIC_OUTPUTS = ("strain",)
"""Outputs that span decades."""


RUPTURE_OUTPUT = "rupture"
"""The output of tests that were followed to their end: the time of rupture, s. It has no frames of its own."""


class OutputTransform(Protocol):
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

    def inverse(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        ...

    def derivative(self, y: Floats) -> Floats:
        """dg/dy."""
        ...


@dataclass(frozen=True)
class LogTransform:
    """g(y) = asinh(y / 2 floor): ln(y / floor) well above the floor, linear below it, finite for y <= 0."""

    floor: float

    @property
    def ceiling(self) -> float:
        """That of a strain of one."""
        return float(np.arcsinh(1.0 / (2.0 * self.floor)))

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return np.arcsinh(y / (2.0 * self.floor))

    def inverse(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        return 2.0 * self.floor * np.sinh(g)

    def derivative(self, y: Floats) -> Floats:
        """dg/dy; 1/y well above the floor."""
        return 1.0 / np.hypot(y, 2.0 * self.floor)


@dataclass(frozen=True)
class LinearTransform:
    """g(y) = y / size: with size the spread of what was measured, one means as wrong as the mean of all frames is.

    largest : largest value measured.
    """

    scale: float
    largest: float

    @property
    def floor(self) -> float:
        """One per cent of the size."""
        return 0.01 * self.scale

    @property
    def ceiling(self) -> float:
        """That of the largest value measured."""
        return self.largest / self.scale

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return y / self.scale

    def inverse(self, g: Floats) -> Floats:
        """The output whose compared quantity is g."""
        return g * self.scale

    def derivative(self, y: Floats) -> Floats:
        """dg/dy."""
        return np.full(np.shape(y), 1.0 / self.scale)


@dataclass(frozen=True)
class LogTimeTransform:
    """g(t) = -ln t of a rupture time t in s: larger where a test breaks earlier, as strains are where it is faster."""

    floor: float = 0.0
    ceiling: float = 0.0

    def forward(self, y: Floats) -> Floats:
        """The compared quantity."""
        return -np.log(y)

    def inverse(self, g: Floats) -> Floats:
        """The rupture time whose compared quantity is g."""
        return np.exp(-g)

    def derivative(self, y: Floats) -> Floats:
        """dg/dy."""
        return -1.0 / y


def transform_for(histories: Sequence[History], output: str) -> OutputTransform:
    """The scale of one output of these histories, all of which have it."""
    if output == RUPTURE_OUTPUT:
        return LogTimeTransform()
    return log_transform_for(histories, output) if output in LOGARITHMIC_OUTPUTS else linear_transform_for(histories, output)


def log_transform_for(histories: Sequence[History], output: str) -> LogTransform:
    """A floor at 1 % of the median end value, and never below three times the frame-to-frame noise."""
    largest_values = [float(np.max(h.outputs[output][usable_frames(h, output)], initial=0.0)) for h in histories]
    noise = np.median([frame_noise(h, output) for h in histories])
    median_largest = float(np.median(largest_values))
    return LogTransform(max(0.01 * median_largest, 3.0 * float(noise), 1e-14))


def linear_transform_for(histories: Sequence[History], output: str) -> LinearTransform:
    """The standard deviation of all frames of all tests about their one mean."""
    values = np.concatenate([h.outputs[output][usable_frames(h, output)] for h in histories])
    scale = float(np.std(values)) if values.size else 0.0
    largest = float(np.max(values, initial=0.0))
    return LinearTransform(max(scale, 1e-6 * abs(largest), 1e-14), largest)


def usable_frames(history: History, output: str) -> Bools:
    """(frames,) which frames of one output may be used: marked so, after time zero, and a number."""
    return np.asarray(history.used & (history.times > 0) & np.isfinite(history.outputs[output]))


def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame; 0 for under 6 frames.

    From third differences, robustly, in time or in its logarithm, whichever calls less of the curve noise.
    """
    used = usable_frames(history, output)
    times, values = history.times[used], history.outputs[output][used]
    if times.size < 6:
        return 0.0
    return min(_noise_from_third_differences(x, values) for x in (times, np.log(times)))


def _noise_from_third_differences(x: Floats, y: Floats) -> float:
    """Spread of what is left of four neighbours once a parabola is taken off, in units of one frame's error."""
    windows = np.lib.stride_tricks.sliding_window_view(x, 4)
    differences = windows[:, :, None] - windows[:, None, :] + np.eye(4)
    weights = 1.0 / differences.prod(axis=2)
    remainders = (weights * np.lib.stride_tricks.sliding_window_view(y, 4)).sum(axis=1)
    return float(1.4826 * np.median(np.abs(remainders / np.sqrt((weights**2).sum(axis=1)))))


def noise_standard_deviation(history: History, output: str) -> Floats:
    """(frames,) standard deviation of one output's error: as the history states it, else from frame to frame."""
    stated = history.standard_deviation.get(output)
    estimated = np.full(history.times.size, frame_noise(history, output))
    if stated is None:
        return estimated
    return np.where(np.isfinite(stated) & (stated > 0), stated, estimated)
