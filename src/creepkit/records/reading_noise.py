"""The noise of readings as their neighbours show it: of frames of a test, of records of loads and temperatures."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats


def noise_of_readings(values: Floats, times: Floats | None = None, *, order: int = 2) -> float:
    """Standard deviation of white noise, in the unit of the values; 0 of no more values than the order.

    By the median of divided differences of this order: what polynomials of a lower degree through neighbours leave, 2
    of records that are held or rise evenly, 3 of curves.
    values : (readings,). times : (readings,) s above zero, at which they were read, by default evenly. The differences
    are those in time or in its logarithm, whichever calls less of the curve noise.
    """
    if values.size <= order:
        return 0.0
    scales = (np.arange(values.size, dtype=float),) if times is None else (times, np.log(times))
    return min(_noise_over(x, values, order) for x in scales)


def _noise_over(x: Floats, y: Floats, order: int) -> float:
    """The same of values at one scale of time.

    x, y : (readings,), what the values depend on, and the values.
    """
    windows = np.lib.stride_tricks.sliding_window_view(x, order + 1)
    differences = windows[:, :, None] - windows[:, None, :] + np.eye(order + 1)
    weights = 1.0 / differences.prod(axis=2)
    remainders = (weights * np.lib.stride_tricks.sliding_window_view(y, order + 1)).sum(axis=1)
    return float(1.4826 * np.median(np.abs(remainders / np.sqrt((weights**2).sum(axis=1)))))
