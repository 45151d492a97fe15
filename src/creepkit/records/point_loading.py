"""What is imposed on a material point: stresses and strains by component; and every loading in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from creepkit.errors import SolveError
from creepkit.records.loading import Loading, Program, Quantity

COMPONENTS = ("11", "22", "33", "12", "23", "13")
"""Names of the components of a stress or strain, in the order of every vector of six; shear strains of the tensor."""

ComponentHistory: TypeAlias = float | Program | Sequence[tuple[float, float]]
"""A constant, a program, or steps as (start time, value) pairs."""


@dataclass(frozen=True)
class PointLoading:
    """Stresses (MPa) and total strains (of the tensor) prescribed at a material point, by component "11" to "13".

    PointLoading(stress={"11": 100, "12": [(0, 0), (3600, 40)]}, strain={"33": 0.0}) is tension, torsion from one hour
    on, and no strain along 33. What is named in neither is free of stress.
    """

    stress: Mapping[str, Program] = field(default_factory=dict)
    strain: Mapping[str, Program] = field(default_factory=dict)
    quantity: Quantity = field(default="components", init=False)

    def __init__(
        self, stress: Mapping[str, ComponentHistory] | None = None, strain: Mapping[str, ComponentHistory] | None = None
    ) -> None:
        given = {"stress": dict(stress or {}), "strain": dict(strain or {})}
        for name in (*given["stress"], *given["strain"]):
            if name not in COMPONENTS:
                raise SolveError(f"there is no component '{name}' to load; allowed are {', '.join(COMPONENTS)}")
        for name in given["stress"].keys() & given["strain"].keys():
            raise SolveError(f"component {name} has both a stress and a strain prescribed; keep one of them")
        if not (given["stress"] or given["strain"]):
            raise SolveError(
                'a material point needs a stress or a strain of some component, such as stress={"11": 100}'
            )
        for kind, components in given.items():
            ordered = {name: _as_program(components[name]) for name in COMPONENTS if name in components}
            object.__setattr__(self, kind, MappingProxyType(ordered))
        object.__setattr__(self, "quantity", "components")

    def __reduce__(self) -> tuple[Any, ...]:
        return PointLoading, (dict(self.stress), dict(self.strain))

    def __hash__(self) -> int:
        return hash((tuple(self.stress.items()), tuple(self.strain.items())))

    def program(self) -> Program:
        """The first prescribed component over time; `stress` and `strain` hold them all."""
        return next(iter([*self.stress.values(), *self.strain.values()]))


def _as_program(given: ComponentHistory) -> Program:
    if isinstance(given, Program):
        return given
    if isinstance(given, Sequence):
        return Program.steps(given)
    return Program.constant(given)


def loading_text(loading: Loading) -> str:
    """What is imposed, as people say it: '43 MPa', '60 to 95 MPa', 'strain 0.002', '11 100 MPa, 12 40 MPa'."""
    if isinstance(loading, PointLoading):
        parts = [f"{name} {_levels_text(p)} MPa" for name, p in loading.stress.items()]
        return ", ".join(parts + [f"strain {name} {_levels_text(p)}" for name, p in loading.strain.items()])
    program = loading.program()
    if loading.quantity == "strain":
        return f"strain {_levels_text(program)}"
    return f"{program.values.max():g} MPa" if loading.quantity == "pressure" else f"{_levels_text(program)} MPa"


def _levels_text(program: Program) -> str:
    first, last = float(program.values[0]), float(program.values[-1])
    return f"{last:g}" if float(np.ptp(program.values)) == 0.0 else f"{first:g} to {last:g}"
