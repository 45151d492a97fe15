"""The nouns: programs, loadings, histories and nuisances, and what they refuse."""

import dataclasses
import pickle

import numpy as np
import pytest

from creepkit.errors import HistoryError, SolveError
from creepkit.records import (
    History,
    Loading,
    Nuisance,
    Prediction,
    PressureJump,
    Program,
    RecordedLoading,
    StressSteps,
    constant_stress,
)

LOADINGS = [
    constant_stress(60.0),
    StressSteps(((0, 100), (3600, 120)), "stress"),
    PressureJump(8, 10, 14580),
    RecordedLoading(Program([0, 5], [0, 8]), "pressure"),
]


def history(**changes) -> History:
    made = History("a", [0.0, 1.0, 2.0], {"strain": [0.0, 0.1, 0.05]}, constant_stress(60.0), 1123.15)
    return made.replace(**changes)


def test_program_is_linear_between_its_points_and_holds_beyond_them():
    program = Program([0, 10, 30], [0, 5, 1])
    np.testing.assert_allclose(program.at([0, 2, 10, 25, 30, 99]), [0, 1, 5, 2, 1, 1])
    np.testing.assert_allclose(program.at([[5.0], [20.0]]), [[2.5], [3.0]])
    assert Program.constant(7).at(1e9) == 7


def test_program_jumps_at_a_repeated_time_to_the_later_value():
    program = Program.steps([(0, 100), (3600, 120), (7200, 80)])
    before = np.nextafter([3600, 7200], 0)
    np.testing.assert_allclose(program.at([0, *before, 3600, 7200, 1e6]), [100, 100, 120, 120, 80, 80])


def test_programs_compare_by_value_and_cannot_be_changed():
    one, two = Program([0, 1], [2, 3]), Program(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert one == two
    assert hash(one) == hash(two)
    assert one != Program([0, 1], [2, 4])
    assert one != "program"
    with pytest.raises(ValueError, match="read-only"):
        one.values[0] = 1.0


@pytest.mark.parametrize("loading", LOADINGS)
def test_loadings_are_values(loading):
    assert isinstance(loading, Loading)
    assert pickle.loads(pickle.dumps(loading)) == loading
    assert hash(dataclasses.replace(loading)) == hash(loading)
    with pytest.raises(dataclasses.FrozenInstanceError):
        loading.quantity = "force"


def test_programs_of_the_loadings():
    np.testing.assert_allclose(LOADINGS[1].program().at([0, 3599, 3600]), [100, 100, 120])
    # 5 s ramps: half of 8 MPa after 2.5 s, half way from 8 to 10 MPa 2.5 s after the jump
    np.testing.assert_allclose(LOADINGS[2].program().at([0, 2.5, 5, 14580, 14582.5, 2e4]), [0, 4, 8, 8, 9, 10])
    np.testing.assert_allclose(LOADINGS[3].program().at([2.5, 9]), [4, 8])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Program([0, 1], [1]), "as many values as times, found 1 and 2"),
        (lambda: Program([], []), "as many values as times"),
        (lambda: Program([1, 2], [1, 1]), "must start at 0 and never decrease"),
        (lambda: Program([0, 2, 1], [1, 1, 1]), "must start at 0 and never decrease"),
        (lambda: Program([0, 1], [1, np.nan]), "finite numbers only"),
        (lambda: history(**{"times": []}), "history 'a': no frames"),
        (lambda: history(**{"times": [0, 2, 1]}), "history 'a': time does not increase at frame 3"),
        (lambda: history(**{"times": [0, 1, 1]}), "history 'a': time does not increase at frame 3"),
        (lambda: history(**{"times": [-1, 0, 1]}), "history 'a': times must be finite and start at or after 0 s"),
        (lambda: history(**{"times": [0, 1, np.inf]}), "history 'a': times must be finite"),
        (lambda: history(**{"outputs": {"strain": [0.0]}}), "history 'a': output 'strain' has 1 values for 3 times"),
        (lambda: history(**{"temperature": -5.0}), "history 'a': a temperature of -5 K is not above 0"),
        (lambda: history(**{"temperature": np.nan}), "history 'a': a temperature of nan K"),
        (lambda: history(**{"times": [], "source": "x.csv"}), "^x.csv: no frames"),
        (lambda: StressSteps(()), "must start at time 0"),
        (lambda: StressSteps(((1, 100),)), "must start at time 0"),
        (lambda: StressSteps(((0, 100), (0, 120))), "follow one another in time"),
        (lambda: constant_stress(-1.0), r"from 0 to 1e5 MPa in every step, found \[-1.0\]"),
        (lambda: constant_stress(float("nan")), "from 0 to 1e5 MPa"),
        (lambda: constant_stress(1.0, "force"), "control is 'force'; allowed are 'load' and 'stress'"),
        (lambda: PressureJump(8, 10, 5), "Tj after the first ramp"),
        (lambda: PressureJump(0, 10, 50), "above zero"),
        (lambda: Nuisance("offset", sd=0.0), "must be above zero"),
        (lambda: Nuisance("offset", bounds=(1.0, 0.0)), "are reversed"),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    with pytest.raises((HistoryError, SolveError), match=message):
        make()


def test_history_keeps_its_own_copies():
    times = np.array([0.0, 1.0, 2.0])
    made = history(times=times)
    times[0] = -1.0
    assert made.times[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.outputs["strain"][0] = 1.0
    with pytest.raises(TypeError):
        made.labels["heat"] = "X7"


def test_history_marks_frames_from_the_first_one_beyond_a_limit():
    cut = history().up_to("strain", 0.06)
    assert cut.used.tolist() == [True, False, False]
    assert history().up_to("strain", 0.2).used.all()
    assert history(used=[True, False, True]).up_to("strain", 0.06).used.tolist() == [True, False, True]


def test_standard_deviation_may_be_one_number():
    assert history(standard_deviation={"strain": 1e-5}).standard_deviation["strain"].tolist() == [1e-5] * 3


@pytest.mark.parametrize(
    ("loading", "temperature", "words"),
    [
        (constant_stress(43.0), 1123.15, "850 °C, 43 MPa"),
        (StressSteps(((0, 100), (3600, 120))), 1123.15, "850 °C, 100 to 120 MPa"),
        (PressureJump(8, 10, 14580), 1075.6, "802 °C, 8 to 10 MPa"),
        (constant_stress(43.0), Program([0, 10], [1123.15, 1173.15]), "850 to 900 °C, 43 MPa"),
    ],
)
def test_condition_in_words(loading, temperature, words):
    assert history(loading=loading, temperature=temperature).condition == words


def test_prediction_gives_the_frames_of_one_test():
    padded = np.arange(2 * 2 * 3 * 1, dtype=float).reshape(2, 2, 3, 1)
    prediction = Prediction(padded, ("strain",), np.array([3, 2]), np.zeros((2, 2), int), np.ones((2, 2)))
    assert prediction.of(1, candidate=1)[:, 0].tolist() == [9.0, 10.0]
