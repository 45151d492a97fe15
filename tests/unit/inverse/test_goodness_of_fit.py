"""Relative squared error in its three readings, by hand; errors that were not predicted stay unknown."""

import numpy as np
import pytest

from creepkit.inverse.goodness_of_fit import output_errors, relative_squared_error

MEASURED = [np.array([1.0, 3.0]), np.array([5.0, 7.0])]
PREDICTED = [np.array([1.0, 4.0]), np.array([5.0, 5.0])]


def test_three_means():
    """Squares 1 + 4; about 4 they are 9 + 1 + 1 + 9, about 2 and 6 four times 1, about 3 and 5 four times 4."""
    assert relative_squared_error(MEASURED, PREDICTED) == pytest.approx(5 / 20)
    assert relative_squared_error(MEASURED, PREDICTED, about="test") == pytest.approx(5 / 4)
    assert relative_squared_error(MEASURED, PREDICTED, about="frame") == pytest.approx(5 / 16)


def test_the_mean_itself_has_an_error_of_one():
    assert relative_squared_error(MEASURED, [np.full(2, 4.0)] * 2) == pytest.approx(1.0)


def test_errors_of_one_output():
    found = output_errors(np.array([1.0, 3.0]), np.array([1.0, 4.0]), np.array([0.5, 0.5]))
    assert (found.frames, found.mean_squared_error, found.mean_absolute_error) == (2, 0.5, 0.5)
    assert found.relative_squared_error == pytest.approx(1 / 2)
    assert found.relative_rms_error == pytest.approx(np.sqrt(0.5 / 5))
    assert found.chi_square == pytest.approx(0.5 * (1 / 0.5) ** 2)


def test_a_frame_that_was_not_predicted_leaves_no_number():
    found = output_errors(np.array([1.0, 3.0]), np.array([1.0, np.nan]), np.ones(2))
    assert all(
        np.isnan(v)
        for v in (
            found.relative_squared_error,
            found.mean_squared_error,
            found.mean_absolute_error,
            found.relative_rms_error,
            found.chi_square,
        )
    )
