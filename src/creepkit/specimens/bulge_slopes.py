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
from creepkit.fem.shape import GeometryDerivative, geometry_derivative
from creepkit.fem.simulation import SurfaceSensitivities, Simulation, sensitivities
from creepkit.records import Program
from creepkit.specimens.bulge_course import MODULUS_TEMPERATURE_STEP, TestSetup
from creepkit.specimens.dimple import DimpleGeometry

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.records import History

_TIME_SHIFT = 1e-3
"""s, by which steps are moved to difference an interpolation between steps that move."""


@dataclass(frozen=True, eq=False)
class BulgeSensitivities:
    """Derivatives of the outputs, (times, 3, parameters) to the law's and {name: (times, 3)} to everything else."""

    law: Floats
    nuisances: Mapping[str, Floats]


def output_sensitivities(
    setup: TestSetup, kernel: CompiledLaw, theta: Floats, history: History, simulation: Simulation, profiles: Floats,
    names: Sequence[str],
) -> tuple[Floats, BulgeSensitivities]:  # fmt: skip
    """Outputs (times, 3) and their derivatives.

    names : "modulus" (relative), "temperature" (K), "thickness" (mm) and any length of the dimple, "window" (mm), and
        the numbers of the loading, such as P1, P2 and Tj.
    """
    loads = [n for n in names if n != "window" and not _is_dimension(n)]
    lengths = [n for n in names if _is_dimension(n)]
    directions = np.array([_direction(setup, history, name) for name in loads]).reshape(-1, *setup.load_history.segments.shape)
    velocities = [_velocity(setup.geometry, _dimension_name(name), setup) for name in lengths]
    change = sensitivities(kernel, theta, setup.model, setup.load_history, simulation, directions=directions, velocities=velocities)
    outputs, output_derivatives = setup.observation.observe_with_derivatives(setup.radii, profiles)
    output_columns = output_derivatives @ change.surface
    output_columns[0, 1:] = output_columns[1, 1:] if len(output_columns) > 1 else 0.0
    for k, (_, velocity) in enumerate(velocities):
        radial_velocity = velocity[setup.model.top, 0]
        output_columns[:, :, theta.size + len(loads) + k] += setup.observation.node_derivatives(setup.radii, profiles, radial_velocity)
    along = simulation.at(output_columns, history.times)
    nuisances = {}
    for k, name in enumerate(loads):
        nuisances[name] = along[..., theta.size + k] + _step_time_derivative(simulation, change, directions, k, outputs, history.times)
    for k, name in enumerate(lengths):
        nuisances[name] = along[..., theta.size + len(loads) + k]
    if "window" in names:
        nuisances["window"] = simulation.at(setup.observation.window_derivatives(setup.radii, profiles), history.times)
    return simulation.at(outputs, history.times), BulgeSensitivities(along[..., : theta.size], nuisances)


def _step_time_derivative(
    simulation: Simulation, change: SurfaceSensitivities, directions: Floats, k: int, outputs: Floats, times: Floats
) -> Floats | float:
    """What the motion of the steps in time does to the interpolation between them."""
    if not change.times[:, k].any() and not directions[k, :, 0].any():
        return 0.0
    starts = directions[k, : simulation.timeline.starts.size, 0]
    ends = (simulation.timeline.moved(s * _TIME_SHIFT * change.times[:, k], s * _TIME_SHIFT * starts) for s in (1.0, -1.0))
    up, down = (line.interpolate(outputs, times) for line in ends)
    return np.asarray((up - down) / (2.0 * _TIME_SHIFT))


def _is_dimension(name: str) -> bool:
    return name == "thickness" or name in DimpleGeometry.lengths


def _dimension_name(name: str) -> str:
    return "apex_thickness" if name == "thickness" else name


def _direction(setup: TestSetup, history: History, name: str) -> Floats:
    """Derivative of the course's segments, (segments, 10), by a central difference, exact for what enters linearly."""
    load_history = setup.load_history
    if name == "modulus":
        # measured against the modulus that the history states
        given_value = history.elastic.at(float(load_history.temperature.values[0])).E if history.elastic else 1.0
        share = Program(load_history.modulus.times, load_history.modulus.values * (float(given_value) / load_history.modulus.values[0]))
        return np.asarray(replace(load_history, modulus=share).segments * _COLUMNS["modulus"])
    if name == "temperature":
        return _by_temperature(setup, history)
    loading = history.loading
    if not isinstance(getattr(loading, name, None), Real):
        known = ("modulus", "temperature", "thickness", "window", *getattr(loading, "__dataclass_fields__", ()))
        raise SolveError(f"history '{history.name}': no derivative to '{name}' is known; {nearest(name, known)}")
    value = float(getattr(loading, name))
    step = 1e-4 * max(abs(value), 1e-3)
    up, down = (
        replace(load_history, pressure=replace(loading, **{name: value + s}).program()).segments  # type: ignore[type-var]
        for s in (step, -step)
    )
    return np.asarray((up - down) / (2.0 * step))


_COLUMNS = {
    "modulus": np.array([0, 0, 0, 0, 0, 0, 1, 1, 0, 0.0]),
    "temperature": np.array([0, 0, 0, 0, 1, 1, 0, 0, 0, 0.0]),
}


def _by_temperature(setup: TestSetup, history: History) -> Floats:
    """One kelvin more in every temperature, and the modulus that goes with it."""
    load_history = setup.load_history
    direction: Floats = np.zeros_like(load_history.segments) + _COLUMNS["temperature"]
    if history.elastic is None:
        return np.asarray(direction)
    temperature = load_history.temperature.values
    given_modulus = [float(history.elastic.at(float(T)).E) for T in temperature]
    factor = load_history.modulus.values / np.array(given_modulus)
    up, down = (
        np.array([float(history.elastic.at(float(T) + s).E) for T in temperature]) for s in (MODULUS_TEMPERATURE_STEP, -MODULUS_TEMPERATURE_STEP)
    )
    slope = Program(load_history.modulus.times, factor * (up - down) / (2.0 * MODULUS_TEMPERATURE_STEP))
    modulus_changes: Floats = replace(load_history, modulus=slope).segments * _COLUMNS["modulus"]
    return np.asarray(direction + modulus_changes)


@lru_cache(maxsize=256)
def _velocity_of(geometry: DimpleGeometry, refinement: float, name: str) -> tuple[GeometryDerivative, Floats]:
    velocity = geometry.mesh_velocity(name, refinement)
    return geometry_derivative(geometry.mesh(refinement), velocity), velocity


def _velocity(geometry: DimpleGeometry, name: str, setup: TestSetup) -> tuple[GeometryDerivative, Floats]:
    if setup.refinement is None:
        raise SolveError(f"a mesh from files does not say how it follows {name}; use the structured mesh instead")
    return _velocity_of(geometry, setup.refinement, name)
