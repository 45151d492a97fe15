"""Minimum creep rates: predicted as one more output, with sensitivities, and measured on curves.

The rate is the slope of the predicted curve of the leading strain between neighbouring times; its minimum lies on the
parabola through the logarithms of three slopes, over ln t. Of a curve with a primary and a tertiary stage it is within
0.2 % of the exact minimum, of steady creep exact, and the derivatives are those of the parabola.

The measured rate of a curve is the least slope of straight lines through neighbouring readings. Each line spans a tenth
of the test at least, and as many readings more as its slope needs to be known to LARGEST_ERROR from their noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.stats import t as student

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError
from creepkit.inverse.compared_tests import compares_minimum_rate, duration_known, followed_duration, needs_durations
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, noise_standard_deviation, usable_frames
from creepkit.language import CreepLaw, strain, time
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import (
    History,
    NuisanceValues,
    Output,
    Prediction,
    Predictor,
    growing_output,
    is_logarithmic,
    load_unit,
    outputs_of,
    values_of_tests,
)

TIMES = np.concatenate([[0.0], np.geomspace(1e-6, 0.1, 48), np.linspace(0.1, 1.0, 25)[1:]])
"""Times between which rates are taken, over the duration of the test: early ones for predictions that break early."""


STRAIGHT = 1e-9
"""Second difference of ln of three rates below which they are taken to be the same."""


CONSTANT_LOAD = 1e-6
"""Relative range of a load that is constant."""


def check_minimum_rates(law: CreepLaw, histories: Sequence[History], predictor: Predictor) -> None:
    """FitError for a stated rate that cannot be predicted.

    No strain leads, the load is not constant, or the rate changes with the duration of tests, which is not known.
    """
    unknown = [h.name for h in histories if not duration_known(h)]
    if unknown and needs_durations(law):
        variables = " and ".join(one.name for one in (strain, time) if law.uses(one)) or "internal variables"
        more = f" and {len(unknown) - 1} more" if len(unknown) > 1 else ""
        raise FitError(
            f"law '{law.name}' depends on {variables}, and minimum creep rates of tests of unknown duration cannot "
            f"judge it (history '{unknown[0]}'{more}): state how long these tests lasted, as rupture_h or as "
            "end_time_h with 'ended: stopped', leave them out, or take a law that depends on stress and temperature "
            "alone, such as norton"
        )
    for history in (h for h in histories if compares_minimum_rate(h)):
        own = predictor.for_history(history)
        leading = _leading_output(own)
        if leading is None or leading.quantity != "strain":
            known = "nothing is known of its outputs" if leading is None else f"its leading output is {leading}"
            raise FitError(
                f"history '{history.name}' has a minimum creep rate and no frames, which is predicted where the "
                f"leading output is a strain; of specimen '{history.specimen}' {known}: leave the test out"
            )
        values = history.load_levels
        if np.ptp(values) > CONSTANT_LOAD * np.abs(values).max():
            raise FitError(
                f"history '{history.name}' has a minimum creep rate and a load that changes from {values.min():g} to "
                f"{values.max():g} {load_unit(history)}; give each load a test of its own"
            )


def with_minimum_rates(
    prediction: Prediction,
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues | None = None,
    *,
    sensitivities: bool = False,
) -> Prediction:
    """A prediction with the minimum rates of those tests that are compared by them, 1/s, as one more output.

    theta : (candidates[, tests], parameters) internal values. The rate stands at the first time of its test; it is NaN
    where nothing was predicted. sensitivities : also those that the predictor does not know itself, of one candidate.
    """
    tests = [k for k, history in enumerate(histories) if compares_minimum_rate(history)]
    if not tests:
        return prediction
    given = {key: values[:, tests] for key, values in (nuisances or {}).items()}
    compared, theta = [histories[k] for k in tests], values_of_tests(theta, tests)
    rates, by_parameter, by_nuisance = minimum_rates(predictor, law, theta, compared, given, sensitivities)

    def extended(array: Floats, of_tests: Floats) -> Floats:
        """Array (candidates, tests, times, outputs, ...) with one output more, of values (candidates, tests, ...)."""
        further = np.full((*array.shape[:3], 1, *array.shape[4:]), np.nan)
        further[:, tests, 0, 0] = of_tests
        return np.concatenate([array, further], axis=3)

    jacobian = prediction.jacobian
    return replace(
        prediction,
        values=extended(prediction.values, rates),
        outputs=(*prediction.outputs, MINIMUM_RATE_OUTPUT),
        jacobian=None if jacobian is None or by_parameter is None else extended(jacobian, by_parameter),
        nuisance_jacobian={key: extended(a, by_nuisance[key]) for key, a in prediction.nuisance_jacobian.items()},
    )


def minimum_rates(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    sensitivities: bool,
) -> tuple[Floats, Floats | None, dict[str, Floats]]:
    """(candidates, tests) 1/s, with derivatives to internal parameters, (..., parameters) or None, and to nuisances.

    Each test is followed from loading to its end, at TIMES.

    theta : (candidates[, tests], parameters) internal values. sensitivities : as of with_minimum_rates().
    """
    known: dict[str, Any] = {"includes_elastic": False, "minimum_rate": None, "minimum_rate_sd": None}
    curves = [h.replace(times=followed_duration(h) * TIMES, outputs={}, **known) for h in histories]
    predicted = predictor.predict(law, theta, curves, nuisances=nuisances, sensitivities=sensitivities)
    columns = [predicted.outputs.index(str(_leading_output(predictor.for_history(h)))) for h in curves]
    intervals = np.stack([np.diff(h.times) for h in curves])

    def slopes(array: Floats) -> Floats:
        """(candidates, tests, times - 1, ...) 1/s, of the leading ones of (candidates, tests, times, outputs, ...)."""
        strains = np.stack([array[:, k, :, column] for k, column in enumerate(columns)], axis=1)
        with np.errstate(invalid="ignore"):
            return np.diff(strains, axis=2) / intervals.reshape(*intervals.shape, *(1,) * (strains.ndim - 3))

    rates = slopes(predicted.values)
    positive = np.where(rates > 0, rates, np.nan)
    index, weights = _minima(rates, curves)
    minima = np.exp(_at_minimum(np.log(positive), index, weights))

    def derivative(array: Floats) -> Floats:
        """Of the minima, (candidates, tests, ...), from that of the outputs, as Prediction.jacobian."""
        further = (1,) * (array.ndim - 4)
        of_logarithm = _at_minimum(slopes(array) / positive.reshape(*rates.shape, *further), index, weights)
        return np.asarray(minima.reshape(*minima.shape, *further) * of_logarithm)

    by_parameter = None if predicted.jacobian is None else derivative(predicted.jacobian)
    return minima, by_parameter, {key: derivative(array) for key, array in predicted.nuisance_jacobian.items()}


def _leading_output(predictor: Predictor) -> Output | None:
    """The output of a predictor that grows with creep; None where it names none."""
    return next((output for output in outputs_of(predictor) if output.grows), None)


def _minima(rates: Floats, curves: Sequence[History]) -> tuple[Ints, Floats]:
    """Three neighbouring rates around each minimum, and the weights of their logarithms in it.

    rates : (candidates, tests, intervals) 1/s. Returns positions (candidates, tests, 3) and weights of that shape. At
    the beginning the minimum is the first rate; at the end the parabola is followed to the end of the test.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithms = np.where(rates > 0, np.log(rates), np.inf)
    lowest, last = np.argmin(logarithms, axis=2), rates.shape[2] - 1
    index = np.clip(lowest, 1, last - 1)[..., None] + np.array([-1, 0, 1])
    x = np.log(np.stack([0.5 * (h.times[1:] + h.times[:-1]) for h in curves]))
    ends = np.log([h.times[-1] for h in curves])
    x0, x1, x2 = np.moveaxis(np.take_along_axis(np.broadcast_to(x, rates.shape), index, axis=2), 2, 0)
    y0, y1, y2 = np.moveaxis(np.take_along_axis(logarithms, index, axis=2), 2, 0)
    complete = np.isfinite(y0) & np.isfinite(y2)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, second = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
        curvature = (second - first) / (x2 - x0)
        vertex = 0.5 * (x0 + x1) - 0.5 * first / curvature
    straight = ~(np.abs(second - first) * (x2 - x0) > STRAIGHT)
    at_lowest = np.take_along_axis(np.broadcast_to(x, rates.shape), lowest[..., None], axis=2)[..., 0]
    outermost = np.where(lowest == last, ends, x2)
    place = np.where(curvature > 0, np.clip(vertex, x0, outermost), np.where(lowest == last, ends, at_lowest))
    place = np.where(complete & ~straight, place, at_lowest)
    weights = np.stack(
        [
            (place - x1) * (place - x2) / ((x0 - x1) * (x0 - x2)),
            (place - x0) * (place - x2) / ((x1 - x0) * (x1 - x2)),
            (place - x0) * (place - x1) / ((x2 - x0) * (x2 - x1)),
        ],
        axis=-1,
    )
    alone = (index == lowest[..., None]).astype(float)
    return index, np.where((complete & ~straight)[..., None], weights, alone)


