"""LoadScaling: reference stresses and growth of many tests at once, where they are powers of load and length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats


@dataclass(frozen=True)
class LoadScaling:
    """Reference stress and growth of the tests of a specimen, as a sampling design asks for them: of all rows at once.

    A specimen states it as `load_scaling`; without it a design asks reference_stress(history) and
    growth_per_strain(history) of every test.

    stress_per_load : reference stress, MPa, over load, at the `nominal` length. growth_per_strain : growth of the
        output, in its unit, for each unit of reference strain there.
    length : the length of the test piece, mm, on which both depend; "" for none. nominal : the specimen's own, mm.
    exponents : of that length over the nominal one, in the stress and in the growth.
    averaged : whether one stress, of the geometric mean of both load levels, stands for the whole test: of a test piece
        that relieves itself of stress as it deflects.
    """

    stress_per_load: float = 1.0
    growth_per_strain: float = 1.0
    length: str = ""
    nominal: float = 0.0
    exponents: tuple[float, float] = (0.0, 0.0)
    averaged: bool = False

    def stresses(self, first: Floats, second: Floats, lengths: Floats, before_jump: Bools) -> Floats:
        """(rows, times) MPa, or (rows, 1) where one stress stands for the test.

        first, second : (rows, 1) both levels, in the unit of the load. lengths : (rows,) mm.
        before_jump : (rows, times) whether the first level holds.
        """
        load = np.sqrt(first * second) if self.averaged else np.where(before_jump, first, second)
        return np.asarray(self.stress_per_load * load * self._relative(lengths)[:, None] ** self.exponents[0])

    def growth(self, lengths: Floats) -> Floats:
        """(rows,) growth of the output, in its unit, for each unit of reference strain; lengths : (rows,) mm."""
        return np.asarray(self.growth_per_strain * self._relative(lengths) ** self.exponents[1])

    def _relative(self, lengths: Floats) -> Floats:
        return lengths / self.nominal if self.length else np.ones(len(lengths))
