"""BulgeRun: one simulated bulge test with displacements, stresses and strains at any time until its end."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.specimens.finite_element_run import STRESS_FIELD, FiniteElementRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, kw_only=True)
class BulgeRun(FiniteElementRun):
    """A simulated bulge test.

    See FiniteElementRun for fields and times; its test has the geometry and the operator of this test as well.
    """

    def displacement(self, radius: ArrayLike = 0.0, times: ArrayLike | None = None) -> Floats:
        """How far the top has risen, (times,) mm at one radius, (times, radii) at several.

        radius : number or (radii,) mm, at rest. times : number or (times,) s, by default those of the frames.
        """
        rows = self._at(self._profiles, times) @ surface_interpolation(self.test.piece.top_radii, radius).T
        return rows if np.ndim(radius) else np.asarray(rows[..., 0])

    def section(self, time: float | None = None, name: str = STRESS_FIELD, path: str | Path | None = None) -> Figure:
        """A picture of the deformed section, coloured by a field (see `field`), at a time; by default the last."""
        from creepkit.reports.simulation import section_figure

        return section_figure(self, time, name, path)

    @property
    def _profiles(self) -> Floats:
        """(steps, top nodes) mm."""
        return np.asarray(self.test.piece.observed(self.test.load, self.simulation))
