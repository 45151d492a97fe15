"""What the core can simulate, finite elements or a reduced-order model of them, and what it differentiates them to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from creepkit.arrays import Floats
from creepkit.core import CoreStructure


@dataclass(frozen=True, eq=False)
class SensitivityDirections:
    """What is differentiated to beside the P parameters of the law: C = P + D + G columns.

    segments : (D, segments, 10) change of the load history's segments, in the units of their columns.
    gradients : (G, elements, 4, 2, 2) and
    hoops : (G, elements, 4), see fem.mesh.GeometryDerivative.
    velocities : (G, 2 nodes) mm, all three for each unit of a number of the geometry.
    forces : (G, nodes, 2) N/rad, change of the dead forces of a unit of the load, for each unit of that number; None
        where there are no such forces, or they stay.
    """

    segments: Floats
    gradients: Floats
    hoops: Floats
    velocities: Floats
    forces: Floats | None = None


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
        """What the core takes for a unit of motion of the held nodes, (2 nodes,), mm, or (0,) where none moves.

        pattern : (nodes, 2) mm, or None.
        """

    def displacements(self, coordinates: Floats) -> Floats:
        """Displacements of the nodes, (steps, nodes, 2), mm.

        coordinates : (steps, displacement_count) what the core keeps of each step.
        """

    def core_directions(self, directions: SensitivityDirections) -> tuple[Floats, Floats, Floats, Floats]:
        """What the core takes of directions that move the nodes.

        Velocity gradients (G, ..., 2, 2), hoop strains (G, ...), velocities (G, ...) and changes of the dead forces
        (G, ...), for each unit of the G numbers of the geometry.
        """
