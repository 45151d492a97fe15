"""How far predictions are from measurements, in the numbers that papers quote.

The relative squared error sum (p - m)^2 / sum (m - mean m)^2 of Eq. (4) of Chen et al. depends on what `mean` is:
`about="all"` takes one mean over all frames of all tests, the pooled value quoted here unless told otherwise;
`about="test"` each test's own mean, which alone makes sense for a single test and is larger; `about="frame"` the mean
of all tests at the same frame, the letter of Eq. (4) ("the averaged output vectors at the i-th time step").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError


def relative_squared_error(
    measured: Sequence[ArrayLike], predicted: Sequence[ArrayLike], about: Literal["all", "test", "frame"] = "all"
) -> float:
    """Return sum (p - m)^2 / sum (m - mean)^2 over all frames of all tests; each test a (frames,) array."""
    measured_arrays = [np.asarray(m, float) for m in measured]
    squares = sum(float(((np.asarray(p, float) - m) ** 2).sum()) for m, p in zip(measured_arrays, predicted, strict=True))
    return squares / total_sum_of_squares(measured_arrays, about) if total_sum_of_squares(measured_arrays, about) > 0 else float("nan")


def total_sum_of_squares(tests: Sequence[Floats], about: Literal["all", "test", "frame"] = "all") -> float:
    """Sum of (m - mean)^2 over all frames of all tests."""
    if about == "test":
        return sum(float(((m - m.mean()) ** 2).sum()) for m in tests if m.size)
    if about == "all":
        joined = np.concatenate(tests) if tests else np.zeros(0)
        return float(((joined - joined.mean()) ** 2).sum()) if joined.size else 0.0
    if len({m.size for m in tests}) > 1:
        raise FitError('about="frame" needs tests of as many frames each; use "all" or "test"')
    table = np.stack(tests)
    return float(((table - table.mean(axis=0)) ** 2).sum())


@dataclass(frozen=True)
class OutputErrors:
    """Errors of one output, of one test or of all.

    frames : how many were compared. rse : relative squared error (about the mean of just these frames).
    mse, mae : mean squared and mean absolute error, in the output's unit. relative : rms error over the rms of what was
    measured. chi_square : mean of (error / noise)^2; one would be noise alone. NaN where a frame was not predicted.
    """

    frames: int
    relative_squared_error: float
    mean_squared_error: float
    mean_absolute_error: float
    relative_rms_error: float
    chi_square: float


def output_errors(measured: Floats, predicted: Floats, noise: Floats) -> OutputErrors:
    """Errors of predicted against measured values, (frames,) each; noise : (frames,) standard deviations."""
    nan = float("nan")
    if measured.size == 0:
        return OutputErrors(0, nan, nan, nan, nan, nan)
    deviation = predicted - measured
    mse = float(np.mean(deviation**2))
    mean_square = float(np.mean(measured**2))
    known = noise > 0
    chi_square = float(np.mean((deviation[known] / noise[known]) ** 2)) if known.any() else nan
    return OutputErrors(
        measured.size, relative_squared_error([measured], [predicted]), mse, float(np.mean(np.abs(deviation))),
        float(np.sqrt(mse / mean_square)) if mean_square > 0 else nan, chi_square,
    )  # fmt: skip
