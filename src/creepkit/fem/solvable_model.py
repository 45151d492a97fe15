"""What the core can simulate, finite elements or a reduced-order model of them, and what it differentiates them to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from creepkit.arrays import Floats
from creepkit.core import CoreStructure


@dataclass(frozen=True, eq=False)
class SensitivityDirections:
    """What is differentiated to beside the P parameters of the law: C = P + D + G columns.

    segments : (D, segments, 10) change of the load history's segments.
    gradients, hoops : (G, elements, 4, 2, 2) and (G, elements, 4), see fem.mesh.GeometryDerivative.
    velocities : (G, 2 nodes) mm.
    """

    segments: Floats
    gradients: Floats
    hoops: Floats
    velocities: Floats


class CompiledArrays(Protocol):
    """A model in the order of the core; structure : for calls of it."""

    @property
    def structure(self) -> CoreStructure: ...  # noqa: D102


class SolvableModel(Protocol):
    """What can be simulated: a FiniteElementModel, or a ReducedOrderModel of one; see there."""

    entry: ClassVar[str]

    @property
    def compiled(self) -> CompiledArrays: ...  # noqa: D102
    @property
    def displacement_count(self) -> int: ...  # noqa: D102
    @property
    def point_count(self) -> int: ...  # noqa: D102
    @property
    def observed_count(self) -> int: ...  # noqa: D102
    def held_motion(self, pattern: Floats | None) -> Floats:
        """(2 nodes,) mm for a unit of motion, or (0,); pattern : (nodes, 2) mm, None where held nodes stay."""
        ...

    def displacements(self, coordinates: Floats) -> Floats:
        """(steps, nodes, 2) mm of the steps; coordinates : (steps, displacement_count)."""
        ...

    def core_directions(self, directions: SensitivityDirections) -> tuple[Floats, Floats, Floats]:
        """Velocity gradients (G, points, 2, 2), hoop strains (G, points) and velocities (G, ...) for the core."""
        ...
