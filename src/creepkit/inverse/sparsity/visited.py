"""The points of stress, strain, time and temperature that tests go through: where terms of a law are weighed.

G = {.5, .8, 1, 1.3} x the reference stress at each time of each test: a specimen spans about that much about its
reference stress. Strain is what the measured creep growth says (see inverse.nominal); a factor of two in it moves all
terms alike, but for those that harden with strain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.frames import chosen_frames
from creepkit.inverse.nominal import AMPLITUDE_PER_STRAIN, end_strain, stresses
from creepkit.inverse.scales import usable
from creepkit.records import History, Predictor

FACTORS = (0.5, 0.8, 1.0, 1.3)
FRAMES = 16
"""Times looked at in each test."""
LEAST_STRAIN = 0.1
"""Of steady growth to the end: below this a measured strain is noise, or was there before the first frame."""


@dataclass(frozen=True, eq=False)
class Visited:
    """Points, (points,) each: stress MPa, strain, time s, temperature K, and weights that add up to one.

    All tests weigh alike, however many frames they have.
    """

    stress: Floats
    strain: Floats
    time: Floats
    temperature: Floats
    weight: Floats

    @classmethod
    def of(cls, histories: Sequence[History], using: Predictor | None = None) -> Visited:
        """The points that histories visit; `using` may state reference stresses."""
        parts = [_points(h, using) for h in histories]
        loaded = [p for p in parts if p.shape[1]]
        if not loaded:
            raise FitError("no test is ever under load: terms of a law cannot be weighed against one another")
        weights = [np.full(p.shape[1], 1.0 / (len(loaded) * p.shape[1])) for p in loaded]
        stress, strain, time, temperature = np.concatenate(loaded, axis=1)
        return cls(stress, strain, time, temperature, np.concatenate(weights))


def _points(history: History, using: Predictor | None) -> Floats:
    """(4, points) stress, strain, time, temperature of one test, without those where it bears no load."""
    frames = chosen_frames(history, FRAMES)
    time = history.times[frames]
    strain, warmth = strain_course(history, using)[frames], history.temperature_program().at(time)
    stress = stress_course(history, using, time)
    wide = np.multiply.outer(stress, FACTORS)
    others = (np.broadcast_to(v[:, None, None], wide.shape) for v in (strain, time, warmth))
    points = np.stack([wide, *others]).reshape(4, -1)
    return np.asarray(points[:, points[0] > 0])


def stress_course(history: History, using: Predictor | None, times: Floats) -> Floats:
    """(times, stresses) reference stresses at each time, MPa.

    A bulge test has one for each level of pressure, between which it is linear; a specimen whose stress moves by
    itself, as in relaxation, has all of its reference stresses at all times.
    """
    program, offered = history.loading.program(), stresses(history, using)
    levels = np.unique(program.values[program.values > 0])
    imposed = program.at(times)
    if history.loading.quantity == "stress" and offered.size == program.values.size:
        return np.asarray(imposed[:, None])
    if offered.size == levels.size:
        return np.asarray(np.interp(imposed, [0.0, *levels], [0.0, *np.sort(offered)])[:, None])
    return np.broadcast_to(offered, (times.size, offered.size))


def strain_course(history: History, using: Predictor | None) -> Floats:
    """(frames,) creep strain along the test, as far as its outputs tell; never falling, never zero."""
    times, end = history.times, end_strain(history, using)
    least = LEAST_STRAIN * end * times / times[-1]
    for output, scale in (("strain", 1.0), ("amplitude", AMPLITUDE_PER_STRAIN)):
        if output in history.outputs and usable(history, output).sum() > 1:
            seen = usable(history, output)
            measured = np.interp(times, times[seen], history.outputs[output][seen])
            start = measured[seen][0] if output == "amplitude" else 0.0
            least = np.maximum(least, np.minimum((measured - start) / scale, end))
            break
    else:
        least = end * times / times[-1]
    return np.asarray(np.maximum.accumulate(np.maximum(least, 1e-12)))