def _at_minimum(array: Floats, index: Ints, weights: Floats) -> Floats:
    """(candidates, tests, ...) weighted sums of three intervals; array : (candidates, tests, intervals, ...)."""
    trailing = (1,) * (array.ndim - 3)
    three = np.take_along_axis(array, index.reshape(*index.shape, *trailing), axis=2)
    share = weights.reshape(*weights.shape, *trailing)
    return np.asarray(np.where(share != 0.0, share * three, 0.0).sum(axis=2))


SHORTEST_SPAN = 0.1
"""Of the duration of a test: over less, a slope is not taken."""


FEWEST_READINGS = 5
"""Readings from which a slope is taken."""


LARGEST_ERROR = 0.05
"""Relative standard deviation of a slope from the noise of a reading."""


@lru_cache(maxsize=4096)  # a study asks for the exponent, for its bend and for the rates themselves
def measured_minimum_rate(history: History) -> float:
    """The minimum creep rate that a test states or its strain shows, 1/s; NaN where it is not known.

    Load and temperature have to be constant, and the leading output a strain.
    """
    loads, temperatures = history.load_levels, history.temperature_program().values
    held = history.loading.quantity == "stress" and np.ptp(temperatures) <= ISOTHERMAL_RANGE
    if not (held and np.ptp(loads) <= CONSTANT_LOAD * np.abs(loads).max()):
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


