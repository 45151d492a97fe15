"""Axisymmetric: a specimen in finite elements of which its author states the section, the load and what is observed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from creepkit.checked_arguments import checked
from creepkit.specimens.axisymmetric.settings import AxisymmetricSettings
from creepkit.specimens.finite_element_specimen import FiniteElementSpecimen

if TYPE_CHECKING:
    from creepkit.specimens.axisymmetric.finite_elements import AxisymmetricTest


@checked
@dataclass(frozen=True, kw_only=True)
class Axisymmetric(AxisymmetricSettings, FiniteElementSpecimen):
    """A body of revolution in creep at finite strain, simulated by finite elements.

    A subclass is a frozen dataclass whose lengths are fields made by `ck.dimension`. It states `name`, `title`,
    `outputs` and `loads`, and writes two methods: `section`, the mesh of its half section with what holds it and what
    the load does to it, and `observe`, the outputs from displacements of named points. Candidates and tests in threads,
    lengths, elastic data, temperature and load programs, the end of a test with its reason, nuisance parameters and
    exact derivatives to the law's parameters and to all of these come with it.

    tolerance : estimated error of a step, over the largest observed displacement plus `resolution` mm.
    refinement : what `self.elements(count)` multiplies numbers of elements by.
    resolution : mm, below which the size of a displacement does not matter.
    deflection_limit : mm, observed displacement at which the test ends. strain_limit : creep strain at which a point
        has ruptured. max_steps : cap on the steps of one simulation, so on its cost.
    threads : simulations that run at the same time; None for one on each core.
    """

    @property
    def test_kind(self) -> type[AxisymmetricTest]:
        """See AxisymmetricTest."""
        from creepkit.specimens.axisymmetric.finite_elements import AxisymmetricTest

        return AxisymmetricTest
