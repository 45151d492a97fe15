"""The reduced-order model of a dimple against its finite elements, on laws and thicknesses that training did not see.

Both in small steps, so that modes and points alone make the difference.
"""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.fem.finite_element_model import finite_element_model
from creepkit.fem.reduced_order_model import ReducedOrderModel
from creepkit.fem.simulation import sensitivity_directions, simulate
from creepkit.language import Elastic, parameters, principal_stress, strain, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.records import History, PressureJump, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.reduced_order_model import nominal_geometry
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.finite_element_tests import FiniteElementTest, solver_settings
from helpers.fem_cases import lowered
from helpers.literature_laws import RATE, damage, law, number, omega

SPECIMEN = Bulge(threads=1, tolerance=1e-4)
REDUCED = SPECIMEN.reduced_order_model()
A, B, n, k, m, c = parameters("A B n k m c")
TENSILE = law(A * stress**n * strain**m * (1 + c * principal_stress / stress), {
    A: RATE, n: number(1, 8), m: number(-1, 0), c: number(0, 10)})  # fmt: skip
DAMAGING = damage(
    A * (stress / (1 - omega)) ** n,
    B * principal_stress**k / (1 - omega) ** k,
    {A: RATE, n: number(1, 8), B: RATE, k: number(1, 8)},
)
CASES = {
    "combined": (
        COMBINED,
        {"A_1": 1e-9, "n_1": 3, "B": 60, "A_2": 1e-14, "n_2": 4, "m_1": -0.3, "A_3": 3e-12, "n_3": 3, "m_2": -0.4},
    ),
    "damage by principal stress": (DAMAGING, {"A": 1e-13, "n": 3.5, "B": 3e-11, "k": 2.5}),
    "hardening, faster under tension": (TENSILE, {"A": 3e-15, "n": 3.5, "m": -0.5, "c": 0.5}),
}


def history(**geometry: float) -> History:
    """A test of two pressures; the modulus depends on temperature."""
    return History(
        name="planned", times=np.array([150.0, 1800.0, 7000.0, 7202.0, 7300.0, 14400.0]), outputs={},
        loading=PressureJump(8.0, 9.0, 7200.0), temperature=1000.0, specimen="bulge", elastic=Elastic(E=150e3),
        geometry=geometry,
    )  # fmt: skip


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("thickness", [0.47, 0.5, 0.545])
def test_outputs_are_those_of_the_finite_elements(case: str, thickness: float) -> None:
    """Amplitude, width and shape, each within one per cent of its largest."""
    creep, values = CASES[case]
    test = history(apex_thickness=thickness)
    theta = creep.to_internal(values)
    exact, found = (p.predict(creep, theta, [test]) for p in (SPECIMEN, REDUCED))
    assert exact.status[0, 0] == found.status[0, 0] == Status.COMPLETE
    error = np.abs(found.values - exact.values)[0, 0].max(axis=0) / np.abs(exact.values)[0, 0].max(axis=0)
    np.testing.assert_array_less(error, 0.01)


@pytest.mark.parametrize("case", CASES)
def test_a_prediction_is_the_same_with_derivatives(case: str) -> None:
    """To the last digit, in the tolerances that users have: equilibrium is solved once for both."""
    creep, values = CASES[case]
    theta, usual = creep.to_internal(values), Bulge(threads=1)
    for predictor in (usual, usual.reduced_order_model(), usual.reduced_order_model().for_search()):
        alone, beside = (predictor.predict(creep, theta, [history()], sensitivities=also) for also in (False, True))
        np.testing.assert_array_equal(alone.values, beside.values)


@pytest.mark.parametrize("case", CASES)
def test_equilibrium_is_solved_well_enough(case: str) -> None:
    """In the usual tolerances, at the very same steps: displacements within 5e-4 of their largest, derivatives 2e-3."""
    creep, values = CASES[case]
    theta, usual = creep.to_internal(values)[0], Bulge(threads=1)
    setup = FiniteElementTest.of(usual, history(), {}, True)
    reduced = usual.reduced_order_model()
    for model, settings in (
        (setup.model, solver_settings(usual)), (reduced.reduced_model_of(usual), reduced.settings),
    ):  # fmt: skip
        like = None
        runs = []
        for each in (settings, settings._replace(newton=1e-11)):
            like = simulate(lowered(creep), theta, model, setup.load_history, settings=each, same_steps_as=like,
                            directions=setup.directions)  # fmt: skip
            runs.append(like)
        found, exact = (run.displacements[:, setup.model.top, 1] for run in runs)
        assert np.abs(found - exact).max() < 5e-4 * np.abs(exact).max()
        found, exact = (run.sensitivities for run in runs)
        largest = np.abs(exact).max(axis=(0, 1))
        assert (np.abs(found - exact).max(axis=(0, 1)) <= 2e-3 * largest).all()


