"""Lag between the clock of a camera and that of an instrument, from the response to changes of load.

One lag holds for the whole test. That one clock gains on the other, which moves the lag within the test, widens its
interval (docs/measured/clock_alignment.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError
from creepkit.instruments.response_likelihood import (
    TRIED,
    DrivingRecord,
    Response,
    ResponseModel,
    best_model,
    driving_record,
    log_likelihoods,
    trial_models,
)
from creepkit.records import ClockAlignment, InstrumentRecord
from creepkit.records.reading_noise import noise_of_readings

FEWEST_FRAMES = 8
UNIX_TIME = 1e8
"""s; larger times of a camera count from 1970: no test lasts three years."""


DRIFT = 1e-4
"""s/s, standard deviation of the gain of one clock on the other: 9 s a day, a poor quartz."""


LEAST_RANGE = 10.0
"""Standard deviations of a reading by which a channel must change for an alignment."""


LEAST_GAIN = 10.0
"""Natural logarithm of the likelihood by which the best lag must beat a displacement that knows no load."""


LARGEST_OTHER = 1e-3
"""Posterior probability of other lags, apart from the best ones, beyond which the answer is ambiguous."""


SHARP = 0.1
"""Fraction of its range by which the load may change between two lags without being averaged between them."""


RAMP_SHARE = 0.3
"""Share of the time in which the load would change by its whole range at its fastest, see _Task.reach."""


LOAD_AT_REST, NOT_AT_REST = 0.05, 1e-4
"""Share of the range of a load that a frame without load has, and the probability that one which seems so is not."""


SPIKE = 8.0
"""Standard deviations by which a single frame that falls back at once is off."""


COARSE_LAGS, FINE_LAGS, CANDIDATES, MOST_FRAMES = 2000, 300, 3, 500
"""Lags of the first search and of the second, candidates kept between them, and frames that are used at most."""


LOOSER = 3.0
"""Factor of the walk of the rate of models that are averaged with the most likely one, which tends to know too much."""


MODEL_LAGS, MODEL_ITERATIONS, ITERATIONS, SHARE_ITERATIONS = 3, 2, 7, 4
"""Lags at which the scales of the model are estimated, in how many of the iterations that close in on the posterior
they are, iterations at most, and those that find the share of several test pieces that counts."""


RESOLVED, NEGLIGIBLE = 30, 12.0
"""Grid points within a posterior that resolve it, and the fall of a log likelihood beyond which nothing counts."""


@dataclass(frozen=True)
class _Task:
    """One test piece.

    times, displacements : (frames,) s from the nominal zero, and mm. noise : mm. interval : s, median of frames.
    unloaded : (frames,) s, of those that seem to be without load.
    """

    driving: DrivingRecord
    times: Floats
    displacements: Floats
    noise: float
    interval: float
    name: str
    channel: str
    unloaded: Floats

    def terms(self, lags: Floats, model: ResponseModel, width: float = 0.0) -> Floats:
        """(frames - 1, lags) terms of the logarithm of the likelihood; width : s, between the lags."""
        blurred = width if width * self.driving.steepest > SHARP else 0.0
        return log_likelihoods(self.driving.response(self.times, lags, blurred), self.displacements, model)

    def best_model(self, lag: float) -> ResponseModel:
        """The most likely model at one lag."""
        return best_model(self.driving.response(self.times, np.array([lag])), self.displacements, self.noise)

    def models(self, lags: Floats) -> list[ResponseModel]:
        """The most likely model of several lags, with each of the walks that it may have."""
        found = list(dict.fromkeys(self.best_model(float(lag)) for lag in lags))
        best = max(found, key=lambda model: float(self.terms(lags, model).sum(axis=0).max()))
        size, walks = float(np.ptp(self.displacements)), product(TRIED[0], (1.0, LOOSER))
        return [replace(best, compliance_walk=k * size, rate_walk=c * best.rate_walk) for k, c in walks]

    def log_at_rest(self, lags: Floats) -> Floats:
        """(lags,) logarithm of how likely it is that frames that seem to be without load are under what they are."""
        if not self.unloaded.size:
            return np.zeros(lags.shape)
        loads = np.interp(self.unloaded[:, None] + lags, self.driving.times, self.driving.loads)
        size = (loads.mean(axis=0) - self.driving.loads.min()) / LOAD_AT_REST
        return np.asarray(np.log((1.0 - NOT_AT_REST) * np.exp(-0.5 * size**2) + NOT_AT_REST))

    @property
    def reach(self) -> float:
        """s about a candidate within which its posterior lies: frames do not tell lags apart, nor do slow ramps."""
        return max(1.5 * self.interval, RAMP_SHARE / self.driving.steepest)

    def subset(self, kept: Ints) -> _Task:
        """The same with some of its frames."""
        return replace(self, times=self.times[kept], displacements=self.displacements[kept])


@checked
def align_clocks(
    record: InstrumentRecord,
    channel: str | Sequence[str],
    frame_times: ArrayLike,
    displacement: ArrayLike,
    *,
    camera_start: float | None = None,
    search: tuple[float, float] | None = None,
    unloaded: Sequence[int] = (),
) -> ClockAlignment:
    """The lag of an instrument's clock on a camera's, at which displacements jump where the pressure does.

    channel : of the pressure, or of another load, that the displacement follows. frame_times : (frames,) s on the
    camera's clock; above 1e8 they are unix times. displacement : (frames,) mm of the apex, or of any point; NaN where
    it is lost; or (test pieces, frames) of all that one camera sees, which have one lag, with the channel of all of
    them or one each. camera_start : unix time, s, of the camera's time zero. search : s, least and largest lag; by
    default all at which frames and record meet. unloaded : numbers of frames that seem to be without load, which tells
    a first loading from later steps.

    Every lag is equally likely beforehand; intervals hold 95 % of the posterior probability. Creep and plastic flow
    do not bias it, see response_likelihood. A test piece whose channel does not change, or that does not follow it, is
    left aside where others decide. HistoryError where no change of load decides, or where several lags fit about as
    well.
    """
    camera, rows = np.asarray(frame_times, dtype=float), np.atleast_2d(np.asarray(displacement, dtype=float))
    names = [channel] * len(rows) if isinstance(channel, str) else [*channel]
    if len(names) != len(rows) or not rows.size:
        raise HistoryError(f"{len(names)} channels and displacements of {len(rows)} test pieces; give one of each")
    zero = nominal_zero(record, camera, camera_start)
    still = camera[np.asarray(unloaded, dtype=int)] - zero
    tasks, problem = list[_Task](), HistoryError("")
    for name, values in zip(names, rows, strict=True):
        try:
            times, displacements = _checked_frames(record, camera, values)
            tasks.append(_task(record, name, times - zero, displacements, still))
        except HistoryError as error:
            problem = error
    if not tasks:
        raise problem
    low, high = search or (
        record.times[0] - max(task.times[-1] for task in tasks),
        record.times[-1] - min(task.times[0] for task in tasks),
    )
    if not (np.isfinite([low, high]).all() and low < high):
        raise HistoryError(f"search from {low:g} to {high:g} s of lag; give two finite numbers, the smaller one first")
    candidates = _candidates([_thinned(task, None) for task in tasks], low, high)
    lag, tasks = _checked_best([_thinned(task, candidates[0]) for task in tasks], candidates, (low, high))
    frames = max(task.times.size for task in tasks)
    channels = ", ".join(dict.fromkeys(task.channel for task in tasks))
    lags, probability = _with_drift(tasks, *_posterior(tasks, lag, (low, high)))
    interval = _interval(lags, probability)
    return ClockAlignment(zero, float(lags @ probability), interval, lags, probability, channels, frames)


def _task(record: InstrumentRecord, channel: str, times: Floats, displacements: Floats, unloaded: Floats) -> _Task:
    name, values = f"{record.origin}: channel '{channel}'", record.readings(channel)[1]
    size, reading_noise = float(np.ptp(values)), noise_of_readings(values)
    if not size > LEAST_RANGE * reading_noise:
        raise HistoryError(
            f"{name} changes by {size:g}, with noise of {reading_noise:g}: there is no step to align clocks on; give "
            "the record of a time in which the load changes, or state the lag by ck.ClockAlignment.stated(lag)"
        )
    driving, interval = driving_record(record, channel), float(np.median(np.diff(times)))
    noise = max(noise_of_readings(displacements), 1e-4 * float(np.ptp(displacements)))
    return _Task(driving, times, displacements, noise, interval, name, channel, unloaded)


def _checked_frames(record: InstrumentRecord, times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Times and displacements of the frames that hold one, without spikes of single frames."""
    if times.ndim != 1 or times.shape != values.shape:
        raise HistoryError(f"frame_times and displacement have the shapes {times.shape} and {values.shape}; give both")
    seen = np.isfinite(values)
    times, values = times[seen], values[seen]
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise HistoryError("the times of the frames must be finite and increase; read them from the camera's files")
    if times.size >= 3:
        before, after = np.diff(values)[:-1], np.diff(values)[1:]
        smaller = np.minimum(np.abs(before), np.abs(after))
        spikes = (before * after < 0) & (smaller > SPIKE * max(noise_of_readings(values), 1e-12))
        kept = ~np.concatenate([[False], spikes, [False]])
        times, values = times[kept], values[kept]
    if times.size < FEWEST_FRAMES:
        raise HistoryError(
            f"{record.origin}: {times.size} frames hold a displacement; an alignment needs at least {FEWEST_FRAMES}"
        )
    if float(np.ptp(values)) == 0.0:
        raise HistoryError(f"{record.origin}: the displacement is the same in all frames; there is nothing to align")
    return times, values


