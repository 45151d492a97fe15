"""ParameterGru as a predictor: derivatives, nuisances, the domain, laws that are reductions, and identification."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import creepkit as ck
from creepkit.dataset.dataset import Dataset
from creepkit.errors import SolveError, SurrogateError
from creepkit.records import RecordedLoading, Status
from creepkit.sampling.conditions import TimeGrid
from creepkit.surrogates.parameter_gru import LawInputs, LoadHistoryInputs, ParameterGru, Training
from creepkit.surrogates.parameter_network import sample_tensors
from creepkit.surrogates.surrogate import Surrogate, load_surrogate
from creepkit.surrogates.training import train
from helpers.planted_datasets import HOURS, bars, data_set, dimples, measured

BRIEF = Training(epochs=2, batch=32, rate=1e-2)


pytestmark = pytest.mark.usefixtures("one_torch_thread")


@pytest.fixture(scope="module")
def tension() -> Dataset:
    return bars(600)


@pytest.fixture(scope="module")
def learnt(tension: Dataset) -> Surrogate:
    how = Training(epochs=120, batch=64, rate=3e-2, schedule="cosine")
    return train(tension, ParameterGru(16, 1, target="log", training=how))


@pytest.fixture(scope="module")
def plates() -> Dataset:
    return dimples()


@pytest.fixture(scope="module")
def bulging(plates: Dataset) -> Surrogate:
    how = Training(epochs=30, batch=8, rate=1e-2)
    return train(plates, ParameterGru(12, 2, target="log", training=how))


# ---- derivatives -----------------------------------------------------------------------------------------------------


def differences(model: Surrogate, data: Dataset, row: int, step: float = 1e-5) -> np.ndarray:
    law, values, out = data.law, data.values_of(row), []
    for name, param in law.table.items():
        ends = []
        for sign in (step, -step):
            internal = param.to_internal(values[name]) + sign
            ends.append(
                model.predict(
                    law, law.to_internal({**values, name: param.from_internal(internal)}), [data.planned_test(row)]
                ).values
            )
        out.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(out, axis=-1)


@pytest.mark.parametrize("target", ["value", "log"])
def test_jacobians_are_central_differences(tension: Dataset, target: str) -> None:
    model = train(tension, ParameterGru(6, 2, target=target, training=BRIEF))
    found = model.predict(tension.law, tension.theta_of(4), [tension.planned_test(4)], sensitivities=True)
    numeric = differences(model, tension, 4)
    assert found.jacobian == pytest.approx(numeric, rel=1e-6, abs=1e-8 * np.abs(numeric).max())
    assert np.abs(numeric).max() > 1e-5


def test_effects_of_a_dimple_are_central_differences(bulging: Surrogate, plates: Dataset) -> None:
    assert bulging.nuisances == ("modulus", "thickness")
    tests = [plates.planned_test(2), plates.planned_test(5)]
    at = {"modulus": np.array([[0.05, -0.1]]), "thickness": np.array([[0.5, 0.49]])}
    law, values = plates.law, plates.values_of(2)
    found = bulging.predict(law, law.to_internal(values), tests, sensitivities=True, nuisances=at)
    for kind, step in (("modulus", 1e-5), ("thickness", 1e-6)):
        ends = [
            bulging.predict(law, law.to_internal(values), tests, nuisances={**at, kind: at[kind] + s}).values
            for s in (step, -step)
        ]
        numeric = (ends[0] - ends[1]) / (2 * step)
        assert found.nuisance_jacobian[kind] == pytest.approx(numeric, rel=1e-5, abs=1e-6 * np.abs(numeric).max())
    assert found.jacobian is not None
    assert found.jacobian.shape == (1, 2, 7, 3, 2)


# ---- predictions -----------------------------------------------------------------------------------------------------


def test_candidates_and_tests_are_predicted_as_one_by_one(learnt: Surrogate, tension: Dataset) -> None:
    tests = [tension.planned_test(k) for k in (1, 2, 3)]
    values = {name: tension.parameters[[5, 6], k] for k, name in enumerate(tension.law.names)}
    batch = learnt.predict(tension.law, tension.law.to_internal(values), tests).values
    for c, t in np.ndindex(2, 3):
        own = {name: column[c] for name, column in values.items()}
        alone = learnt.predict(tension.law, tension.law.to_internal(own), [tests[t]]).values[0, 0]
        assert batch[c, t] == pytest.approx(alone, rel=1e-12)


def test_a_search_goes_through_the_network_in_single_precision(learnt: Surrogate, tension: Dataset) -> None:
    tests, single = [tension.planned_test(k) for k in range(5)], learnt.for_search().single_threaded()
    theta = tension.law.to_internal(tension.parameters[:40])
    exact, rounded = (one.predict(tension.law, theta, tests).values for one in (learnt, single))
    difference = np.abs(rounded - exact)
    assert 0 < difference.max() < 1e-5 * np.abs(exact).max()
    assert difference.max() < 1e-3 * learnt.error["strain"]


def test_frames_of_the_training_are_predicted_as_in_training(learnt: Surrogate, tension: Dataset) -> None:
    samples = sample_tensors(learnt.recipe.sample_arrays(tension))
    module = learnt.recipe.module(tension, samples, torch.arange(100))
    module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in learnt.weights.items()})
    with torch.no_grad():
        known = module({name: v[:4] for name, v in samples.items()}).numpy()
    for row in range(4):
        found = learnt.predict(tension.law, tension.theta_of(row), [tension.planned_test(row)])
        assert found.values[0, 0] == pytest.approx(known[row], rel=1e-3, abs=1e-6)


def test_between_frames_predictions_are_linear_and_short_tests_are_short(learnt: Surrogate, tension: Dataset) -> None:
    plan, values = tension.planned_test(0), tension.values_of(0)
    frames = learnt.predict(tension.law, tension.law.to_internal(values), [plan]).values[0, 0, :, 0]
    short = plan.replace(times=np.array([1800.0, 3600.0, 4500.0]))
    found = learnt.predict(tension.law, tension.law.to_internal(values), [short, plan])
    assert found.values[0, 0, :3, 0] == pytest.approx(
        [frames[:2].mean(), frames[1], 0.75 * frames[1] + 0.25 * frames[2]]
    )
    assert np.isnan(found.values[0, 0, 3:]).all()
    assert found.lengths.tolist() == [3, 11]


def test_a_grid_that_stretches_serves_tests_of_any_length() -> None:
    data = bars(120, TimeGrid(np.linspace(0.0, 1.0, 9), relative=True), ends=(1200.0, 12 * HOURS))
    how = Training(epochs=60, batch=16, rate=1e-2, schedule="cosine")
    model = train(data, ParameterGru(16, 1, target="log", training=how))
    assert len(model.metadata.scaling["series"]) == 4
    assert model.metadata.metrics["loss"] < 0.1
    twenty_minutes = data.planned_test(0).replace(times=np.linspace(60.0, 1300.0, 5), loading=ck.constant_stress(100.0))
    found = model.predict(data.law, data.theta_of(0), [twenty_minutes])
    assert found.status[0, 0] == Status.COMPLETE
    week = twenty_minutes.replace(times=np.array([7 * 24 * HOURS]))
    assert model.predict(data.law, data.theta_of(0), [week]).status[0, 0] == Status.OUTSIDE_DOMAIN


# ---- the domain ------------------------------------------------------------------------------------------------------


def test_training_rows_are_inside_and_others_are_flagged_with_values(learnt: Surrogate, tension: Dataset) -> None:
    status = [
        learnt.predict(tension.law, tension.theta_of(k), [tension.planned_test(k)]).status[0, 0] for k in range(20)
    ]
    assert np.mean(np.array(status) == Status.COMPLETE) >= 0.9
    steep = {**tension.values_of(0), "n": 9.0}
    found = learnt.predict(tension.law, tension.law.to_internal(steep), [tension.planned_test(0)])
    assert found.status[0, 0] == Status.OUTSIDE_DOMAIN
    assert np.isfinite(found.values).all()


def test_a_coefficient_switched_off_is_outside_where_training_had_none(learnt: Surrogate, tension: Dataset) -> None:
    found = learnt.predict(tension.law, tension.law.to_internal({"A": 0.0, "n": 4.0}), [tension.planned_test(0)])
    assert found.status[0, 0] == Status.OUTSIDE_DOMAIN
    assert np.isfinite(found.values).all()


# ---- other laws, other tests -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def two_terms() -> tuple[Surrogate, Dataset]:
    law, plain = ck.law("norton") + ck.law("strain-hardening"), bars(60)
    parameters = np.array([[a, n, 1e-30, 4.0, -0.5] for a, n in plain.parameters])
    parameters[::2, 2] = 0.0
    columns = dict(zip(plain.condition_names, plain.conditions.T, strict=True))
    data = data_set("uniaxial", law, plain.grid, parameters, columns, plain.values)
    return train(data, ParameterGru(6, 1, training=BRIEF)), data


def test_a_reduction_of_the_law_is_the_law_with_its_terms_off(two_terms: tuple[Surrogate, Dataset]) -> None:
    model, data = two_terms
    alone = data.law.only("power law")
    values = data.values_of(0)
    whole = model.predict(
        data.law,
        data.law.to_internal({**values, "A_2": 0.0, "n_2": 4.5, "m": -0.5}),
        [data.planned_test(0)],
        sensitivities=True,
    )
    found = model.predict(
        alone, alone.to_internal({n: values[n] for n in alone.names}), [data.planned_test(0)], sensitivities=True
    )
    assert found.jacobian.shape[-1] == 2
    assert found.values[0, 0, -1, 0] == pytest.approx(whole.values[0, 0, -1, 0], rel=0.5)
    assert (whole.jacobian[..., 2] == 0).all()


def test_another_law_is_refused(learnt: Surrogate, tension: Dataset) -> None:
    law = ck.law("time-hardening")
    found = learnt.predict(law, law.to_internal(law.center()), [tension.planned_test(0)])
    assert found.status.tolist() == [[Status.OUTSIDE_CLASS]]
    assert np.isnan(found.values).all()
    assert found.reason.startswith("a surrogate of law 'norton' cannot predict law 'time-hardening'")
    assert "predicts law 'norton', and that less some of its terms" in str(learnt)
    with pytest.raises(SolveError, match="simulate it with the specimen 'uniaxial' itself"):
        ck.simulate(law, learnt, law.center(), loading=ck.constant_stress(100.0), times=[HOURS])


def test_other_kinds_of_tests_are_refused(
    learnt: Surrogate, bulging: Surrogate, tension: Dataset, plates: Dataset
) -> None:
    plan, plate = tension.planned_test(0), plates.planned_test(0)
    held = plan.replace(loading=RecordedLoading(plan.loading.program(), "stress", "stress"))
    cases = [
        (learnt, tension, plan.replace(times=np.array([11 * HOURS])), "lasts 39600 s, and the surrogate was"),
        (learnt, tension, plan.replace(loading=plate.loading), "its pressure is prescribed; the"),
        (learnt, tension, held, "true stress is held"),
        (bulging, plates, plate.replace(operator="field 0-5 mm"), "observed by 'field 0-5 mm'"),
        (bulging, plates, plate.replace(elastic=None), "needs the modulus"),
        (bulging, plates, plate.replace(geometry={"cavity_radius": 6.0}), "cavity_radius is 6 mm"),
    ]  # fmt: skip
    for model, data, history, told in cases:
        with pytest.raises(SurrogateError, match=told):
            model.predict(data.law, data.theta_of(0), [history])
    with pytest.raises(SolveError, match="does not know the nuisance 'window'; it knows modulus, thickness"):
        bulging.predict(plates.law, plates.theta_of(0), [plate], nuisances={"window": np.ones((1, 1))})


# ---- studies ---------------------------------------------------------------------------------------------------------


def test_a_few_dimples_are_learnt_and_the_file_predicts_the_same(bulging: Surrogate, plates: Dataset, tmp_path) -> None:
    assert bulging.outputs == ("amplitude", "width", "shape")
    again = load_surrogate(bulging.save(tmp_path / "m.safetensors"))
    for model in (bulging, again):
        found = model.predict(plates.law, plates.theta_of(3), [plates.planned_test(3)], sensitivities=True)
        assert found.values[0, 0, -1, 0] == pytest.approx(plates.values[3, -1, 0], rel=0.5)
    assert str(again) == str(bulging)
    assert again.file_header == bulging.file_header
    assert again.reference_stress(plates.planned_test(3)) == pytest.approx(
        plates.specimen.reference_stress(plates.planned_test(3))
    )


def test_identify_with_a_network_finds_what_was_planted(learnt: Surrogate, tension: Dataset) -> None:
    truth, tests, noise = tension.values_of(7), [], np.random.default_rng(0)
    for k, row in enumerate((7, 8, 9, 10)):
        specimen, theta = learnt.specimen, tension.law.to_internal(truth)
        shown = specimen.predict(tension.law, theta, [tension.planned_test(row)]).values[0, 0]
        tests.append(
            measured(
                tension.planned_test(row), shown * (1 + 1e-3 * noise.normal(size=shown.shape)), ("strain",), f"t{k}"
            )
        )
    fit = ck.identify(tension.law, tests, using=learnt, starts=3, weights="equal")  # the network's error is no noise
    by_name = {e.name: e.value for e in fit.estimates}
    assert by_name["n"] == pytest.approx(truth["n"], abs=0.02)
    assert by_name["A"] * 100 ** by_name["n"] == pytest.approx(truth["A"] * 100 ** truth["n"], rel=0.02)
    assert not [note for note in fit.notes if "outside the domain" in note]


# ---- parameter inputs ------------------------------------------------------------------------------------------------

# What a network of parameters and loads sees: inputs of laws with their slopes, and of histories of load.


def test_slopes_of_inputs_are_central_differences() -> None:
    inputs = LawInputs(ck.law("combined"))
    theta = np.array([[p.to_internal(p.bounds[0] ** 0.4 * p.bounds[1] ** 0.6 if p.scale == "log" else p.center)
                       for p in inputs.law.params.values()]])  # fmt: skip
    slopes = inputs.derivatives(theta)
    for k in range(theta.shape[1]):
        shift = 1e-5 * np.eye(theta.shape[1])[k]
        numeric = (inputs.input_rows(theta + shift) - inputs.input_rows(theta - shift)) / 2e-5
        assert slopes[:, :, k] == pytest.approx(numeric, rel=1e-6, abs=1e-7)


def test_mean_loads_hold_the_time_of_the_jump() -> None:
    made = LoadHistoryInputs(ck.specimen("uniaxial"), (), ("load", "mean_load", "time", "step"))
    history = bars(1).planned_test(0).replace(loading=ck.StressSteps(((0.0, 100.0), (25.0, 140.0))))
    found = made.series_values(history, np.array([0.0, 20.0, 40.0]))
    expected = [[100, 100, 0, 0], [100, 100, np.log10(21), np.log10(21)], [140, 130, np.log10(41), np.log10(21)]]
    assert found == pytest.approx(np.array(expected))
