"""Odd tables and arguments of ck.rupture: an answer or one sentence, and no strength without its flag."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.rupture_assessment.fitting import GroupedTimes, _shared_tests
from helpers.planted_rupture import larson_miller, planted

TESTS = planted(larson_miller, count=18)


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
        found.rupture_time(0.0, 900.0)


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
