"""Which frames of a history a fit looks at: some forty, spread over the logarithm of time and over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from creepkit.arrays import Bools, Ints
from creepkit.records import History


def selected_frames(history: History, count: int) -> Ints:
    """Indices of at most `count` used frames after time zero, half spread in ln t and half in t."""
    candidates = np.flatnonzero(history.used & (history.times > 0) & frames_with_data(history))
    if candidates.size <= count:
        return candidates
    times = history.times[candidates]
    targets = np.concatenate([np.geomspace(times[0], times[-1], count - count // 2), np.linspace(times[0], times[-1], count // 2)])
    nearest = np.abs(times[:, None] - targets[None, :]).argmin(axis=0)
    return np.asarray(candidates[np.unique(nearest)])


def frames_with_data(history: History) -> Bools:
    """(frames,) whether any output has a number there."""
    finite = [np.isfinite(values) for values in history.outputs.values()]
    return np.asarray(np.any(finite, axis=0)) if finite else np.zeros(history.times.size, bool)


def thinned_history(history: History, count: int) -> History:
    """The history at its chosen frames only, all outputs of a frame together."""
    selected = selected_frames(history, count)
    return replace(
        history,
        times=history.times[selected],
        outputs={name: values[selected] for name, values in history.outputs.items()},
        standard_deviation={name: values[selected] for name, values in history.standard_deviation.items()},
        used=np.ones(selected.size, bool),
    )