def test_derivatives_to_the_law_and_to_nuisances_are_near_those_of_the_finite_elements() -> None:
    """Of the amplitude, within 5 % of the largest; `test_thickness` and the tests of the core ask for exactness."""
    creep, values = CASES["combined"]
    nuisances = {"thickness": 0.51, "modulus": 0.02, "window": 7.5, "load step@7200": 0.01}
    given = {key: np.array([[value]]) for key, value in nuisances.items()}
    exact, found = (
        p.predict(creep, creep.to_internal(values), [history()], nuisances=given, sensitivities=True)
        for p in (SPECIMEN, REDUCED)
    )
    pairs = [(exact.jacobian[0, 0, :, 0, p], found.jacobian[0, 0, :, 0, p]) for p in range(exact.jacobian.shape[-1])]
    pairs += [(exact.nuisance_jacobian[key][0, 0, :, 0], found.nuisance_jacobian[key][0, 0, :, 0]) for key in given]
    largest = max(np.abs(one).max() for one, _ in pairs[: len(values)])
    for one, other in pairs:
        np.testing.assert_allclose(other, one, atol=0.05 * max(np.abs(one).max(), 0.05 * largest))


def test_thickness() -> None:
    """u_z of the top to the apex thickness on nodes that move, at the very same steps: within 1e-6 of the largest."""
    creep, values = CASES["combined"]
    theta = creep.to_internal(values)[0]
    setup = FiniteElementTest.of(SPECIMEN, history(), {})
    settings = solver_settings(SPECIMEN)._replace(newton=1e-12)
    mesh, velocity = setup.piece.geometry.mesh(1.0), setup.piece.geometry.mesh_velocity("apex_thickness", 1.0)
    moves = [(setup.model.geometry_derivative(velocity), velocity)]
    along = sensitivity_directions(setup.model, setup.load_history, velocities=moves)
    model = REDUCED.reduced_model_of(SPECIMEN)
    base = simulate(lowered(creep), theta, model, setup.load_history, settings=settings, directions=along)

    def top(step: float):
        moved = ReducedOrderModel(finite_element_model(mesh.moved(mesh.nodes + step * velocity)), model.basis)
        run = simulate(lowered(creep), theta, moved, setup.load_history, settings=settings, same_steps_as=base)
        return run.displacements[:, setup.model.top, 1]

    difference = (top(1e-5) - top(-1e-5)) / 2e-5
    np.testing.assert_allclose(base.sensitivities[:, :, -1], difference, atol=1e-6 * np.abs(difference).max())


@pytest.mark.long_when_sanitized
@pytest.mark.nightly
def test_another_dimple_and_its_mesh_from_files() -> None:
    """A plate with a fillet, meshed and as a mesh from elsewhere, within one per cent: nothing knows the dimple."""
    fillet = Bulge(geometry=DimpleGeometry(1.0, 5.0, 1.0, 1.5, 4.0, 7.5, ("rim",)), threads=1, tolerance=1e-4)
    theta = NORTON.to_internal({"A": 1e-13, "n": 4.3})
    for specimen in (fillet, fillet.replace(mesh=with_top(fillet))):
        exact, found = (p.predict(NORTON, theta, [history()]) for p in (specimen, specimen.reduced_order_model()))
        error = np.abs(found.values - exact.values)[0, 0, :, 0].max() / np.abs(exact.values[..., 0]).max()
        assert error < 0.01


def with_top(specimen: Bulge):
    """The specimen's own mesh, as if it were read from files."""
    return specimen.geometry.mesh(1.0)


@pytest.mark.long_when_sanitized
def test_stated_error_enters_the_covariance_and_the_specimen_corrects_it() -> None:
    errors = REDUCED.error
    assert set(errors) == set(SPECIMEN.optional_outputs)
    assert 1e-5 < errors["amplitude"] < 0.01
    assert REDUCED.refined() == SPECIMEN.refined()


def test_test_pieces_share_a_basis() -> None:
    """Within a tenth of the thickness and two per cent of other lengths; where these do not fit, each has its own."""
    own = DimpleGeometry()
    assert nominal_geometry(own, own.replace(apex_thickness=0.53)) == own
    assert nominal_geometry(own, own.replace(outer_radius=10.15)) == own
    thick = nominal_geometry(own, own.replace(apex_thickness=0.6))
    assert thick.apex_thickness == pytest.approx(0.625)
    tall = own.replace(roof_axial=3.45)
    assert nominal_geometry(own, tall).roof_axial == pytest.approx(3.45, rel=0.025)


def test_a_fitted_thickness_moves_no_step() -> None:
    """Where a history of that thickness, 0.559 mm, begins to have another basis, the one that is stated stays."""
    creep, values = CASES["combined"]
    amplitudes = np.array(
        [
            REDUCED.predict(
                creep, creep.to_internal(values), [history()], nuisances={"thickness": np.array([[h]])}
            ).values[0, 0, -1, 0]
            for h in (0.558, 0.559, 0.56)
        ]
    )
    assert abs(np.diff(amplitudes, 2)[0]) < 0.01 * abs(amplitudes[2] - amplitudes[0])
