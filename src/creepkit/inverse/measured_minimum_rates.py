"""Minimum creep rates of measured curves, and those that an identified law predicts for the same tests.

The measured rate is the least slope of straight lines through neighbouring readings. Each line spans a tenth of the
test at least, and as many readings more as its slope needs to be known to LARGEST_ERROR from the noise of a reading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.frame_noise import noise_standard_deviation, usable_frames
from creepkit.inverse.identification import Identification
from creepkit.inverse.minimum_rate_comparison import compare_minimum_rates
from creepkit.inverse.minimum_rates import CONSTANT_LOAD
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.records import History, growing_output, is_logarithmic

SHORTEST_SPAN = 0.1
"""Of the duration of a test: over less, a slope is not taken."""


FEWEST_READINGS = 5
"""Readings from which a slope is taken."""


LARGEST_ERROR = 0.05
"""Relative standard deviation of a slope from the noise of a reading."""


@dataclass(frozen=True)
class MinimumRate:
    """The minimum creep rate of one test, 1/s: measured, and by the law with the 95 % interval of a single test.

    stress : MPa, that was held; temperature : K. predicted, low, high : NaN where the law predicts none.
    """

    test: int
    stress: float
    temperature: float
    measured: float
    predicted: float
    low: float
    high: float


def measured_minimum_rate(history: History) -> float:
    """The minimum creep rate that a test states or its strain shows, 1/s; NaN where it is not known.

    Load and temperature have to be constant, and the leading output a strain.
    """
    if not _is_constant(history):
        return float("nan")
    if history.minimum_rate is not None:
        return history.minimum_rate
    output = growing_output(history) if history.outputs else ""
    if not is_logarithmic(output):
        return float("nan")
    used = usable_frames(history, output)
    noise = noise_standard_deviation(history, output)[used]
    return least_slope(history.times[used], history.outputs[output][used], noise)


def least_slope(times: Floats, strains: Floats, noise: Floats) -> float:
    """The least slope of straight lines through neighbouring readings, 1/s; NaN where no slope is known well enough.

    times, strains, noise : (readings,) s and -, noise the standard deviation of a reading.
    """
    least, span = float("nan"), SHORTEST_SPAN * float(times[-1]) if times.size else 0.0
    for first in range(times.size - FEWEST_READINGS + 1):
        start = max(first + FEWEST_READINGS, int(np.searchsorted(times, times[first] + span)) + 1)
        for end in range(start, times.size + 1):
            t = times[first:end] - times[first:end].mean()
            squares = float((t**2).sum())
            slope = float((t * strains[first:end]).sum()) / squares
            error = float(np.sqrt((t**2 * noise[first:end] ** 2).sum())) / squares
            if slope > 0.0 and error <= LARGEST_ERROR * slope:
                least = slope if np.isnan(least) else min(least, slope)
                break
    return least


def _is_constant(history: History) -> bool:
    loads, temperatures = history.loading.program().values, history.temperature_program().values
    return bool(
        history.loading.quantity == "stress"
        and np.ptp(loads) <= CONSTANT_LOAD * np.abs(loads).max()
        and np.ptp(temperatures) <= ISOTHERMAL_RANGE
    )


def minimum_rates_of(fit: Identification) -> list[MinimumRate]:
    """Measured and predicted minimum rates of the tests of an identification that show one.

    fit : with its histories and predictor.
    """
    measured = [measured_minimum_rate(h) for h in fit.histories]
    known = [k for k, rate in enumerate(measured) if np.isfinite(rate)]
    if not known or fit.predictor is None:
        return []
    tests = [_without_readings(fit.histories[k], measured[k]) for k in known]
    compared = compare_minimum_rates(
        fit.coordinates, fit.u, fit.scatter_of_rates, fit.noise_model, tests, fit.predictor
    )
    rates = []
    for k, test, one in zip(known, tests, compared, strict=True):
        if one is not None:
            stress = float(test.loading.program().values[0])
            rates.append(MinimumRate(k, stress, test.mean_temperature, measured[k], one.predicted, one.low, one.high))
    return rates


def _without_readings(history: History, rate: float) -> History:
    """The test as one of which its minimum rate is known, over the same duration."""
    return history.replace(
        times=history.times[-1:], outputs={}, minimum_rate=rate, minimum_rate_sd=None, includes_elastic=False
    )


def apparent_exponent(stresses: Floats, rates: Floats, temperatures: Floats) -> float:
    """d ln rate / d ln stress by regression with a level of each temperature; NaN where the stresses do not differ.

    stresses, rates, temperatures : (tests,) MPa, 1/s and K.
    """
    known = np.isfinite(rates) & (rates > 0)
    x, y, levels = np.log(stresses[known]), np.log(rates[known]), np.round(temperatures[known] / ISOTHERMAL_RANGE)
    for level in np.unique(levels):
        same = levels == level
        x[same] -= x[same].mean()
        y[same] -= y[same].mean()
    squares = float((x**2).sum())
    return float((x * y).sum()) / squares if squares > LEAST_SPREAD * max(x.size, 1) else float("nan")


LEAST_SPREAD = 0.03**2
"""Mean square of ln stress about its means from which an exponent is taken."""
