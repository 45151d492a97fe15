"""Stress programmes whose deviator keeps its direction: the tensor problem is then a scalar one, with exact slopes.

With the stress s(t) = g(t) D + mean(t) 1, g not negative and the mean a straight line in g, the equivalent stress is
q = g q(D), largest principal and mean stress are straight lines in q, and creep flows along D for ever.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.integration.problem import Axes
from creepkit.integration.segments import segments_of
from creepkit.integration.tensor_point import trial_of
from creepkit.records import COMPONENTS, Program

if TYPE_CHECKING:
    from creepkit.records import PointLoading

_ALIKE = 1e-9
"""Of the largest stress: what differs by less is the same direction."""
_TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
_UNIT = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


class Proportional(NamedTuple):
    """driving : von Mises stress over time, MPa; axes : of the scalar problem; flow : (6,) d(creep)/d(equivalent)."""

    driving: Program
    axes: Axes
    flow: Floats


def proportional(loading: PointLoading, end: float) -> Proportional | None:
    """The scalar problem of a loading by stresses alone up to `end`, s; None where there is none."""
    if loading.strain:
        return None
    programs = [loading.stress.get(name, Program.constant(0.0)) for name in COMPONENTS]
    rows = segments_of(*programs, end=end)
    times = rows[:, :2].reshape(-1) if len(rows) else np.zeros(1)
    at_ends = np.stack([rows[:, 2::2], rows[:, 3::2]], axis=1).reshape(-1, 6)
    stresses = at_ends if len(rows) else np.array([[float(p.at(0.0)) for p in programs]])
    means = stresses[:, :3].mean(axis=1)
    deviators = stresses - means[:, None] * _UNIT
    size, room = np.sqrt(1.5 * (deviators**2 @ _TWICE)), _ALIKE * max(float(np.abs(stresses).max()), 1e-300)
    along = deviators[np.argmax(size)] / size.max() if size.max() > room else np.zeros(6)
    level = 1.5 * (deviators * _TWICE) @ along
    line = _line(level, means, room)
    if line is None or np.abs(deviators - level[:, None] * along).max() > room or level.min() < -room:
        return None
    axes = trial_of(along).axes
    lines = Axes(line[0], axes.principal_slope + line[1], line[0], line[1])
    return Proportional(Program(times, np.maximum(level, 0.0)), lines, 1.5 * along)


def _line(x: Floats, y: Floats, room: float) -> tuple[float, float] | None:
    """Offset and slope of y over x, where it is a straight line."""
    slope = float(np.polyfit(x, y, 1)[0]) if float(np.ptp(x)) > room else 0.0
    offset = float(np.mean(y - slope * x))
    return (offset, slope) if np.abs(y - offset - slope * x).max() <= 10 * room else None
