"""When the one-degree-of-freedom model looks at a test: nodes that thin out after each change of load, and splines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from creepkit.arrays import Floats
from creepkit.records import History
from creepkit.specimens.bulge_course import TestSetup, set_up_test

if TYPE_CHECKING:
    from creepkit.specimens.bulge import Bulge

FIRST_STEP, STEP_GROWTH, LARGEST_STEP_FRACTION = 2.5, 1.0, 1.0 / 12.0
"""Steps: the first after a change of load, s; later ones over the time since; the longest over the test."""
RAMP_STEPS = 4
"""Steps of a ramp from zero to the largest pressure."""
_OFFSET = 20.0
"""s; creep after a change of load decays over decades of time since then."""


@dataclass(frozen=True, eq=False)
class TimeNodes:
    """When a test is looked at: nodes (nodes,) with time s, pressure MPa and temperature K; weights of frames.

    frames : (frames, nodes) the values at the history's times as sums of those at nodes.
    """

    setup: TestSetup
    times: Floats
    pressure: Floats
    temperature: Floats
    frames: Floats


@lru_cache(maxsize=1024)
def time_nodes(specimen: Bulge, history: History) -> TimeNodes:
    """The schedule of a test; complains as the specimen does where the test cannot be simulated."""
    test_setup = set_up_test(specimen, history, {})
    segments, largest = test_setup.load_history.segments, float(test_setup.load_history.pressure.values.max())
    nodes, values, rows, origins = [np.zeros(0)], [np.zeros((0, 2))], [], []
    count, before, origin = 0, np.full(2, np.nan), 0.0
    for start, end, P, P_end, T, T_end in segments[:, :6]:
        moving = P_end != P
        origin = start if moving or before[0] != P else origin
        whole = segments[-1, 1]
        inner = _ramp(start, end, abs(P_end - P) / largest, whole) if moving else _hold(start, end, origin, whole)
        # where nothing jumps the node that ends a segment begins the next one
        old = int((before == (P, T)).all())
        share = ((inner - start) / (end - start))[old:, None]
        nodes.append(inner[old:])
        values.append((1 - share) * [P, T] + share * [P_end, T_end])
        rows.append((count - old, count + inner.size - old - 1))
        origins.append(origin)
        count, before = count + inner.size - old, np.array([P_end, T_end])
        origin = end if moving else origin
    times, columns = np.concatenate(nodes), np.concatenate(values)
    frames = _weights(times, rows, segments[:, 0], np.array(origins), history.times)
    return TimeNodes(test_setup, times, columns[:, 0], columns[:, 1], frames)


def _ramp(start: float, end: float, share: float, whole: float) -> Floats:
    """Nodes of a segment in which the pressure changes by a share of the largest one; whole : s, length of the test."""
    steps = max(RAMP_STEPS * share, (end - start) / max(LARGEST_STEP_FRACTION * whole, FIRST_STEP))
    return np.linspace(start, end, max(1, int(np.ceil(steps))) + 1)


def _hold(start: float, end: float, origin: float, whole: float) -> Floats:
    """Nodes of a segment of constant pressure, in steps that grow with the time since the load changed.

    whole : s, length of the test.
    """
    nodes, longest = [start], max(LARGEST_STEP_FRACTION * whole, FIRST_STEP)
    while nodes[-1] < end:
        nodes.append(nodes[-1] + min(max(STEP_GROWTH * (nodes[-1] - origin), FIRST_STEP), longest))
    nodes[-1] = end
    return np.array(nodes)


def _weights(nodes: Floats, rows: Sequence[tuple[int, int]], starts: Floats, origins: Floats, times: Floats) -> Floats:
    """Weights (times, nodes) of splines in ln(t - t0 + 20 s), one for each segment; before a jump at its very time.

    rows : first and last node of each segment; starts : s; origins : t0, s, when the load changed last.
    """
    out = np.zeros((times.size, nodes.size))
    which = np.maximum(np.searchsorted(starts, times, side="left") - 1, 0)
    for n, (first, last) in enumerate(rows):
        mine, known = which == n, slice(first, last + 1)
        here = np.flatnonzero(mine)
        at_node = np.minimum(first + np.searchsorted(nodes[known], times[here]), last)
        if (nodes[at_node] == times[here]).all():  # as a campaign asks that only looks at ends
            out[here, at_node] = 1.0
        else:
            spline = CubicSpline(np.log(nodes[known] - origins[n] + _OFFSET), np.eye(last + 1 - first))
            out[mine, known] = spline(np.log(times[mine] - origins[n] + _OFFSET))
    return out
