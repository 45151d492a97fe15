"""Displacements: what the author of an axisymmetric specimen observes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, nearest
from creepkit.fem.section import Section


@checked
class Displacements:
    """What `observe` is given: displacements of named points of the section in each step, mm, and a force, N."""

    def __init__(self, section: Section, values: Floats | None = None, order: Sequence[int] = ()) -> None:
        """Note what is asked for, where there are no values (steps, observed) mm, N.

        order : which displacement each column is, 2 node + component; the force of a moved side comes last.
        """
        self._section, self._values, self._order = section, values, list(order)
        self.asked: list[int] = []

    def radial(self, point: str) -> Floats:
        """u_r of a point, (steps,) mm, outwards."""
        return self._displacement(point, 0)

    def axial(self, point: str) -> Floats:
        """u_z of a point, (steps,) mm."""
        return self._displacement(point, 1)

    @property
    def force(self) -> Floats:
        """Axial force on the side that the load moves, (steps,) N over the whole circumference."""
        if self._section.controlled is None:
            raise SolveError("only a side that the load moves has a force to be observed; see Section.move")
        return np.ones(1) if self._values is None else np.asarray(self._values[:, -1])

    def _displacement(self, point: str, component: int) -> Floats:
        points = self._section.points
        if point not in points:
            raise SolveError(f"a section has no point '{point}' to observe; {nearest(point, tuple(points))}")
        number = 2 * points[point] + component
        if self._values is None:
            self.asked.append(number)
            return np.zeros(1)
        return np.asarray(self._values[:, self._order.index(number)])
