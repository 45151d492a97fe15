"""Order of convergence, measured: in the mesh, of elastic displacements and of steady creep, and in time."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.specimens.bulge.geometry import DimpleGeometry
from helpers.fem_cases import STILL, course, equal_steps, mesh_of, orders, run, shell, steady_velocity

MESHES = (2, 4, 8, 16)


def sphere(parts: int):
    """A hollow sphere between the radii 1 and 2 under pressure from inside, `parts` elements each way."""
    body = shell(1.0, 2.0, parts, parts)
    return body, mesh_of(body, z=body.last, pressed=body.inner)


def mean_square(field: np.ndarray, exact: float) -> float:
    """Relative error of the radial displacements of a line of nodes, root of the mean square."""
    return float(np.sqrt(np.mean((np.hypot(*field.T) / exact - 1) ** 2)))


def test_order_in_the_mesh_elastic() -> None:
    """Lame's sphere at a strain of 1e-7: order 3, that of quadratic displacements, inside, and 4 outside."""
    p, E, nu, errors = 1e-7, 1.0, 0.3, []
    for parts in MESHES:
        body, mesh = sphere(parts)
        made = run(mesh, course(p, 1.0, E), NORTON, STILL, newton=1e-12)
        lines = ((body.inner_line, 1.0), (body.outer_line, 2.0))
        exact = [p * r / (7 * E) * ((1 - 2 * nu) + (1 + nu) * 4 / r**3) for _, r in lines]
        errors.append([mean_square(made.displacements[-1][k], u) for (k, _), u in zip(lines, exact, strict=True)])
    assert (orders(errors)[1:] > [2.7, 3.9]).all()
    assert max(errors[-1]) < 1e-4


def test_order_in_the_mesh_in_steady_creep() -> None:
    """The sphere in Norton creep, n = 5: velocity A/2 [(3p/2n)/(2^(3/n) - 1)]^n b^3/r^2, with the same orders.

    The finest mesh is as near as the change of the geometry, 1e-5, lets the outer surface be.
    """
    p, n, A, errors = 100.0, 5, 1e-12, []
    exact = 0.5 * A * ((1.5 * p / n) / (2 ** (3 / n) - 1)) ** n * 8
    assert exact == pytest.approx(0.002664470105408614)  # closed_form_references.json, r = 1
    for parts in MESHES:
        body, mesh = sphere(parts)
        velocity = steady_velocity(mesh, p, {"A": A, "n": n}, modulus=1e9, elastic=1e-7, speed=exact)
        lines = ((body.inner_line, exact), (body.outer_line, exact / 4))
        errors.append([mean_square(velocity[k], v) for k, v in lines])
    assert orders(errors)[-1, 0] > 2.7
    assert orders(errors)[1, 1] > 3.9
    assert max(errors[-1]) < 2e-4


@pytest.mark.parametrize(
    ("law", "values"),
    [(NORTON, {"A": 2e-12, "n": 3}), (TIME_HARDENING, {"A": 3e-11, "n": 3.2, "m": -0.4})],
    ids=["norton", "time hardening"],
)
def test_order_in_time(law, values) -> None:
    """Equal steps of the clock t^(1+m) on a coarse dimple while creep redistributes the elastic stress: order 2.

    From the differences of runs with 64 to 512 steps; of the apex, and of the stress at any point, whose order the
    fastest points reach last.
    """
    mesh = DimpleGeometry().mesh(0.5)
    way = course(8.0, 600.0, 150e3)
    made = run(mesh, way, law, values)
    counts = (64, 128, 256, 512)
    runs = [run(mesh, way, law, values, like=equal_steps(made, count), newton=1e-10) for count in counts]
    assert [len(r.times) - 2 for r in runs] == list(counts)
    apex = np.diff([r.displacements[-1][mesh.top[0], 1] for r in runs])
    stress = np.abs(np.diff([r.mises[-1] for r in runs], axis=0)).max(axis=1)
    assert (orders(apex) > 1.75).all()
    assert (orders(stress) > 1.6).all()
    assert abs(apex[-1] / runs[-1].displacements[-1][mesh.top[0], 1]) < 1e-4
