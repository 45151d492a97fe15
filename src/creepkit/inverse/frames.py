"""Which frames of a history a fit looks at: some forty, spread over the logarithm of time and over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from creepkit.arrays import Bools, Ints
from creepkit.records import History


def chosen_frames(history: History, count: int) -> Ints:
    """Indices of at most `count` used frames after time zero, half spread in ln t and half in t."""
    usable = np.flatnonzero(history.used & (history.times > 0) & measured(history))
    if usable.size <= count:
        return usable
    t = history.times[usable]
    targets = np.concatenate([np.geomspace(t[0], t[-1], count - count // 2), np.linspace(t[0], t[-1], count // 2)])
    nearest = np.abs(t[:, None] - targets[None, :]).argmin(axis=0)
    return np.asarray(usable[np.unique(nearest)])


def measured(history: History) -> Bools:
    """(frames,) whether any output has a number there."""
    present = [np.isfinite(values) for values in history.outputs.values()]
    return np.asarray(np.any(present, axis=0)) if present else np.zeros(history.times.size, bool)


def thinned(history: History, count: int) -> History:
    """The history at its chosen frames only, all outputs of a frame together."""
    k = chosen_frames(history, count)
    return replace(
        history,
        times=history.times[k],
        outputs={name: values[k] for name, values in history.outputs.items()},
        standard_deviation={name: values[k] for name, values in history.standard_deviation.items()},
        used=np.ones(k.size, bool),
    )
