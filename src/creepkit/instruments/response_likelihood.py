"""How likely displacements are at every lag between two clocks: a Kalman filter, run at many lags at once.

Between two frames the displacement grows by k dp + q dm + integral of (c + a p^3 + b p^6) dt + transients: k is the
compliance, q that of first loading (m is the largest load so far; plastic flow), c, a p^3 and b p^6 are creep rates.
All walk at random, k and q with the load that has changed, c with the creep rate that has changed and with time, a and
b with time; each change of load starts transients of primary creep of random size, in proportion to the change of the
creep rate, that fade within one and within six intervals. So stiffening, plastic flow and creep of any law are
followed; what cannot be followed is a jump of the displacement in another interval between frames than that of the
load. Primary creep that were as large after a step at low load as after one at high load would pass for a lag.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.records import InstrumentRecord, Program
from creepkit.records.recorded_programs import recorded_program

STATES = 8
"""Displacement, compliance, that of first loading, creep rate, what is left of two transients, creep rates at the whole
range of the load that fall with its EXPONENTS."""


EXPONENTS = (3, 6)
"""Of the creep rate on the load, about which those of alloys lie; the rest is left to the random walks."""


LOAD_EXPONENT = 4
"""Of the changes of the creep rate that start transients."""


TRANSIENTS = (1.0, 6.0)
"""Time constants of the transients in median intervals between frames."""


RECORD_TOLERANCE = 0.002
"""Fraction of a channel's range by which the program that stands for it may be off, where noise is not more."""


@dataclass(frozen=True)
class Response:
    """What drives a displacement, at several lags.

    loads, maxima : (frames, lags) load, and the largest so far, as fractions of the range of the load.
    intervals : (frames - 1,) between frames, as fractions of the whole time. powers : (EXPONENTS, frames - 1, lags)
    means of the powers of the load between frames.
    """

    loads: Floats
    maxima: Floats
    intervals: Floats
    powers: Floats


@dataclass(frozen=True)
class DrivingRecord:
    """A load without its noise: load and the largest so far are straight between `times`.

    times : (points,) s. loads, maxima : (points,) fractions of the range. steepest : 1/s, the fastest change.
    """

    times: Floats
    loads: Floats
    maxima: Floats
    steepest: float

    def response(self, frame_times: Floats, lags: Floats, width: float = 0.0) -> Response:
        """Load and maximum at every frame for every lag.

        frame_times : (frames,) s. lags : (lags,) s. width : s, over which both are averaged; a jump that is sharper
        than lags lie apart would be missed.
        """
        wanted = frame_times[:, None] + lags
        between, loads = np.diff(frame_times), np.maximum(self.loads, 0.0)
        powers = [np.diff(_integral(self.times, loads, power, wanted), axis=0) for power in EXPONENTS]
        return Response(
            _averaged(self.times, self.loads, width, wanted),
            _averaged(self.times, self.maxima, width, wanted),
            between / np.ptp(frame_times),
            np.array(powers) / between[:, None],
        )


def driving_record(record: InstrumentRecord, channel: str) -> DrivingRecord:
    """A channel of a record as it drives the displacement, free of noise."""
    times, values = record.readings(channel)
    size = float(np.ptp(values)) or 1.0
    shifted = recorded_program(times - times[0], (values - values[0]) / size, RECORD_TOLERANCE)
    corners, loads = _with_crossings(shifted)
    slopes = np.abs(np.diff(loads)) / np.maximum(np.diff(corners), 1e-300)
    return DrivingRecord(
        corners + times[0], loads, np.maximum.accumulate(loads), float(slopes.max(initial=0.0)) or 1.0 / size
    )


def _with_crossings(program: Program) -> tuple[Floats, Floats]:
    """Corners of a program, and the points at which it first exceeds what was the largest value before."""
    times, values = [program.times[0]], [program.values[0]]
    largest = values[0]
    for (t0, v0), (t1, v1) in pairwise(zip(program.times, program.values, strict=True)):
        if v0 < largest < v1:
            times.append(t0 + (largest - v0) / (v1 - v0) * (t1 - t0))
            values.append(largest)
        times.append(t1)
        values.append(v1)
        largest = max(largest, v1)
    return np.array(times), np.array(values)


def _averaged(times: Floats, values: Floats, width: float, wanted: Floats) -> Floats:
    """(...,) mean of a polygon over `width` s about times (...,) s; its first and last values hold outside."""
    if width <= 0.0:
        return np.asarray(np.interp(wanted, times, values))
    before, after = _integral(times, values, 1, np.array([wanted - 0.5 * width, wanted + 0.5 * width]))
    return np.asarray((after - before) / width)


def _integral(times: Floats, values: Floats, power: int, wanted: Floats) -> Floats:
    """(...,) integral of a power of a polygon up to times (...,) s; its first and last values hold outside."""
    times = np.array([min(times[0], wanted.min()) - 1.0, *times, max(times[-1], wanted.max()) + 1.0])
    values = np.array([values[0], *values, values[-1]])

    def from_corner(row: Ints, until: Floats) -> Floats:
        share = (until - times[row]) / (times[row + 1] - times[row])
        first, last = values[row], values[row] + share * (values[row + 1] - values[row])
        mean = sum(first**k * last ** (power - k) for k in range(power + 1)) / (power + 1)
        return np.asarray((until - times[row]) * mean)

    up_to = np.append(0.0, np.cumsum(from_corner(np.arange(times.size - 1), times[1:])))
    row = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, times.size - 2)
    return np.asarray(up_to[row] + from_corner(row, wanted))


