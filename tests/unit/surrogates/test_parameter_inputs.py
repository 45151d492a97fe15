"""What a network of parameters and loads sees: inputs of laws with their slopes, and of histories of load."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.surrogates.parameter_inputs import LawInputs, LoadHistoryInputs
from helpers.planted_datasets import bars


def test_slopes_of_inputs_are_central_differences() -> None:
    inputs = LawInputs(ck.law("combined"))
    theta = np.array([[p.to_internal(p.bounds[0] ** 0.4 * p.bounds[1] ** 0.6 if p.scale == "log" else p.center)
                       for p in inputs.law.params.values()]])  # fmt: skip
    slopes = inputs.derivatives(theta)
    for k in range(theta.shape[1]):
        shift = 1e-5 * np.eye(theta.shape[1])[k]
        numeric = (inputs.input_rows(theta + shift) - inputs.input_rows(theta - shift)) / 2e-5
        assert slopes[:, :, k] == pytest.approx(numeric, rel=1e-6, abs=1e-7)


def test_a_coefficient_that_is_off_has_no_number_and_a_switch() -> None:
    inputs = LawInputs(ck.law("norton"))
    rows = inputs.input_rows(inputs.law.to_internal({"A": np.array([0.0, 1e-12]), "n": np.array([4.0, 2.0])}))
    assert inputs.names == ("log10 A", "n", "A is off")
    assert rows == pytest.approx(np.array([[np.nan, 4.0, 1.0], [-12.0, 2.0, 0.0]]), nan_ok=True)
    assert (inputs.derivatives(inputs.law.to_internal({"A": 0.0, "n": 4.0}))[0, :, 0] == 0).all()


def test_mean_loads_hold_the_time_of_the_jump() -> None:
    made = LoadHistoryInputs(ck.specimen("uniaxial"), (), ("load", "mean_load", "time", "step"))
    history = bars(1).planned_test(0).replace(loading=ck.StressSteps(((0.0, 100.0), (25.0, 140.0))))
    found = made.series_values(history, np.array([0.0, 20.0, 40.0]))
    expected = [[100, 100, 0, 0], [100, 100, np.log10(21), np.log10(21)], [140, 130, np.log10(41), np.log10(21)]]
    assert found == pytest.approx(np.array(expected))