def nominal_zero(record: InstrumentRecord, times: Floats, camera_start: float | None) -> float:
    """Camera time at which the record's time is zero if both clocks are right, or, not knowing, by the first frame.

    times : (frames,) s on the camera's clock. camera_start : unix time, s, of its zero.
    """
    absolute = times[0] > UNIX_TIME
    if absolute and camera_start is not None:
        raise HistoryError(f"frame_times begin with {times[0]:g} s, which is a unix time; leave camera_start away")
    if record.start is not None and (absolute or camera_start is not None):
        return record.start - (camera_start or 0.0)
    return float(times[0]) if absolute else 0.0


def _thinned(task: _Task, lag: float | None) -> _Task:
    """At most MOST_FRAMES of the frames: evenly, or where the load changes if it is known by about which lag."""
    count = task.times.size
    if count <= MOST_FRAMES:
        return task
    even = np.linspace(0, count - 1, MOST_FRAMES // 2).astype(int)
    if lag is None:
        return task.subset(np.unique(even))
    reach = 3.0 * (task.times[-1] - task.times[0]) / MOST_FRAMES + 3.0 * task.interval
    loads = np.interp(task.times[:, None] + lag + np.linspace(-reach, reach, 9), task.driving.times, task.driving.loads)
    near = np.argsort(-np.ptp(loads, axis=1), kind="stable")[: MOST_FRAMES // 2]
    return task.subset(np.union1d(even, near))


def _total(tasks: Sequence[_Task], lags: Floats, width: float) -> Floats:
    """(lags,) logarithm of the likelihood of all test pieces, each by its most likely trial model."""
    return np.asarray(
        sum(
            np.max(
                [task.terms(lags, m, width).sum(axis=0) for m in trial_models(task.displacements, task.noise)], axis=0
            )
            + task.log_at_rest(lags)
            for task in tasks
        )
    )


def _coarse_step(tasks: Sequence[_Task], low: float, high: float) -> float:
    return max(min(task.interval for task in tasks) / 3.0, (high - low) / COARSE_LAGS)


def _candidates(tasks: Sequence[_Task], low: float, high: float) -> list[float]:
    """The most likely lags, apart from each other by two reaches at least; the most likely one first."""
    step, reach = _coarse_step(tasks, low, high), max(task.reach for task in tasks)
    lags = np.linspace(low, high, int((high - low) / step) + 2)
    totals = _total(tasks, lags, step)
    chosen: list[float] = []
    for k in np.argsort(-totals):
        if all(abs(lags[k] - one) > 2.0 * max(reach, 1.5 * step) for one in chosen):
            chosen.append(float(lags[k]))
        if len(chosen) == CANDIDATES:
            break
    return chosen


def _checked_best(
    tasks: list[_Task], candidates: Sequence[float], search: tuple[float, float]
) -> tuple[float, list[_Task]]:
    """The most likely lag, and the test pieces that respond; HistoryError where none does, or another lag fits too."""
    step = _coarse_step(tasks, *search)
    steepest, reach = max(t.driving.steepest for t in tasks), max(*(t.reach for t in tasks), 1.5 * step)
    found: list[tuple[float, float]] = []
    for lag in candidates:
        fine = min(step / 100.0, 0.2 / steepest)
        lags = np.linspace(lag - reach, lag + reach, min(FINE_LAGS, int(2.0 * reach / fine) + 2))
        lags = lags[(lags >= search[0]) & (lags <= search[1])]
        best = float(lags[np.argmax(_total(tasks, lags, lags[1] - lags[0]))])
        models = [task.best_model(best) for task in tasks]
        each = np.array([task.terms(lags, model).sum(axis=0) for task, model in zip(tasks, models, strict=True)])
        if lag == candidates[0]:
            peaks = zip(tasks, models, each.max(axis=1), strict=True)
            responding = [task for task, model, peak in peaks if _responds(task, model, float(peak))]
            if not responding:
                raise HistoryError(
                    f"{tasks[0].name}: the displacement does not follow it at any lag; choose the channel of this "
                    "specimen, give frames from a time in which it changes, or state the lag by "
                    "ck.ClockAlignment.stated(lag)"
                )
            if len(responding) < len(tasks):
                return _checked_best(responding, candidates, search)
        totals = each.sum(axis=0) + sum(task.log_at_rest(lags) for task in tasks)
        peak = float(totals.max())
        found.append((peak + float(np.log(np.exp(totals - peak).sum() * (lags[1] - lags[0]))), best))
    found.sort(reverse=True)
    weights = np.exp([evidence - found[0][0] for evidence, _ in found])
    others = [  # what lies nearer is within the interval of the best
        f"{lag:.3g}"
        for (_, lag), w in zip(found[1:], weights[1:] / weights.sum(), strict=True)
        if w > LARGEST_OTHER and abs(lag - found[0][1]) > 2.0 * reach
    ]
    if others:
        raise HistoryError(
            f"{tasks[0].name}: lags of {found[0][1]:.3g} s and {' and '.join(others)} s fit about as well; say between "
            "which the lag lies, search=(least, largest)"
        )
    return found[0][1], tasks


def _responds(task: _Task, model: ResponseModel, peak: float) -> bool:
    """Whether the displacement follows the load at the best lag better than one without a load would be."""
    nothing = np.zeros((task.times.size, 1))
    silent = Response(nothing, nothing, np.diff(task.times) / np.ptp(task.times), nothing[None, 1:])
    alone = log_likelihoods(silent, task.displacements, best_model(silent, task.displacements, task.noise)).sum()
    return bool(peak - alone > LEAST_GAIN)


def _posterior(tasks: Sequence[_Task], lag: float, search: tuple[float, float]) -> tuple[Floats, Floats]:
    """Lags (points,) s on a grid that closes in on their posterior probabilities (points,), of all test pieces."""
    half, models = max(task.reach for task in tasks), list[list[ResponseModel]]()
    for iteration in range(ITERATIONS):
        if iteration < MODEL_ITERATIONS:
            models = [task.models(lag + half * np.linspace(-0.9, 0.9, MODEL_LAGS)) for task in tasks]
        lags = lag + np.linspace(-half, half, FINE_LAGS)
        step = float(lags[1] - lags[0])
        grids = [[task.terms(lags, m, step).sum(axis=0) for m in own] for task, own in zip(tasks, models, strict=True)]
        logs = _together(np.array([np.logaddexp.reduce(grid) for grid in grids]), lags)
        logs[(lags < search[0]) | (lags > search[1])] = -np.inf
        relevant = np.flatnonzero(logs > logs.max() - NEGLIGIBLE)
        cut_off = relevant[0] == 0 or relevant[-1] == lags.size - 1
        if cut_off and iteration < ITERATIONS // 2 and half < search[1] - search[0]:
            half *= 2.0
        elif np.ptp(relevant) >= RESOLVED:
            break
        else:
            half = max(0.6 * (float(np.ptp(lags[relevant])) + 2.0 * step), 1e-9)
            lag = 0.5 * float(lags[relevant[0]] + lags[relevant[-1]])
    weights = np.exp(logs - logs.max())
    return lags, weights / weights.sum()


def _with_drift(tasks: Sequence[_Task], lags: Floats, probability: Floats) -> tuple[Floats, Floats]:
    """Lags and their probabilities where the clocks differ by a normal DRIFT: its mean effect over the test."""
    span = max(task.times[-1] for task in tasks) - min(task.times[0] for task in tasks)
    sd = max(DRIFT * span / 12.0**0.5, float(lags[1] - lags[0]))
    wide = np.linspace(lags[0] - 4.0 * sd, lags[-1] + 4.0 * sd, FINE_LAGS)
    weights = np.exp(-0.5 * ((wide[:, None] - lags) / sd) ** 2) @ probability
    return wide, np.asarray(weights / weights.sum())


def _together(each: Floats, lags: Floats) -> Floats:
    """(lags,) logarithm of the likelihood of test pieces (pieces, lags), as sure as the surest of them.

    What no model of the response follows is the same in all, whose errors therefore are no independent ones: the sum of
    the logarithms counts by the share that has the variance of the piece that has least.
    """
    total, share, least = each.sum(axis=0), 1.0, min(_variance(logs, lags) for logs in each)
    for _ in range(SHARE_ITERATIONS):  # one would do for normal ones
        share = min(1.0, share * _variance(share * total, lags) / least)
    return np.asarray(share * total)


def _variance(logs: Floats, lags: Floats) -> float:
    """s^2, of lags (points,) s by logarithms of their probabilities, that of a cell of the grid at least."""
    weights = np.exp(logs - logs.max())
    mean, spread = np.average(lags, weights=weights), (lags[1] - lags[0]) ** 2 / 12.0
    return float(np.average((lags - mean) ** 2, weights=weights) + spread)


def _interval(values: Floats, weights: Floats) -> tuple[float, float]:
    """Bounds of 95 % of the probability of grid cells about values (points,)."""
    half = 0.5 * (values[1] - values[0])
    edges = np.append(values - half, values[-1] + half)
    low, high = np.interp((0.025, 0.975), np.append(0.0, np.cumsum(weights)), edges)
    return float(low), float(high)
