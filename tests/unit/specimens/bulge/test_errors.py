"""What a bulge test refuses, and in which words: one sentence that says what was found and what to do."""

import re
from dataclasses import replace

import numpy as np
import pytest
from sympy import exp, log

import creepkit as ck
from creepkit.errors import HistoryError, LawError, SolveError
from creepkit.language import CreepLaw, stress, time
from creepkit.records import Loading, Program, RecordedLoading, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.specimen import Bulge
from helpers.literature_laws import POWER, RATE, A, law, n, number, s_0

N3 = {"A": 5e-13, "n": 3.0}
TIMES = np.array([0.0, 600.0, 3600.0])
HELD = ck.PressureJump(8, 8, 43200)
STIFF = ck.Elastic(E=150e3)
WHERE = "simulation of law 'norton'"


def simulate(law="norton", values=N3, using="bulge", times=TIMES, loading: Loading = HELD, elastic=STIFF, **more):
    return ck.simulate(law, using, values, loading=loading, times=times, elastic=elastic, **more)


def program(*pressures: float) -> RecordedLoading:
    return RecordedLoading(Program(100.0 * np.arange(len(pressures)), np.array(pressures)), "pressure")


# ---- what is asked for ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "ask", "said"),
    [
        (
            SolveError,
            {"elastic": None},
            f"{WHERE}: a bulge test needs elastic data; set elastic=Elastic(E=...), E in MPa",
        ),
        (
            SolveError,
            {"loading": ck.constant_stress(100.0)},
            f"{WHERE}: a bulge specimen is loaded by pressure, found stress; use PressureJump",
        ),
        (
            SolveError,
            {"using": "uniaxial"},
            f"{WHERE}: a uniaxial specimen is loaded by stress, found pressure; use StressSteps or constant_stress",
        ),
        (
            SolveError,
            {"loading": program(0.0, 8.0, -2.0)},
            f"{WHERE}: the pressure falls to -2 MPa; it must not be negative",
        ),
        (
            HistoryError,
            {"times": [0.0, 600.0, 300.0]},
            f"{WHERE}: time does not increase at frame 3 (300 s after 600 s)",
        ),
        (HistoryError, {"times": []}, f"{WHERE}: no frames; a history needs at least one time"),
        (HistoryError, {"times": [0.0, np.inf]}, f"{WHERE}: times must be finite and start at or after 0 s"),
        (
            SolveError,
            {"times": [0.0]},
            f"{WHERE}: the last time is 0 s, where the load only begins; ask for a time after it",
        ),
        (HistoryError, {"temperature": -300.0}, f"{WHERE}: a temperature of -300 K is not above 0 and below 4500 K"),
        (LawError, {"values": {"A": 5e-13}}, "law 'norton' needs a value for n"),
        (
            LawError,
            {"values": {"A": -1.0, "n": 3.0}},
            "law 'norton', parameter 'A': -1 is negative; it must be positive",
        ),
        (LawError, {"values": {"A": 5e-13, "n": np.nan}}, "law 'norton', parameter 'n': nan is not a finite number"),
        (
            SolveError,
            {"loading": 8.0},
            "loading is 8.0; write constant_stress(50) or PressureJump(P1=8, P2=10, Tj=14400)",
        ),
    ],
)
def test_what_cannot_be_simulated_is_one_sentence(error: type[Exception], ask: dict, said: str) -> None:
    with pytest.raises(error) as found:
        simulate(**ask)
    assert str(found.value) == said


# ---- the specimen --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"apex_thickness": -0.5},
            "dimple: apex_thickness is -0.5; allowed is a number from 0.001 to 10000, a length in mm",
        ),
        (
            {"roof_axial": 4.0},
            "dimple: the roof would stand above the plate: roof_axial 4 mm and apex_thickness 0.5 mm add up to 4.5 mm, "
            "allowed is up to plate_thickness 4 mm; make one of them smaller or the plate thicker",
        ),
        ({"tolerance": 0.5}, "bulge specimen: tolerance is 0.5; allowed are 1e-06 to 0.1"),
        ({"max_steps": 3}, "bulge specimen: max_steps is 3; allowed are 10 to 100000"),
        ({"deflection_limit": 0.0}, "bulge specimen: deflection_limit is 0; allowed are 0.001 to 1000"),
        ({"threads": 0}, "bulge specimen: threads is 0; allowed are whole numbers above zero, or None for all cores"),
        (
            {"threads": np.inf},
            "bulge specimen: threads is inf; allowed are whole numbers above zero, or None for all cores",
        ),
        ({"max_steps": 100.5}, "bulge specimen: max_steps is 100.5; allowed are whole numbers, 10 to 100000"),
        ({"tolerance": "a"}, "bulge specimen: tolerance is 'a'; allowed are finite numbers, 1e-06 to 0.1"),
        (
            {"thickness": 0.5},
            "a bulge specimen has no field 'thickness'; did you mean 'apex_thickness'? (known: apex_thickness, "
            "cavity_radius, clamped, deflection_limit, geometry, max_steps, mesh, observation, outer_radius, "
            "plate_thickness, refinement, roof_axial, roof_radial, strain_limit, threads, tolerance)",
        ),
    ],
)
def test_a_specimen_that_cannot_be_is_one_sentence(change: dict, said: str) -> None:
    with pytest.raises(SolveError) as found:
        Bulge().replace(**change)
    assert str(found.value) == said


