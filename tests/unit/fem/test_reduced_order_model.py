"""The reduced-order model of a mesh: with all modes and points it is its finite elements, with few it is near them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.reduced_order_model import ReducedBasis, ReducedOrderModel, mode_gradients
from creepkit.fem.reduced_order_training import non_negative_least_squares, principal_modes, snapshots
from creepkit.fem.simulation import LoadHistory, Simulation, sensitivity_directions, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.language import CreepLaw, mean_stress, parameters, stress
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
from creepkit.specimens.reduced_order_training import power_law_runs, trained_basis
from helpers.fem_cases import FREE, STILL, StageConditions, assemble, block, full_basis, left_of, lowered, mesh_of
from helpers.literature_laws import RATE, damage, number, omega

TIGHT = SolverSettings(newton=1e-12, **FREE)
A, B, n, k, c = parameters("A B n k c")
DAMAGING = damage(
    A * (stress / (1 - omega)) ** n,
    B * stress**k * (1 + c * mean_stress / 100) / (1 - omega) ** k,
    {A: RATE, n: number(1, 8), B: RATE, k: number(1, 8), c: number(0, 10)},
)
"""With an internal variable that grows faster under tension."""

CASES = {
    "norton": (NORTON, {"A": 1e-11, "n": 3.5}),
    "damage": (DAMAGING, {"A": 1e-11, "n": 3.5, "B": 3e-8, "k": 2.0, "c": 0.5}),
}


def tube() -> FiniteElementModel:
    """Nine elements of a thick tube that is closed below, pressed from inside; its top is observed."""
    body = block([5.0, 6.0, 7.0, 8.0], [0.0, 1.0, 2.5, 4.0])
    top = np.flatnonzero(body.nodes[:, 1] == 4.0)
    order = top[np.argsort(body.nodes[top, 0])]
    bottom = np.flatnonzero(body.nodes[:, 1] == 0.0)
    return finite_element_model(mesh_of(body, r=bottom, z=bottom, pressed=left_of(body), top=order))


TUBE = tube()
WAY = LoadHistory(
    Program(np.array([0.0, 5.0, 4e3, 4.005e3]), np.array([0.0, 12.0, 12.0, 15.0])),
    Program.constant(900.0), Program.constant(1.5e5), 9e3,
)  # fmt: skip


def made_by(model, creep: CreepLaw, values, way: LoadHistory = WAY, like: Simulation | None = None, along=None):
    """A simulation with equilibrium as tight as rounding allows."""
    theta = creep.to_internal(values)[0]
    return simulate(
        lowered(creep), theta, model, way, settings=TIGHT, same_steps_as=like, directions=along, keep_points=True
    )


def directions():
    """Pressure and modulus that rise in proportion, and nodes that move along both axes."""
    segments = np.zeros((2, *WAY.segments.shape))
    for position, columns in enumerate(((2, 3), (6, 7))):
        segments[position][:, columns] = WAY.segments[:, columns]
    velocity = TUBE.nodes * np.array([0.1, -0.2]) * np.array([1.0, 0.5])
    return sensitivity_directions(TUBE, WAY, segments, [(TUBE.geometry_derivative(velocity), velocity)]), velocity


@pytest.mark.parametrize("case", CASES)
def test_all_modes_and_points_are_the_finite_elements(case: str) -> None:
    """Displacements, histories of the points and all derivatives, to rounding."""
    creep, values = CASES[case]
    along, _ = directions()
    exact = made_by(TUBE, creep, values, along=along)
    found = made_by(ReducedOrderModel(TUBE, full_basis(TUBE)), creep, values, like=exact, along=along)
    assert exact.status == found.status == Status.COMPLETE
    np.testing.assert_allclose(found.displacements, exact.displacements, atol=1e-10 * exact.displacements.max())
    np.testing.assert_allclose(found.values, exact.values, atol=1e-9 * np.abs(exact.values).max())
    largest = np.abs(exact.sensitivities).max(axis=(0, 1))
    difference = np.abs(found.sensitivities - exact.sensitivities).max(axis=(0, 1))
    assert (largest > 0).all()
    np.testing.assert_array_less(difference, 1e-7 * largest)


def few() -> ReducedBasis:
    """A basis that is not good, but a model like any other: five modes, half of the points, matrices for weights."""
    numbers = np.random.default_rng(0)
    modes = numbers.normal(size=(5, *TUBE.nodes.shape)) * 0.02
    modes += np.array([TUBE.nodes * f for f in (1.0, [1.0, 0.0], [0.0, 1.0], TUBE.nodes / 8, TUBE.nodes[:, ::-1] / 8)])
    modes *= (TUBE.equations >= 0).reshape(-1, 2)
    points = np.arange(0, TUBE.weights.size, 2)
    return ReducedBasis(modes, points, 2.0 * np.eye(5) + numbers.normal(size=(points.size, 5, 5)) * 0.1)


@pytest.mark.parametrize("case", CASES)
def test_derivatives_against_central_differences(case: str) -> None:
    """Of the very same steps: the law's parameters, the load history, and the geometry with the modes kept."""
    creep, values = CASES[case]
    along, velocity = directions()
    basis = few()
    base = made_by(ReducedOrderModel(TUBE, basis), creep, values, along=along)
    assert base.status == Status.COMPLETE
    theta = creep.to_internal(values)[0]

    def top(theta=theta, segments=None, moved: float = 0.0):
        way = WAY if segments is None else replace(WAY)
        if segments is not None:
            object.__setattr__(way, "segments", segments)
        model = TUBE if not moved else finite_element_model(moved_tube(moved * velocity))
        run = simulate(lowered(creep), theta, ReducedOrderModel(model, basis), way, settings=TIGHT, same_steps_as=base)
        return run.displacements[:, TUBE.top, 1]

    expected = []
    for p in range(theta.size):
        step = 3e-5 * max(1.0, abs(theta[p]))
        up, down = (top(theta + s * np.eye(theta.size)[p]) for s in (step, -step))
        expected.append((up - down) / (2 * step))
    for d, step in enumerate((1e-4, 1e-4)):
        up, down = (top(segments=WAY.segments + s * along.segments[d]) for s in (step, -step))
        expected.append((up - down) / (2 * step))
    up, down = (top(moved=s) for s in (1e-5, -1e-5))
    expected.append((up - down) / 2e-5)
    for column, difference in enumerate(expected):
        largest = np.abs(difference).max()
        np.testing.assert_allclose(base.sensitivities[:, :, column], difference, atol=max(2e-6 * largest, 1e-11))


