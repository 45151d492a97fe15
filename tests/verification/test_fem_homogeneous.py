"""Bodies of uniform strain at any size of it: the patch test, and creep of a bar of one element."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.fem.mesh import Mesh
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import Program, Status
from helpers.fem_cases import block, course, equal_steps, mesh_of, orders, right_of, run

E, NU = 1e5, 0.3
STRETCH = np.array([0.3, -0.2])
"""Displacements over r and z: radius 1.3, height 0.8."""


@pytest.fixture(scope="module")
def patch() -> tuple[Mesh, np.ndarray]:
    """Nine elements between r = 1 and 2 whose inner corners lie anywhere, and whether a node is held."""
    body = block(np.linspace(1, 2, 4), np.linspace(0, 1.5, 4))
    outside = np.unique(np.concatenate([body.inner_line, body.outer_line, body.first, body.last]))
    nodes, corners = body.nodes.copy(), np.unique(body.elements[:, :4])
    inside = np.setdiff1d(corners, outside)
    nodes[inside] += np.random.default_rng(3).uniform(-0.1, 0.1, (inside.size, 2))
    for k in range(4):
        nodes[body.elements[:, 4 + k]] = nodes[body.elements[:, [k, (k + 1) % 4]]].mean(axis=1)
    return mesh_of(body._replace(nodes=nodes), r=outside, z=outside), outside


@pytest.mark.parametrize("law", [NORTON, STRAIN_HARDENING], ids=lambda law: law.name)
def test_patch(patch, law) -> None:
    """Boundary displacements linear in r and z give such displacements inside, and one stress everywhere.

    With straight sides and nodes in their middles the 2 x 2 points integrate r N and r dN/dr exactly, so a uniform
    stress balances to the last digits: 1e-9 of the strain is the tolerance of Newton's method.
    """
    mesh, outside = patch
    imposed = mesh.nodes * STRETCH
    way = course(0.0, 1000.0, E, pattern=imposed, motion=Program.constant(1.0))
    made = run(mesh, way, law, {"A": 1e-20, "n": 4, "m": -0.5} if law is STRAIN_HARDENING else {"A": 1e-20, "n": 4},
               newton=1e-9)  # fmt: skip
    assert made.status == Status.COMPLETE
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), outside)
    assert inner.size == 16
    for row in (1, -1):
        np.testing.assert_allclose(made.displacements[row][inner], imposed[inner], atol=1e-9)
        np.testing.assert_allclose(made.mises[row], made.mises[row, 0], rtol=1e-9)
    assert made.mises[-1, 0] < 0.9 * made.mises[1, 0]


def test_elastic_stress_of_a_patch_is_that_of_logarithmic_strain(patch) -> None:
    """von Mises 2G |ln 1.3 - ln 0.8| / J, J = 1.3^2 0.8: two equal stretches, Cauchy stress of Hencky's law."""
    mesh, _ = patch
    made = run(mesh, course(0.0, 1.0, E, pattern=mesh.nodes * STRETCH, motion=Program.constant(1.0)), newton=1e-9)
    exact = E / (1 + NU) * np.log(1.3 / 0.8) / (1.3**2 * 0.8)
    np.testing.assert_allclose(made.mises[-1], exact, rtol=1e-9)


def test_relaxation_of_a_patch_and_its_order_in_time(patch) -> None:
    """At held strain dq/dt = -3G/J A q^n: q^(1-n) = q0^(1-n) + (n-1) 3G A t/J; equal steps of SDIRK2 err as h^2.

    Strains are held, so that the control of errors, which watches displacements, has nothing to see: steps are given.
    """
    mesh, _ = patch
    n, A, end = 4, 1e-20, 1000.0
    way = course(0.0, end, E, pattern=mesh.nodes * STRETCH, motion=Program.constant(1.0))
    made = run(mesh, way, NORTON, {"A": A, "n": n}, newton=1e-9)
    start, stiffness = made.mises[1, 0], 1.5 * E / (1 + NU) / (1.3**2 * 0.8)
    exact = (start ** (1 - n) + (n - 1) * stiffness * A * end) ** (1 / (1 - n))
    assert exact < 0.3 * start
    runs = [run(mesh, way, NORTON, {"A": A, "n": n}, like=equal_steps(made, count)) for count in (32, 64, 128, 256)]
    errors = [r.mises[-1, 0] / exact - 1 for r in runs]
    assert abs(errors[-1]) < 1e-4
    np.testing.assert_allclose(orders(errors), 2.0, atol=0.1)


@pytest.mark.parametrize("stress", [100.0, -100.0])
@pytest.mark.parametrize("sides", ["ends", "mantle", "both"])
def test_creep_of_a_bar(sides: str, stress: float) -> None:
    """A follower pressure p keeps the Cauchy stress at -p, so that creep is linear in time at any strain.

    Pressed ends: ln(height) = s J/E + A |s|^n t, ln(radius) = -nu s J/E - A |s|^n t/2, with J = exp((1 - 2 nu) s J/E)
    the factor from Cauchy to Kirchhoff stress; a pressed mantle is the sum of two such states; with both there is no
    creep. Creep strain 0.5, or 1.65 times the height.
    """
    A, n, end = 5e-12, 4, 1000.0
    body = block([0, 1], [0, 1])
    pressed = {"ends": body.outer, "mantle": right_of(body), "both": np.vstack([body.outer, right_of(body)])}
    mesh = mesh_of(body, z=body.inner_line, pressed=pressed[sides])
    made = run(mesh, course(-stress, end, E), NORTON, {"A": A, "n": n}, newton=1e-11)
    assert made.status == Status.COMPLETE
    along, around = {"ends": (stress, 0.0), "mantle": (0.0, stress), "both": (stress, stress)}[sides]
    trace, volume = 0.0, 1.0
    for _ in range(20):
        volume = np.exp(trace)
        trace = (1 - 2 * NU) * (along + 2 * around) * volume / E
    creep = np.sign(along - around) * A * abs(along - around) ** n * made.times
    height = (along - 2 * NU * around) * volume / E + creep
    radius = ((1 - NU) * around - NU * along) * volume / E - 0.5 * creep
    corner = made.displacements[1:, body.last[-1]]
    np.testing.assert_allclose(np.log1p(corner[:, 1]), height[1:], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(np.log1p(corner[:, 0]), radius[1:], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(made.mises[-1], abs(along - around), rtol=1e-8, atol=1e-8)
