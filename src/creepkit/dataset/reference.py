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
from creepkit.dataset.conditions import BULGE, LOAD_LEVELS, ROOM_TEMPERATURE, test_kind
from creepkit.dataset.criteria_of_boxes import VISIBLE_CREEP
from creepkit.dataset.design import Draws
from creepkit.dataset.looks import POINT_FRACTIONS, RateEvaluationPoints
from creepkit.records import Specimen
from creepkit.specimens.bulge import Bulge

LARGEST_REFERENCE_STRAIN = 0.2
"""Of the reference strain when the test ends; the paper's dimple is then some 2 mm deep."""


@dataclass(frozen=True)
class ReferenceStress:
    """How loads become rates.

    kind : of specimen. visible : creep, mm or strain, that every sample should show. per_load : reference stress over
        load at the specimen's own thickness (mm; 0: it has none). growth : creep per unit of reference strain there.
        powers : of thickness in both.
    """

    kind: str
    visible_creep: float
    stress_per_load: float = 1.0
    creep_per_strain: float = 1.0
    thickness: float = 0.0
    thickness_exponents: tuple[float, float] = (0.0, 0.0)

    def evaluation_points(self, draws: Draws, end: float) -> RateEvaluationPoints:
        """Stresses and times of each row; end : s, where it is not drawn."""
        first, second = (draws.condition(name)[:, None] for name in LOAD_LEVELS[self.kind])
        times = POINT_FRACTIONS * draws.condition("end_time", end)[:, None]
        if self.kind == BULGE:
            stress = self.stress_per_load * np.sqrt(first * second) * self._relative_thickness(draws)[:, None] ** self.thickness_exponents[0]
        else:
            stress = np.where(times < draws.condition("Tj")[:, None], first, second)
        return RateEvaluationPoints(stress, times, draws.condition("temperature", ROOM_TEMPERATURE))

    def useful_rates(self, draws: Draws, end: float) -> tuple[Floats, Floats]:
        """log10 of the lowest and highest useful mean rate, 1/s: half the visible creep, and the largest strain.

        Half, because the higher of both pressures gives more creep than their geometric mean.
        """
        least_strain = 0.5 * self.visible_creep / (self.creep_per_strain * self._relative_thickness(draws) ** self.thickness_exponents[1])
        end_times = draws.condition("end_time", end)
        return np.log10(least_strain / end_times), np.log10(LARGEST_REFERENCE_STRAIN / end_times)

    def _relative_thickness(self, draws: Draws) -> Floats:
        """Thickness of each row over the specimen's own."""
        if not self.thickness:
            return np.ones(len(draws))
        return draws.condition("apex_thickness", self.thickness) / self.thickness


def reference_stress_of(specimen: Specimen) -> ReferenceStress:
    """The reference of a specimen."""
    kind = test_kind(specimen)
    if kind != BULGE:
        return ReferenceStress(kind, VISIBLE_CREEP[kind])
    bulge = getattr(specimen, "specimen", specimen)
    assert isinstance(bulge, Bulge)
    radius, thickness = bulge.geometry.cavity_radius / 7.5, bulge.geometry.apex_thickness / 0.5
    stress_per_load, creep_per_strain = 14.69 * (radius / thickness) ** 1.17, 42.3 * radius**1.486 * thickness**-0.486
    return ReferenceStress(kind, VISIBLE_CREEP[kind], stress_per_load, creep_per_strain, bulge.geometry.apex_thickness, (-1.17, -0.486))
