"""The whole life of a bar: when each measured strain is arrived at, and when the bar breaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.records import History, TimesToStrain, Status
from creepkit.specimens.elastic_part import elastic_strain

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest

HORIZON = 100.0
"""How far beyond the last frame, and the measured rupture, a bar is followed, as a factor on time."""
SMALLEST_STRAIN = 1e-12
"""Creep strains below this are there from the beginning."""
EARLIEST_RUPTURE = 1e-12
"""s; a bar that breaks at once does so then, for rupture times are compared by their logarithms."""


@dataclass(frozen=True)
class StrainLevels:
    """The creep strains of a history's frames as levels to arrive at.

    test : the point test that is followed to the horizon.
    frames : of each level its frame; creep : (frames,) logarithmic creep strain that was measured; where not finite or
        not above LEAST a frame has no level.
    """

    test: PointTest
    frames: Ints
    creep: Floats


@lru_cache(maxsize=4096)
def strain_levels(history: History, test: PointTest) -> StrainLevels:
    """The levels of a history; `test` is what its material point goes through."""
    creep = _measured_creep_strain(history)
    frames = np.flatnonzero(np.isfinite(creep) & (creep > SMALLEST_STRAIN))
    frames = frames[np.argsort(creep[frames], kind="stable")]
    last = max(float(history.times[-1]), history.rupture_time or 0.0)
    return StrainLevels(replace(test, levels=creep[frames], until=HORIZON * last), frames, creep)


def _measured_creep_strain(history: History) -> Floats:
    """Measured logarithmic creep strain, (frames,); nothing where the history only plans."""
    if "strain" not in history.outputs:
        return np.full(history.times.size, np.nan)
    strain = history.outputs["strain"] - (elastic_strain(history) if history.includes_elastic else 0.0)
    if history.strain_measure == "logarithmic":
        return np.asarray(strain)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log1p(strain)


def predicted_life(histories: Sequence[History], levels: Sequence[StrainLevels], result: Integration) -> TimesToStrain:
    """Arrivals and ruptures on the axes of a prediction."""
    candidates, longest = result.terminations.shape[0], max((h.times.size for h in histories), default=0)
    shape = candidates, len(histories), longest
    ruptured = result.status == int(Status.RUPTURED)
    ruptures = np.where(ruptured, np.maximum(result.end_times, EARLIEST_RUPTURE), np.nan)
    level_times, level_rates = np.repeat(ruptures[..., None], longest, axis=2), np.full(shape, np.inf)
    jacobian = None
    if result.end_jacobian is not None:
        jacobian = np.repeat(result.end_jacobian[:, :, None], longest, axis=2)
    start = 0
    for k, (history, own_values) in enumerate(zip(histories, levels, strict=True)):
        reach, frames = slice(start, start + own_values.frames.size), own_values.frames
        start = reach.stop
        level_times[:, k, np.flatnonzero(own_values.creep <= SMALLEST_STRAIN)] = 0.0
        reached = np.isfinite(result.level_times[:, reach])
        output_factor = np.exp(own_values.creep[frames]) if history.strain_measure == "engineering" else 1.0
        level_times[:, k, frames] = np.where(reached, result.level_times[:, reach], level_times[:, k, frames])
        level_rates[:, k, frames] = np.where(reached, result.level_rates[:, reach] * output_factor, np.inf)
        if jacobian is not None and result.level_time_jacobian is not None:
            level_jacobian = result.level_time_jacobian[:, reach]
            jacobian[:, k, frames] = np.where(reached[..., None], level_jacobian, jacobian[:, k, frames])
    horizon = np.array([own.test.end for own in levels])
    return TimesToStrain(level_times, level_rates, ruptures, horizon, jacobian, result.end_jacobian)
