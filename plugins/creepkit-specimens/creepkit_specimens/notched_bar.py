"""A round bar with a circumferential notch, creeping under an axial force or relaxing at a held elongation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

import creepkit as ck

EXPONENT = 5.0
"""Stress exponent at which the length is worked out that creeps as much as the notch; that of many alloys."""


@dataclass(frozen=True)
class NotchedBar(ck.Axisymmetric):
    """A round bar with a notch of circular profile under a dead axial force, half of it by symmetry.

    The elongation is measured over the gauge length about the notch, between sections that stay plane; the contraction
    is that of the diameter at the root. A notch is a circular arc from surface to surface, at most half a circle.
    """

    diameter: float = ck.dimension(12.0, (0.5, 500.0), tolerance=1e-3)
    notch_diameter: float = ck.dimension(8.0, (0.2, 500.0), tolerance=2e-3, long_name="diameter at the root")
    notch_radius: float = ck.dimension(2.5, (0.05, 1000.0), tolerance=0.02, long_name="radius of the notch")
    gauge_length: float = ck.dimension(30.0, (0.5, 2000.0), tolerance=1e-3, long_name="gauge length")

    name, title = "notched-bar", "Notched round bar under axial force"
    outputs = (
        ck.Output("elongation", "length", "elongation over the gauge length", noise=2e-3, change_of="gauge_length"),
        ck.Output(
            "contraction", "length", "contraction of the diameter at the root", noise=2e-3, change_of="-notch_diameter"
        ),
    )
    loads = (ck.Load("force", "force", "axial force"),)
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"force": (2e3, 12e3), "modulus": (50e3, 300e3)}
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.depth <= self.notch_radius:
            raise ck.errors.SolveError(
                f"{self.name} specimen: notch_diameter {self.notch_diameter:g} mm makes the notch {self.depth:g} mm "
                f"deep; allowed is more than 0, up to notch_radius, {self.notch_radius:g} mm"
            )
        if not 0.5 * self.gauge_length > self.half_width + 0.5 * self.notch_diameter:
            least = 2.0 * self.half_width + self.notch_diameter
            raise ck.errors.SolveError(
                f"{self.name} specimen: gauge_length is {self.gauge_length:g} mm; allowed is more than {least:g} mm, "
                "the width of the notch and the diameter at its root"
            )

    @property
    def depth(self) -> float:
        """Depth of the notch, mm."""
        return 0.5 * (self.diameter - self.notch_diameter)

    @property
    def half_width(self) -> float:
        """Half the width of the notch along the bar, mm: the height over the root at which it ends."""
        return float(np.sqrt(max(self.notch_radius**2 - (self.notch_radius - self.depth) ** 2, 0.0)))

    @property
    def constraint(self) -> float:
        """Mean stress of the root over the flow stress: Bridgman's factor, at most that of a bar that flows."""
        ratio = 4.0 * self.notch_radius / self.notch_diameter
        return float(min((1.0 + ratio) * np.log1p(1.0 / ratio), (self.diameter / self.notch_diameter) ** 2))

    def profile(self, count: int, straight: int) -> tuple[np.ndarray, np.ndarray]:
        """Ends (2 (count + straight) + 1, 2) of the column lines on the surface and on the axis, mm, from the root up.

        count : columns along half of the notch. straight : columns above it.
        """
        turn = np.arctan2(self.half_width, self.notch_radius - self.depth)
        angles = np.linspace(0.0, turn, 2 * count + 1)
        root = 0.5 * self.notch_diameter + self.notch_radius * (1.0 - np.cos(angles))
        top, fan = 0.5 * self.gauge_length, self.half_width + 0.25 * self.notch_diameter
        ends = np.concatenate([[0.0], np.cumsum(3.0 ** np.linspace(0.0, 1.0, straight))])
        shares = np.sort(np.concatenate([ends, 0.5 * (ends[:-1] + ends[1:])]))[1:] / ends[-1]
        above = np.full(shares.size, 0.5 * self.diameter)
        surface = np.stack([root, self.notch_radius * np.sin(angles)], axis=1)
        surface = np.vstack([surface, np.stack([above, self.half_width + (top - self.half_width) * shares], axis=1)])
        heights = np.append(fan * angles / turn, fan + (top - fan) * shares)
        return surface, np.stack([np.zeros(heights.size), heights], axis=1)

    def section(self, load: str) -> ck.Section:
        """Column lines from the surface to the axis, with thinner layers near the surface."""
        surface, axis = self.profile(self.elements(6), self.elements(5))
        layers = np.linspace(0.0, 1.0, self.elements(5) + 1) ** 1.5
        bar = ck.Section.strip(surface, axis, layers).hold("first", z=True)
        return bar.move("last", by=0.5) if load == "displacement" else bar.plane("last").pull("last")

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        """Both halves of the gauge length become longer by u_z of the end."""
        return {
            "elongation": 2.0 * displacements.axial("inner_last"),
            "contraction": -2.0 * displacements.radial("inner_first"),
        }

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """Net stress over Bridgman's factor, (levels,) MPa, (1 + 2 R/a) ln(1 + a/(2 R)) with root radius a.

        Of a shallow sharp notch it is the gross stress, which that factor would fall below. P. W. Bridgman, Studies in
        Large Plastic Flow and Fracture, 1952: mean stress over flow stress of a neck.
        """
        bar, _ = self.of_test(history, {})
        levels = np.unique(np.abs(history.loading.program().values))
        return levels[levels > 0] / (0.25 * np.pi * bar.notch_diameter**2 * bar.constraint)

    def growth_per_strain(self, history: ck.History) -> float:
        """mm of elongation for each unit of reference strain: the length that would creep as the root does.

        Every section creeps by its mean stress over the factor of the root, which fades to 1 at the end of the notch.
        """
        bar, _ = self.of_test(history, {})
        surface, _ = bar.profile(200, 200)
        within = np.maximum(1.0 - surface[:, 1] / bar.half_width, 0.0)
        stress = bar.constraint / (1.0 + (bar.constraint - 1.0) * within)
        stress *= (0.5 * bar.notch_diameter / surface[:, 0]) ** 2
        return float(2.0 * np.trapezoid(stress**EXPONENT, surface[:, 1]))


