"""Contact with rigid circles: its tangent against differences, and a ball pressed on a block against Hertz."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

import creepkit as ck
from creepkit import kernels
from creepkit.errors import SolveError
from creepkit.fem.solver import StageConditions, assemble
from creepkit.records import Status

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


def test_one_body_moves_at_most() -> None:
    section = BallOnBlock().section("force")
    two = section.touch("top", (60.0, 5.0), (60.0, 0.0), name="ring", force=-1.0)
    with pytest.raises(SolveError, match="2 rigid bodies of a section move freely; allowed is one"):
        two.model(np.zeros(0, dtype=np.int64))
