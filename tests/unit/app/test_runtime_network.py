"""The runtime of the page, run in node, gives what the recurrent network of a law predicts."""

import numpy as np
import pytest

from creepkit.app.network_data import network_data
from creepkit.errors import SurrogateError
from creepkit.sampling.conditions import TimeGrid
from creepkit.surrogates.parameter_gru import ParameterGru
from creepkit.surrogates.recipe import Training
from creepkit.surrogates.training import train
from helpers.page_runtime import in_page, pairs
from helpers.planted_datasets import HOURS, bars, dimples

AGREEMENT = 1e-5
"""Relative to the largest output: weights are packed in single precision."""

BRIEF = Training(epochs=2, batch=32, rate=1e-2)

pytestmark = pytest.mark.usefixtures("one_torch_thread")


def predicted(model, data, row, times):
    plan = data.planned_test(row).replace(times=np.asarray(times))
    return plan, model.predict(data.law, data.theta_of(row), [plan])


def check(tmp_path, model, data, times, constants):
    found_data = network_data(model)
    cases, exact = [], []
    for row in (0, 3):
        plan, prediction = predicted(model, data, row, times)
        given = {"load": pairs(plan.loading.program()), "times": list(times), "constants": constants(plan)}
        cases.append((data.law, "predictByNetwork", data.values_of(row), given))
        exact.append(prediction.of(0))
    for found, expected in zip(in_page(tmp_path, cases, found_data), exact, strict=True):
        assert isinstance(found, dict), found
        for k, name in enumerate(found_data["outputs"]):
            scale = np.abs(expected[:, k]).max()
            np.testing.assert_allclose(found["outputs"][name], expected[:, k], atol=AGREEMENT * scale, err_msg=name)


@pytest.mark.parametrize("cell", ["gru", "lstm"])
@pytest.mark.parametrize("target", ["value", "log"])
def test_a_network_of_bars(tmp_path, cell, target):
    data = bars(48)
    model = train(data, ParameterGru(6, 2, cell=cell, target=target, training=BRIEF))
    check(tmp_path, model, data, [0.0, 0.4 * HOURS, 5.3 * HOURS, 10 * HOURS], lambda plan: {})


def test_a_network_on_a_grid_of_shares(tmp_path):
    grid = TimeGrid(np.array([0.0, 0.1, 0.5, 1.0]), relative=True)
    data = bars(48, grid, ends=(HOURS, 20 * HOURS))
    model = train(data, ParameterGru(6, 1, training=BRIEF))
    check(tmp_path, model, data, [0.0, 1 * HOURS, 3 * HOURS], lambda plan: {})


@pytest.fixture(scope="module")
def plates():
    return dimples(12)


def test_a_network_of_dimples(tmp_path, plates):
    model = train(plates, ParameterGru(6, 1, target="log", training=BRIEF))

    def constants(plan):
        return {"modulus": float(plan.elastic.at(plan.mean_temperature).E)} | dict(plan.geometry)

    check(tmp_path, model, plates, [0.0, 0.2 * HOURS, 5 * HOURS], constants)


def test_a_network_that_corrects_another_model_is_refused(plates):
    model = train(plates, ParameterGru(4, 1, base="reference-stress", training=BRIEF))
    with pytest.raises(SurrogateError, match="base='none'"):
        network_data(model)