@dataclass(frozen=True)
class NotchedRelaxation(NotchedBar):
    """The same bar with its elongation imposed over the gauge length; the force is measured while it relaxes."""

    name, title = "notched-relaxation", "Notched round bar under imposed elongation"
    outputs = (
        ck.Output("force", "force", "axial force", grows=False, noise=5.0),
        ck.Output("contraction", "length", "contraction of the diameter at the root", noise=2e-3),
    )
    loads = (ck.Load("displacement", "length", "imposed elongation"),)
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"displacement": (0.01, 0.1), "modulus": (50e3, 300e3)}
    )

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        """The force over the whole circumference."""
        return {"force": displacements.force, "contraction": -2.0 * displacements.radial("inner_first")}

    def reference_stress(self, history: ck.History) -> np.ndarray:
        """That of the elastic force at the imposed elongations, (levels,) MPa, by the sections as bars in a row."""
        bar, _ = self.of_test(history, {})
        surface, _ = bar.profile(200, 200)
        compliance = 2.0 * np.trapezoid(1.0 / (np.pi * surface[:, 0] ** 2), surface[:, 1])
        modulus = (
            150e3 if history.elastic is None else float(history.elastic.at(history.temperature_program().values[0]).E)
        )
        levels = np.unique(np.abs(history.loading.program().values))
        force = modulus * levels[levels > 0] / compliance
        return force / (0.25 * np.pi * bar.notch_diameter**2 * bar.constraint)


@ck.hookimpl
def creepkit_specimens() -> list[ck.Specimen]:
    return [NotchedBar(), NotchedRelaxation()]
