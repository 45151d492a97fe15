"""Known noise: what histories state or neighbouring frames show, without any law, and chi-square judged by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import chi2, f

from creepkit.arrays import Bools, Floats
from creepkit.inverse.observation_vector import SINGLE_VALUES, SMALLEST_NOISE, ObservationVector
from creepkit.inverse.reference_conditions import frame_noise, is_reversed, usable_frames
from creepkit.records import History

FREEDOM_PER_FRAME = 0.2
"""Degrees of freedom that a frame gives to a noise estimated from third differences by a median: 0.21 to 0.22 for 40 to
48 frames of one test (tests/unit/inverse/test_adequacy.py draws them)."""


LEAST_NOISE_FREEDOM = 6.0
"""Degrees of freedom below which an estimated noise says too little to judge by: some 30 frames."""


FEWEST_HALF_FRAMES, NOTEWORTHY_GROWTH = 15, 1.4
"""Frames of half a test whose noise can be estimated, and the growth of noise and output from which it is compared."""


@dataclass(frozen=True, eq=False)
class KnownNoise:
    """The noise that is known without the law.

    judged : (tests, observations) which are data of which it is known. sd : (tests, observations) in the output's unit.
    freedom : (tests, observations) -, how well it is known: infinite where it is stated.
    few_frames : names of tests whose frames are too few to show their noise, each with how many there are.
    """

    judged: Bools
    sd: Floats
    freedom: Floats
    few_frames: tuple[tuple[str, int], ...] = ()

    @classmethod
    def of_histories(cls, observations: ObservationVector, histories: Sequence[History]) -> KnownNoise:
        """The noise that histories state, and of others that of each test between neighbouring frames."""
        sd = observations.per_observation(observations.noise) * observations.relative_noise
        freedom = np.full(sd.shape, np.inf)
        few: dict[str, int] = {}
        for test, position, index in observations.series:
            history, name = histories[test], observations.outputs[position]
            if name in SINGLE_VALUES or observations.stated[position]:
                continue
            frames = int(usable_frames(history, name).sum())
            floor = SMALLEST_NOISE * observations.transforms[position].floor
            estimated = _estimated_noise(history, name, observations.values[test, index])
            sd[test, index] = np.maximum(estimated, floor) if (estimated > 0).all() else 0.0
            freedom[test, index] = FREEDOM_PER_FRAME * frames
            if FREEDOM_PER_FRAME * frames < LEAST_NOISE_FREEDOM:
                few[history.name] = min(frames, few.get(history.name, frames))
        ruptures = observations.rupture_mask
        judged = observations.present & ~ruptures & (sd > 0) & (freedom >= LEAST_NOISE_FREEDOM)
        return cls(judged, np.where(judged, sd, 1.0), freedom, tuple(few.items()))

    def where(self, mask: Bools) -> KnownNoise:
        """The same of some observations alone; mask : (tests, observations)."""
        return replace(self, judged=self.judged & mask)

    def distribution(self, share_of_freedom: float, mask: Bools) -> Any:
        """That of the reduced chi-square of a law that is right, a frozen one of scipy.

        Each test has noise of its own. One test has the distribution of F, or of chi-square where its noise is stated;
        the sum over several is taken as the scaled chi-square of the same mean and variance (Satterthwaite).
        share_of_freedom : degrees of freedom of each observation. mask : (tests, observations) which count.
        """
        groups = self._groups(share_of_freedom, mask)
        freedom = np.array([freedom for freedom, _ in groups])
        each = [chi2(n, scale=1.0 / n) if np.isinf(nu) else f(n, nu) for n, nu in groups]
        if len(each) == 1:
            return each[0]
        share = freedom / freedom.sum()
        mean, variance = share @ [one.mean() for one in each], share**2 @ [one.var() for one in each]
        return chi2(2.0 * mean**2 / variance, scale=variance / (2.0 * mean))

    def _groups(self, share_of_freedom: float, mask: Bools) -> list[tuple[float, float]]:
        """(degrees of freedom of chi-square, of its noise) of observations whose noise is one estimate."""
        return [
            (share_of_freedom * float((mask[k] & (self.freedom[k] == nu)).sum()), float(nu))
            for k in range(len(mask))
            for nu in np.unique(self.freedom[k][mask[k]])
        ]


def _estimated_noise(history: History, name: str, values: Floats) -> Floats:
    """(frames,) noise of an output at its values (frames,): constant, or in proportion to the output where that fits.

    Noise between neighbouring frames is estimated of the first and of the second half of the test; where the second is
    larger as the output is, and by more than chance, it is in proportion.
    """
    usable = usable_frames(history, name)
    measured = history.outputs[name][usable]
    constant = np.full(values.shape, frame_noise(history, name))
    if measured.size < 2 * FEWEST_HALF_FRAMES or measured.min() <= 0.0 or is_reversed(history):
        return constant
    first, second = np.array_split(np.flatnonzero(usable), 2)
    noises, sizes = [], []
    for half in (first, second):
        mask = np.zeros(usable.size, bool)
        mask[half] = True
        noises.append(frame_noise(history.replace(used=mask), name))
        sizes.append(float(np.median(history.outputs[name][half])))
    if min(noises) <= 0.0 or sizes[1] < NOTEWORTHY_GROWTH * sizes[0] or noises[1] < NOTEWORTHY_GROWTH * noises[0]:
        return constant
    exponent = float(np.clip(np.log(noises[1] / noises[0]) / np.log(sizes[1] / sizes[0]), 0.0, 1.0))
    level = float(np.sqrt(np.prod(noises)) / np.sqrt(np.prod(sizes)) ** exponent)
    return np.asarray(level * np.maximum(values, 1e-300) ** exponent)
