"""BulgeRun: one simulated bulge test with displacements, stresses and strains at any time until its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError, nearest
from creepkit.fem.mesh import GAUSS_POINTS, shape_functions, surface_interpolation
from creepkit.fem.simulation import Simulation, simulate
from creepkit.fem.solver import EQUIVALENT_STRAIN
from creepkit.kernels.interface import (
    MEAN_STRESS,
    POINT_SIZE,
    PRINCIPAL_STRESS,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
    call_entry,
)
from creepkit.kernels.rate_jumps import find_rate_jump
from creepkit.presentation import present
from creepkit.records import History, Status
from creepkit.specimens.bulge.finite_elements import solver_settings
from creepkit.specimens.bulge.observation import OBSERVED
from creepkit.specimens.bulge.setup import BulgeSetup, set_up_test
from creepkit.specimens.run import Run, run_from_outputs

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw


if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge.settings import BulgeSettings


def uniaxial_points(stresses: Floats, strains: Floats, states: Floats, time: float, temperature: float) -> Floats:
    """Points of a law, (points, 6 + S), under uniaxial stress; stress and strain a little above zero at least.

    stresses : (points,) MPa. strains : (points,). states : (points, S).
    """
    points = np.zeros((stresses.size, POINT_SIZE + states.shape[1]))
    points[:, STRESS] = points[:, PRINCIPAL_STRESS] = np.maximum(stresses, 1e-3)
    points[:, MEAN_STRESS] = points[:, STRESS] / 3.0
    points[:, STRAIN], points[:, TIME], points[:, TEMPERATURE] = np.maximum(strains, 1e-9), time, temperature
    points[:, POINT_SIZE:] = states
    return points


def missing_rate_message(law: CompiledLaw, theta: Floats, points: Floats) -> str:
    """The first of these points where the law has no rate, or one without derivatives, in words; empty when none is.

    theta : (parameters,) internal values. points : (points, 6 + S).
    Kernels floor what they take logarithms of: where an equation has no number, such as the logarithm of something
    negative, its rate may look small instead, but then its derivatives are not finite. A rate too large for a number
    is one: its logarithm is what the integration works with.
    """
    rates, flags = call_entry(law, "update", points, theta)
    if not flags:
        return ""
    bad = np.flatnonzero(~np.isfinite(rates).all(axis=1))
    point = points[bad[:1]]
    stress, strain, time, temperature = point[0, [STRESS, STRAIN, TIME, TEMPERATURE]]
    return (
        f"law has no finite creep rate, or none with derivatives, at a stress of {stress:.4g} MPa, a creep strain of "
        f"{strain:.3g}, {time:.4g} s and {temperature:.4g} K"
    )


def rate_jump_message(law: CompiledLaw, theta: Floats, point: Floats, stresses: tuple[float, float]) -> str:
    """Where the creep rate jumps between two stresses, MPa, in words; empty where it does not.

    theta : (parameters,) internal values. point : (6 + S,), whose stresses are replaced.
    A point whose stress meets a jump would have to creep at a rate between the two: no implicit step finds one.
    """

    def log_rates(levels: Floats) -> Floats:
        states = np.tile(point[POINT_SIZE:], (levels.size, 1))
        strains = np.full(levels.size, point[STRAIN])
        rows = uniaxial_points(levels, strains, states, float(point[TIME]), float(point[TEMPERATURE]))
        return np.asarray(call_entry(law, "update", rows, theta)[0][:, 0])

    jump = find_rate_jump(log_rates, *stresses)
    if jump is None:
        return ""
    before, after = np.exp([jump.before, jump.after])
    return (
        f"the law's creep rate jumps from {before:.3g} to {after:.3g} 1/s at a stress of {jump.place:.4g} MPa, where "
        "no equilibrium is found; let the branches of the law meet there, or blend them"
    )


STRESS_FIELD, CREEP_STRAIN_FIELD = "stress", "creep strain"


class TopProfile(NamedTuple):
    """The top of the dimple: radii (nodes,) at rest, mm; displacement : (times, nodes) mm, how far each has risen."""

    radii: Floats
    displacement: Floats


class StressRange(NamedTuple):
    """Least and greatest von Mises stress; low, high : (times,) MPa."""

    low: Floats
    high: Floats


class FieldValues(NamedTuple):
    """A quantity at the integration points.

    points : (points, 2) r and z at rest, mm. values : (times, points).
    """

    points: Floats
    values: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class BulgeRun(Run):
    """A simulated bulge test.

    `times` below are s and by default those of the run. A number instead of an array takes its axis away from the
    result; a time after the end is refused, for nothing is known there. At the time of a sudden change of load the
    state before it is meant.

    setup : finite element model, load history, geometry and observation operator; simulation : the accepted steps.
    states : names of the law's internal variables.
    """

    setup: BulgeSetup = field(repr=False)
    simulation: Simulation = field(repr=False)
    states: tuple[str, ...] = ()

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

    def field(self, name: str = STRESS_FIELD, times: ArrayLike | None = None) -> FieldValues:
        """Von Mises "stress" (MPa), equivalent "creep strain" or a state of the law by its name, at all points.

        times : number or (times,) s, by default those of the frames.
        """
        values = self._at(self._field_at_steps(name), times)
        return FieldValues(
            self.point_coordinates, np.maximum(values, 0.0) if name in (STRESS_FIELD, CREEP_STRAIN_FIELD) else values
        )

    def section(self, time: float | None = None, name: str = STRESS_FIELD, path: str | Path | None = None) -> Figure:
        """A picture of the deformed section, coloured by a field (see `field`), at a time; by default the last."""
        return present(self, "section", time, name, path)

    def plot(self, path: str | Path | None = None) -> Figure:
        """A picture of amplitude, width, shape and pressure over time."""
        return present(self, "plot", path)

    @property
    def point_coordinates(self) -> Floats:
        """(points, 2) r and z of the integration points at rest, mm; four an element, in the order of the mesh."""
        body = self.setup.model
        return np.asarray(
            np.einsum("pa,eai->epi", shape_functions(GAUSS_POINTS), body.nodes[body.elements]).reshape(-1, 2)
        )

    @property
    def _profiles(self) -> Floats:
        """(steps, top nodes) mm."""
        return np.asarray(self.simulation.displacements[:, self.setup.model.top, 1])

    def _field_at_steps(self, name: str) -> Floats:
        """Values of a field at the accepted steps, (steps, points)."""
        assert self.simulation.values is not None
        if name == STRESS_FIELD:
            return self.simulation.mises
        known = (CREEP_STRAIN_FIELD, *self.states)
        if name not in known:
            raise SolveError(f"a bulge run has no field '{name}'; {nearest(name, (STRESS_FIELD, *known))}")
        return np.asarray(self.simulation.values[:, :, EQUIVALENT_STRAIN + known.index(name)])

    def _at(self, steps: Floats, times: ArrayLike | None) -> Floats:
        """Values (steps, ...) at times, (times, ...), or (...) at one time; refuses times after the end."""
        wanted = self.times if times is None else np.asarray(times, float)
        reach = self.end_time
        outside = ~((wanted >= 0.0) & (wanted <= reach * (1 + 1e-12)))
        if outside.any():
            why = f" ({self.reason})" if self.reason else ""
            time = float(np.atleast_1d(wanted)[np.atleast_1d(outside)][0])
            raise SolveError(
                f"run '{self.name}': nothing is known at {time:g} s; the simulation reaches from 0 to {reach:g} s{why}"
            )
        rows = self.simulation.at(steps, wanted)
        return rows if wanted.ndim else np.asarray(rows[0])


def run_bulge(specimen: BulgeSettings, law: CreepLaw, values: Mapping[str, float], plan: History) -> BulgeRun:
    """Simulate one test and keep all of it."""
    test_setup = set_up_test(specimen, plan, {})
    kernel = kernels.lower(law, "compiled")
    theta = law.to_internal(law.values(values))[0]
    simulation = simulate(
        kernel, theta, test_setup.model, test_setup.load_history, settings=solver_settings(specimen), keep_points=True
    )
    rows = simulation.at(
        test_setup.observation.observe(test_setup.radii, simulation.displacements[:, test_setup.model.top, 1]),
        plan.times,
    )
    status, end_time, reason = simulation.status, simulation.end_time, simulation.reason
    rate_failure = _rate_failure(specimen, kernel, theta, plan, test_setup, simulation)
    if rate_failure is not None:
        status, end_time, reason = Status.NOT_CONVERGED, *rate_failure
    plan_with_setup = plan.replace(
        operator=str(test_setup.observation), geometry={**plan.geometry, **_lengths(specimen, test_setup)}
    )
    states = tuple(map(str, law.states))
    return run_from_outputs(
        BulgeRun,
        plan_with_setup,
        OBSERVED,
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


def _rate_failure(
    specimen: BulgeSettings,
    kernel: CompiledLaw,
    theta: Floats,
    plan: History,
    setup: BulgeSetup,
    simulation: Simulation,
) -> tuple[float, str] | None:
    """Until when the law had a creep rate, and where it has none: at any step, and beyond an early end.

    A simulation that stopped was on its way to other stresses, at most a few times those that stand for the test.
    """
    assert simulation.values is not None
    temperatures = setup.load_history.temperature.at(simulation.times)
    for k in range(1, simulation.times.size):
        strains, states = simulation.values[k, :, EQUIVALENT_STRAIN], simulation.values[k, :, EQUIVALENT_STRAIN + 1 :]
        points = uniaxial_points(
            simulation.mises[k], strains, states, float(simulation.times[k]), float(temperatures[k])
        )
        reason = missing_rate_message(kernel, theta, points)
        if reason:
            return float(simulation.times[k - 1]), reason
    if simulation.status is Status.COMPLETE:
        return None
    stresses = np.geomspace(0.1, 4.0, 9) * float(np.max(specimen.reference_stress(plan), initial=1.0))
    worst = simulation.values[-1, np.argmax(simulation.values[-1, :, EQUIVALENT_STRAIN])]
    strains, states = np.full(9, worst[EQUIVALENT_STRAIN]), np.tile(worst[EQUIVALENT_STRAIN + 1 :], (9, 1))
    reason = missing_rate_message(
        kernel,
        theta,
        uniaxial_points(stresses, strains, states, max(simulation.end_time, 1.0), float(temperatures[-1])),
    )
    if not reason and simulation.status is Status.NOT_CONVERGED:
        end, temperature = simulation.end_time, float(temperatures[-1])
        point = uniaxial_points(stresses[:1], strains[:1], states[:1], end, temperature)[0]
        jump = rate_jump_message(kernel, theta, point, (float(stresses[0]), float(stresses[-1])))
        reason = f"{simulation.reason}: {jump}" if jump else ""
    return (simulation.end_time, reason) if reason else None
