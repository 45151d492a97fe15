"""AxisymmetricSettings: what the author of an axisymmetric specimen states, and how it is simulated."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

from creepkit.arrays import ArrayLike
from creepkit.errors import SolveError
from creepkit.records import PROGRAM_NUISANCES, Load, Output
from creepkit.specimens.settings_checks import check_number, check_whole_number, is_whole_number
from creepkit.specimens.test_piece import TestPiece

if TYPE_CHECKING:
    from creepkit.fem.section import Section
    from creepkit.specimens.axisymmetric.displacements import Displacements


_RANGES = {
    "tolerance": (1e-6, 0.1),
    "refinement": (0.1, 100.0),
    "resolution": (1e-9, 1e3),
    "deflection_limit": (1e-6, 1e6),
    "strain_limit": (1e-3, 10.0),
    "max_steps": (10, 100_000),
}


@dataclass(frozen=True, kw_only=True)
class AxisymmetricSettings(TestPiece, ABC):
    """A body of revolution and the limits of its simulation; `Axisymmetric` says how a specimen is made of it."""

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

    first_step: ClassVar[float] = 10.0
    """s, the longest first step after a change of load; less where high stresses relax in less."""

    program_nuisances: ClassVar[tuple[str, ...]] = PROGRAM_NUISANCES
    """Kinds of nuisances of a history's programs that predict() differentiates itself."""

    def __post_init__(self) -> None:
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            check = check_whole_number if name == "max_steps" else check_number
            check(self.name, name, value, f"{low:g} to {high:g}")
            if not low <= value <= high:
                raise SolveError(f"{self.name} specimen: {name} is {value:g}; allowed are {low:g} to {high:g}")
        if self.threads is not None and not (is_whole_number(self.threads) and self.threads >= 1):
            allowed = "whole numbers above zero, or None for all cores"
            raise SolveError(f"{self.name} specimen: threads is {self.threads!r}; allowed are {allowed}")

    # ---- of each specimen -----------------------------------------------------------------------------------------

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

    # ---- of every specimen ----------------------------------------------------------------------------------------

    def elements(self, count: int) -> int:
        """A number of elements of a mesh at this specimen's refinement, one at least."""
        return max(1, round(count * self.refinement))

    def refined(self) -> Self:
        """The same with twice as many elements in each direction, in steps of a tenth of the tolerance."""
        return self.replace(refinement=2.0 * self.refinement, tolerance=max(0.1 * self.tolerance, 1e-6))
