"""AxisymmetricSettings: what the author of an axisymmetric specimen states."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from creepkit.arrays import ArrayLike
from creepkit.specimens.finite_element_settings import FiniteElementSettings

if TYPE_CHECKING:
    from creepkit.fem.section import Section
    from creepkit.specimens.axisymmetric.displacements import Displacements


@dataclass(frozen=True, kw_only=True)
class AxisymmetricSettings(FiniteElementSettings, ABC):
    """A body of revolution by its section and its observation; `Axisymmetric` says how a specimen is made of it."""

    @abstractmethod
    def section(self, load: str) -> Section:
        """The half section, held and loaded for one unit of a load; see `ck.Section`.

        load : name of the load that a test imposes. Lengths move nodes and change forces, but not numbers of elements.
        """

    @abstractmethod
    def observe(self, displacements: Displacements) -> Mapping[str, ArrayLike]:
        """{output: (steps,)} in its unit, from displacements of the section's points, and the force of a moved side.

        Every step stands for itself; the functions are smooth.
        """

    def elements(self, count: int) -> int:
        """A number of elements of a mesh at this specimen's refinement, one at least."""
        return max(1, round(count * self.refinement))
