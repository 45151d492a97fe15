"""The largest deviation: where a law misses the tests most, as the mean of a few neighbouring frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.records import History, output_unit

LOCAL_FRAMES = 5
"""Frames whose mean deviation says where a law misses the tests."""


@dataclass(frozen=True)
class LargestDeviation:
    """Where a law misses the tests most: the mean of a few frames of one output, in its unit and in their noises.

    test, output : names. time : s. deviation : predicted less measured. noises : over the noise of one frame.
    """

    test: str
    output: str
    time: float
    deviation: float
    noises: float

    def __str__(self) -> str:
        unit = output_unit(self.output)
        side = "above" if self.deviation > 0 else "below"
        return (
            f"{self.output} of '{self.test}' about {self.time:.4g} s, where it lies {abs(self.deviation):.2g}"
            f"{' ' + unit if unit else ''} {side} what was measured"
        )


def largest_deviation(
    observations: ObservationVector, known: KnownNoise, deviation: Floats, histories: Sequence[History]
) -> LargestDeviation | None:
    """The mean deviation of a few neighbouring frames that is largest over its noise."""
    judged, noise = known.judged, known.sd
    best: LargestDeviation | None = None
    for test, history in enumerate(histories):
        for position, name in enumerate(observations.outputs):
            index = np.flatnonzero(judged[test] & (observations.output_index[test] == position))
            if not index.size:
                continue
            width = min(LOCAL_FRAMES, index.size)
            weights = np.full(width, 1.0 / width)
            means = np.convolve(deviation[test, index], weights, mode="valid")
            noises = np.abs(np.convolve(deviation[test, index] / noise[test, index], weights, mode="valid"))
            k = int(np.argmax(noises))
            time = float(observations.times[test, index[k + width // 2]])
            if best is None or noises[k] > best.noises:
                best = LargestDeviation(history.name, name, time, float(means[k]), float(noises[k]))
    return best