@dataclass(frozen=True)
class ResponseModel:
    """Scales of the prior and of the random walks; each a number, or (lags,) of them.

    noise : number or (lags,) mm. compliance : mm over the range of the load, rate : mm over the whole time, prior
    standard deviations. compliance_walk : number or (lags,) mm over the range of the load, by which the compliance
    walks over that range. rate_walk : number or (lags,) mm over the whole time, by which the creep rate walks over the
    whole time, and over its range. transient : number or (lags,) mm, standard deviation of each transient after a
    change of the load by its whole range.
    """

    noise: Floats | float
    compliance: float
    rate: float
    compliance_walk: Floats | float
    rate_walk: Floats | float
    transient: Floats | float


TRIED = ((0.003, 0.03, 0.3, 3.0), (0.01, 0.1, 1.0, 10.0, 100.0), (0.001, 0.01, 0.1), (0.4, 0.65, 1.0, 1.5))
"""Walks of compliance and rate and transients, as fractions of the range of the displacements, and fractions of their
noise from frame to frame, that are tried."""


def trial_models(displacements: Floats, noise: float) -> list[ResponseModel]:
    """Few models that together fit most tests, for a first search.

    displacements : (frames,) mm. noise : mm.
    """
    size = float(np.ptp(displacements))
    walks = product((0.03, 1.0), (0.3, 10.0))
    return [ResponseModel(noise, size, 10 * size, k * size, c * size, 0.03 * size) for k, c in walks]


def best_model(response: Response, displacements: Floats, noise: float) -> ResponseModel:
    """The most likely model at one lag.

    response : at that lag alone. displacements : (frames,) mm. noise : mm, a first estimate.
    """
    size = float(np.ptp(displacements))
    scales = np.array([size, size, size, noise])
    grid = np.array(list(product(*TRIED)))
    for step in (10.0**0.5, 10.0**0.25):
        values = np.maximum(grid * scales, 1e-12)
        columns = ("loads", "maxima", "powers")
        repeated = replace(response, **{c: np.repeat(getattr(response, c), len(grid), axis=-1) for c in columns})
        tried = ResponseModel(values[:, 3], size, 10 * size, values[:, 0], values[:, 1], values[:, 2])
        best = grid[int(np.argmax(log_likelihoods(repeated, displacements, tried).sum(axis=0)))]
        factors = (1 / step, 1.0, step)
        grid = best * np.array(list(product(factors, factors, factors, (step**-0.4, 1.0, step**0.4))))
    k, c, u, e = (float(x) for x in best * scales)
    return ResponseModel(e, size, 10 * size, k, c, u)


def log_likelihoods(response: Response, displacements: Floats, model: ResponseModel) -> Floats:
    """(frames - 1, lags) logarithm of the density of each displacement after the first, given those before it.

    displacements : (frames,) mm.
    """
    innovation, variance = np.array(list(_innovations(response, displacements, model))).transpose(1, 0, 2)
    return np.asarray(-0.5 * (np.log(2.0 * np.pi * variance) + innovation**2 / variance))


def _innovations(response: Response, displacements: Floats, model: ResponseModel) -> Iterator[tuple[Floats, Floats]]:
    """Innovation and its variance, mm and mm^2, (lags,) each, frame after frame."""
    lags = response.loads.shape[1]
    mean = np.zeros((STATES, lags))
    mean[0] = displacements[0]
    spread = np.zeros((STATES, STATES, lags))
    for state, sd in enumerate((model.noise, model.compliance, model.compliance, model.rate)):
        spread[state, state] = np.square(sd)
    spread[6, 6] = spread[7, 7] = np.square(model.rate)
    steps = np.abs(np.diff(np.maximum(response.loads, 0.0) ** LOAD_EXPONENT, axis=0))
    changes, first_loading = np.diff(response.loads, axis=0), np.diff(response.maxima, axis=0)
    noise, compliance_walk, rate_walk, transient = (
        np.square(x) for x in (model.noise, model.compliance_walk, model.rate_walk, model.transient)
    )
    constants = np.array(TRANSIENTS) * np.median(response.intervals)
    gain = np.ones((STATES, lags))
    for k, dt in enumerate(response.intervals):
        change = np.abs(changes[k])
        spread[1, 1] += compliance_walk * change
        spread[2, 2] += compliance_walk * first_loading[k]
        spread[3, 3] += rate_walk * (dt + steps[k])
        spread[(6, 7), (6, 7)] += rate_walk * dt
        left = np.exp(-dt / constants)
        gain[1], gain[2], gain[3], gain[6:] = changes[k], first_loading[k], dt, dt * response.powers[:, k]
        for state, fraction in zip((4, 5), left, strict=True):
            spread[state, state] += transient * steps[k]
            gain[state] = 1.0 - fraction
        mean[0] = (gain * mean).sum(axis=0)
        row = (gain[:, None] * spread).sum(axis=0)
        spread[0] = row
        spread[:, 0] = row
        spread[0, 0] = (gain * row).sum(axis=0)
        for state, fraction in zip((4, 5), left, strict=True):
            mean[state] *= fraction
            spread[state] *= fraction
            spread[:, state] *= fraction
        variance = spread[0, 0] + noise
        innovation = displacements[k + 1] - mean[0]
        yield innovation, variance
        weight = spread[:, 0] / variance
        mean += weight * innovation
        spread -= weight[:, None] * spread[None, 0]
