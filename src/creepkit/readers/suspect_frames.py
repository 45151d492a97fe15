"""Frames that look wrong by the history alone: unloading, an amplitude that falls, single frames that jump."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.records import History

JUMP = 6.0
"""Robust standard deviations by which a single frame must miss its neighbours: of Gaussian noise 2 in 1e9 do."""
FEW = 10.0
"""The threshold is JUMP (1 + FEW / frames): few frames say little about their own noise."""
FALL = 0.02
"""Of the largest value: less can be drift of instruments; a loaded dimple or bar does not recover at all."""
FALL_NOISE = 6.0
"""Standard deviations that a fall must have at least."""
END, END_NOISE, END_FRAMES = 12, 4.0, 5
"""Frames through which a line predicts the end, standard deviations of it that an unloading falls short, the most
frames that it may have: 1 in 3e4 ends of Gaussian noise fall as much.
"""
LEAST = 12
"""Frames under one load below which nothing is said of noise."""
SAME_LOAD, SAME_TEMPERATURE = 0.01, 2.0
"""Relative change of the load, and K, that begin a new part of a test."""
OTHER_WAY = 0.3
"""Of a frame's miss: how far its neighbours must miss the other way if it is to be off alone."""
_DECIMALS = 0.5
"""Of the smallest step between values: noise cannot be seen below."""
_MOST = 0.05
"""Of the frames that may be outliers; more are not outliers."""


class Finding(NamedTuple):
    """Frames and a sentence about them."""

    frames: tuple[int, ...]
    reason: str


class Part(NamedTuple):
    """Frames under one load and temperature.

    load : MPa. raised : whether it is at least what it was before. first : whether the part is the test's first.
    """

    frames: Ints
    load: float
    raised: bool
    first: bool


def leading(history: History) -> str:
    """The output that grows with creep."""
    return next((name for name in ("strain", "amplitude") if name in history.outputs), next(iter(history.outputs), ""))


def unloading(history: History) -> Iterator[Finding]:
    """Frames after the end of the test, and a sudden fall in its last used frames."""
    usable = np.flatnonzero(history.used & _measured(history))
    late = np.flatnonzero(~history.used)
    late = late[late > usable[-1]] if usable.size else late[:0]
    if late.size and "frames_after_end" in history.labels:
        yield Finding(tuple(map(int, late)), f"from {history.times[late[0]]:g} s on, after the end of the test")
    parts = [part for part in parts_of(history) if part.frames.size > LEAST]
    if parts and parts[-1].frames[-1] == usable[-1]:
        yield from _fallen_end(history, parts[-1].frames)


def _fallen_end(history: History, frames: Ints) -> Iterator[Finding]:
    t, y = history.times[frames], history.outputs[leading(history)][frames]
    sigma = noise(t, y)
    for count in range(min(END_FRAMES, frames.size - LEAST), 0, -1):
        before = slice(max(frames.size - count - END, 0), frames.size - count)
        expected, spread = _foreseen(t[before], y[before], t[-count])
        short = expected - y[-count]
        if short > END_NOISE * sigma * spread and (y[-count:] < y[-count - 1] - sigma).all():
            told = f"{_amount(history, short)} below what the {END} frames before it lead to, {short / sigma:.0f} times"
            reason = f"at {t[-count]:g} s {told} the noise: the load was taken off"
            yield Finding(tuple(map(int, frames[-count:])), reason)
            return


def _foreseen(t: Floats, y: Floats, at: float) -> tuple[float, float]:
    """A line through frames, at a later time, and the standard deviation of y less it over that of y."""
    middle, width = t.mean(), float(((t - t.mean()) ** 2).sum())
    slope = float(((t - middle) * (y - y.mean())).sum()) / width
    return float(y.mean()) + slope * (at - middle), float(np.sqrt(1 + 1 / t.size + (at - middle) ** 2 / width))


def falling(history: History) -> Iterator[Finding]:
    """Frames of a part in which the amplitude falls though the load is held or was raised.

    They begin at the highest frame; after a raise of the load with the raise, for whatever makes a dimple or a bar fall
    under a larger load was there from then on.
    """
    for part in parts_of(history):
        if part.frames.size < LEAST or not part.raised:
            continue
        t, y = history.times[part.frames], history.outputs[leading(history)][part.frames]
        smooth = _running_median(y)
        top = int(np.argmax(smooth))
        fall = float(smooth[top] - smooth[top:].min())
        if fall > max(FALL_NOISE * noise(t, y), FALL * float(np.abs(smooth).max())):
            lowest = top + int(np.argmin(smooth[top:]))
            kept = f"{history.loading.quantity} {'is held at' if part.first else 'was raised to'} {part.load:g} MPa"
            reason = (
                f"falls by {_amount(history, fall)} from {t[top]:g} s to {t[lowest]:g} s, "
                f"{fall / noise(t, y):.0f} times the noise, though the {kept}"
            )
            yield Finding(tuple(map(int, part.frames[top if part.first else 0 :])), reason)


