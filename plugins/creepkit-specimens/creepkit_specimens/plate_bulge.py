"""Plates and shallow domes, clamped at their rim, under gas pressure from below."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

import creepkit as ck

LIMIT_LOAD = 4.0 / 12.5
"""Stress of a clamped plate at its limit load over p (a/h)^2: p = 12.5 M/a^2 with M = s h^2/4 (Hopkins and Wang 1954,
J. Mech. Phys. Solids 3, 117; a plate that yields by von Mises)."""

DEFLECTION = 0.38
"""Deflection of a thin clamped plate in steady creep by Norton's law, for each unit of strain at the stress above, over
a^2/h: 0.44 with n = 1 and 0.31 with n = 7 while it is small, 0.40 to 0.43 at a fifth of the thickness."""


def graded(count: int, last: float) -> np.ndarray:
    """Boundaries (count + 1,) of elements from 0 to 1, lengths in a geometric series, the last `last` of the first."""
    ends = np.concatenate([[0.0], np.cumsum(last ** np.linspace(0.0, 1.0, count))])
    return ends / ends[-1]


def bulging(history: ck.History) -> tuple[np.ndarray, np.ndarray]:
    """Pressures above zero, MPa, and deflections, mm, (frames,) each; of a test that shows none its levels at rest."""
    levels = np.unique(history.load_levels)
    if "deflection" in history.outputs:
        heights = np.maximum(history.outputs["deflection"][history.used], 0.0)
        pressures = history.loading.program().at(history.times[history.used])
        seen = (pressures > 0) & np.isfinite(heights)
        if seen.any():
            return pressures[seen], heights[seen]
    return levels[levels > 0], np.zeros(np.count_nonzero(levels > 0))


def few(stresses: np.ndarray) -> np.ndarray:
    """The least, the middle and the largest of stresses (frames,), (3,); of few themselves."""
    return np.quantile(stresses, (0.0, 0.5, 1.0)) if stresses.size > 3 else stresses


@dataclass(frozen=True)
class PlateBulge(ck.Axisymmetric):
    """A flat round plate, clamped at its rim over its thickness; the deflection of its middle is measured on top."""

    radius: float = ck.dimension(10.0, (0.5, 500.0), tolerance=1e-3, long_name="radius to the clamp")
    thickness: float = ck.dimension(0.5, (0.01, 100.0), tolerance=0.02)

    name, title = "plate-bulge", "Flat clamped plate under gas pressure"
    outputs = (ck.Output("deflection", "length", "deflection of the middle", noise=2e-3),)
    loads = (ck.Load("pressure", "pressure"),)
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"pressure": (0.2, 1.5), "modulus": (50e3, 300e3)}
    )

    @property
    def columns(self) -> np.ndarray:
        """Boundaries of columns from the middle to the clamp, near which they are shorter than the thickness."""
        return graded(self.elements(12), 0.5 * self.thickness / self.radius)

    def section(self, load: str) -> ck.Section:
        """Columns of five layers, shorter towards the clamp: a thin plate creeps within 0.6 % of finer ones."""
        plate = ck.Section.rectangle((0.0, 0.0), (self.radius, self.thickness), self.columns, self.elements(5))
        return plate.hold("right", r=True, z=True).press("bottom")

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        """The middle of the upper surface."""
        return {"deflection": displacements.axial("top_left")}

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """Stress of a clamped plate under bending and membrane forces, (levels,) MPa: of a limit load at first.

        Both share the load as 1/s^2 = 1/bending^2 + 1/membrane^2: within 13 % of the mean that creep follows in
        simulations by Norton's law with n from 2 to 8, from deflections of a half to 2.8 thicknesses.
        """
        plate, _ = self.of_test(history, {})
        bending = LIMIT_LOAD * (plate.radius / plate.thickness) ** 2
        pressures, heights = bulging(history)
        return few(pressures * bending / np.hypot(1.0, bending / plate.membrane_stress(heights)))

    def membrane_stress(self, height: np.ndarray) -> np.ndarray:
        """Stress over the pressure, (heights,), of a cap of the height of its middle, mm, thinned as its area grows."""
        cap = self.radius**2 + height**2
        with np.errstate(divide="ignore"):
            return cap**2 / (4.0 * height * self.thickness * self.flat_area)

    @property
    def flat_area(self) -> float:
        """Area of the middle surface at rest, over pi, mm^2."""
        return self.radius**2

    def growth_per_strain(self, history: ck.History) -> float:
        """mm of deflection for each unit of strain at the reference stress, while it is less than the thickness."""
        plate, _ = self.of_test(history, {})
        return DEFLECTION * plate.radius**2 / plate.thickness


@dataclass(frozen=True)
class DomeBulge(PlateBulge):
    """A shallow spherical dome of even thickness, clamped at its rim, under gas pressure on its inner side."""

    rise: float = ck.dimension(2.0, (0.01, 500.0), tolerance=0.01, long_name="rise of the inner side over the rim")

    name, title = "dome-bulge", "Shallow clamped dome under gas pressure"
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"pressure": (1.0, 8.0), "modulus": (50e3, 300e3)}
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.rise <= self.radius:
            raise ck.errors.SolveError(
                f"{self.name} specimen: rise is {self.rise:g} mm; allowed is up to the radius, {self.radius:g} mm"
            )

    @property
    def sphere(self) -> float:
        """Radius of the inner side, mm."""
        return 0.5 * (self.radius**2 + self.rise**2) / self.rise

    def section(self, load: str) -> ck.Section:
        """Columns along the radii of the sphere, shorter towards the clamp."""
        ends = self.columns
        shares = np.sort(np.concatenate([ends, 0.5 * (ends[:-1] + ends[1:])]))
        angles = shares * 2.0 * np.arctan(self.rise / self.radius)
        towards = np.stack([np.sin(angles), np.cos(angles)], axis=1)
        centre = np.array([0.0, self.rise - self.sphere])
        dome = ck.Section.strip(
            centre + self.sphere * towards, centre + (self.sphere + self.thickness) * towards, self.elements(4)
        )
        return dome.hold("last", r=True, z=True).press("inner")

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        """The middle of the outer surface."""
        return {"deflection": displacements.axial("outer_first")}

    @property
    def flat_area(self) -> float:
        """Area of the inner side at rest, over pi, mm^2."""
        return self.radius**2 + self.rise**2

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """Membrane stress P R/(2 t) of the cap as it is at first and as it was seen, (levels,) MPa."""
        dome, _ = self.of_test(history, {})
        pressures, heights = bulging(history)
        return few(pressures * dome.membrane_stress(dome.rise + heights))

    def growth_per_strain(self, history: ck.History) -> float:
        """mm for each unit of reference strain: half of it strains a whole sphere; clamped at its rim it flattens less.

        0.8 R was found for domes of the default rise over radius, for n from 3 to 7.
        """
        dome, _ = self.of_test(history, {})
        return 0.8 * dome.sphere


@ck.hookimpl
def creepkit_specimens() -> list[ck.Specimen]:
    return [PlateBulge(), DomeBulge()]