def moved_tube(by):
    """The tube with its nodes moved."""
    body = block([5.0, 6.0, 7.0, 8.0], [0.0, 1.0, 2.5, 4.0])
    bottom = np.flatnonzero(body.nodes[:, 1] == 0.0)
    return replace(mesh_of(body, r=bottom, z=bottom, pressed=left_of(body), top=TUBE.top), nodes=body.nodes + by)


def test_stresses_of_snapshots_are_those_of_the_core() -> None:
    """Without pressure, elastic forces of the core are the integral of the stresses times the gradients."""
    runs = power_law_runs([TUBE], 2)
    data = snapshots([replace(runs[0], theta=np.array([-np.inf, 1.0, 0.0]))], SolverSettings())
    modulus = 1e5
    conditions = StageConditions(0.0, 0.0, 1.0, 900.0, modulus / 1.2, modulus / 2.6, 0.0)
    unit = mode_gradients(TUBE, full_basis(TUBE).modes, np.arange(TUBE.weights.size))
    for row in range(1, len(data.mesh), 5):
        forces = np.einsum("psm,ps,p->m", unit, data.stresses[row], TUBE.weights.ravel())
        exact, _ = assemble(lowered(NORTON), NORTON.to_internal(STILL)[0], TUBE, conditions,
                            data.displacements[row].ravel())  # fmt: skip
        np.testing.assert_allclose(forces, exact, atol=1e-8 * np.abs(exact).max())


def test_modes_span_the_snapshots() -> None:
    """Orthonormal in the elastic energy, zero where displacements are held, and enough of them leave nothing."""
    data = snapshots(power_law_runs([TUBE], 8), SolverSettings())
    modes = principal_modes(data, 12, 3.0)
    assert np.abs(modes.reshape(len(modes), -1)[:, TUBE.equations < 0]).max() == 0.0
    flat = data.displacements.reshape(len(data.mesh), -1)
    errors = []
    for count in (2, 6, 12):
        span = modes[:count].reshape(count, -1).T
        left = flat.T - span @ np.linalg.lstsq(span, flat.T, rcond=None)[0]
        errors.append(np.linalg.norm(left) / np.linalg.norm(flat))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-3


def test_non_negative_least_squares() -> None:
    """A sparse vector above zero is found from its image; where one is below zero, the optimum has it at zero."""
    numbers = np.random.default_rng(1)
    matrix = numbers.normal(size=(60, 20))
    x = np.zeros(20)
    x[[2, 7, 11]] = 1.0, 0.5, 2.0
    places, values = non_negative_least_squares(matrix.T @ matrix, matrix.T @ (matrix @ x), 10)
    found = np.zeros(20)
    found[places] = values
    np.testing.assert_allclose(found, x, atol=1e-6)
    x[7] = -0.5
    image = matrix @ x
    places, values = non_negative_least_squares(matrix.T @ matrix, matrix.T @ image, 20)
    assert (values > 0).all()
    slope = matrix.T @ (image - matrix[:, places] @ values)  # the conditions of Karush, Kuhn and Tucker
    np.testing.assert_allclose(slope[places], 0.0, atol=1e-8)
    assert (slope[np.setdiff1d(np.arange(20), places)] < 1e-8).all()


def test_a_trained_model_is_near_its_finite_elements(tmp_path, monkeypatch) -> None:
    """A law that training did not see, within half a per cent of the largest displacement; kept on disk."""
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path))
    settings = SolverSettings(deflection_limit=0.05)
    basis = trained_basis((TUBE,), settings, modes=16, points=36)
    assert len(basis.modes) == 16
    assert basis.points.size == 36
    assert (basis.factors.trace(axis1=1, axis2=2) > 0).all()
    assert list(tmp_path.glob("reduced_bases/*.safetensors"))
    assert trained_basis((TUBE,), settings, modes=16, points=36) is basis
    creep, values = CASES["damage"]
    runs = [made_by(model, creep, values) for model in (TUBE, ReducedOrderModel(TUBE, basis))]
    times = np.linspace(10.0, 9e3, 40)
    exact, found = (run.at(run.displacements, times) for run in runs)
    assert np.abs(found - exact).max() < 5e-3 * np.abs(exact).max()


def test_gradients_of_modes_are_those_of_a_linear_field() -> None:
    """u = (a r + b z, d z + e r) has the gradients a, b, e, d and u_r/r at every point."""
    a, b, e, d = 0.1, -0.2, 0.3, 0.4
    r, z = TUBE.nodes.T
    field = np.stack([a * r + b * z, e * r + d * z], axis=1)[None]
    found = mode_gradients(TUBE, field, np.arange(TUBE.weights.size))[..., 0]
    for column, value in zip(range(4), (a, b, e, d), strict=True):
        np.testing.assert_allclose(found[:, column], value, atol=1e-12)
    assert all(np.isfinite(found[p, 4]) for (p,) in product(range(len(found))))
