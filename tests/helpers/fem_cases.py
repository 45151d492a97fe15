"""What the verification of the finite elements is made of: blocks and spheres, runs of them, and stresses at points."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.core import address, function
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.mesh import CORNERS, GAUSS_POINTS, Mesh, StripMesh, discretize, local_tangents, strip_mesh
from creepkit.fem.reduced_order_model import ReducedBasis
from creepkit.fem.simulation import LoadHistory, Simulation, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import CreepLaw
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
from helpers.paths import SHARED

BENCHMARKS = SHARED / "benchmarks"
"""Reference numbers of others, which lie beside the checkout."""

FREE = {"deflection_limit": np.inf, "strain_limit": np.inf}
STILL = {"A": 1e-40, "n": 1.0}
"""Norton's law for a body that does not creep: at 1e5 MPa it would take 1e27 s to."""


def block(radii, heights) -> StripMesh:
    """A block of rectangles; radii, heights : (columns + 1,) and (layers + 1,) mm."""
    radii, heights = np.asarray(radii, float), np.asarray(heights, float)
    along = np.interp(np.arange(2 * radii.size - 1) / 2, np.arange(radii.size), radii)
    below, above = (np.stack([along, np.full(along.size, z)], axis=1) for z in heights[[0, -1]])
    return strip_mesh(below, above, (heights - heights[0]) / np.ptp(heights))


def shell(inner: float, outer: float, columns: int, layers: int) -> StripMesh:
    """The upper half of a hollow sphere, from the axis to the equator; layers grow in proportion to the radius."""
    turn = np.linspace(np.pi / 2, 0, 2 * columns + 1)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    circle[0, 0] = circle[-1, 1] = 0.0
    breaks = (inner * (outer / inner) ** np.linspace(0, 1, layers + 1) - inner) / (outer - inner)
    return strip_mesh(inner * circle, outer * circle, np.clip(breaks, 0.0, 1.0))


def mesh_of(body: StripMesh, *, r=(), z=(), pressed=(), top=()) -> Mesh:
    """A strip whose nodes `r` are held in radius and whose nodes `z` are held in height."""
    held = np.zeros(body.nodes.shape, bool)
    held[np.asarray(r, int), 0] = True
    held[np.asarray(z, int), 1] = True
    return Mesh(body.nodes, body.elements, held, pressed, top)


def left_of(body: StripMesh) -> np.ndarray:
    """Sides of elements (layers, 3) along the first column line, the solid to their left."""
    return np.stack([body.first[2::2], body.first[1::2], body.first[:-2:2]], axis=1)


def right_of(body: StripMesh) -> np.ndarray:
    """Sides of elements (layers, 3) along the last column line, the solid to their left."""
    return np.stack([body.last[:-2:2], body.last[1::2], body.last[2::2]], axis=1)


@cache
def lowered(law: CreepLaw) -> CompiledLaw:
    """The compiled form of a law."""
    return kernels.lower(law, "compiled")


def course(pressure, end: float, modulus: float, poisson: float = 0.3, **more) -> LoadHistory:
    """A course at one temperature; pressure : a number or a Program, MPa."""
    pressure = pressure if isinstance(pressure, Program) else Program.constant(pressure)
    return LoadHistory(pressure, Program.constant(293.15), Program.constant(modulus), end, poisson, **more)


def run(
    mesh: Mesh, way: LoadHistory, law: CreepLaw = NORTON, values=STILL, like=None, keep=False, **settings
) -> Simulation:
    """Simulate without limits on deflection or strain, unless settings give them."""
    kernel = lowered(law)
    theta = law.to_internal(values)[0]
    settings = SolverSettings(**{**FREE, **settings})
    return simulate(
        kernel, theta, finite_element_model(mesh), way, settings=settings, same_steps_as=like, keep_points=keep
    )


def steady_velocity(mesh: Mesh, pressure, values, *, modulus: float, elastic: float, speed: float) -> np.ndarray:
    """Velocities (nodes, 2) in steady Norton creep, mm/s: those when creep has gone 40 times as far as elasticity.

    elastic, speed : sizes of the elastic displacement, mm, and of the velocity, mm/s; the former is to be so small that
        the geometry stays what it was.
    """
    way = course(pressure, 40 * elastic / speed, modulus)
    made = run(mesh, way, NORTON, values, tolerance=2 * elastic, newton=1e-3 * elastic)
    assert made.status == Status.COMPLETE
    return (made.displacements[-1] - made.displacements[-2]) / (made.times[-1] - made.times[-2])


