"""Designs of experiments: which samples of a law and its tests are simulated, and which of them are kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import DatasetError, nearest
from creepkit.language import CreepLaw
from creepkit.records import Specimen

if TYPE_CHECKING:
    from creepkit.dataset.criteria import Criterion


@dataclass(frozen=True, eq=False)
class Draws:
    """Rows of a design.

    parameters : (rows, parameters) in the author's units, columns as law.names; 0 of a coefficient is off.
    conditions : (rows, conditions), columns as condition_names.
    """

    parameters: Floats
    conditions: Floats
    condition_names: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", frozen(self.parameters))
        object.__setattr__(self, "conditions", frozen(self.conditions))
        shapes = self.parameters.shape, self.conditions.shape
        if {len(s) for s in shapes} != {2} or shapes[0][0] != shapes[1][0]:
            raise DatasetError(f"draws need a row of parameters and of conditions each, found {shapes[0]}, {shapes[1]}")
        if shapes[1][1] != len(self.condition_names):
            raise DatasetError(f"draws have {shapes[1][1]} conditions and {len(self.condition_names)} names of them")

    def __len__(self) -> int:
        return len(self.parameters)

    def condition(self, name: str, default: float | None = None) -> Floats:
        """One condition of every row, (rows,); `default` where the design does not vary it."""
        if name in self.condition_names:
            return np.asarray(self.conditions[:, self.condition_names.index(name)])
        if default is None:
            raise DatasetError(f"these draws have no condition '{name}': {nearest(name, self.condition_names)}")
        return np.full(len(self), default)

    def conditions_of(self, row: int) -> dict[str, float]:
        """{condition: value} of one row."""
        return dict(zip(self.condition_names, map(float, self.conditions[row]), strict=True))


@runtime_checkable
class SamplingDesign(Protocol):
    """Which samples are drawn; a frozen record that worker processes can be sent."""

    @property
    def law(self) -> CreepLaw:
        """The law whose parameters are drawn."""
        ...

    @property
    def name(self) -> str:
        """paper, conditioned or rate-family."""
        ...

    @property
    def specimen(self) -> str:
        """The kind of test: bulge or uniaxial."""
        ...

    @property
    def condition_names(self) -> tuple[str, ...]:
        """What is drawn of a test, in the order of the columns."""
        ...

    @property
    def grid(self) -> TimeGrid:
        """The times of its samples."""
        ...

    @property
    def criteria(self) -> tuple[Criterion, ...]:
        """What a sample must meet to be kept, those before simulation first."""
        ...

    def draw(self, first: int, count: int, seed: int) -> Draws:
        """Return rows `first` to `first + count` of one scrambled Sobol sequence, whatever the block."""
        ...

    def document(self) -> dict[str, Any]:
        """Everything that decides the draws, as JSON-able data."""
        ...


def sampling_design(law: CreepLaw, specimen: Specimen, domain: str = "conditioned", **changes: Any) -> SamplingDesign:
    """Return a design for a law and a specimen; see paper_box.paper_box and conditioned_box.conditioned_box.

    box : "conditioned", whose samples creep visibly, or "paper", uniform in the law's bounds.
    changes : ranges of conditions, (low, high) or a number: P1=(5, 20), apex_thickness=(.44, .6), end_time=3600;
        `every`, s between frames, or `grid`, a TimeGrid.
    """
    from creepkit.dataset.conditioned_box import conditioned_domain
    from creepkit.dataset.paper_box import paper_domain

    domains: dict[str, Callable[..., SamplingDesign]] = {"conditioned": conditioned_domain, "paper": paper_domain}
    if domain not in domains:
        raise DatasetError(f"there is no box '{domain}': {nearest(domain, domains)}")
    return domains[domain](law, specimen, **changes)
