"""BulgeRun: one simulated bulge test with displacements, stresses and strains at any time until its end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.simulation import simulate
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.presentation import present
from creepkit.records import History, Status
from creepkit.specimens.bulge.finite_elements import solver_settings
from creepkit.specimens.bulge.setup import BulgeSetup, set_up_test
from creepkit.specimens.finite_element_run import STRESS_FIELD, FiniteElementRun, rate_failure_of
from creepkit.specimens.run import run_from_outputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.fem.reduced_order_model import ReducedOrderModel
    from creepkit.fem.solver import SolverSettings
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge.settings import BulgeSettings


class TopProfile(NamedTuple):
    """The top of the dimple: radii (nodes,) at rest, mm; displacement : (times, nodes) mm, how far each has risen."""

    radii: Floats
    displacement: Floats


class StressRange(NamedTuple):
    """Least and greatest von Mises stress; low, high : (times,) MPa."""

    low: Floats
    high: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class BulgeRun(FiniteElementRun):
    """A simulated bulge test.

    `times` below are s and by default those of the run. A number instead of an array takes its axis away from the
    result; a time after the end is refused, for nothing is known there. At the time of a sudden change of load the
    state before it is meant.

    setup : finite element model, load history, geometry and observation operator; simulation : the accepted steps.
    states : names of the law's internal variables.
    """

    setup: BulgeSetup = field(repr=False)

    @property
    def model(self) -> FiniteElementModel:
        """The finite elements of the dimple."""
        return self.setup.model

    def displacement(self, radius: ArrayLike = 0.0, times: ArrayLike | None = None) -> Floats:
        """How far the top has risen, (times,) mm at one radius, (times, radii) at several.

        radius : number or (radii,) mm, at rest. times : number or (times,) s, by default those of the frames.
        """
        rows = self._at(self._profiles, times) @ surface_interpolation(self.setup.radii, radius).T
        return rows if np.ndim(radius) else np.asarray(rows[..., 0])

    def profile(self, times: ArrayLike | None = None) -> TopProfile:
        """The whole top, at the nodes of the mesh; times : number or (times,) s, by default those of the frames."""
        return TopProfile(self.setup.radii, self._at(self._profiles, times))

    def mises_range(self, times: ArrayLike | None = None, within: float | None = None) -> StressRange:
        """Least and greatest von Mises stress of the integration points at radii up to `within` mm.

        times : number or (times,) s, by default those of the frames.
        By default the whole roof, up to the radius of the cavity. The least of these depends on the mesh: it is that of
        the point nearest to where bending changes its sign.
        """
        reach = self.setup.geometry.cavity_radius if within is None else float(within)
        chosen = self.point_coordinates[:, 0] <= reach
        if not chosen.any():
            raise SolveError(f"run '{self.name}': no integration point lies within a radius of {reach:g} mm")
        values = np.maximum(self._at(self.simulation.mises[:, chosen], times), 0.0)
        return StressRange(values.min(axis=-1), values.max(axis=-1))

    def section(self, time: float | None = None, name: str = STRESS_FIELD, path: str | Path | None = None) -> Figure:
        """A picture of the deformed section, coloured by a field (see `field`), at a time; by default the last."""
        return present("reports.simulation:section_figure", self, time, name, path)

    def plot(self, path: str | Path | None = None) -> Figure:
        """A picture of what is observed, and of the pressure, over time."""
        return present("reports.simulation:outputs_figure", self, path)

    @property
    def _profiles(self) -> Floats:
        """(steps, top nodes) mm."""
        return np.asarray(self.simulation.displacements[:, self.setup.model.top, 1])


class ReducedSimulation(NamedTuple):
    """How a reduced-order model simulates: the model of a test that is set up, and the settings of the solver."""

    model_of: Callable[[BulgeSetup], ReducedOrderModel]
    settings: SolverSettings


def run_bulge(
    specimen: BulgeSettings,
    law: CreepLaw,
    values: Mapping[str, float],
    plan: History,
    reduced: ReducedSimulation | None = None,
) -> BulgeRun:
    """Simulate one test and keep all of it; by a reduced-order model, displacements alone."""
    test_setup = set_up_test(specimen, plan, {})
    kernel = kernels.lower(law, "compiled")
    theta = law.to_internal(law.values(values))[0]
    model = test_setup.model if reduced is None else reduced.model_of(test_setup)
    settings = solver_settings(specimen) if reduced is None else reduced.settings
    simulation = simulate(kernel, theta, model, test_setup.load_history, settings=settings, keep_points=reduced is None)
    rows = simulation.at(
        test_setup.observation.observe(test_setup.radii, simulation.displacements[:, test_setup.model.top, 1]),
        plan.times,
    )
    status, end_time, reason = simulation.status, simulation.end_time, simulation.reason
    largest = float(np.max(specimen.reference_stress(plan), initial=1.0))
    rate_failure = None
    if reduced is None:
        rate_failure = rate_failure_of(kernel, theta, simulation, test_setup.load_history.temperature, largest)
    if rate_failure is not None:
        status, end_time, reason = Status.NOT_CONVERGED, *rate_failure
    plan_with_setup = plan.replace(
        operator=str(test_setup.observation), geometry={**plan.geometry, **_lengths(specimen, test_setup)}
    )
    states = tuple(map(str, law.states))
    return run_from_outputs(
        BulgeRun,
        plan_with_setup,
        test_setup.observation.outputs,
        rows,
        status,
        end_time,
        reason,
        setup=test_setup,
        simulation=simulation,
        states=states,
    )


def _lengths(specimen: BulgeSettings, setup: BulgeSetup) -> dict[str, float]:
    """The lengths of the dimple, so that a written history says what was simulated; a mesh from files has none."""
    return {} if specimen.mesh is not None else {name: getattr(setup.geometry, name) for name in setup.geometry.lengths}
