"""Odd tables and arguments of ck.rupture: an answer or one sentence, and no strength without its flag."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError, HistoryError
from creepkit.rupture_assessment.likelihood import GroupedTimes, _shared_tests
from helpers.planted_rupture import larson_miller, planted, rupture_test

TESTS = planted(larson_miller, count=18)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"hours": 1e5}, "hours is 100000.0; give a list"),
        ({"hours": []}, "hours is empty"),
        ({"hours": "1e5"}, "hours is '1e5'; give a list"),
        ({"hours": [10**400]}, "asked for at inf h"),
        ({"temperatures": 900.0}, "temperatures is 900.0; give a list"),
        ({"temperatures": []}, "temperatures is empty"),
        ({"temperatures": [float("nan")]}, "a temperature is nan"),
        ({"methods": 5}, "methods is 5; give a list of names"),
    ],
)
def test_odd_arguments(arguments: dict, sentence: str) -> None:
    with pytest.raises(FitError, match=sentence) as caught:
        ck.rupture(TESTS, **arguments)
    assert "\n" not in str(caught.value)


def test_numbers_of_numpy_are_numbers() -> None:
    found = ck.rupture(TESTS, "larson-miller", hours=np.array([1e3, 1e4]), temperatures=np.array([873.15], np.float32))
    assert [one.hours for one in found.strengths if one.method == "average"] == [1e3, 1e4]


def test_constants_that_are_given_have_a_size() -> None:
    with pytest.raises(FitError, match="at most 1e7 in size"):
        ck.RuptureSettings(fixed={"larson-miller": {"C": 1e300}})
    settings = ck.RuptureSettings(fixed={"larson-miller": {"C": 1e6}})
    assert "FAILS" in str(ck.rupture(TESTS, "larson-miller", settings=settings))


def test_few_tests_are_refused_in_a_short_sentence() -> None:
    for tests in (TESTS[:1], TESTS[:2], [rupture_test(f"t{k}", 100.0, 873.15, 90.0 + k) for k in range(9)]):
        with pytest.raises(FitError, match="do not determine the .* constants|take . or more") as caught:
            ck.rupture(tests)
        assert len(str(caught.value)) < 500


def test_one_temperature_and_strengths_at_another() -> None:
    tests = [h for h in TESTS if h.temperature == 873.15]
    found = ck.rupture(tests, temperatures=[700.0])
    assert all(one.value is None and "all tests are at" in one.reason for one in found.strengths)
    assert any("no strength can be stated" in check.found for check in found.checks)


def test_tests_that_stand_twice_are_told() -> None:
    assert any("18 tests have the stress" in note for note in ck.rupture([*TESTS, *TESTS], "larson-miller").notes)
    assert not any("have the stress" in note for note in ck.rupture(TESTS, "larson-miller").notes)


def test_times_beyond_a_double_are_infinite() -> None:
    found = ck.rupture(TESTS, "larson-miller")
    assert found.rupture_time(1e-3, 20.0) == (np.inf, np.inf, np.inf)
    with pytest.raises(FitError, match="give MPa above zero"):
        found.rupture_time("abc", 900.0)


def test_a_load_is_a_record() -> None:
    with pytest.raises(HistoryError, match=r"loading is 100; give what was imposed, such as ck.constant_stress"):
        ck.History("a", [3600.0], {}, 100, 873.15, rupture_time=3600.0)


def test_pairs_of_levels_that_share_tests() -> None:
    """The Hessian of effects of heats and laboratories against the product of matrices."""
    rng = np.random.default_rng(0)
    groups = {
        "heat": [f"H{k}" for k in rng.integers(0, 7, 40)],
        "laboratory": [f"L{k}" for k in rng.integers(0, 3, 40)],
    }
    members = np.column_stack(GroupedTimes.of(np.zeros(40), np.zeros(40, bool), groups, "lognormal").members)
    weights = rng.uniform(size=(5, 40))
    first, second, order, starts = _shared_tests(members)
    found = np.zeros((5, members.shape[1], members.shape[1]))
    found[:, first, second] = np.add.reduceat(weights[:, order], starts, axis=1)
    np.testing.assert_allclose(found, np.einsum("ml,cm,mk->clk", members, weights, members), atol=1e-12)