MESH = DimpleGeometry().mesh(0.5)
SIDE = MESH.pressed[0].tolist()
AROUND = MESH.elements[0, [1, 5, 2]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"elements": []}, "the mesh has no elements; give the eight nodes of each"),
        ({"elements": MESH.elements[:, :4]}, f"shape ({len(MESH.elements)}, 4); give each a row of its eight nodes"),
        ({"elements": MESH.elements - 1}, "but its elements name node -1"),
        ({"held": MESH.held[1:]}, f"give u_r and u_z of each of its {len(MESH.nodes)} nodes"),
        ({"held": np.ones_like(MESH.held)}, "is held at every node; hold it at its clamped rim alone"),
        ({"pressed": []}, "has no pressed side; name those that the gas presses on"),
        ({"pressed": [[0, 2, 1]]}, "nodes 0, 2 and 1 is no side of an element; name the first"),
        ({"pressed": [AROUND]}, "lies between two elements; name the first"),
        (
            {"pressed": MESH.pressed[:, ::-1]},
            f"the pressed side of nodes {SIDE[2]}, {SIDE[1]} and {SIDE[0]} runs against the order of its element, so "
            f"that pressure would pull at it; give its nodes in the order {SIDE[0]}, {SIDE[1]}, {SIDE[2]}",
        ),
    ],
)
def test_a_mesh_that_cannot_be_pressed_is_one_sentence(change: dict, said: str) -> None:
    with pytest.raises(SolveError, match=re.escape(said)):
        simulate(using=Bulge(mesh=replace(MESH, **change)))


# ---- laws that others wrote ----------------------------------------------------------------------------------------

UNDEFINED = law(A * stress**n * log(s_0 - stress), {A: RATE, n: POWER, s_0: number(-1, 100)}, "undefined")
FADING = law(A * stress**n * log(2 - time / s_0), {A: RATE, n: POWER, s_0: number(1, 1e5)}, "fading")
EXPLOSIVE = law(A * stress**n * exp(stress**s_0), {A: RATE, n: POWER, s_0: number(-1, 100)}, "explosive")


def test_a_law_without_a_number_is_named_with_the_place() -> None:
    with pytest.raises(SolveError) as found:
        simulate(UNDEFINED, {**N3, "s_0": -1.0})
    assert re.fullmatch(
        r"simulation of law 'undefined' ended at 0 s, before any of the times asked for: law has no finite creep rate, "
        r"or none with derivatives, at a stress of \d+ MPa, a creep strain of 1e-09, 1 s and 293.1 K; "
        r"check values, loading and times",
        str(found.value),
    )


def test_a_law_without_a_number_later_keeps_what_was_before() -> None:
    """After 1000 s the logarithm is negative, and the rate nothing; after 2000 s it is no number."""
    run = simulate(FADING, {**N3, "s_0": 1000.0}, times=[0.0, 300.0, 900.0, 3600.0])
    assert run.times.tolist() == [0.0, 300.0, 900.0]
    assert run.status is Status.NOT_CONVERGED
    assert 900 <= run.end_time < 2000
    assert run.reason.startswith("law has no finite creep rate, or none with derivatives, at a stress of ")
    with pytest.raises(SolveError, match="nothing is known at 3600 s"):
        run.displacement(times=3600.0)


@pytest.mark.parametrize("values", [{**N3, "s_0": 1.0}, {**N3, "s_0": 50.0}])
def test_a_law_that_grows_without_bound_ends_the_test(values: dict[str, float]) -> None:
    with pytest.raises(SolveError, match=r"^simulation of law 'explosive' ended at .* s, before any of the times"):
        simulate(EXPLOSIVE, values)


@pytest.mark.parametrize("A_now", [1e-10, 1e-5, 1e3])
def test_whatever_the_rate_nothing_comes_after_the_end(A_now: float) -> None:
    """Faster and faster creep only bursts earlier; never a number after the end."""
    soon = np.array([0.0, 1e-6, 1e-3, 1.0, 60.0, 3600.0, 43200.0])
    run = simulate(values={"A": A_now, "n": 3.0}, times=soon)
    assert run.status is Status.RUPTURED
    assert run.times[-1] <= run.end_time < 43200
    assert (np.abs(run.outputs["amplitude"]) < 3.5).all()


def test_a_rate_beyond_all_numbers_is_no_answer() -> None:
    with pytest.raises(SolveError) as found:
        simulate(values={"A": 1e300, "n": 3.0})
    assert str(found.value) == (
        f"{WHERE} ended at 0 s, before any of the times asked for: the law gave no finite rate at a point; "
        "check values, loading and times; A = 1e+300 lies outside its bounds, 1e-40 to 1e-05"
    )


def test_a_predictor_of_candidates_never_holds_numbers_after_an_end() -> None:
    one: CreepLaw = ck.law("norton")
    plan = simulate(times=[0.0, 3600.0, 43200.0])
    found = ck.specimen("bulge").predict(one, one.to_internal({"A": np.array([5e-13, 5e-10]), "n": 3.0}), [plan])
    assert found.status[:, 0].tolist() == [Status.COMPLETE, Status.RUPTURED]
    assert np.isnan(found.values[1, 0, plan.times > found.end_times[1, 0]]).all()
