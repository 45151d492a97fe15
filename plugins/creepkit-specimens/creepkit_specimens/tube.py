"""A thick tube under internal gas pressure: a slice of it, far from its ends."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

import creepkit as ck


@dataclass(frozen=True)
class Tube(ck.Axisymmetric):
    """A tube under internal pressure, which rests on its bore; the outer diameter is measured while it grows.

    A slice whose faces stay plane (generalised plane strain) stands for the tube. With closed ends the pressure on the
    ends pulls at it, by the area of the bore at rest; with open ends no force does.
    """

    outer_diameter: float = ck.dimension(20.0, (1.0, 1000.0), tolerance=1e-3, long_name="outer diameter")
    thickness: float = ck.dimension(2.0, (0.05, 300.0), tolerance=0.02, long_name="wall thickness")
    closed: ClassVar[bool] = True

    name, title = "tube", "Tube under internal pressure with closed ends"
    outputs = (
        ck.Output("diameter_growth", "length", "growth of the outer diameter", noise=1e-3, change_of="outer_diameter"),
    )
    loads = (ck.Load("pressure", "pressure"),)
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"pressure": (5.0, 40.0), "modulus": (50e3, 300e3)}
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 2.0 * self.thickness < self.outer_diameter:
            raise ck.errors.SolveError(
                f"{self.name} specimen: thickness is {self.thickness:g} mm; allowed is less than half of the outer "
                f"diameter, {0.5 * self.outer_diameter:g} mm"
            )

    @property
    def bore(self) -> float:
        """Radius of the bore at rest, mm."""
        return 0.5 * self.outer_diameter - self.thickness

    def section(self, load: str) -> ck.Section:
        """One row of elements through the wall, as high as a third of it, finer in proportion to the radius."""
        outer, count = 0.5 * self.outer_diameter, self.elements(8)
        radii = self.bore * (outer / self.bore) ** np.linspace(0.0, 1.0, count + 1)
        breaks = np.append((radii[:-1] - self.bore) / self.thickness, 1.0)
        wall = ck.Section.rectangle((self.bore, 0.0), (outer, self.thickness / 3.0), breaks, 1)
        wall = wall.hold("bottom", z=True).plane("top").press("left")
        return wall.pull("top", math.pi * self.bore**2) if self.closed else wall

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        """The diameter grows by twice the displacement of the outer surface."""
        return {"diameter_growth": 2.0 * displacements.radial("bottom_right")}

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """Von Mises stress of the limit load of each pressure level, (levels,) MPa: P sqrt(3)/2 / ln(b/a).

        The limit load of a closed tube of a material that yields by von Mises (Hill 1950, The Mathematical Theory of
        Plasticity, chapter V).
        """
        tube, _ = self.of_test(history, {})
        levels = np.unique(history.loading.program().values)
        return 0.5 * math.sqrt(3.0) * levels[levels > 0] / math.log(0.5 * tube.outer_diameter / tube.bore)

    def growth_per_strain(self, history: ck.History) -> float:
        """mm of diameter for each unit of reference strain: sqrt(3)/2 times the bore's diameter."""
        tube, _ = self.of_test(history, {})
        ratio = 1.0 - 2.0 * tube.thickness / tube.outer_diameter
        return 0.5 * math.sqrt(3.0) * tube.outer_diameter * ratio


@dataclass(frozen=True)
class OpenTube(Tube):
    """A tube under internal pressure whose ends carry no force."""

    closed: ClassVar[bool] = False
    name, title = "open-tube", "Tube under internal pressure with open ends"

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """P/ln(b/a) of each pressure level, (levels,) MPa: the hoop stress of a thin tube, which is alone in it."""
        return super().reference_stress(history) / (0.5 * math.sqrt(3.0))

    def growth_per_strain(self, history: ck.History) -> float:
        """mm of diameter for each unit of reference strain, which is that of the circumference."""
        return super().growth_per_strain(history) / (0.5 * math.sqrt(3.0))


@ck.hookimpl
def creepkit_specimens() -> list[ck.Specimen]:
    return [Tube(), OpenTube()]
