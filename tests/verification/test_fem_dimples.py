"""Bulging dimples against converged runs of another code: five of the true dimple, four of one with a flat floor."""

from __future__ import annotations

import json
from typing import NamedTuple

import numpy as np
import pytest

from creepkit.fem.mesh import discretize
from creepkit.fem.mesh_files import read_mesh
from creepkit.fem.simulation import LoadHistory, Simulation
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.language import CreepLaw
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import PressureJump, Program, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.observation import Observation
from helpers.decks import mesh_of_deck
from helpers.fem_cases import BENCHMARKS, course, run
from helpers.paths import NO_SHARED_DATA

if not BENCHMARKS.is_dir():
    pytest.skip(NO_SHARED_DATA, allow_module_level=True)

TAPERED = DimpleGeometry()
FILLET = DimpleGeometry(
    apex_thickness=1, cavity_radius=5, roof_radial=1, roof_axial=1.5, plate_thickness=4, outer_radius=7.5,
    clamped=("rim",),
)  # fmt: skip
END = 43200.0
TRUE = json.loads((BENCHMARKS / "dimple_reference.json").read_text())["cases"]
FLAT = json.loads((BENCHMARKS / "fe_reference.json").read_text())
DRIFT = {"n0": "n_0", "ninf": "n_inf", "C": "C", "td": "tau_d", "tr": "tau_r"}
ACCURATE = {"tolerance": 1e-3, "newton": 1e-6}


class Case(NamedTuple):
    """A law, its values and the course of a test."""

    law: CreepLaw
    values: dict[str, float]
    course: LoadHistory


def true_case(name: str) -> Case:
    """A case of dimple_reference.json: ramps of 5 s."""
    case, law = TRUE[name], dict(TRUE[name]["law"])
    kind = law.pop("type")
    if kind == "nt":
        law = {"A": case["A_at_T"], "m": 0.0, **{ours: law[theirs] for theirs, ours in DRIFT.items()}}
    laws = {"norton": NORTON, "time": TIME_HARDENING, "sinh": HYPERBOLIC_SINE, "nt": DRIFTING_EXPONENT}
    pressure = PressureJump(case["P1"], case["P2"], case["Tj"] or 0.5 * END).program()
    return Case(laws[kind], law, course(pressure, END, case["E"]))


def flat_case(name: str) -> Case:
    """A case of fe_reference.json, spelled out from its `spec`: pressure at once, and its jump at once at 4 h."""
    combined = dict(A_1=1e-8, n_1=3, B=60, A_2=1e-13, n_2=4, m_1=-0.3, A_3=1e-11, n_3=3, m_2=-0.4)
    jump = Program.steps([(0.0, 8.0), (14400.0, 10.0)])
    return {
        "c1": Case(NORTON, {"A": 1e-13, "n": 4.3}, course(8.0, END, 150e3)),
        "c2": Case(NORTON, {"A": 6e-19, "n": 7}, course(jump, END, 100e3)),
        "c3": Case(TIME_HARDENING, {"A": 1.2e-10, "n": 3.2, "m": -0.4}, course(6.0, END, 200e3)),
        "c4": Case(COMBINED, combined, course(jump, END, 150e3)),
    }[name]


def simulated(geometry: DimpleGeometry, case: Case, refinement: float, **settings):
    """Radii of the top nodes and the finished run."""
    mesh = geometry.mesh(refinement)
    made = run(mesh, case.course, case.law, case.values, **settings)
    assert made.status == Status.COMPLETE
    return mesh.nodes[mesh.top, 0], made.displacements[:, mesh.top, 1], made


def observed(radii, profiles, made: Simulation, times) -> dict[str, np.ndarray]:
    """Histories at `times` by the names of dimple_reference.json."""
    points = made.at(profiles @ surface_interpolation(radii, [0, 2, 4]).T, times)
    fit = made.at(Observation().observe(radii, profiles), times)
    return dict(zip(("apex", "u_r2", "u_r4", "D_amp", "S_d", "S_p"), [*points.T, *fit.T], strict=True))


