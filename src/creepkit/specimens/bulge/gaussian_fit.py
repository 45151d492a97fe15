"""Least squares fit of a generalised Gaussian to the profiles of a surface: calls of the core (src/core).

The core minimises by Newton's method and has exact derivatives to the data.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creepkit import core
from creepkit.arrays import Floats
from creepkit.fem.time_interpolation import TimeInterpolation, check_interpolation

LOG_OF_ZERO = -700.0
"""Stands for ln 0: exp(LOG_OF_ZERO p) is nothing beside 1 for any admitted p, and nothing times -700 still is."""


_OUTPUTS = 3


@dataclass(frozen=True, eq=False)
class PolarGrid:
    """Where profiles are sampled.

    log_radius : (radii,) ln(r / window). radial : (radii,) their weights.
    log_cosine, log_sine : (angles,) logarithms of |cos a| and |sin a|. angular : (angles,) their weights.
    """

    log_radius: Floats
    radial: Floats
    log_cosine: Floats
    log_sine: Floats
    angular: Floats

    @property
    def numbers(self) -> Floats:
        """All of them one after another, (numbers,), as functions of the core take them."""
        return np.concatenate([self.log_radius, self.radial, self.log_cosine, self.log_sine, self.angular])


@dataclass(frozen=True, eq=False)
class GaussianFit:
    """The fit to a surface whose displacements are known at its nodes.

    grid : where profiles are sampled. nodes : (radii, nodes) from the displacements of the nodes to those at the radii.
    window : mm.
    """

    grid: PolarGrid
    nodes: Floats
    window: float

    def observe(self, profiles: Floats, derivatives: bool) -> tuple[Floats, Floats]:
        """D mm, S mm and p (frames, 3); derivatives (frames or 0, 3, radii) to the displacements at the radii.

        profiles : (frames, nodes) mm. A frame at rest (below 1e-9 mm everywhere) has D = 0 and the S and p of the next
        frame that was fitted, else of the last one, whose derivatives of D it has, those of S and p being zero. A frame
        without a fit worth the name is NaN.
        """
        frames = np.ascontiguousarray(profiles, dtype=float)
        outputs = np.empty((len(frames), _OUTPUTS))
        to_radii = np.empty((len(frames) if derivatives else 0, _OUTPUTS, len(self.nodes)))
        check_interpolation(
            core.function("creepkit_observe")(
                *self._core_arguments, ctypes.c_int64(len(frames)), core.address(frames), core.address(outputs),
                core.address(to_radii) if derivatives else None,
            )
        )  # fmt: skip
        return outputs, to_radii

    def observe_at_times(
        self, profiles: Floats, steps: TimeInterpolation, times: Floats, changes: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """As `observe` of the accepted steps, interpolated: outputs (times, 3) and derivatives (times, 3, columns).

        profiles : (steps, nodes) mm. times : (times,) s. changes : (steps, nodes, columns) derivatives of `profiles`;
        None for no columns. At the first step, at rest, derivatives of S and p are those of the second step.
        """
        frames, asked = np.ascontiguousarray(profiles, dtype=float), np.ascontiguousarray(times, dtype=float)
        given = np.empty((*frames.shape, 0)) if changes is None else np.ascontiguousarray(changes, dtype=float)
        if frames.shape != (steps.times.size, self.nodes.shape[1]) or given.shape[:2] != frames.shape:
            raise ValueError(f"profiles {frames.shape} and changes {given.shape} of {steps.times.size} steps")
        columns = given.shape[2]
        outputs, derivatives = np.empty((asked.size, _OUTPUTS)), np.empty((asked.size, _OUTPUTS, columns))
        check_interpolation(
            core.function("creepkit_observe_at_times")(
                *self._core_arguments, *steps.core_arguments, core.address(frames), ctypes.c_int64(columns),
                core.address(given), ctypes.c_int64(asked.size), core.address(asked), core.address(outputs),
                core.address(derivatives),
            )
        )  # fmt: skip
        return outputs, derivatives

    @property
    def _core_arguments(self) -> tuple[ctypes.c_void_p | ctypes.c_double, ...]:
        """Counts, grid, interpolation and window, as functions of the core take them."""
        return *map(core.address, self._core_arrays), ctypes.c_double(self.window)

    @cached_property
    def _core_arrays(self) -> tuple[np.ndarray, ...]:
        """What `_core_arguments` point to."""
        grid = self.grid
        counts = np.array([grid.log_radius.size, grid.angular.size, self.nodes.shape[1]], np.int64)
        return counts, grid.numbers, np.ascontiguousarray(self.nodes, dtype=float)
