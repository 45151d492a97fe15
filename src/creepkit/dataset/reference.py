"""What stands for a test where the rate of its material is wanted: a stress at each time, and which rates are useful.

Of a bulge test sigma* = k P at small deflection, with k = 14.69 (h/.5 mm)^-1.17 of the paper's dimple of radius 7.5 mm
and apex thickness h, scaled as a plate of the same radius to thickness, and P the geometric mean of both pressures: as
it deflects a dimple relieves itself of what is more. Its amplitude grows by kappa = 42.3 (h/.5 mm)^-.486 mm per unit of
strain at sigma*. Both were read off simulations of that dimple with Norton's law, n from 1 to 8, h from .44 to .60 mm.
A bar has the stresses of its two holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import BULGE, LEVELS, ROOM, kind_of
from creepkit.dataset.criteria_of_boxes import VISIBLE
from creepkit.dataset.design import Draws
from creepkit.dataset.looks import SHARES, Looks
from creepkit.records import Specimen
from creepkit.specimens.bulge import Bulge

LARGEST_STRAIN = 0.2
"""Of the reference strain when the test ends; the paper's dimple is then some 2 mm deep."""


@dataclass(frozen=True)
class Reference:
    """How loads become rates.

    kind : of specimen. visible : creep, mm or strain, that every sample should show. per_load : reference stress over
        load at the specimen's own thickness (mm; 0: it has none). growth : creep per unit of reference strain there.
        powers : of thickness in both.
    """

    kind: str
    visible: float
    per_load: float = 1.0
    growth: float = 1.0
    thickness: float = 0.0
    powers: tuple[float, float] = (0.0, 0.0)

    def looks(self, draws: Draws, end: float) -> Looks:
        """Stresses and times of each row; end : s, where it is not drawn."""
        first, second = (draws.condition(name)[:, None] for name in LEVELS[self.kind])
        times = SHARES * draws.condition("end_time", end)[:, None]
        if self.kind == BULGE:
            stress = self.per_load * np.sqrt(first * second) * self._thin(draws)[:, None] ** self.powers[0]
        else:
            stress = np.where(times < draws.condition("Tj")[:, None], first, second)
        return Looks(stress, times, draws.condition("temperature", ROOM))

    def window(self, draws: Draws, end: float) -> tuple[Floats, Floats]:
        """log10 of the lowest and highest useful mean rate, 1/s: half the visible creep, and the largest strain.

        Half, because the higher of both pressures gives more creep than their geometric mean.
        """
        least = 0.5 * self.visible / (self.growth * self._thin(draws) ** self.powers[1])
        ends = draws.condition("end_time", end)
        return np.log10(least / ends), np.log10(LARGEST_STRAIN / ends)

    def _thin(self, draws: Draws) -> Floats:
        """Thickness of each row over the specimen's own."""
        if not self.thickness:
            return np.ones(len(draws))
        return draws.condition("apex_thickness", self.thickness) / self.thickness


def reference_of(specimen: Specimen) -> Reference:
    """The reference of a specimen."""
    kind = kind_of(specimen)
    if kind != BULGE:
        return Reference(kind, VISIBLE[kind])
    body = getattr(specimen, "specimen", specimen)
    assert isinstance(body, Bulge)
    radius, thickness = body.geometry.cavity_radius / 7.5, body.geometry.apex_thickness / 0.5
    per_load, growth = 14.69 * (radius / thickness) ** 1.17, 42.3 * radius**1.486 * thickness**-0.486
    return Reference(kind, VISIBLE[kind], per_load, growth, body.geometry.apex_thickness, (-1.17, -0.486))