@pytest.mark.parametrize("name", TRUE)
def test_true_dimple_on_the_mesh_for_production(name: str) -> None:
    """Targets of the project: the apex within 0.2 % of its largest, what is fitted, or seen elsewhere, within 0.4 %."""
    case = TRUE[name]
    found = observed(*simulated(TAPERED, true_case(name), 1.0), np.array(case["times_s"], float))
    largest = max(case["apex"])
    np.testing.assert_allclose(found["apex"], case["apex"], rtol=0, atol=2e-3 * largest)
    for key in ("u_r2", "u_r4", "D_amp"):
        np.testing.assert_allclose(found[key], case[key], rtol=0, atol=4e-3 * largest, err_msg=key)
    for key in ("S_d", "S_p"):
        np.testing.assert_allclose(found[key], case[key], rtol=4e-3, err_msg=key)


@pytest.mark.parametrize("name", TRUE)
def test_true_dimple_converges(name: str) -> None:
    """Twice as fine, with a tenth of the tolerance: displacements, width and shape within 0.06 %.

    The references estimate their own error at 0.02 %, in single values of N7 and SINH at 0.1 %.
    """
    case = TRUE[name]
    found = observed(*simulated(TAPERED, true_case(name), 2.0, **ACCURATE), np.array(case["times_s"], float))
    for key in ("apex", "u_r2", "u_r4", "D_amp"):
        np.testing.assert_allclose(found[key], case[key], rtol=0, atol=6e-4 * max(case["apex"]), err_msg=key)
    for key in ("S_d", "S_p"):
        np.testing.assert_allclose(found[key], case[key], rtol=6e-4, err_msg=key)


def flat_errors(name: str, refinement: float, **settings) -> tuple[float, float, float]:
    """Errors of elastic apex (relative), apex history and final top profile, over the largest apex."""
    case = FLAT["cases"][name]
    radii, profiles, made = simulated(FILLET, flat_case(name), refinement, **settings)
    history = made.at(profiles[:, 0], np.array(FLAT["times_s"])) - case["apex"]
    wanted = {float(r): u for r, u in case["final_top_profile_uz"].items()}
    profile = surface_interpolation(radii, list(wanted)) @ profiles[-1] - list(wanted.values())
    largest = max(case["apex"])
    return profiles[1, 0] / case["u_elastic"] - 1, np.abs(history).max() / largest, np.abs(profile).max() / largest


@pytest.mark.parametrize(("name", "refinement"), [("c1", 1.0), ("c2", 1.5), ("c3", 1.0), ("c4", 1.0)])
def test_flat_dimple_within_two_per_mille(name: str, refinement: float) -> None:
    """Targets of the project, on the mesh for production; n = 7 of c2 takes one of half as many elements again.

    (It ends at -0.21 % on that for production.) The values at 4 h are those before the jump of c2 and c4.
    """
    elastic, history, profile = flat_errors(name, refinement)
    assert abs(elastic) < 2e-3
    assert history < 2e-3
    assert profile < 2e-3


@pytest.mark.parametrize("name", FLAT["cases"])
def test_flat_dimple_converges(name: str) -> None:
    """Twice as fine: within 0.1 %, as the references estimate themselves at 0.05 to 0.13 % (c2 0.25 % at 4 h)."""
    elastic, history, profile = flat_errors(name, 2.0, **ACCURATE)
    assert abs(elastic) < 5e-4
    assert history < 1e-3
    assert profile < 1e-3


# ---- fem other meshes ------------------------------------------------------------------------------------------------

# Meshes of others: two CalculiX decks with their results, the paper's own mesh, and the paper's example of Fig. 2c.


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
def deck(request, tmp_path_factory):
    """The table of a deck's results, and ours on its mesh of 174 CAX8R: u_z along the top, fit, largest stress."""
    name, law, values = request.param
    table = np.genfromtxt(DECKS / f"{name}.csv", delimiter=",", names=True)
    mesh = mesh_of_deck(DECKS / f"{name}.inp", tmp_path_factory.mktemp("deck"))
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
