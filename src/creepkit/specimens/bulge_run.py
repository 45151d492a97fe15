"""BulgeRun: one simulated bulge test with all that is inside the dimple, at any time until its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError, nearest
from creepkit.fem.material import EQUIVALENT
from creepkit.fem.shape import POINTS, shape_functions
from creepkit.fem.simulation import Simulation, simulate
from creepkit.records import History, Status
from creepkit.specimens.bulge_course import Setup, setup
from creepkit.specimens.bulge_prediction import settings_of
from creepkit.specimens.observation import OBSERVED
from creepkit.specimens.rate_check import fault_of, points_at
from creepkit.specimens.run import Run, run_of
from creepkit.specimens.top_profile import interpolation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge import Bulge

STRESS, CREEP_STRAIN = "stress", "creep strain"


class Profile(NamedTuple):
    """The top of the dimple: radii (nodes,) at rest, mm, and how far each has risen, (times, nodes) mm."""

    radii: Floats
    displacement: Floats


class Range(NamedTuple):
    """Least and greatest von Mises stress, (times,) MPa."""

    low: Floats
    high: Floats


class Field(NamedTuple):
    """A quantity at the integration points: places (points, 2), r and z at rest in mm, and values (times, points)."""

    places: Floats
    values: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class BulgeRun(Run):
    """A simulated bulge test.

    `times` below are s and by default those of the run. A number instead of an array takes its axis away from the
    answer; a time after the end is refused, for nothing is known there. At the time of a sudden change of load the
    state before it is meant.

    made : body, course, geometry and observation operator; simulation : the accepted steps.
    states : names of the law's internal variables.
    """

    made: Setup = field(repr=False)
    simulation: Simulation = field(repr=False)
    states: tuple[str, ...] = ()

    def displacement(self, radius: ArrayLike = 0.0, times: ArrayLike | None = None) -> Floats:
        """How far the top has risen at a radius (mm, at rest), (times,) mm, or at several, (times, radii)."""
        rows = self._at(self._profiles, times) @ interpolation(self.made.radii, radius).T
        return rows if np.ndim(radius) else np.asarray(rows[..., 0])

    def profile(self, times: ArrayLike | None = None) -> Profile:
        """The whole top, at the nodes of the mesh."""
        return Profile(self.made.radii, self._at(self._profiles, times))

    def mises_range(self, times: ArrayLike | None = None, within: float | None = None) -> Range:
        """Least and greatest von Mises stress of the integration points at radii up to `within` mm.

        By default the whole roof, up to the radius of the cavity. The least of these hangs on the mesh: it is that of
        the point nearest to where bending changes its sign.
        """
        reach = self.made.geometry.cavity_radius if within is None else float(within)
        chosen = self.places[:, 0] <= reach
        if not chosen.any():
            raise SolveError(f"run '{self.name}': no integration point lies within a radius of {reach:g} mm")
        values = np.maximum(self._at(self.simulation.mises[:, chosen], times), 0.0)
        return Range(values.min(axis=-1), values.max(axis=-1))

    def field(self, name: str = STRESS, times: ArrayLike | None = None) -> Field:
        """Von Mises "stress" (MPa), equivalent "creep strain" or a state of the law by its name, at all points."""
        values = self._at(self._kept(name), times)
        return Field(self.places, np.maximum(values, 0.0) if name in (STRESS, CREEP_STRAIN) else values)

    def section(self, time: float | None = None, name: str = STRESS, path: str | Path | None = None) -> Figure:
        """A picture of the deformed section, coloured by a field (see `field`), at a time; by default the last."""
        from creepkit.specimens.bulge_pictures import section

        return section(self, float(self.times[-1]) if time is None else float(time), name, path)

    def plot(self, path: str | Path | None = None) -> Figure:
        """A picture of amplitude, width, shape and pressure over time."""
        from creepkit.specimens.bulge_pictures import outputs

        return outputs(self, path)

    @property
    def places(self) -> Floats:
        """(points, 2) r and z of the integration points at rest, mm; four an element, in the order of the mesh."""
        body = self.made.body
        return np.asarray(np.einsum("pa,eai->epi", shape_functions(POINTS), body.nodes[body.elements]).reshape(-1, 2))

    @property
    def _profiles(self) -> Floats:
        """(steps, top nodes) mm."""
        return np.asarray(self.simulation.displacements[:, self.made.body.top, 1])

    def _kept(self, name: str) -> Floats:
        """Values of a field at the accepted steps, (steps, points)."""
        assert self.simulation.values is not None
        if name == STRESS:
            return self.simulation.mises
        known = (CREEP_STRAIN, *self.states)
        if name not in known:
            raise SolveError(f"a bulge run has no field '{name}'; {nearest(name, (STRESS, *known))}")
        return np.asarray(self.simulation.values[:, :, EQUIVALENT + known.index(name)])

    def _at(self, steps: Floats, times: ArrayLike | None) -> Floats:
        """Values (steps, ...) at times, (times, ...), or (...) at one time; refuses times after the end."""
        wanted = self.times if times is None else np.asarray(times, float)
        reach = self.end_time
        outside = ~((wanted >= 0.0) & (wanted <= reach * (1 + 1e-12)))
        if outside.any():
            why = f" ({self.reason})" if self.reason else ""
            found = float(np.atleast_1d(wanted)[np.atleast_1d(outside)][0])
            raise SolveError(
                f"run '{self.name}': nothing is known at {found:g} s; the simulation reaches from 0 to {reach:g} s{why}"
            )
        rows = self.simulation.at(steps, wanted)
        return rows if wanted.ndim else np.asarray(rows[0])


def run(specimen: Bulge, law: CreepLaw, values: Mapping[str, float], plan: History) -> BulgeRun:
    """Simulate one test and keep all of it."""
    made = setup(specimen, plan, {})
    kernel = kernels.lower(law, "numba")
    theta = kernel.internal(law.values(values))[0]
    found = simulate(kernel, theta, made.body, made.course, settings=settings_of(specimen), keep_points=True)
    rows = found.at(made.observation.observe(made.radii, found.displacements[:, made.body.top, 1]), plan.times)
    status, end_time, reason = found.status, found.end_time, found.reason
    fault = _fault(specimen, kernel, theta, plan, made, found)
    if fault is not None:
        status, end_time, reason = Status.NOT_CONVERGED, *fault
    told = plan.replace(operator=str(made.observation), geometry={**plan.geometry, **_lengths(specimen, made)})
    states = tuple(map(str, law.states))
    return run_of(BulgeRun, told, OBSERVED, rows, status, end_time, reason, made=made, simulation=found, states=states)


def _lengths(specimen: Bulge, made: Setup) -> dict[str, float]:
    """The lengths of the dimple, so that a written history says what was simulated; a mesh from files has none."""
    return {} if specimen.mesh is not None else {name: getattr(made.geometry, name) for name in made.geometry.lengths}


def _fault(
    specimen: Bulge, kernel: CompiledLaw, theta: Floats, plan: History, made: Setup, found: Simulation
) -> tuple[float, str] | None:
    """Until when the law had a creep rate, and where it has none: at any step, and beyond an early end.

    A simulation that stopped was on its way to other stresses, at most a few times those that stand for the test.
    """
    assert found.values is not None
    warmth = made.course.temperature.at(found.times)
    for k in range(1, found.times.size):
        strains, states = found.values[k, :, EQUIVALENT], found.values[k, :, EQUIVALENT + 1 :]
        points = points_at(found.mises[k], strains, states, float(found.times[k]), float(warmth[k]))
        reason = fault_of(kernel, theta, points)
        if reason:
            return float(found.times[k - 1]), reason
    if found.status is Status.COMPLETE:
        return None
    stresses = np.geomspace(0.1, 4.0, 9) * float(np.max(specimen.reference_stress(plan), initial=1.0))
    worst = found.values[-1, np.argmax(found.values[-1, :, EQUIVALENT])]
    strains, states = np.full(9, worst[EQUIVALENT]), np.tile(worst[EQUIVALENT + 1 :], (9, 1))
    reason = fault_of(kernel, theta, points_at(stresses, strains, states, max(found.end_time, 1.0), float(warmth[-1])))
    return (found.end_time, reason) if reason else None
