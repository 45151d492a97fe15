"""Meshes of others: two CalculiX decks with their results, the paper's own mesh, and the paper's example of Fig. 2c."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.fem.mesh import discretize
from creepkit.fem.mesh_files import read_input_deck, read_mesh
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import PressureJump, Program, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.observation import Observation
from helpers.fem_cases import BENCHMARKS, course, run
from helpers.paths import NO_SHARED_DATA

if not BENCHMARKS.is_dir():
    pytest.skip(NO_SHARED_DATA, allow_module_level=True)

DECKS = BENCHMARKS / "dabi_ccx"
PAPER = BENCHMARKS.parent / "dabi"
RAMP = Program(np.array([0.0, 5.0]), np.array([0.0, 8.0]))
RADII = (0, 1, 2, 3, 4, 5, 6, 7.5)


@pytest.fixture(
    scope="module",
    params=[
        ("dabi_norton_in625_800C_steady", NORTON, {"A": 1.07981587e-15, "n": 4.3}),
        ("dabi_timehardening", TIME_HARDENING, {"A": 3e-13, "n": 4, "m": -0.3}),
    ],
    ids=lambda case: case[0],
)
def deck(request):
    """The table of a deck's results, and ours on its mesh of 174 CAX8R: u_z along the top, fit, largest stress."""
    name, law, values = request.param
    table = np.genfromtxt(DECKS / f"{name}.csv", delimiter=",", names=True)
    mesh = read_input_deck(DECKS / f"{name}.inp")
    made = run(mesh, course(RAMP, 14400.0, 1e5), law, values, tolerance=1e-3, newton=1e-6)
    assert made.status == Status.COMPLETE
    radii, profiles, times = mesh.nodes[mesh.top, 0], made.displacements[:, mesh.top, 1], table["time_s"]
    along = made.at(profiles @ surface_interpolation(radii, RADII).T, times)
    fit = made.at(Observation().observe(radii, profiles), times)
    return table, along, fit, made.at(made.mises, times).max(axis=1)


def test_calculix_decks_along_the_top(deck) -> None:
    """Within 0.1 % of the largest at the end of the ramp, then CalculiX lags by up to 0.6 %.

    Its steps are backward Euler with CETOL = 6e-5; it approaches from below, with 0.25 to 0.7 % at 1e-4 and 0.08 to
    0.26 % at 1e-5 (ccx_mesh48 of dimple_reference.json). Extrapolated to none it agrees with the converged references.
    """
    table, along, _, _ = deck
    names = [f"uz_mm_r{r}".replace(".", "") for r in RADII]
    known = np.stack([table[name] for name in names], axis=1)
    largest = known[-1, 0]
    np.testing.assert_allclose(along[0], known[0], atol=1e-3 * largest)
    np.testing.assert_allclose(along, known, atol=6e-3 * largest)
    lag = along[5:, :6] - known[5:, :6]
    assert (lag > 0).all()


def test_calculix_decks_fit(deck) -> None:
    """Width and shape within 0.12 %: a lag in time moves all of the top together. Amplitude as the apex above."""
    table, _, fit, _ = deck
    np.testing.assert_allclose(fit[:, 0], table["fit_Damp_mm"], atol=6e-3 * table["fit_Damp_mm"][-1])
    np.testing.assert_allclose(fit[:, 1], table["fit_Sd_mm"], rtol=1.5e-3)
    np.testing.assert_allclose(fit[:, 2], table["fit_Sp"], rtol=1.5e-3)


def test_calculix_decks_largest_stress(deck) -> None:
    """The largest of the points, within 1.5 %: stress redistributes fastest there, and lags most early on."""
    table, _, _, largest = deck
    np.testing.assert_allclose(largest, table["max_vonMises_ip_MPa"], rtol=1.5e-2)
    np.testing.assert_allclose(largest[-5:], table["max_vonMises_ip_MPa"][-5:], rtol=5e-3)


@pytest.mark.long_when_sanitized
def test_the_mesh_of_the_paper() -> None:
    """2117 elements, made eight-node ones, against the structured mesh at 5, 50 and 300 s of Norton creep.

    Its roof is a polygon of 0.09 mm sides where ours is curved: 0.03 % against the mesh of 192 elements, 0.15 %
    against the 48 of that for production.
    """
    mesh = read_mesh(*(PAPER / f"paper_mesh_{name}" for name in ("nodes.csv", "quads.csv", "sets.json")))
    assert len(mesh.elements) == 2117
    times = np.array([5.0, 50.0, 300.0])
    apex = []
    for body in (mesh, DimpleGeometry().mesh(), DimpleGeometry().mesh(2.0)):
        made = run(body, course(RAMP, 300.0, 1e5), NORTON, {"A": 1e-15, "n": 4.3})
        apex.append(made.at(made.displacements[:, body.top[0], 1], times))
    np.testing.assert_allclose(apex[0], apex[1], rtol=1.5e-3)
    np.testing.assert_allclose(apex[0], apex[2], rtol=3e-4)


def test_the_example_of_the_paper() -> None:
    """Fig. 2c: 8 to 10 MPa with the values of its caption; von Mises stress "from 40 to 160 MPa" at 0.5, 2 and 4 h.

    The time of the jump is not given; 2 h is taken for it, so that the third picture follows it. The largest stress of
    all points is 161 MPa at 0.5 h, on top of the middle, and 125 MPa at 2 and 4 h. Of the roof (r < 7 mm) 98 % of the
    volume lies between 40 and 160 MPa at each time; the rest is the neutral layer near the edge.
    """
    values = {"A": 7.4e-17, "n_0": 4.9, "n_inf": 4.3, "C": 2.7, "tau_d": 13823.6, "tau_r": 8090.4, "m": 0.0}
    mesh = DimpleGeometry().mesh(2.0)
    made = run(mesh, course(PressureJump(8.0, 10.0, 7200.0).program(), 14400.0, 150e3), DRIFTING_EXPONENT, values)
    stress = made.at(made.mises, np.array([1800.0, 7200.0, 14400.0]))
    at = discretize(mesh)
    volume, roof = at.weights.ravel(), at.points[:, :, 0].ravel() < 7.0
    within = (stress > 40) & (stress < 160)
    assert (within[:, roof] @ volume[roof] > 0.98 * volume[roof].sum()).all()
    assert stress.max() == pytest.approx(160, rel=0.02)
    assert (stress.max(axis=1)[1:] < 0.9 * stress.max()).all()