def equal_steps(made: Simulation, count: int, first: int = 2) -> Simulation:
    """A pattern for `like`: `count` equal steps in one segment, whose first step is row `first` of the record."""
    return replace(made, positions=np.full((count + first, 2), 1.0 / count))


def coaxial_stresses(mesh: Mesh, made: Simulation, modulus: float, poisson: float, row: int = -1):
    """Radius, and the log-conjugate stresses r, z and hoop, at the points (points,) of a run without any shear.

    From the displacements and the creep strains that a run with `keep` holds; these are e_hoop and e_r - e_z.
    """
    at = discretize(mesh)
    u = made.displacements[row][mesh.elements]
    gradients = [(at.by_radius, 0), (at.by_height, 1), (at.over_radius, 0)]
    strains = np.log1p([np.einsum("epa,ea->ep", by, u[:, :, i]).ravel() for by, i in gradients])
    hoop, difference = made.values[row][:, 0], made.values[row][:, 1]
    creep = np.stack([0.5 * (difference - hoop), -0.5 * (difference + hoop), hoop])
    trace = strains.sum(axis=0)
    shear, bulk = modulus / (2 * (1 + poisson)), modulus / (3 * (1 - 2 * poisson))
    return at.points[:, :, 0].ravel(), *(2 * shear * (strains - trace / 3 - creep) + bulk * trace)


def orders(errors) -> np.ndarray:
    """Observed orders of errors that belong to twice as many parts each."""
    errors = np.abs(np.asarray(errors))
    return np.log2(errors[:-1] / errors[1:])


class MeshQuality(NamedTuple):
    """The worst of each element over its corners and integration points, 1 for a rectangle and 0 for a collapsed one.

    sine : (elements,) sine of the angle between its two local directions.
    evenness : (elements,) smallest over largest local area.
    """

    sine: Floats
    evenness: Floats


def mesh_quality(mesh: Mesh) -> MeshQuality:
    """How far the elements of a mesh are from parallelograms with right angles."""
    tangents = local_tangents(mesh.nodes[mesh.elements], np.vstack([CORNERS, GAUSS_POINTS]))
    areas = np.linalg.det(tangents)
    lengths = np.linalg.norm(tangents, axis=3).prod(axis=2)
    return MeshQuality((areas / lengths).min(axis=1), areas.min(axis=1) / areas.max(axis=1))


def full_basis(model: FiniteElementModel) -> ReducedBasis:
    """A basis of all displacements and points: finite elements themselves."""
    free = np.flatnonzero(model.equations >= 0)
    modes = np.zeros((free.size, model.equations.size))
    modes[np.arange(free.size), free] = 1.0
    points = np.arange(model.weights.size)
    return ReducedBasis(modes.reshape(free.size, -1, 2), points, np.tile(np.eye(5), (points.size, 1, 1)))


class StageConditions(ctypes.Structure):
    """As of the core's material_point.hpp."""

    names = ("weight", "log_weight", "time", "temperature", "bulk", "shear", "pressure")
    _fields_ = tuple((name, ctypes.c_double) for name in names)


def assemble(law, theta, model: FiniteElementModel, stage: StageConditions, displacement):
    """Out-of-balance forces (size,), N/rad, and tangent (size, size), N/(rad mm), of a virgin body.

    theta : (P,) internal parameters. displacement : (2 nodes,) mm. The tangent is made symmetric.
    """
    theta, displacement = (np.ascontiguousarray(values, dtype=float) for values in (theta, displacement))
    history = np.zeros((4 * model.compiled.elements, 4 + law.states))
    history[:, 4:] = law.initial
    residual, tangent = np.zeros(model.size), np.zeros((model.size, model.size))
    entries = np.array([law.update.address, law.sensitivity.address, theta.ctypes.data, theta.size, law.states])
    arrays = map(address, (history, displacement, residual, tangent))
    structure = ctypes.byref(model.compiled.structure)
    assert function("creepkit_assemble")(structure, address(entries), ctypes.byref(stage), *arrays) == 0
    return residual, tangent
