"""PointRun: one simulated test of a material point with its tensors and the states of its law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.records import History
from creepkit.specimens.run import Run, run_of

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.point import Point


@dataclass(frozen=True, eq=False, kw_only=True)
class PointRun(Run):
    """A simulated material point, at the times of the run.

    stress, total_strain, creep_strain : (times, 6) MPa and tensor strains, in the order 11, 22, 33, 12, 23, 13; the
        total strain is NaN without elastic data. equivalent : (times,) equivalent creep strain.
    states : {name: (times,)} internal variables of the law.

    Its outputs leave out the components that stay zero.
    """

    stress: Floats = field(repr=False)
    total_strain: Floats = field(repr=False)
    creep_strain: Floats = field(repr=False)
    equivalent: Floats = field(repr=False)
    states: Mapping[str, Floats] = field(repr=False)

    @property
    def mises(self) -> Floats:
        """The von Mises stress, (times,) MPa."""
        deviator = self.stress - self.stress[:, :3].mean(axis=1)[:, None] * np.array([1, 1, 1, 0, 0, 0])
        return np.asarray(np.sqrt(1.5 * (deviator**2 @ np.array([1, 1, 1, 2, 2, 2]))))


def run(specimen: Point, law: CreepLaw, values: Mapping[str, float], plan: History) -> PointRun:
    """Simulate one test and keep all of it."""
    from creepkit.specimens.point import OUTPUTS, shown

    kernel = kernels.lower(law, "numba")
    found = specimen.drive(kernel, kernel.internal(law.values(values))[0], plan)
    rows = shown(found, plan)
    told = [k for k, column in enumerate(rows.T) if k == 0 or np.nanmax(np.abs(column), initial=0.0) > 0.0]
    names = [OUTPUTS[k] for k in told]
    kept = np.searchsorted(found.times, plan.times[plan.times <= found.end_time])
    total = found.strain if plan.elastic is not None else np.full_like(found.strain, np.nan)
    states = {symbol.name: found.states[kept, k] for k, symbol in enumerate(law.states)}
    return run_of(
        PointRun,
        plan,
        names,
        rows[:, told],
        found.status,
        found.end_time,
        found.reason,
        stress=found.stress[kept],
        total_strain=total[kept],
        creep_strain=found.creep_strain[kept],
        equivalent=found.equivalent[kept],
        states=states,
    )
