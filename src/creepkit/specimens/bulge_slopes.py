"""Exact derivatives of what a bulge test shows: through the solver, the Gaussian fit and the times of the steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError, nearest
from creepkit.fem.shape import GeometryChange, geometry_change
from creepkit.fem.simulation import Change, Simulation, differentiate
from creepkit.records import Program
from creepkit.specimens.bulge_course import MODULUS_STEP, Setup
from creepkit.specimens.dimple import DimpleGeometry

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.records import History

_NUDGE = 1e-3
"""s, by which steps are moved to difference an interpolation between steps that move."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of the outputs, (times, 3, parameters) to the law's and {name: (times, 3)} to everything else."""

    law: Floats
    effects: Mapping[str, Floats]


def slopes_of(
    made: Setup, kernel: CompiledLaw, theta: Floats, history: History, found: Simulation, profiles: Floats,
    names: Sequence[str],
) -> tuple[Floats, Slopes]:  # fmt: skip
    """Outputs (times, 3) and their derivatives.

    names : "modulus" (relative), "temperature" (K), "thickness" (mm) and any length of the dimple, "window" (mm), and
        the numbers of the loading, such as P1, P2 and Tj.
    """
    loads = [n for n in names if n != "window" and not _is_length(n)]
    lengths = [n for n in names if _is_length(n)]
    directions = np.array([_direction(made, history, name) for name in loads]).reshape(-1, *made.course.segments.shape)
    velocities = [_velocity(made.geometry, _length(name), made) for name in lengths]
    change = differentiate(kernel, theta, made.body, made.course, found, directions=directions, velocities=velocities)
    seen, pulls = made.observation.observe_with_slopes(made.radii, profiles)
    columns = pulls @ change.surface
    columns[0, 1:] = columns[1, 1:] if len(columns) > 1 else 0.0
    for k, (_, velocity) in enumerate(velocities):
        drift = velocity[made.body.top, 0]
        columns[:, :, theta.size + len(loads) + k] += made.observation.node_slopes(made.radii, profiles, drift)
    along = found.at(columns, history.times)
    effects = {}
    for k, name in enumerate(loads):
        effects[name] = along[..., theta.size + k] + _moved(found, change, directions, k, seen, history.times)
    for k, name in enumerate(lengths):
        effects[name] = along[..., theta.size + len(loads) + k]
    if "window" in names:
        effects["window"] = found.at(made.observation.window_slopes(made.radii, profiles), history.times)
    return found.at(seen, history.times), Slopes(along[..., : theta.size], effects)


def _moved(
    found: Simulation, change: Change, directions: Floats, k: int, seen: Floats, times: Floats
) -> Floats | float:
    """What the motion of the steps in time does to the interpolation between them."""
    if not change.times[:, k].any() and not directions[k, :, 0].any():
        return 0.0
    starts = directions[k, : found.timeline.starts.size, 0]
    ends = (found.timeline.moved(s * _NUDGE * change.times[:, k], s * _NUDGE * starts) for s in (1.0, -1.0))
    up, down = (line.interpolate(seen, times) for line in ends)
    return np.asarray((up - down) / (2.0 * _NUDGE))


def _is_length(name: str) -> bool:
    return name == "thickness" or name in DimpleGeometry.lengths


def _length(name: str) -> str:
    return "apex_thickness" if name == "thickness" else name


def _direction(made: Setup, history: History, name: str) -> Floats:
    """Derivative of the course's segments, (segments, 10), by a central difference, exact for what enters linearly."""
    course = made.course
    if name == "modulus":
        # measured against the modulus that the history states
        stated = history.elastic.at(float(course.temperature.values[0])).E if history.elastic else 1.0
        share = Program(course.modulus.times, course.modulus.values * (float(stated) / course.modulus.values[0]))
        return np.asarray(replace(course, modulus=share).segments * _COLUMNS["modulus"])
    if name == "temperature":
        return _by_temperature(made, history)
    loading = history.loading
    if not isinstance(getattr(loading, name, None), Real):
        known = ("modulus", "temperature", "thickness", "window", *getattr(loading, "__dataclass_fields__", ()))
        raise SolveError(f"history '{history.name}': no derivative to '{name}' is known; {nearest(name, known)}")
    value = float(getattr(loading, name))
    step = 1e-4 * max(abs(value), 1e-3)
    up, down = (
        replace(course, pressure=replace(loading, **{name: value + s}).program()).segments  # type: ignore[type-var]
        for s in (step, -step)
    )
    return np.asarray((up - down) / (2.0 * step))


_COLUMNS = {
    "modulus": np.array([0, 0, 0, 0, 0, 0, 1, 1, 0, 0.0]),
    "temperature": np.array([0, 0, 0, 0, 1, 1, 0, 0, 0, 0.0]),
}


def _by_temperature(made: Setup, history: History) -> Floats:
    """One kelvin more in every temperature, and the modulus that goes with it."""
    course = made.course
    direction: Floats = np.zeros_like(course.segments) + _COLUMNS["temperature"]
    if history.elastic is None:
        return np.asarray(direction)
    warmth = course.temperature.values
    stated = [float(history.elastic.at(float(T)).E) for T in warmth]
    factor = course.modulus.values / np.array(stated)
    up, down = (
        np.array([float(history.elastic.at(float(T) + s).E) for T in warmth]) for s in (MODULUS_STEP, -MODULUS_STEP)
    )
    slope = Program(course.modulus.times, factor * (up - down) / (2.0 * MODULUS_STEP))
    stiffer: Floats = replace(course, modulus=slope).segments * _COLUMNS["modulus"]
    return np.asarray(direction + stiffer)


@lru_cache(maxsize=256)
def _velocity_of(geometry: DimpleGeometry, refinement: float, name: str) -> tuple[GeometryChange, Floats]:
    velocity = geometry.mesh_velocity(name, refinement)
    return geometry_change(geometry.mesh(refinement), velocity), velocity


def _velocity(geometry: DimpleGeometry, name: str, made: Setup) -> tuple[GeometryChange, Floats]:
    if made.refinement is None:
        raise SolveError(f"a mesh from files does not say how it follows {name}; use the structured mesh instead")
    return _velocity_of(geometry, made.refinement, name)
