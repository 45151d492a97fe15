"""AxisymmetricRun: one simulated test of an axisymmetric specimen, with its whole body at any time until its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.records import History, Status
from creepkit.specimens.axisymmetric.finite_elements import AxisymmetricTest, solver_settings
from creepkit.specimens.finite_element_run import FiniteElementRun, rate_failure_of
from creepkit.specimens.run import run_from_outputs

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.axisymmetric.settings import AxisymmetricSettings


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisymmetricRun(FiniteElementRun):
    """A simulated test of a body of revolution; see FiniteElementRun for fields and times.

    test : its section, load history and lengths.
    """

    test: AxisymmetricTest = field(repr=False)

    @property
    def model(self) -> FiniteElementModel:
        """The finite elements of the section."""
        return self.test.body.model

    def displacements(self, times: ArrayLike | None = None) -> Floats:
        """Displacements of all nodes, (times, nodes, 2) mm, u_r and u_z.

        times : number or (times,) s, by default those of the frames.
        """
        return self._at(self.simulation.displacements, times)


def run_axisymmetric(
    specimen: AxisymmetricSettings, law: CreepLaw, values: Mapping[str, float], plan: History
) -> AxisymmetricRun:
    """Simulate one test and keep all of it."""
    test = AxisymmetricTest.of(specimen, plan, {}, sensitivities=False)
    kernel = kernels.lower(law, "compiled")
    theta = law.to_internal(law.values(values))[0]
    simulation = test.simulate(kernel, theta, solver_settings(specimen), keep_points=True)
    rows = test.outputs(simulation)
    status, end_time, reason = simulation.status, simulation.end_time, simulation.reason
    stress = float(np.max(simulation.mises, initial=1.0))
    rate_failure = rate_failure_of(kernel, theta, simulation, test.load_history.temperature, stress)
    if rate_failure is not None:
        status, end_time, reason = Status.NOT_CONVERGED, *rate_failure
    lengths = {each.name: each.default for each in test.piece.dimensions if each.of_piece}
    plan = plan.replace(geometry={**lengths, **plan.geometry})
    states = tuple(map(str, law.states))
    return run_from_outputs(
        AxisymmetricRun, plan, specimen.outputs, rows, status, end_time, reason,
        test=test, simulation=simulation, states=states,
    )  # fmt: skip
