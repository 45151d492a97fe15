"""The rate of Adam over a training, as a function of the losses so far: nothing else need be remembered."""

from __future__ import annotations

import math
from collections.abc import Sequence

from creepkit.surrogate.recipe import Training

PLATEAU_THRESHOLD = 1e-4
"""Relative fall of a loss that counts as one, and DROP what the rate falls to: torch's ReduceLROnPlateau, unset in the
paper."""
PLATEAU_FACTOR = 0.1
LEAST_LEARNING_RATE = 1e-8


def learning_rate(training: Training, losses: Sequence[float], epoch_fraction: float = 0.0) -> float:
    """The rate in the epoch that follows these validation losses; share : of that epoch's batches that are done."""
    if training.schedule == "constant":
        return training.rate
    if training.schedule == "cosine":
        done = (len(losses) + epoch_fraction) / training.epochs
        return training.rate * 0.5 * (1.0 + math.cos(math.pi * min(done, 1.0)))
    rate, best, stalled_epochs = training.rate, math.inf, 0
    for loss in losses:
        better = loss < best * (1.0 - PLATEAU_THRESHOLD)
        best, stalled_epochs = (loss, 0) if better else (best, stalled_epochs + 1)
        if stalled_epochs > training.patience:
            stalled_epochs = 0
            if rate - max(rate * PLATEAU_FACTOR, LEAST_LEARNING_RATE) > LEAST_LEARNING_RATE:
                rate = max(rate * PLATEAU_FACTOR, LEAST_LEARNING_RATE)
    return rate


def epochs_since_best(losses: Sequence[float]) -> int:
    """Epochs since the lowest loss; 0 when the last was the lowest."""
    finite = [loss if math.isfinite(loss) else math.inf for loss in losses]
    return len(finite) - 1 - finite.index(min(finite)) if finite else 0
