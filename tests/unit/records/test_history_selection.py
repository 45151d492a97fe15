"""Subsets of tests by label: what matches, and what an error names."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError

TIMES = np.array([1.0, 2.0])


def bar(name: str, stress: float, temperature: float, **labels: str) -> ck.History:
    alloy = labels.pop("alloy", "")
    outputs = {"strain": 1e-3 * TIMES}
    return ck.History(name, TIMES, outputs, ck.constant_stress(stress), temperature, alloy=alloy, labels=labels)


TESTS = [
    bar("a1", 50, 1073.15, alloy="X", heat="7"),
    bar("a2", 80, 1073.15, alloy="X", heat="8"),
    bar("b1", 80, 1123.15, alloy="Y"),
]


@pytest.mark.parametrize(
    ("labels", "names"),
    [
        ({}, ["a1", "a2", "b1"]),
        ({"name": "a2"}, ["a2"]),
        ({"name": "a*"}, ["a1", "a2"]),
        ({"name": ["b1", "a1"]}, ["a1", "b1"]),
        ({"temperature": 1073}, ["a1", "a2"]),
        ({"temperature": "1123.15"}, ["b1"]),
        ({"stress": 80}, ["a2", "b1"]),
        ({"stress": 80, "alloy": "X"}, ["a2"]),
        ({"heat": "7"}, ["a1"]),
        ({"heat": 7}, ["a1"]),
        ({"specimen": "uniaxial"}, ["a1", "a2", "b1"]),
    ],
)
def test_tests_are_selected_by_label(labels: dict[str, str | float], names: list[str]) -> None:
    assert [history.name for history in ck.select_tests(TESTS, **labels)] == names


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        ({"temprature": 1073}, "no test has a label 'temprature': did you mean 'temperature'?"),
        ({"temperature": 1100}, "no test has temperature=1100; there are 1073.15, 1123.15"),
        ({"temperature": "hot"}, "temperature=hot is not a number; write one, as in temperature=1073.15"),
        ({"alloy": "Z"}, "no test has alloy=Z; there are X, Y"),
        ({"alloy": "Y", "stress": 50}, "no test has alloy=Y and stress=50 at once"),
        ({"pressure": 8}, "no test has a label 'pressure': did you mean 'stress'?"),
    ],
)
def test_an_error_names_the_labels_that_exist(labels: dict[str, str | float], message: str) -> None:
    with pytest.raises(HistoryError) as raised:
        ck.select_tests(TESTS, **labels)
    assert message in str(raised.value)
