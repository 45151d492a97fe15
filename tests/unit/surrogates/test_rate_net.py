"""RateNet: laws it never saw, derivatives, tests of any length, its domain, and identification with it."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import creepkit as ck
from creepkit.dataset.dataset import Dataset
from creepkit.errors import DatasetError, SolveError, SurrogateError
from creepkit.language import symbols
from creepkit.records import History, Program, RecordedLoading, Status
from creepkit.surrogates.loading import load_surrogate
from creepkit.surrogates.parameter_network import sample_tensors
from creepkit.surrogates.rate_net import RateNet, RateSurrogate
from creepkit.surrogates.recipe import Training
from creepkit.surrogates.training import train
from creepkit.surrogates.training_rows import training_split
from helpers.laws_with_states import BACK_STRESS, COUNTED, VALUES
from helpers.planted_datasets import HOURS, bars, measured, rates, unsimulated_rates

HOW = Training(epochs=60, batch=8, rate=3e-3, schedule="cosine", clip=1.0)
RECIPE = RateNet(hidden=24, layers=2, training=HOW)
NORTON = ck.law("norton")


def norton(n: float, rate: float = 1e-7, stress: float = 120.0) -> dict[str, float]:
    """Norton's law with this rate (1/s) at a stress, MPa."""
    return {"A": rate / stress**n, "n": n}


def dimple(end: float = 12 * HOURS, scale: float = 1.0, **more: object) -> History:
    """8 MPa, after a third of the time 10 MPa, times `scale`; 48 frames."""
    given = {
        "times": np.linspace(end / 48, end, 48),
        "loading": ck.PressureJump(P1=8.0 * scale, P2=10.0 * scale, Tj=end / 3),
        "elastic": ck.Elastic(E=150e3),
        "temperature": 1000.0,
        **more,
    }
    return History("planned", outputs={}, specimen="bulge", **given)


def amplitude(model: RateSurrogate, values: dict[str, float], history: History) -> np.ndarray:
    return model.predict(NORTON, NORTON.to_internal(values), [history]).values[0, 0, :, 0]


pytestmark = pytest.mark.usefixtures("one_torch_thread")


@pytest.fixture(scope="module")
def family() -> Dataset:
    return rates()


@pytest.fixture(scope="module")
def learnt(family: Dataset) -> RateSurrogate:
    return train(family, RECIPE)


@pytest.fixture(scope="module")
def exact(learnt: RateSurrogate) -> RateSurrogate:
    """The same in float64: a difference over 1e-5 of numbers with seven digits has two."""
    return RateSurrogate(learnt.recipe, {name: a.astype(float) for name, a in learnt.weights.items()}, learnt.metadata)


# ---- what it learns --------------------------------------------------------------------------------------------------


def test_training_corrects_the_base(learnt: RateSurrogate, family: Dataset) -> None:
    samples = sample_tensors(RECIPE.sample_arrays(family))
    train_rows, aside = (torch.from_numpy(part) for part in training_split(len(family), HOW, 0))
    batch = {name: tensor[aside] for name, tensor in samples.items()}
    with torch.no_grad():
        modules = RECIPE.module(family, samples, train_rows), RECIPE.network(learnt.weights)
        base, after = (float(module.loss(batch)) for module in modules)
    assert after < 0.6 * base
    assert learnt.metadata.metrics["outputs"]["amplitude"]["rse"] < 1e-2


def test_the_file_holds_the_same_network(learnt: RateSurrogate, tmp_path) -> None:
    again = load_surrogate(learnt.save(tmp_path / "m.safetensors"))
    assert again.file_header == learnt.file_header
    found = [
        model.predict(NORTON, NORTON.to_internal(norton(5.0)), [dimple()], sensitivities=True)
        for model in (learnt, again)
    ]
    assert np.array_equal(found[0].values, found[1].values)
    assert np.array_equal(found[0].jacobian, found[1].jacobian)


SINH = ck.law("hyperbolic-sine"), {"A": 1e-8, "n": 3.0, "B": 90.0}
SUM = NORTON + ck.law("strain-hardening"), {"A_1": 4e-20, "n_1": 6.0, "A_2": 2e-20, "n_2": 5.0, "m": -0.6}
GRAHAM_WALLES = (
    ck.law("graham-walles"),
    {"C_1": 3e-12, "n_1": 3.2, "C_2": 2e-18, "n_2": 5.0, "C_3": 1e-30, "n_3": 6.0},
)
OUTPUT = COUNTED, VALUES[COUNTED]
WARM = NORTON.with_temperature(n=ck.linear(T_ref=1000.0, slope=(-0.01, 0.01))), {**norton(4.0), "n_T": 0.004}


