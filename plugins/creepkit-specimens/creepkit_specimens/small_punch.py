"""Small punch creep: a clamped disc that a ball pushes through a hole under constant force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar

import numpy as np

import creepkit as ck

FORCE_FACTOR = 3.33
"""F/s = 3.33 R^-0.2 r^1.2 h: force over the stress of the uniaxial test with the same life, for a hole of radius R, a
ball of radius r and a thickness h, mm (CEN Workshop Agreement CWA 15627:2007, with its factor k_SP of 1)."""

MEMBRANE = (0.2090, 0.0596, 0.0023)
"""Strain of the disc at deflection u, 0.2090 u + 0.0596 u^2 + 0.0023 u^3 with u in mm, for a hole of radius 2 mm and a
ball of radius 1.25 mm: J. Chakrabarty's membrane stretched over a hemisphere (Int. J. Mech. Sci. 12, 1970, 315) as
fitted by Yang and Wang, Int. J. Press. Vess. Piping 80 (2003) 715."""


@dataclass(frozen=True)
class SmallPunch(ck.Axisymmetric):
    """A disc between two dies, pushed by a rigid ball under a dead force through the hole of the lower die.

    Both faces are held beyond the rounded edge of the hole, over which the disc bends; contact with the ball and with
    the edge is without friction. The deflection is that of the lower face in its middle.

    contact_stiffness : MPa/mm, pressure for each mm of penetration; with ten times as much set a smaller tolerance
        too, for errors of equilibrium, mm, mean larger ones of pressure.
    contact_smoothing : mm, gap at which pressure begins.
    """

    thickness: float = ck.dimension(0.5, (0.05, 5.0), tolerance=0.01)
    punch_radius: float = ck.dimension(1.25, (0.1, 20.0), tolerance=2e-3, long_name="radius of the ball")
    hole_radius: float = ck.dimension(2.0, (0.2, 40.0), tolerance=5e-3, long_name="radius of the hole")
    edge_radius: float = ck.dimension(0.2, (0.01, 5.0), tolerance=0.1, long_name="radius of the edge of the hole")
    contact_stiffness: float = field(default=4e6, kw_only=True)
    contact_smoothing: float = field(default=1e-4, kw_only=True)
    strain_limit: float = field(default=1.5, kw_only=True)
    tolerance: float = field(default=5e-4, kw_only=True)  # node after node comes into contact

    name, title = "small-punch", "Disc under a ball at constant force"
    outputs = (ck.Output("deflection", "length", "deflection of the lower face", noise=2e-3),)
    loads = (ck.Load("force", "force", "force on the ball"),)
    first_step = 1e-6
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"force": (150.0, 500.0), "modulus": (50e3, 300e3)}
    )

    @property
    def clamp(self) -> float:
        """Radius from which on both faces are held, mm."""
        return self.hole_radius + self.edge_radius

    def section(self, load: str) -> ck.Section:
        """Even columns over the hole, shorter ones over its edge, and a clamped rim as wide as the disc is thick."""
        h, clamp, outer = self.thickness, self.clamp, self.clamp + self.thickness
        blocks = ((0.0, self.hole_radius, 20), (self.hole_radius, clamp, 3), (clamp, outer, 3))
        parts = [np.linspace(a, b, self.elements(count) + 1)[1:] for a, b, count in blocks]
        columns = np.concatenate([[0.0], *parts]) / outer
        columns[-1] = 1.0
        disc = ck.Section.rectangle((0.0, 0.0), (outer, h), columns, self.elements(4))
        held = 0.9999999 * clamp
        disc = disc.with_side("lower", lambda r, z: (z == 0.0) & (r > held))
        disc = disc.with_side("upper", lambda r, z: (z == h) & (r > held))
        near = 0.4567 * self.hole_radius
        disc = disc.with_side("over the edge", lambda r, z: (z == 0.0) & (r > near) & (r < 1.0000001 * clamp))
        for side in ("lower", "upper", "right"):
            disc = disc.hold(side, r=True, z=True)
        law = {"stiffness": self.contact_stiffness, "smoothing": self.contact_smoothing}
        e, R = self.edge_radius, self.punch_radius
        disc = disc.touch("over the edge", (clamp, -e), (clamp, 0.0), name="edge", **law)
        return disc.touch("top", (0.0, h + R), (0.0, h), name="punch", force=-1.0, **law)

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        """The middle of the lower face, downwards."""
        return {"deflection": -displacements.axial("bottom_left")}

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """Stress of the uniaxial test with the same life for each force, (levels,) MPa, by CWA 15627."""
        disc, _ = self.of_test(history, {})
        levels = np.unique(history.loading.program().values)
        area = FORCE_FACTOR * disc.hole_radius**-0.2 * disc.punch_radius**1.2 * disc.thickness
        return levels[levels > 0] / area

    def growth_per_strain(self, history: ck.History) -> float:
        """mm of deflection for each unit of strain of the membrane, at a deflection of half the hole's radius."""
        disc, _ = self.of_test(history, {})
        a, b, c = MEMBRANE
        return 0.5 * disc.hole_radius / (a + 2.0 * b + 3.0 * c)


@ck.hookimpl
def creepkit_specimens() -> list[ck.Specimen]:
    return [SmallPunch()]
