"""Derivatives of what a bulge test shows against central differences at the very same steps.

With equilibrium as tight as rounding allows, both are derivatives of one scheme: they agree within 1e-5 of the largest
of each output, most within 1e-7. Differences of 1e-4 of a parameter leave 1e-8 of truncation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from sympy import exp

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.fem.finite_element_model import finite_element_model
from creepkit.fem.simulation import Simulation, simulate
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import CreepLaw, Elastic, mean_stress, parameters, principal_stress, stress, temperature
from creepkit.laws.combined import COMBINED
from creepkit.records import History, PressureJump, Status
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.finite_element_tests import FiniteElementTest, solver_settings
from creepkit.specimens.separate_tests import TestResponse
from helpers.literature_laws import RATE, damage, law, number, omega

SPECIMEN = Bulge(refinement=0.5, threads=1)
SETTINGS = solver_settings(SPECIMEN)._replace(newton=1e-12)
NUISANCES = {
    "modulus": 0.0, "temperature": 0.0, "thickness": 0.5, "window": 7.5, "load step@3600": 0.0,
    "temperature step@1000": 0.0, "temperature drift": 0.0,
}  # fmt: skip
A, B, n, k, c = parameters("A B n k c")
TRIAXIAL = law(A * stress**n * (1 + c * mean_stress / temperature), {A: RATE, n: number(1, 8), c: number(0, 10)})
"""Faster under tension and when it is cold: depends on the mean stress and on temperature."""

DAMAGING = damage(
    A * (stress / (1 - omega)) ** n,
    B * stress**k * exp(c * principal_stress / 100) / (1 - omega) ** k,
    {A: RATE, n: number(1, 8), B: RATE, k: number(1, 8), c: number(0, 10)},
)
"""With an internal variable that grows faster under tension."""

CASES: dict[str, tuple[CreepLaw, dict[str, float]]] = {
    "combined": (
        COMBINED,
        {"A_1": 1e-9, "n_1": 3, "B": 60, "A_2": 1e-14, "n_2": 4, "m_1": -0.3, "A_3": 3e-12, "n_3": 3, "m_2": -0.4},
    ),
    "damage by principal stress": (DAMAGING, {"A": 1e-13, "n": 3.5, "B": 3e-11, "k": 2.5, "c": 0.5}),
    "mean stress": (TRIAXIAL, {"A": 2e-13, "n": 3.5, "c": 3.0}),
}


class Base(NamedTuple):
    """A run, and what `slopes_of` says of it."""

    kernel: CompiledLaw
    theta: Floats
    history: History
    made: FiniteElementTest
    found: Simulation
    response: TestResponse


ON_RINGS = "combined, on rings"
"""The same law, observed by u_z at radii that are no nodes of the mesh."""


@pytest.fixture(scope="module", params=(*CASES, ON_RINGS))
def base(request) -> Base:
    """A test of two pressures with outputs before, at and after the jump; the modulus depends on temperature."""
    creep, values = CASES[request.param.partition(",")[0]]
    history = History(
        name="planted", times=np.array([150.0, 1800.0, 7000.0, 7202.0, 7300.0, 14400.0]), outputs={},
        loading=PressureJump(8.0, 9.0, 7200.0), temperature=1000.0, specimen="bulge",
        elastic=Elastic(E=210e3 - 60 * temperature),
        operator="rings 0, 2.03, 4.1 mm" if request.param == ON_RINGS else "",
    )  # fmt: skip
    kernel = kernels.lower(creep, "compiled")
    theta = creep.to_internal(values)[0]
    made = FiniteElementTest.of(SPECIMEN, history, NUISANCES, sensitivities=True)
    found = made.simulate(kernel, theta, SETTINGS)
    assert found.status == Status.COMPLETE
    return Base(kernel, theta, history, made, found, made.response(found))


def seen(base: Base, theta: Floats | None = None, **nuisances: float) -> Floats:
    """Outputs (times, outputs) of the same steps with something changed."""
    made = FiniteElementTest.of(SPECIMEN, base.history, {**NUISANCES, **nuisances})
    theta = base.theta if theta is None else theta
    found = simulate(base.kernel, theta, made.model, made.load_history, settings=SETTINGS, same_steps_as=base.found)
    return found.at(made.piece.observed_outputs(made.load, found), base.history.times)


def agree(exact: Floats, up: Floats, down: Floats, step: float) -> None:
    """Within 1e-5 of the largest, for each output."""
    difference = (up - down) / (2 * step)
    largest = np.abs(difference).max(axis=0)
    assert (largest > 0).all()
    np.testing.assert_array_less(np.abs(exact - difference).max(axis=0), 1e-5 * largest)


def test_every_parameter_of_the_law(base) -> None:
    for p, step in enumerate(1e-4 * np.maximum(1.0, np.abs(base.theta) / 10)):
        move = step * np.eye(base.theta.size)[p]
        agree(base.response.jacobian[:, :, p], seen(base, base.theta + move), seen(base, base.theta - move), step)


def test_every_nuisance_but_lengths(base) -> None:
    steps = {"modulus": 1e-4, "temperature": 0.1, "window": 1e-4, "load step@3600": 1e-4}
    for name, step in {**steps, "temperature step@1000": 0.1, "temperature drift": 0.1}.items():
        if name == "window" and base.history.operator:
            assert not base.response.nuisances[name].any()  # rings have none
            continue
        up, down = (seen(base, **{name: NUISANCES[name] + s}) for s in (step, -step))
        agree(base.response.nuisances[name], up, down, step)


def moved_profiles(base: Base, step: float) -> Floats:
    """Top profiles (steps, top) of the same steps on nodes moved as the thickness moves them."""
    mesh = base.made.piece.geometry.mesh(SPECIMEN.refinement)
    velocity = base.made.piece.geometry.mesh_velocity("apex_thickness", SPECIMEN.refinement)
    body = finite_element_model(mesh.moved(mesh.nodes + step * velocity))
    found = simulate(base.kernel, base.theta, body, base.made.load_history, settings=SETTINGS, same_steps_as=base.found)
    return found.displacements[:, body.top, 1]


def test_thickness_on_a_mesh_that_moves(base) -> None:
    """What is observed to the apex thickness, the observed nodes moving along the radius too."""
    step = 1e-5
    drift = base.made.piece.geometry.mesh_velocity("apex_thickness", SPECIMEN.refinement)[base.made.model.top, 0]
    assert np.abs(drift).max() > 0.01
    operator, radii = base.made.piece.observation, base.made.piece.top_radii
    frames = [operator.observe(radii + s * drift, moved_profiles(base, s)) for s in (step, -step)]
    up, down = (base.found.at(each, base.history.times) for each in frames)
    agree(base.response.nuisances["thickness"], up, down, step)


def test_thickness_as_the_specimen_meshes_it(base) -> None:
    """A dimple of another thickness spreads its columns otherwise too."""
    step = 1e-5
    agree(
        base.response.nuisances["thickness"], seen(base, thickness=0.5 + step), seen(base, thickness=0.5 - step), step
    )
