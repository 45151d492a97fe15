"""FiniteElementSettings: how a specimen in finite elements is simulated, and up to where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Self

from creepkit.records import PROGRAM_NUISANCES, Load, Output
from creepkit.specimens.settings_checks import check_ranges
from creepkit.specimens.test_piece import TestPiece


@dataclass(frozen=True, kw_only=True)
class FiniteElementSettings(TestPiece):
    """A body of revolution and the limits of its simulation.

    tolerance : estimated error of a step, over the largest observed displacement plus `resolution` mm.
    refinement : of the mesh; 2 has twice as many elements each way.
    deflection_limit : mm, observed displacement at which the test ends. strain_limit : creep strain at which a point
        has ruptured. max_steps : cap on the steps of one simulation, so on its cost.
    threads : simulations that run at the same time; None for one on each core.
    """

    tolerance: float = 5e-3
    refinement: float = 1.0
    resolution: float = 1e-3
    deflection_limit: float = 1e3
    strain_limit: float = 1.0
    max_steps: int = 1000
    threads: int | None = None

    name: ClassVar[str]  # type: ignore[misc]
    title: ClassVar[str]
    outputs: ClassVar[tuple[Output, ...]]
    loads: ClassVar[tuple[Load, ...]]

    ranges: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {
            "tolerance": (1e-6, 0.1),
            "refinement": (0.1, 100.0),
            "resolution": (1e-9, 1e3),
            "deflection_limit": (1e-6, 1e6),
            "strain_limit": (1e-3, 10.0),
            "max_steps": (10, 100_000),
        }
    )
    """What is allowed of each setting."""

    first_step: ClassVar[float] = 10.0
    """s, the longest first step after a change of load; less where high stresses relax in less."""

    program_nuisances: ClassVar[tuple[str, ...]] = PROGRAM_NUISANCES
    """Kinds of nuisances of a history's programs that predict() differentiates itself."""

    def __post_init__(self) -> None:
        threads = {} if self.threads is None else {"threads": (1, 100_000)}
        check_ranges(self, {**self.ranges, **threads})

    def refined(self) -> Self:
        """The same with twice as many elements in each direction, in steps of a tenth of the tolerance."""
        return self.replace(refinement=2.0 * self.refinement, tolerance=max(0.1 * self.tolerance, 1e-6))
