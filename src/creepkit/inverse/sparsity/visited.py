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
from creepkit.inverse.frames import selected_frames
from creepkit.inverse.nominal import AMPLITUDE_PER_STRAIN, reference_end_strain, reference_stresses
from creepkit.inverse.scales import usable_frames
from creepkit.records import History, Predictor

STRESS_FACTORS = (0.5, 0.8, 1.0, 1.3)
TIMES_PER_TEST = 16
"""Times looked at in each test."""
MIN_STRAIN_FRACTION = 0.1
"""Of steady growth to the end: below this a measured strain is noise, or was there before the first frame."""


@dataclass(frozen=True, eq=False)
class EvaluationPoints:
    """Points, (points,) each: stress MPa, strain, time s, temperature K, and weights that add up to one.

    All tests weigh alike, however many frames they have.
    """

    stress: Floats
    strain: Floats
    time: Floats
    temperature: Floats
    weight: Floats

    @classmethod
    def from_histories(cls, histories: Sequence[History], predictor: Predictor | None = None) -> EvaluationPoints:
        """The points that histories visit; `using` may state reference stresses."""
        points_by_test = [_points_of_test(h, predictor) for h in histories]
        loaded_tests = [p for p in points_by_test if p.shape[1]]
        if not loaded_tests:
            raise FitError("no test is ever under load: terms of a law cannot be weighed against one another")
        weights = [np.full(p.shape[1], 1.0 / (len(loaded_tests) * p.shape[1])) for p in loaded_tests]
        stress, strain, time, temperature = np.concatenate(loaded_tests, axis=1)
        return cls(stress, strain, time, temperature, np.concatenate(weights))


def _points_of_test(history: History, predictor: Predictor | None) -> Floats:
    """(4, points) stress, strain, time, temperature of one test, without those where it bears no load."""
    frames = selected_frames(history, TIMES_PER_TEST)
    time = history.times[frames]
    strain, temperature = strain_history(history, predictor)[frames], history.temperature_program().at(time)
    stress = stress_history(history, predictor, time)
    stresses = np.multiply.outer(stress, STRESS_FACTORS)
    broadcast = (np.broadcast_to(v[:, None, None], stresses.shape) for v in (strain, time, temperature))
    points = np.stack([stresses, *broadcast]).reshape(4, -1)
    return np.asarray(points[:, points[0] > 0])


def stress_history(history: History, predictor: Predictor | None, times: Floats) -> Floats:
    """(times, stresses) reference stresses at each time, MPa.

    A bulge test has one for each level of pressure, between which it is linear; a specimen whose stress moves by
    itself, as in relaxation, has all of its reference stresses at all times.
    """
    program, test_stresses = history.loading.program(), reference_stresses(history, predictor)
    levels = np.unique(program.values[program.values > 0])
    load = program.at(times)
    if history.loading.quantity == "stress" and test_stresses.size == program.values.size:
        return np.asarray(load[:, None])
    if test_stresses.size == levels.size:
        return np.asarray(np.interp(load, [0.0, *levels], [0.0, *np.sort(test_stresses)])[:, None])
    return np.broadcast_to(test_stresses, (times.size, test_stresses.size))


def strain_history(history: History, predictor: Predictor | None) -> Floats:
    """(frames,) creep strain along the test, as far as its outputs tell; never falling, never zero."""
    times, final_strain = history.times, reference_end_strain(history, predictor)
    lower_limit = MIN_STRAIN_FRACTION * final_strain * times / times[-1]
    for output, scale in (("strain", 1.0), ("amplitude", AMPLITUDE_PER_STRAIN)):
        if output in history.outputs and usable_frames(history, output).sum() > 1:
            is_used = usable_frames(history, output)
            measured = np.interp(times, times[is_used], history.outputs[output][is_used])
            start = measured[is_used][0] if output == "amplitude" else 0.0
            lower_limit = np.maximum(lower_limit, np.minimum((measured - start) / scale, final_strain))
            break
    else:
        lower_limit = final_strain * times / times[-1]
    return np.asarray(np.maximum.accumulate(np.maximum(lower_limit, 1e-12)))
