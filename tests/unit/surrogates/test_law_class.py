"""The class of laws of a surrogate: what is outside it, its place in the file, and what a refusal looks like."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SolveError, SurrogateError
from creepkit.language import mean_stress
from creepkit.records import History, Status
from creepkit.surrogates.law_class import LawClass, acting_states
from creepkit.surrogates.loading import load_surrogate
from creepkit.surrogates.surrogate import Surrogate
from helpers.laws_with_states import (
    BACK_STRESS,
    COUNTED,
    DISLOCATION_DENSITY,
    DYSON_MCLEAN,
    ENDING,
    PRINCIPAL,
    TENSION_ONLY,
    VALUES,
)

RATES = LawClass(("stress", "strain", "time", "temperature"))
PLAN = History(
    "planned",
    np.array([600.0, 3600.0, 7200.0]),
    {},
    ck.PressureJump(P1=8, P2=10, Tj=3600),
    1000.0,
    "bulge",
    ck.Elastic(150e3),
)

pytestmark = pytest.mark.usefixtures("one_torch_thread")


@pytest.fixture(scope="module")
def dimple() -> Surrogate:
    return ck.surrogate("dimple")


@pytest.mark.parametrize(
    ("law", "names"),
    [
        (BACK_STRESS, ("b",)),
        (DISLOCATION_DENSITY, ("rho",)),
        (DYSON_MCLEAN, ("eta", "omega")),
        (ENDING, ("spent",)),
        (COUNTED, ()),
        (ck.law("kachanov-rabotnov"), ("v",)),
        (ck.law("norton"), ()),
    ],
    ids=lambda value: value.name if hasattr(value, "name") else None,
)
def test_a_state_acts_that_enters_a_rate_or_ends_the_life(law: ck.CreepLaw, names: tuple[str, ...]) -> None:
    assert acting_states(law) == names
    assert bool(RATES.reason_outside(law)) == bool(names)


def test_other_stresses_than_the_equivalent_one_are_outside() -> None:
    for law in (PRINCIPAL, TENSION_ONLY):
        assert RATES.reason_outside(law) == "depends on the principal stress"
    both = _with_mean_stress()
    assert RATES.reason_outside(both) == "depends on the principal stress and the mean stress"
    assert not LawClass((*RATES.variables, "principal_stress", "mean_stress")).reason_outside(both)


def _with_mean_stress() -> ck.CreepLaw:
    terms = {label: term * (2 + mean_stress / 100) for label, term in TENSION_ONLY.terms.items()}
    return replace(TENSION_ONLY, name="cavities", terms=terms)


def test_arrhenius_and_sums_stay_inside() -> None:
    law = (ck.law("norton") + ck.law("strain-hardening")).times(ck.arrhenius(T_ref=1000.0))
    assert RATES.reason_outside(law) == ""
    assert RATES.reason_outside(ck.law("norton") + BACK_STRESS) == "has internal variables that act back (b)"
    assert RATES.reason_outside((ck.law("norton") + BACK_STRESS).only(next(iter(ck.law("norton").terms)))) == ""


def test_a_class_names_variables_of_the_language() -> None:
    with pytest.raises(SurrogateError, match="names 'pressure'; allowed are stress, strain, time") as caught:
        LawClass(("stress", "pressure"))
    assert "\n" not in str(caught.value)


def test_a_file_without_the_field_has_the_class_of_its_recipe(dimple: Surrogate, tmp_path) -> None:
    assert dimple.metadata.law_class is None
    assert dimple.law_class == RATES
    again = load_surrogate(dimple.save(tmp_path / "m.safetensors"))
    assert again.metadata.law_class == RATES


def test_the_class_of_a_file_holds(dimple: Surrogate, tmp_path) -> None:
    narrow = LawClass(("stress",))
    model = dimple.recipe.surrogate(dimple.weights, replace(dimple.metadata, law_class=narrow))
    again = load_surrogate(model.save(tmp_path / "m.safetensors"))
    assert again.law_class == narrow
    assert "depends on the strain" in again.outside_class(ck.law("strain-hardening"))


def test_print_states_the_class(dimple: Surrogate) -> None:
    assert (
        "predicts laws whose creep rate is a function of stress, strain, time and temperature "
        "(no internal variables that act back)"
    ) in str(dimple)


@pytest.mark.parametrize("sensitivities", [False, True])
def test_a_refusal_has_a_status_a_sentence_and_no_number(dimple: Surrogate, sensitivities: bool) -> None:
    theta = np.repeat(BACK_STRESS.to_internal(VALUES[BACK_STRESS]), 3, axis=0)
    found = dimple.predict(BACK_STRESS, theta, [PLAN, PLAN.replace(name="other")], sensitivities=sensitivities)
    assert found.status.tolist() == [[Status.OUTSIDE_CLASS] * 2] * 3
    assert found.values.shape == (3, 2, 3, 3)
    assert np.isnan(found.values).all()
    assert found.reason == (
        "law 'back-stress' has internal variables that act back (b), and the surrogate 'rate-net of bulge' predicts "
        f"{RATES}; simulate it with the specimen 'bulge' itself"
    )


def test_simulate_says_why(dimple: Surrogate) -> None:
    with pytest.raises(SolveError, match=r"act back \(b\).*simulate it with the specimen 'bulge' itself"):
        ck.simulate(
            BACK_STRESS,
            dimple,
            VALUES[BACK_STRESS],
            loading=PLAN.loading,
            times=PLAN.times,
            elastic=PLAN.elastic,
            temperature=1000.0,
        )
