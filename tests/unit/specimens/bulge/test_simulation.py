"""What a simulated bulge test holds: displacements, profile, stresses, fields and pictures, until its end."""

from pathlib import Path

import numpy as np
import pytest
from sympy import log

import creepkit as ck
from creepkit.errors import ArgumentError, HistoryError, LawError, SolveError
from creepkit.language import stress, time
from creepkit.language.elastic import STATE_MODULUS
from creepkit.readers.history_csv import write_history
from creepkit.records import Loading, Program, RecordedLoading, Status
from creepkit.specimens.bulge.run import BulgeRun
from helpers.literature_laws import POWER, RATE, A, B, damage, k, law, n, number, s_0

N3 = {"A": 5e-13, "n": 3.0}
TIMES = np.array([0.0, 150, 600, 1800, 3600, 7200, 14400, 28800, 43200])
HELD = ck.PressureJump(8, 8, 43200)
STIFF = ck.Elastic(E=150e3)


def simulated(law="norton", values=N3, using="bulge", times=TIMES, loading=HELD, elastic=STIFF, **more) -> BulgeRun:
    run = ck.simulate(law, using, values, loading=loading, times=times, elastic=elastic, **more)
    assert isinstance(run, BulgeRun)
    return run


@pytest.fixture(scope="module")
def run() -> BulgeRun:
    return simulated()


@pytest.fixture(scope="module")
def burst() -> BulgeRun:
    return simulated(values={"A": 5e-11, "n": 3.0})


# ---- displacements -------------------------------------------------------------------------------------------------


def test_displacement_at_nodes_is_that_of_the_mesh_and_quadratic_between_them(run: BulgeRun) -> None:
    top = run.model.top
    radii, rise = run.model.nodes[top, 0], run.displacements()[:, top, 1]
    np.testing.assert_allclose(run.displacement(radii), rise, atol=1e-15)
    assert (radii[0], radii[-1]) == (0.0, 10.0)
    halfway = np.array([0.375, 0.75, -0.125])
    np.testing.assert_allclose(run.displacement(halfway @ radii[2:5]), rise[:, 2:5] @ halfway, rtol=1e-9)


# ---- stresses and strains ------------------------------------------------------------------------------------------


def test_states_of_a_law_are_fields() -> None:
    law = damage(A * stress**n, B * stress**k, {A: RATE, n: POWER, B: RATE, k: POWER})
    run = simulated(law, {**N3, "B": 1e-12, "k": 3.0}, times=[0.0, 3600.0])
    _, damaged = run.field("omega", 3600.0)
    _, strain = run.field("creep strain", 3600.0)
    np.testing.assert_allclose(damaged, 2 * strain, rtol=1e-6)
    with pytest.raises(SolveError, match="a bulge run has no field 'omga'; did you mean 'omega'"):
        run.field("omga")


# ---- how it ends ---------------------------------------------------------------------------------------------------


def test_a_burst_is_an_answer_up_to_there(burst: BulgeRun) -> None:
    assert burst.status is Status.RUPTURED
    assert burst.reason == "the surface reached the deflection limit"
    assert burst.labels == {"ended": burst.reason}
    assert burst.rupture_time == burst.end_time
    assert burst.times[-1] <= burst.end_time < 43200
    assert burst.displacement(times=burst.end_time) >= 3.0
    assert burst.displacement()[-1] < 3.0


def test_nothing_is_known_after_the_end(burst: BulgeRun) -> None:
    with pytest.raises(SolveError) as said:
        burst.displacement(times=43200.0)
    assert str(said.value) == (
        f"run 'simulated': nothing is known at 43200 s; the simulation reaches from 0 to {burst.end_time:g} s "
        "(the surface reached the deflection limit)"
    )
    for ask in (burst.displacements, lambda t: burst.field("stress", t), burst.section):
        with pytest.raises(SolveError, match="nothing is known at 43200 s"):
            ask(43200.0)


# ---- kept, written, drawn ------------------------------------------------------------------------------------------


def test_a_run_is_a_history_that_files_keep(run: BulgeRun, tmp_path: Path) -> None:
    thin = simulated(using=ck.specimen("bulge").replace(apex_thickness=0.45))
    (read,) = ck.read_histories(write_history(thin, tmp_path / "thin.csv"))
    assert read.specimen == "bulge"
    assert read.geometry == thin.geometry
    assert read.geometry["apex_thickness"] == 0.45
    assert (read.operator, read.elastic, read.loading) == ("profile 0-7.5 mm", STIFF, HELD)
    for name, values in thin.outputs.items():
        np.testing.assert_array_equal(read.outputs[name], values)
    again = ck.specimen("bulge").predict(ck.law("norton"), ck.law("norton").to_internal(N3), [read])
    np.testing.assert_allclose(again.of(0)[:, 0], thin.outputs["amplitude"], rtol=1e-9)


