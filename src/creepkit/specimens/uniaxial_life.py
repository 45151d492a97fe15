"""The whole life of a bar: when each measured strain is arrived at, and when the bar breaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.records import History, Life, Status
from creepkit.specimens.elastic_part import elastic_strain

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest

HORIZON = 100.0
"""How far beyond the last frame, and the measured rupture, a bar is followed, as a factor on time."""
LEAST = 1e-12
"""Creep strains below this are there from the beginning."""
SOONEST = 1e-12
"""s; a bar that breaks at once does so then, for rupture times are compared by their logarithms."""


@dataclass(frozen=True)
class Rungs:
    """The creep strains of a history's frames as levels to arrive at.

    test : the point test that is followed to the horizon.
    frames : of each level its frame; creep : (frames,) logarithmic creep strain that was measured; where not finite or
        not above LEAST a frame has no level.
    """

    test: PointTest
    frames: Ints
    creep: Floats


@lru_cache(maxsize=4096)
def rungs_of(history: History, test: PointTest) -> Rungs:
    """The levels of a history; `test` is what its material point goes through."""
    creep = _creep(history)
    frames = np.flatnonzero(np.isfinite(creep) & (creep > LEAST))
    frames = frames[np.argsort(creep[frames], kind="stable")]
    last = max(float(history.times[-1]), history.rupture_time or 0.0)
    return Rungs(replace(test, levels=creep[frames], until=HORIZON * last), frames, creep)


def _creep(history: History) -> Floats:
    """Measured logarithmic creep strain, (frames,); nothing where the history only plans."""
    if "strain" not in history.outputs:
        return np.full(history.times.size, np.nan)
    strain = history.outputs["strain"] - (elastic_strain(history) if history.includes_elastic else 0.0)
    if history.strain_measure == "logarithmic":
        return np.asarray(strain)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log1p(strain)


def life_of(histories: Sequence[History], rungs: Sequence[Rungs], found: Integration) -> Life:
    """Arrivals and ruptures on the axes of a prediction."""
    candidates, longest = found.endings.shape[0], max((h.times.size for h in histories), default=0)
    shape = candidates, len(histories), longest
    broke = found.status == int(Status.BURST)
    ruptures = np.where(broke, np.maximum(found.end_times, SOONEST), np.nan)
    arrivals, slopes = np.repeat(ruptures[..., None], longest, axis=2), np.full(shape, np.inf)
    changes = None
    if found.end_jacobian is not None:
        changes = np.repeat(found.end_jacobian[:, :, None], longest, axis=2)
    start = 0
    for k, (history, own) in enumerate(zip(histories, rungs, strict=True)):
        reach, frames = slice(start, start + own.frames.size), own.frames
        start = reach.stop
        arrivals[:, k, np.flatnonzero(own.creep <= LEAST)] = 0.0
        reached = np.isfinite(found.arrivals[:, reach])
        stretch = np.exp(own.creep[frames]) if history.strain_measure == "engineering" else 1.0
        arrivals[:, k, frames] = np.where(reached, found.arrivals[:, reach], arrivals[:, k, frames])
        slopes[:, k, frames] = np.where(reached, found.arrival_slopes[:, reach] * stretch, np.inf)
        if changes is not None and found.arrival_jacobian is not None:
            own_changes = found.arrival_jacobian[:, reach]
            changes[:, k, frames] = np.where(reached[..., None], own_changes, changes[:, k, frames])
    horizon = np.array([own.test.end for own in rungs])
    return Life(arrivals, slopes, ruptures, horizon, changes, found.end_jacobian)