@pytest.mark.parametrize(("law", "values"), [SINH, SUM, GRAHAM_WALLES], ids=["sinh", "sum", "graham-walles"])
def test_laws_never_seen_are_as_finite_elements_have_them(learnt: RateSurrogate, law, values) -> None:
    found = learnt.predict(law, law.to_internal(values), [dimple()])
    true = learnt.specimen.predict(law, law.to_internal(values), [dimple()])
    assert found.status[0, 0] == Status.COMPLETE
    assert found.of(0)[:, 0] == pytest.approx(true.of(0)[:, 0], rel=0.04)
    assert found.of(0)[:, 1:] == pytest.approx(true.of(0)[:, 1:], rel=0.1)


# ---- derivatives -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("law", "values"), [(NORTON, norton(5.0)), OUTPUT, WARM], ids=["norton", "output", "warm"])
def test_jacobians_are_central_differences(exact: RateSurrogate, law, values) -> None:
    test = dimple(end=4 * HOURS, elastic=ck.Elastic(E=1.5e5 - 50.0 * symbols.temperature))
    at = {"thickness": np.array([[0.51]]), "modulus": np.array([[0.02]]), "temperature": np.array([[3.0]])}

    def shown(values: dict, nuisances: dict) -> np.ndarray:
        # with the jacobian, for whose sake steps are solved to 1e-11
        return exact.predict(law, law.to_internal(values), [test], sensitivities=True, nuisances=nuisances).values

    found = exact.predict(law, law.to_internal(values), [test], sensitivities=True, nuisances=at)
    for k, (name, param) in enumerate(law.table.items()):
        middle, ends = param.to_internal(values[name]), []
        for step in (1e-5, -1e-5):
            ends.append(shown({**values, name: param.from_internal(middle + step)}, at))
        check(found.jacobian[..., k], (ends[0] - ends[1]) / 2e-5)
    for kind, step in (("thickness", 1e-5), ("modulus", 1e-4), ("temperature", 1e-2)):
        ends = [shown(values, {**at, kind: at[kind] + s}) for s in (step, -step)]
        check(found.nuisance_jacobian[kind], (ends[0] - ends[1]) / (2 * step))


def check(slope: np.ndarray, numeric: np.ndarray) -> None:
    """Each output to 1e-4 of its largest derivative."""
    largest = np.abs(numeric).max(axis=(0, 1, 2))
    assert (np.abs(slope - numeric) <= 1e-4 * largest + 1e-9).all()


# ---- tests of any length ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", [1200.0, 20 * 365.25 * 24 * HOURS], ids=["20 minutes", "20 years"])
def test_only_the_product_of_rate_and_time_counts(learnt: RateSurrogate, end: float) -> None:
    """Ramps scaled too; steps of the base begin with 2.5 s in each, so that 1 % is left."""
    half_day, found = 12 * HOURS, []
    for length in (half_day, end):
        course = Program(np.array([0.0, 0.01, 0.4, 0.41, 1.0]) * length, np.array([0.0, 8.0, 8.0, 10.0, 10.0]))
        values = norton(5.0, 1e-7 * half_day / length)
        test = dimple(length, loading=RecordedLoading(course, "pressure"))
        prediction = learnt.predict(NORTON, NORTON.to_internal(values), [test])
        assert prediction.status[0, 0] == Status.COMPLETE
        found.append(prediction.values[0, 0, 1:, 0])
    assert found[1] == pytest.approx(found[0], rel=0.01)


def test_only_the_ratio_of_load_and_modulus_counts(learnt: RateSurrogate) -> None:
    alike = amplitude(learnt, norton(5.0, stress=240.0), dimple(scale=2.0, elastic=ck.Elastic(E=300e3)))
    assert alike == pytest.approx(amplitude(learnt, norton(5.0), dimple()), rel=1e-5)


def test_a_grid_of_150_s_holds_one_of_900_s(learnt: RateSurrogate) -> None:
    fine, coarse = (amplitude(learnt, norton(5.0), dimple(times=np.arange(s, 43201.0, s))) for s in (150.0, 900.0))
    assert fine[5::6] == pytest.approx(coarse, rel=1e-6)


def test_a_burst_has_values_up_to_it(learnt: RateSurrogate) -> None:
    test = dimple()
    found = learnt.predict(NORTON, NORTON.to_internal(norton(5.0, 2e-4)), [test])
    assert found.status[0, 0] == Status.RUPTURED
    before = test.times < found.end_times[0, 0]
    assert 0 < before.sum() < 48
    assert np.isfinite(found.values[0, 0, before]).all()
    assert np.isnan(found.values[0, 0, ~before]).all()


# ---- the domain ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def guarded(learnt: RateSurrogate) -> RateSurrogate:
    """With the domain of more samples; those need not be simulated."""
    drawn = unsimulated_rates(200)
    told = RECIPE.metadata(drawn, sample_tensors(RECIPE.sample_arrays(drawn)), torch.arange(len(drawn)))
    return RateSurrogate(RECIPE, learnt.weights, replace(learnt.metadata, domain=told.domain))


