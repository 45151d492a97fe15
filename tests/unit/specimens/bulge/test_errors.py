"""What a bulge test refuses, and in which words: one sentence that says what was found and what to do."""

import numpy as np
import pytest
from sympy import log

import creepkit as ck
from creepkit.errors import HistoryError, LawError, SolveError
from creepkit.language import stress, time
from creepkit.records import Loading, Program, RecordedLoading, Status
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


MISTAKES = [
    (SolveError, {"elastic": None},
     f"{WHERE}: specimen 'bulge' needs elastic data; set elastic=Elastic(E=...), E in MPa"),
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
    (LawError, {"values": {"A": 5e-13, "n": np.nan}}, "law 'norton', parameter 'n': nan is not a finite number"),
    (SolveError, {"loading": 8.0}, "loading is 8.0; write constant_stress(50) or PressureJump(P1=8, P2=10, Tj=14400)"),
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
    assert run.reason.startswith("law has no finite creep rate, or none with derivatives, at a stress of ")
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


def test_a_rate_beyond_all_numbers_is_no_answer() -> None:
    with pytest.raises(SolveError) as found:
        simulate(values={"A": 1e300, "n": 3.0})
    assert str(found.value) == (
        f"{WHERE} ended at 0 s, before any of the times asked for: the law gave no finite rate at a point; "
        "check values, loading and times; A = 1e+300 lies outside its bounds, 1e-40 to 1e-05"
    )
