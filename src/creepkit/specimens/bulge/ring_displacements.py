"""u_z on rings of given undeformed radii, in the place of a fit, and what an operator asks of either."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from numbers import Real
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.specimens.bulge.outputs import MOST_RINGS

if TYPE_CHECKING:
    from creepkit.fem.time_interpolation import TimeInterpolation


def checked_ring_radii(radii: Sequence[Any]) -> tuple[float, ...]:
    """Radii of rings, mm; SolveError unless there are one to eight, not negative and increasing."""
    numbers = all(isinstance(r, Real) and 0.0 <= float(r) <= 1e4 for r in radii)
    if not (numbers and 1 <= len(radii) <= MOST_RINGS and all(a < b for a, b in pairwise(radii))):
        raise SolveError(
            f"observation: rings have the radii {tuple(radii)}; allowed are one to {MOST_RINGS} increasing radii in "
            "mm, as in radii=(0, 2, 4)"
        )
    return tuple(float(r) for r in radii)


class ProfileOutputs(Protocol):
    """Outputs of profiles that are sampled at some radii: a GaussianFit, or RingDisplacements."""

    def observe(self, profiles: Floats, derivatives: bool) -> tuple[Floats, Floats]:
        """Outputs (frames, outputs); derivatives (frames or 0, outputs, radii) to the displacements at the radii.

        profiles : (frames, nodes) mm.
        """
        ...

    def observe_at_times(self, profiles: Floats, steps: TimeInterpolation, times: Floats) -> tuple[Floats, Floats]:
        """As `observe` of the accepted steps, interpolated: (times, outputs), and derivatives to nothing.

        profiles : (steps, nodes) mm. times : (times,) s.
        """
        ...


@dataclass(frozen=True, eq=False)
class RingDisplacements:
    """u_z on rings, which needs no fit.

    nodes : (radii, nodes) from the displacements of the nodes to those at the radii.
    """

    nodes: Floats

    def observe(self, profiles: Floats, derivatives: bool) -> tuple[Floats, Floats]:
        """u_z (frames, radii) mm; derivatives (frames or 0, radii, radii), of each to itself.

        profiles : (frames, nodes) mm.
        """
        rings = len(self.nodes)
        own = np.broadcast_to(np.eye(rings), (len(profiles) if derivatives else 0, rings, rings))
        return np.asarray(profiles @ self.nodes.T), own

    def observe_at_times(self, profiles: Floats, steps: TimeInterpolation, times: Floats) -> tuple[Floats, Floats]:
        """As `observe` of the accepted steps, interpolated: (times, radii), and derivatives to nothing.

        profiles : (steps, nodes) mm. times : (times,) s.
        """
        outputs = steps.interpolate(self.observe(profiles, derivatives=False)[0], times)
        return outputs, np.empty((*outputs.shape, 0))
