"""Checks of annotations that depend on the release of NumPy or on Python."""

from __future__ import annotations

import types
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from creepkit.annotation_checks import check_of, is_nested_deep


class Alias:
    """As `type NDArray[T] = ...` of Python 3.12 is, by which NumPy 2.5 defines it."""

    __value__ = NDArray


@pytest.mark.parametrize("annotation", [NDArray[np.float64], types.GenericAlias(Alias, (np.float64,)), Alias])
def test_arrays_are_known_by_an_alias_too(annotation: Any) -> None:
    check = check_of(annotation, {})
    assert check.accepts(np.zeros(3))
    assert check.accepts([1.0, 2.0])
    assert not check.accepts("x")
    assert not check.accepts({})


def test_a_list_is_no_array_of_no_rows() -> None:
    check = check_of(list[str], {})
    assert check.accepts([])
    assert check.accepts(np.array(["a"]))
    assert not check.accepts(np.zeros((0, 3)))


def test_levels_of_lists_are_counted_whatever_they_hold() -> None:
    value: Any = 1.0
    for _ in range(50):
        value = {"a": [value], "b": 1}
    assert not is_nested_deep(value)
    for _ in range(60):
        value = (value,)
    assert is_nested_deep([1, 2, value])
    assert not is_nested_deep([[1.0] * 1000] * 1000)