# ---- errors ----------------------------------------------------------------------------------------------------------

# What a bulge test refuses, and in which words: one sentence that says what was found and what to do.


FRAMES = np.array([0.0, 600.0, 3600.0])
WHERE = "simulation of law 'norton'"


def simulate(law="norton", values=N3, using="bulge", times=FRAMES, loading: Loading = HELD, elastic=STIFF, **more):
    return ck.simulate(law, using, values, loading=loading, times=times, elastic=elastic, **more)


def program(*pressures: float) -> RecordedLoading:
    return RecordedLoading(Program(100.0 * np.arange(len(pressures)), np.array(pressures)), "pressure")


# ---- what is asked for ---------------------------------------------------------------------------------------------


MISTAKES = [
    (SolveError, {"elastic": None},
     f"{WHERE}: specimen 'bulge' needs elastic data; {STATE_MODULUS}"),
    (SolveError, {"loading": ck.constant_stress(100.0)},
     f"{WHERE}: specimen 'bulge' is loaded by pressure (MPa), found stress; use PressureJump"),
    (SolveError, {"using": "uniaxial"},
     f"{WHERE}: a uniaxial specimen is loaded by stress, found pressure; use StressSteps or constant_stress"),
    (SolveError, {"loading": program(0.0, 8.0, -2.0)},
     f"{WHERE}: the pressure falls to -2 MPa; it must not be negative"),
    (HistoryError, {"times": [0.0, 600.0, 300.0]},
     f"{WHERE}: time does not increase at frame 3 (300 s after 600 s)"),
    (HistoryError, {"times": []}, f"{WHERE}: no frames; a history needs at least one time"),
    (HistoryError, {"times": [0.0, np.inf]}, f"{WHERE}: times must be finite and start at or after 0 s"),
    (SolveError, {"times": [0.0]},
     f"{WHERE}: the last time is 0 s, where the load only begins; ask for a time after it"),
    (HistoryError, {"temperature": -300.0}, f"{WHERE}: a temperature of -300 K is not above 0 and below 4500 K"),
    (LawError, {"values": {"A": 5e-13}},
     "law 'norton' needs a value for n; give all of them, such as {'n': 1.5}, in a command --set n=1.5"),
    (LawError, {"values": {"A": -1.0, "n": 3.0}},
     "law 'norton', parameter 'A': -1 is negative; it must be positive"),
    (ArgumentError, {"values": {"A": 5e-13, "n": np.nan}},
     "values['n'] of simulate() is nan; allowed is a finite number"),
    (ArgumentError, {"loading": 8.0},
     "loading of simulate() is 8.0; allowed is a loading such as constant_stress(50) or PressureJump(P1=8, P2=10, "
     "Tj=14400)"),
]  # fmt: skip


def test_what_cannot_be_simulated_is_one_sentence() -> None:
    for error, ask, said in MISTAKES:
        with pytest.raises(error) as found:
            simulate(**ask)
        assert str(found.value) == said


# ---- laws that others wrote ----------------------------------------------------------------------------------------

FADING = law(A * stress**n * log(2 - time / s_0), {A: RATE, n: POWER, s_0: number(1, 1e5)}, "fading")


def test_a_law_without_a_number_later_keeps_what_was_before() -> None:
    """After 1000 s the logarithm is negative, and the rate nothing; after 2000 s it is no number."""
    run = simulate(FADING, {**N3, "s_0": 1000.0}, times=[0.0, 300.0, 900.0, 3600.0])
    assert run.times.tolist() == [0.0, 300.0, 900.0]
    assert run.status is Status.NOT_CONVERGED
    assert 900 <= run.end_time < 2000
    assert run.reason.startswith("the law has no finite creep rate, or no derivatives; 'creepkit check' says")
    with pytest.raises(SolveError, match="nothing is known at 3600 s"):
        run.displacement(times=3600.0)


@pytest.mark.parametrize("A_now", [1e-10, 1e-5, 1e3])
def test_whatever_the_rate_nothing_comes_after_the_end(A_now: float) -> None:
    """Faster and faster creep only bursts earlier; never a number after the end."""
    soon = np.array([0.0, 1e-6, 1e-3, 1.0, 60.0, 3600.0, 43200.0])
    run = simulate(values={"A": A_now, "n": 3.0}, times=soon)
    assert run.status is Status.RUPTURED
    assert run.times[-1] <= run.end_time < 43200
    assert (np.abs(run.outputs["amplitude"]) < 3.5).all()
