"""Contact with rigid circles: its tangent against differences, and a ball pressed on a block against Hertz."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

import creepkit as ck
from creepkit import kernels
from creepkit.core import address, function
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.laws.norton import NORTON
from creepkit.records import Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from helpers.fem_cases import StageConditions, assemble

E, NU = 2e5, 0.3


def graded(count: int) -> np.ndarray:
    """Boundaries (count + 1,) of elements from 0 to 1, the last 400 times as long as the first."""
    ends = np.concatenate([[0.0], np.cumsum(400.0 ** np.linspace(0.0, 1.0, count))])
    return ends / ends[-1]


@dataclass(frozen=True)
class BallOnBlock(ck.Axisymmetric):
    """A cylinder of 100 mm radius and height on a plane, a rigid ball of 50 mm radius pressed on it."""

    stiffness: float = 4e7

    name, title = "ball-on-block", "Ball on a block"
    outputs = (ck.Output("approach", "length", noise=1e-3),)
    loads = (ck.Load("force", "force"),)

    def section(self, load: str) -> ck.Section:
        ends = graded(self.elements(24))
        block = ck.Section.rectangle((0.0, -100.0), (100.0, 0.0), ends, 1.0 - ends[::-1]).hold("bottom", z=True)
        ball = {"name": "ball", "force": -1.0, "stiffness": self.stiffness, "smoothing": 1e-5}
        return block.touch("top", (0.0, 50.0), (0.0, 0.0), **ball)

    def observe(self, displacements: ck.Displacements) -> Mapping[str, np.ndarray]:
        return {"approach": -displacements.axial("ball")}


@pytest.mark.parametrize("force", [1000.0, 8000.0])
@pytest.mark.long_when_sanitized
def test_a_ball_on_a_block_comes_nearer_as_hertz_says(force: float) -> None:
    """K. L. Johnson, Contact Mechanics, 1985, (4.23), less what a half space moves 100 mm below: F/(pi E* 100 mm)."""
    block = BallOnBlock(refinement=2.0, resolution=1e-6, tolerance=1e-3)
    run = ck.simulate(
        "norton", block, {"A": 1e-40, "n": 1.0}, loading=ck.constant_load("force", force), temperature=900.0,
        elastic=ck.Elastic(E=E, nu=NU), times=[1.0],
    )  # fmt: skip
    plane = E / (1.0 - NU**2)
    known = (9.0 * force**2 / (16.0 * plane**2 * 50.0)) ** (1 / 3) - force / (np.pi * plane * 100.0)
    assert run.outputs["approach"][0] == pytest.approx(known, rel=5e-3)


def test_the_tangent_of_contact_is_that_of_differences() -> None:
    """At displacements that press the ball, the free one and a held ring, into the block, in some places barely."""
    section = BallOnBlock(refinement=0.5).section("force")
    section = section.touch("top", (30.0, 5.0), (30.0, 0.1), name="ring", stiffness=1e5, smoothing=0.3)
    model = section.model(np.zeros(0, dtype=np.int64))
    law = ck.law("norton")
    kernel = kernels.lower(law, "compiled")
    theta = law.to_internal(law.values({"A": 1e-40, "n": 1.0}))[0]
    stage = StageConditions(0.0, 0.0, 0.0, 900.0, E / (3 * (1 - 2 * NU)), E / (2 * (1 + NU)), 1000.0)
    random = np.random.default_rng(3)
    free = model.equations >= 0
    u = np.zeros(model.equations.size)
    u[free] = 2e-3 * random.normal(size=model.size)[model.equations[free]]
    u[2 * section.points["ball"] + 1] = u[2 * section.points["ball"] - 1] = -0.02
    _, tangent = assemble(kernel, theta, model, stage, u)
    touching = model.equations[np.unique(2 * model.contacts[:, :3] + 1)]
    for k in [model.bordered, *touching[touching >= 0][::3]]:
        step = 1e-6 * (model.equations == k)
        up, down = (assemble(kernel, theta, model, stage, u + s * step)[0] for s in (1.0, -1.0))
        known = (up - down) / 2e-6
        assert np.abs(tangent[:, k] - known).max() <= 1e-5 * np.abs(known).max()
    assert np.abs(tangent[:-1, -1]).max() > 0.0


@pytest.mark.long_when_sanitized
def test_a_body_leaves_when_its_force_does() -> None:
    """Unloaded, the elastic block is as at first: the ball, then free, has moved back up."""
    steps = ck.load_steps("force", [(0.0, 1000.0), (100.0, 0.0), (200.0, 1000.0)])
    run = ck.simulate(
        "norton", BallOnBlock(resolution=1e-6), {"A": 1e-40, "n": 1.0}, loading=steps, elastic=ck.Elastic(E=E, nu=NU),
        temperature=900.0, times=[50.0, 150.0, 250.0],
    )  # fmt: skip
    loaded, unloaded, again = run.outputs["approach"]
    assert run.status is Status.COMPLETE
    assert abs(unloaded) < 0.02 * loaded
    assert again == pytest.approx(loaded, rel=1e-4)


# ---- pressure --------------------------------------------------------------------------------------------------------

# Follower pressure: its forces, and a load stiffness that is symmetric on one dimple and not on another.


CLAMPED = DimpleGeometry()
FILLET = DimpleGeometry(1.0, 5.0, 1.0, 1.5, 4.0, 7.5, ("rim",))
MODULUS, POISSON, PRESSURE = 150e3, 0.3, 8.0
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


def tangents(geometry: DimpleGeometry) -> tuple[FiniteElementModel, np.ndarray, np.ndarray, np.ndarray]:
    """Body, displacements, the tangent that Newton's method takes, and differences of the residual, (size, size)."""
    body, u = deformed(geometry)
    kernel = kernels.lower(NORTON, "compiled")
    theta = NORTON.to_internal({"A": 1e-15, "n": 4.0})[0]
    stage = StageConditions(
        0.0, 0.0, 0.0, 300.0, MODULUS / (3 * (1 - 2 * POISSON)), MODULUS / (2 * (1 + POISSON)), PRESSURE
    )

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
