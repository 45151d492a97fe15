"""PointRun: one simulated test of a material point with its tensors and the states of its law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.records import History
from creepkit.specimens.run import Run, run_from_outputs

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.point import MaterialPoint


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


def run_material_point(specimen: MaterialPoint, law: CreepLaw, values: Mapping[str, float], plan: History) -> PointRun:
    """Simulate one test and keep all of it."""
    from creepkit.specimens.point import OUTPUTS, point_outputs

    kernel = kernels.lower(law, "numba")
    result = specimen.simulate(kernel, kernel.to_internal(law.values(values))[0], plan)
    rows = point_outputs(result, plan)
    shown_columns = [k for k, column in enumerate(rows.T) if k == 0 or np.nanmax(np.abs(column), initial=0.0) > 0.0]
    names = [OUTPUTS[k] for k in shown_columns]
    output_rows = np.searchsorted(result.times, plan.times[plan.times <= result.end_time])
    total = result.strain if plan.elastic is not None else np.full_like(result.strain, np.nan)
    states = {symbol.name: result.states[output_rows, k] for k, symbol in enumerate(law.states)}
    return run_from_outputs(
        PointRun,
        plan,
        names,
        rows[:, shown_columns],
        result.status,
        result.end_time,
        result.reason,
        stress=result.stress[output_rows],
        total_strain=total[output_rows],
        creep_strain=result.creep_strain[output_rows],
        equivalent=result.equivalent[output_rows],
        states=states,
    )
