"""Follower pressure: its forces, and a load stiffness that is symmetric on one dimple and not on another."""

import numpy as np
import pytest

from creepkit import kernels
from creepkit.core import address, function
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.solver import StageConditions, assemble
from creepkit.laws.norton import NORTON
from creepkit.specimens.bulge.geometry import DimpleGeometry

CLAMPED = DimpleGeometry()
FILLET = DimpleGeometry(1.0, 5.0, 1.0, 1.5, 4.0, 7.5, ("rim",))
E, NU, PRESSURE = 150e3, 0.3, 8.0
CURVED = np.array([[1.0, 1.6, 2.0], [0.5, 0.7, 1.5]])
"""Radii and heights of the nodes of a curved side."""


def force(ends: np.ndarray) -> np.ndarray:
    return side_pressure(ends)[0]


def stiffness(ends: np.ndarray) -> np.ndarray:
    """Derivatives (2, 3, 2, 3) of `force`."""
    return side_pressure(ends)[1].reshape(2, 2, 3, 3).transpose(0, 2, 1, 3)


def side_pressure(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    ends, out, slopes = np.ascontiguousarray(ends), np.empty((2, 3)), np.empty((4, 3, 3))
    function("creepkit_side_pressure", None)(*map(address, (ends, out, slopes)))
    return out, slopes


def deformed(geometry: DimpleGeometry) -> tuple[FiniteElementModel, np.ndarray]:
    """A coarse body, and displacements of up to 0.3 mm that respect what is held."""
    body = finite_element_model(geometry.mesh(0.5))
    r, z = body.nodes.T
    u = 0.3 * np.stack([np.sin(r) * np.cos(z), np.cos(0.3 * r) * z / 4], axis=1).ravel()
    return body, np.where(body.equations >= 0, u, 0.0)


def test_the_force_along_the_axis_is_the_pressure_on_the_projection() -> None:
    """With 2 pi dropped (r1^2 - r0^2)/2 whatever the side's shape, and -int r dz across."""
    assert force(CURVED)[1].sum() == pytest.approx((2.0**2 - 1.0**2) / 2, rel=1e-14)
    straight = np.array([[1.0, 1.5, 2.0], [0.0, 0.5, 1.0]])
    assert force(straight)[0].sum() == pytest.approx(-1.5, rel=1e-14)


def test_stiffness_of_a_side_is_the_derivative_of_its_force() -> None:
    step, found = 1e-5, stiffness(CURVED)
    for i in range(2):
        for a in range(3):
            move = np.zeros((2, 3))
            move[i, a] = step
            slope = (force(CURVED + move) - force(CURVED - move)) / (2 * step)
            np.testing.assert_allclose(found[:, :, i, a], slope, atol=1e-9)


def surface_stiffness(body: FiniteElementModel, u: np.ndarray) -> np.ndarray:
    """Derivatives (2 nodes, 2 nodes) of the forces of a unit pressure on the whole surface."""
    total = np.zeros((u.size, u.size))
    for nodes in body.pressed:
        numbers = 2 * nodes + np.arange(2)[:, None]
        places = body.nodes[nodes].T + u[numbers]
        total[np.ix_(numbers.ravel(), numbers.ravel())] += stiffness(places).reshape(6, 6)
    return total


def test_load_stiffness_is_symmetric_where_the_ends_are_held() -> None:
    """The bottom is clamped and the other end lies on the axis, so that the pressure has a potential, p V."""
    body, u = deformed(CLAMPED)
    free = body.equations >= 0
    inner = surface_stiffness(body, u)[np.ix_(free, free)]
    assert np.abs(inner).max() > 0.1
    np.testing.assert_allclose(inner, inner.T, atol=1e-13)


def test_load_stiffness_is_skew_at_a_free_end() -> None:
    """p V less p r^2 dz/2 at the foot of the wall: what is skew is r there, between its r and z alone."""
    body, u = deformed(FILLET)
    free = body.equations >= 0
    whole = surface_stiffness(body, u)
    foot = int(body.pressed[-1, 2])
    assert body.nodes[foot] == pytest.approx([5.0, 0.0])
    skew = whole - whole.T
    expected = np.zeros_like(skew)
    expected[2 * foot + 1, 2 * foot] = body.nodes[foot, 0] + u[2 * foot]
    expected -= expected.T
    np.testing.assert_allclose(abs(skew[np.ix_(free, free)]), abs(expected[np.ix_(free, free)]), atol=1e-13)
    assert skew[2 * foot + 1, 2 * foot] != 0.0


def tangents(geometry: DimpleGeometry) -> tuple[FiniteElementModel, np.ndarray, np.ndarray, np.ndarray]:
    """Body, displacements, the tangent that Newton's method takes, and differences of the residual, (size, size)."""
    body, u = deformed(geometry)
    kernel = kernels.lower(NORTON, "compiled")
    theta = NORTON.to_internal({"A": 1e-15, "n": 4.0})[0]
    stage = StageConditions(0.0, 0.0, 0.0, 300.0, E / (3 * (1 - 2 * NU)), E / (2 * (1 + NU)), PRESSURE)

    def residual(moved: np.ndarray) -> np.ndarray:
        return assemble(kernel, theta, body, stage, moved)[0]

    tangent = assemble(kernel, theta, body, stage, u)[1]
    slopes = np.empty_like(tangent)
    for place in np.flatnonzero(body.equations >= 0):
        move = np.zeros_like(u)
        move[place] = 1e-6
        slopes[:, body.equations[place]] = (residual(u + move) - residual(u - move)) / 2e-6
    return body, u, tangent, slopes


def test_the_tangent_is_exact_on_a_clamped_dimple() -> None:
    """Elastic, at large displacements; differences of 1e-6 mm, exact to 5e-8 of the largest entry."""
    _, _, tangent, slopes = tangents(CLAMPED)
    np.testing.assert_allclose(tangent, slopes, atol=5e-8 * np.abs(tangent).max())


def test_the_tangent_is_exact_but_for_the_foot_of_a_fillet() -> None:
    """There the symmetric part leaves out p r/2 on both sides of the diagonal, with opposite signs."""
    body, u, tangent, slopes = tangents(FILLET)
    foot = int(body.pressed[-1, 2])
    radial, axial = body.equations[2 * foot], body.equations[2 * foot + 1]
    left_out = 0.5 * PRESSURE * (body.nodes[foot, 0] + u[2 * foot])
    rest = slopes - tangent
    scale = 5e-8 * np.abs(tangent).max()
    assert abs(rest[axial, radial]) == pytest.approx(left_out, abs=scale)
    assert rest[radial, axial] == pytest.approx(-rest[axial, radial], abs=scale)
    rest[axial, radial] = rest[radial, axial] = 0.0
    np.testing.assert_allclose(rest, 0.0, atol=scale)
    assert left_out > 20 * scale
