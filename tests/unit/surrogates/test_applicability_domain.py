"""The domain guard: its leave-one-out distances, boxes, combinations that never occurred, and its document."""

import json
from dataclasses import replace

import numpy as np
import pytest

from creepkit.errors import CreepkitError
from creepkit.surrogates.applicability_domain import ApplicabilityDomain
from creepkit.surrogates.surrogate import CODEC


def mahalanobis(row: np.ndarray, others: np.ndarray) -> float:
    apart = row - others.mean(axis=0)
    return float(np.sqrt(apart @ np.linalg.solve(np.cov(others, rowvar=False), apart)))


def test_the_limit_is_the_largest_distance_of_a_row_from_all_others() -> None:
    rows = np.random.default_rng(0).normal(size=(30, 3)) * [1.0, 100.0, 1e-3]
    brute = max(mahalanobis(row, np.delete(rows, k, axis=0)) for k, row in enumerate(rows))
    assert ApplicabilityDomain.from_rows("abc", rows).limit == pytest.approx(brute, rel=1e-9)


def test_training_rows_are_inside() -> None:
    rows = np.random.default_rng(1).uniform(size=(200, 6))
    assert not ApplicabilityDomain.from_rows("abcdef", rows).outside(rows).any()


def test_one_input_beyond_its_range_is_outside() -> None:
    domain = ApplicabilityDomain.from_rows(
        ("log10 A", "n"), np.random.default_rng(2).uniform(size=(100, 2)) * [10, 1] + [-20, 3]
    )
    assert domain.outside(np.array([[-15.0, 4.2], [-15.0, 3.5]])).tolist() == [True, False]


def test_a_combination_that_never_occurred_is_outside_though_each_input_is_within_its_range() -> None:
    n = np.linspace(2.0, 8.0, 60)
    rows = np.stack([-7.0 - 2.0 * n + 0.3 * np.random.default_rng(3).normal(size=60), n], axis=1)
    domain = ApplicabilityDomain.from_rows(("log10 A", "n"), rows)
    odd = np.array([-11.0, 7.5])
    assert (domain.low < odd).all()
    assert (odd < domain.high).all()
    assert domain.outside(odd)
    assert not domain.outside(np.array([-7.0 - 2.0 * 5.0, 5.0]))


def test_what_never_varied_may_not_vary() -> None:
    rows = np.stack([np.full(50, 0.5), np.linspace(0, 1, 50)], axis=1)
    domain = ApplicabilityDomain.from_rows(("apex_thickness", "x"), rows)
    assert not domain.outside(np.array([0.5, 0.3]))
    assert domain.outside(np.array([0.51, 0.3]))


def test_each_input_is_forgiven_what_it_is_told() -> None:
    rows = np.random.default_rng(7).uniform(size=(400, 2)) * [1, 10]
    domain = replace(ApplicabilityDomain.from_rows(("thickness", "exponent"), rows, [0.05, 0.5]), limit=np.inf)
    assert domain.outside(np.array([[1.04, 5.0], [1.06, 5.0], [0.5, 14.5], [0.5, 15.5]])).tolist() == [0, 1, 0, 1]


def test_a_document_without_margins_is_damaged() -> None:
    rows = np.stack([np.linspace(0.0, 1.0, 50), np.random.default_rng(8).normal(size=50)], axis=1)
    document = CODEC.to_json(ApplicabilityDomain.from_rows("ab", rows, 0.5))
    del document["margin"]
    with pytest.raises(CreepkitError, match="'margin' is missing"):
        CODEC.from_json(ApplicabilityDomain, document)


def test_inputs_that_are_not_there_are_not_far() -> None:
    rows = np.random.default_rng(4).uniform(size=(50, 2))
    rows[::3, 0] = np.nan
    domain = ApplicabilityDomain.from_rows("ab", rows)
    assert not domain.outside(np.array([np.nan, 0.5]))
    assert domain.outside(np.array([np.nan, 5.0]))


def test_few_rows_leave_the_box_alone() -> None:
    domain = ApplicabilityDomain.from_rows("abc", np.array([[0.0, 0, 0], [1.0, 1, 0], [0.0, 1, 1]]))
    assert domain.limit == np.inf
    assert not domain.outside(np.array([0.5, 0.5, 0.5]))
    assert domain.outside(np.array([1.5, 0.5, 0.5]))


def test_the_document_is_json_and_gives_the_same_distances() -> None:
    rows = np.random.default_rng(5).normal(size=(40, 4))
    domain = ApplicabilityDomain.from_rows("abcd", rows)
    again = CODEC.from_json(ApplicabilityDomain, json.loads(json.dumps(CODEC.to_json(domain))))
    assert np.array_equal(again.distance(rows), domain.distance(rows))


def test_a_damaged_document_says_so() -> None:
    document = CODEC.to_json(ApplicabilityDomain.from_rows("ab", np.random.default_rng(6).normal(size=(9, 2))))
    for changes, message in (
        ({"low": [0.0]}, "its arrays do not belong to 2 inputs"),
        ({"mean": "x"}, "mean is 'x', where a list is needed"),
        ({"names": None}, "names is null, where a list is needed"),
        ({"whitening": [[1.0, 0.0]]}, "its arrays do not belong to 2 inputs"),
        ({"whitening": [[1.0], 0.0]}, "whitening.1 is 0.0, where a list is needed"),
        ({"limits": 1.0}, "unknown key 'limits'; did you mean 'limit'"),
    ):
        with pytest.raises(CreepkitError, match=message):
            CODEC.from_json(ApplicabilityDomain, {**document, **changes})