def apparent_exponent(stresses: Floats, rates: Floats, temperatures: Floats) -> tuple[float, float]:
    """d ln rate / d ln stress by regression with a level of each temperature, and half of its 95 % interval.

    stresses, rates, temperatures : (tests,) MPa, 1/s and K. NaN where the stresses do not differ; an interval by
    Student's t from the scatter of the rates, NaN where no test is left to show it.
    """
    levels = np.round(temperatures / ISOTHERMAL_RANGE)
    return _slope(np.log(stresses), (levels[:, None] == np.unique(levels)).astype(float), rates, LEAST_SPREAD)


def apparent_energy(stresses: Floats, rates: Floats, temperatures: Floats) -> tuple[float, float]:
    """-R d ln rate / d(1/T), J/mol, by regression beside one stress exponent, and half of its 95 % interval.

    stresses, rates, temperatures : (tests,) MPa, 1/s and K. NaN where the temperatures do not differ, or not apart from
    the stresses.
    """
    per_energy, beside = -1.0 / (GAS_CONSTANT * temperatures), np.column_stack([np.ones(rates.size), np.log(stresses)])
    return _slope(per_energy, beside, rates, (ISOTHERMAL_RANGE * per_energy / temperatures) ** 2)


def _slope(x: Floats, beside: Floats, rates: Floats, least: Floats | float) -> tuple[float, float]:
    """Slope of ln rate over x (tests,) beside other columns (tests, columns), and half of its 95 % interval.

    NaN of rates that are not known, and of x that differs by less than `least` in mean square.
    """
    known = np.isfinite(rates) & (rates > 0)
    columns = np.column_stack([x, np.log(np.where(known, rates, 1.0))])[known]
    level, _, rank, _ = np.linalg.lstsq(beside[known], columns, rcond=None)
    x, y = (columns - beside[known] @ level).T
    squares, freedom = float((x**2).sum()), x.size - int(rank) - 1
    if not squares > np.max(least, initial=0.0) * max(x.size, 1):
        return float("nan"), float("nan")
    slope = float((x * y).sum()) / squares
    variance = float(((y - slope * x) ** 2).sum()) / freedom if freedom > 0 else float("nan")
    return slope, float(student.ppf(0.975, max(freedom, 1))) * (variance / squares) ** 0.5


LEAST_SPREAD = 0.03**2
"""Mean square of ln stress about its means from which an exponent is taken."""
