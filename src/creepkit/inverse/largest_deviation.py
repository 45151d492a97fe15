"""The largest deviation: where a law misses the tests most, in which test, by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.records import History, output_unit
from creepkit.records.units import time_text

LOCAL_FRAMES = 5
"""Frames whose mean deviation says when a law misses a test."""


@dataclass(frozen=True)
class LargestDeviation:
    """Where a law misses the tests most: the test and output of largest rms over noise, and the frames within it.

    test, output : names. time : s, of the neighbouring frames of largest mean deviation, which is `deviation`,
    predicted less measured, in the output's unit, and `noises`, in noises of one frame. rms : of the deviation over all
    frames of the test, 0 where unknown. Offsets and the scatter of rates and rupture lives are taken out of all.
    """

    test: str
    output: str
    time: float
    deviation: float
    noises: float
    rms: float = 0.0

    def __str__(self) -> str:
        unit = output_unit(self.output)
        side = "above" if self.deviation > 0 else "below"
        rms = f" (rms {_amount(self.rms, unit)})" if self.rms > 0 else ""
        return (
            f"{self.output} of '{self.test}'{rms} about {time_text(self.time)}, where it lies "
            f"{_amount(abs(self.deviation), unit)} {side} what was measured"
        )


def _amount(value: float, unit: str) -> str:
    return f"{value:.2g}{' ' + unit if unit else ''}"


def largest_deviation(
    observations: ObservationVector, known: KnownNoise, deviation: Floats, histories: Sequence[History]
) -> LargestDeviation | None:
    """Where a deviation is largest over the known noise.

    deviation : (tests, observations) in the output's unit.
    """
    series = [
        (test, name, index)
        for test in range(len(histories))
        for position, name in enumerate(observations.outputs)
        if (index := np.flatnonzero(known.judged[test] & (observations.output_index[test] == position))).size
    ]
    if not series:
        return None

    def in_noises(one: tuple[int, str, Ints]) -> Floats:
        return np.asarray(deviation[one[0], one[2]] / known.sd[one[0], one[2]])

    worst = max(series, key=lambda one: float((in_noises(one) ** 2).mean()))
    test, name, index = worst
    width = min(LOCAL_FRAMES, index.size)
    weights = np.full(width, 1.0 / width)
    means = np.convolve(deviation[test, index], weights, mode="valid")
    noises = np.abs(np.convolve(in_noises(worst), weights, mode="valid"))
    k = int(np.argmax(noises))
    time = float(observations.times[test, index[k + width // 2]])
    rms = float(np.sqrt((deviation[test, index] ** 2).mean()))
    return LargestDeviation(histories[test].name, name, time, float(means[k]), float(noises[k]), rms)