FALLING = RecordedLoading(Program(np.array([0.0, 100, 2e4, 20100, 43200]), np.array([0.0, 10, 10, 4, 4])), "pressure")
STRANGE = {
    "thin": (norton(5.0), dimple(geometry={"apex_thickness": 0.35})),
    "thick": (norton(5.0), dimple(geometry={"apex_thickness": 0.8})),
    "soft": (norton(5.0), dimple(elastic=ck.Elastic(E=10e3))),
    "loaded high": (norton(5.0, stress=700.0), dimple(scale=6.0, elastic=ck.Elastic(E=60e3))),
    "steep": (norton(25.0), dimple()),
    "unloaded": (norton(5.0), dimple(loading=FALLING)),
}


@pytest.mark.parametrize("name", STRANGE)
def test_what_is_strange_is_flagged_and_has_values(guarded: RateSurrogate, name: str) -> None:
    values, test = STRANGE[name]
    found = guarded.predict(NORTON, NORTON.to_internal(values), [test, dimple()])
    assert found.status[0].tolist()[0] == Status.OUTSIDE_DOMAIN
    assert np.isfinite(found.values).all()


def test_what_is_usual_is_not_flagged(guarded: RateSurrogate) -> None:
    tests = [dimple(), dimple(1200.0), dimple(geometry={"apex_thickness": 0.45}), dimple(elastic=ck.Elastic(E=100e3))]
    for n in (1.5, 3.0, 5.0, 8.0, 12.0):
        assert (guarded.predict(NORTON, NORTON.to_internal(norton(n)), tests).status == Status.COMPLETE).all()
    law, hardening = ck.law("strain-hardening"), {"A": 1e-7 / 120.0**5 * 0.01**0.9, "n": 5.0, "m": -0.9}
    assert (guarded.predict(law, law.to_internal(hardening), tests).status == Status.COMPLETE).all()


def test_other_kinds_of_tests_are_refused(learnt: RateSurrogate) -> None:
    bar = bars(1).planned_test(0).replace(elastic=ck.Elastic(E=150e3))
    cases = [
        (
            dimple(geometry={"cavity_radius": 6.0}),
            SurrogateError,
            "cavity_radius is 6 mm; the surrogate was trained on",
        ),
        (dimple(operator="field 0-5 mm"), SurrogateError, "observed by 'field 0-5 mm'; the surrogate was trained on"),
        (bar, SurrogateError, "its stress is prescribed; the surrogate knows pressure"),
        (dimple(elastic=None), SolveError, "a bulge test needs elastic data; set elastic"),
    ]
    for history, kind, told in cases:
        with pytest.raises(kind, match=told) as caught:
            learnt.predict(NORTON, NORTON.to_internal(norton(5.0)), [history])
        assert "\n" not in str(caught.value)
    with pytest.raises(SurrogateError, match="does not know the nuisance 'window'; it knows thickness, modulus, temp"):
        learnt.predict(NORTON, NORTON.to_internal(norton(5.0)), [dimple()], nuisances={"window": np.full((1, 1), 6.0)})


def test_bars_teach_it_nothing() -> None:
    with pytest.raises(DatasetError, match="these are tests of a uniaxial specimen; train a ParameterGru") as caught:
        train(bars(40), RECIPE)
    assert "\n" not in str(caught.value)


# ---- identification --------------------------------------------------------------------------------------------------


def planted(model: RateSurrogate, values: dict[str, float], test: History) -> History:
    return measured(
        test, model.predict(NORTON, NORTON.to_internal(values), [test]).values[0, 0], model.outputs, "planted"
    )


def test_identify_with_it_finds_what_was_planted(guarded: RateSurrogate) -> None:
    truth = norton(5.0)
    measured_test = measured(
        dimple(),
        guarded.refined().predict(NORTON, NORTON.to_internal(truth), [dimple()]).values[0, 0],
        guarded.outputs,
        "planted",
    )
    fit = ck.identify(NORTON, [measured_test], using=guarded, starts=2)
    by_name = {e.name: e.value for e in fit.estimates}
    assert by_name["n"] == pytest.approx(5.0, abs=0.01)
    assert by_name["A"] * 120 ** by_name["n"] == pytest.approx(1e-7, rel=2e-3)
    assert not [note for note in fit.notes if "outside the domain" in note]


def test_an_answer_outside_the_domain_says_so_wherever_it_is_told(guarded: RateSurrogate, tmp_path) -> None:
    values, test = STRANGE["thick"]
    fit = ck.identify(NORTON, [planted(guarded, values, test)], using=guarded, starts=1)
    told = "the identified law lies outside the domain that the surrogate was trained in, in test 'planted'"
    assert f"note: {told}" in str(fit)
    fit.save(tmp_path / "fit.json")
    assert told in (tmp_path / "fit.json").read_text()


def test_a_law_whose_state_acts_back_teaches_it_nothing(family: Dataset) -> None:
    """Its inputs are rates along one path, and the state has another value at each point of the dimple."""
    with pytest.raises(DatasetError, match=r"internal variables that act back \(b\), which RateNet is not given"):
        RECIPE.sample_arrays(replace(family, law=BACK_STRESS))