def outliers(history: History) -> Iterator[Finding]:
    """Single frames that miss the cubic through their four neighbours, largest first."""
    for part in parts_of(history):
        kept, values = part.frames, history.outputs[leading(history)]
        sigma = noise(history.times[kept], values[kept]) if kept.size >= LEAST else np.inf
        for _ in range(int(_MOST * part.frames.size) + 1):
            if kept.size < LEAST:
                break
            misses, reach = _misses(history.times[kept], values[kept])
            ratio = np.where(_alone(misses), np.abs(misses) / np.maximum(_rough(misses), sigma), 0.0)
            worst = int(np.argmax(ratio))
            if not ratio[worst] > JUMP * (1 + FEW / kept.size):
                break
            off = _amount(history, float(misses[worst] * reach[worst]))
            frame = int(kept[worst + 2])
            reason = f"at {history.times[frame]:g} s off its neighbours by {off}, {ratio[worst]:.0f} times the noise"
            yield Finding((frame,), reason)
            kept = np.delete(kept, worst + 2)


def parts_of(history: History) -> list[Part]:
    """The used and measured frames, by load and temperature."""
    frames = np.flatnonzero(history.used & _measured(history) & (history.times > 0))
    if not frames.size:
        return []
    load = history.loading.program().at(history.times[frames])
    warm = history.temperature_program().at(history.times[frames])
    new = (np.abs(np.diff(load)) > SAME_LOAD * load.max()) | (np.abs(np.diff(warm)) > SAME_TEMPERATURE)
    edges = np.flatnonzero(np.concatenate([[True], new, [True]]))
    parts = []
    for first, after in pairwise(edges):
        raised = bool(first == 0 or load[first] >= load[first - 1])
        parts.append(Part(frames[first:after], float(load[first]), raised, bool(first == 0)))
    return parts


def noise(times: Floats, values: Floats) -> float:
    """Standard deviation of white noise, robust, from what frames miss the cubic through their neighbours by."""
    misses, _ = _misses(times, values)
    steps = np.abs(np.diff(values))
    least = _DECIMALS * float(steps[steps > 0].min(initial=np.inf)) if (steps > 0).any() else 1e-12
    return max(float(1.4826 * np.median(np.abs(misses))), min(least, float(np.ptp(values)) or least))


def _misses(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """What each frame but the outer two misses the cubic of its neighbours by, over what unit noise makes it, and that.

    The cubic is one in time or in its logarithm, whichever misses less: some tests are read evenly, some over decades.
    """
    found = [_missed(x, values) for x in (times, np.log(times))]
    return min(found, key=lambda pair: float(np.median(np.abs(pair[0]))))


def _missed(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    around = np.stack([x[:-4], x[1:-3], x[3:-1], x[4:]])
    own, values = x[2:-2], np.stack([y[:-4], y[1:-3], y[3:-1], y[4:]])
    weights = np.ones_like(around)
    for a in range(4):
        for b in range(4):
            if a != b:
                weights[a] *= (own - around[b]) / (around[a] - around[b])
    reach = np.sqrt(1.0 + (weights**2).sum(axis=0))
    return np.asarray((y[2:-2] - (weights * values).sum(axis=0)) / reach), reach


def _rough(misses: Floats) -> Floats:
    """The size of misses about each frame, without it and its neighbours: large where a curve bends sharply."""
    size, out = np.abs(misses), np.zeros(misses.size)
    for k in range(misses.size):
        near = np.concatenate([size[max(k - 7, 0) : max(k - 2, 0)], size[k + 3 : k + 8]])
        out[k] = 1.4826 * float(np.median(near)) if near.size else 0.0
    return out


def _alone(misses: Floats) -> Bools:
    """Where a single frame is off: its neighbours then miss the other way, by 2/3 of it when evenly spaced.

    Where a curve bends too sharply for cubics they miss the same way.
    """
    others = -np.sign(misses)[:, None] * np.stack([np.roll(misses, 1), np.roll(misses, -1)], axis=1)
    others[0, 0] = others[-1, 1] = np.inf
    return np.asarray((others > OTHER_WAY * np.abs(misses)[:, None]).all(axis=1))


def _running_median(values: Floats, width: int = 5) -> Floats:
    padded = np.pad(values, width // 2, mode="reflect", reflect_type="odd")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=-1))


def _measured(history: History) -> Bools:
    """(frames,) where the leading output has a number."""
    name = leading(history)
    return np.isfinite(history.outputs[name]) if name else np.zeros(history.times.size, bool)


def _amount(history: History, value: float) -> str:
    """A difference of the leading output in words."""
    return f"{1e3 * value:.3g} um" if leading(history) == "amplitude" else f"{value:.2g} of {leading(history)}"
