"""Every law with internal variables, through the shipped surrogate and the finite elements: within 1 %, or refused."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.records import History, Status
from creepkit.registry import default_registry
from creepkit.surrogates.law_class import acting_states
from helpers.laws_with_states import PRINCIPAL, TENSION_ONLY, VALUES

LIMIT = 0.01
"""Of the amplitude at the same time."""
PLAN = History(
    "planned",
    np.linspace(900.0, 14400.0, 8),
    {},
    ck.PressureJump(P1=8, P2=10, Tj=7200),
    1000.0,
    "bulge",
    ck.Elastic(E=150e3),
)
REGISTERED = [law for law in (default_registry().law(name) for name in sorted(default_registry().laws())) if law.states]
WRITTEN = [*VALUES]
PLAIN = {
    "norton": {"A": 1e-7 / 120.0**5, "n": 5.0},
    "strain-hardening": {"A": 1e-8 / 120.0**5, "n": 5.0, "m": -0.5},
    "time-hardening": {"A": 1e-5 / 120.0**5, "n": 5.0, "m": -0.5},
    "hyperbolic-sine": {"A": 1e-8, "n": 3.0, "B": 90.0},
    "threshold-stress": {"A": 1e-7 / 80.0**4, "n": 4.0, "s_0": 40.0},
}


@pytest.fixture(scope="module")
def dimple():
    return ck.surrogate("dimple")


def test_there_are_laws_to_judge() -> None:
    assert {"kachanov-rabotnov", "liu-murakami", "sinh-damage"} <= {law.name for law in REGISTERED}
    assert {"back-stress", "dislocation-density", "dyson-mclean"} <= {law.name for law in WRITTEN}


@pytest.mark.parametrize("law", [*REGISTERED, *WRITTEN], ids=lambda law: law.name)
def test_a_law_with_states_is_as_finite_elements_have_it_or_refused(dimple, law: ck.CreepLaw) -> None:
    theta = law.to_internal(VALUES.get(law) or law.center())
    found = dimple.predict(law, theta, [PLAN])
    if found.status[0, 0] == Status.OUTSIDE_CLASS:
        assert np.isnan(found.values).all()
        assert law.name in found.reason
        return
    true = dimple.specimen.predict(law, theta, [PLAN])
    assert found.of(0)[:, 0] == pytest.approx(true.of(0)[:, 0], rel=LIMIT)


@pytest.mark.parametrize("name", PLAIN)
def test_a_law_without_states_is_as_finite_elements_have_it_or_flagged(dimple, name: str) -> None:
    law = ck.law(name)
    theta = law.to_internal(PLAIN[name])
    found, true = (model.predict(law, theta, [PLAN]) for model in (dimple, dimple.specimen))
    assert np.isfinite(found.values).all()
    if found.status[0, 0] == Status.COMPLETE:
        assert found.of(0)[:, 0] == pytest.approx(true.of(0)[:, 0], rel=LIMIT)
    else:
        assert found.status[0, 0] == Status.OUTSIDE_DOMAIN
        assert name == "threshold-stress"  # a rate that is zero below a stress is far from every trained one


def test_a_state_that_acts_on_nothing_is_no_reason_to_refuse(dimple) -> None:
    """Not every law with states is outside: what counts is what the strain depends on."""
    inside = [law for law in WRITTEN if not dimple.outside_class(law)]
    assert [law.name for law in inside] == ["counted-life"]
    assert not any(acting_states(law) for law in inside)
    assert all(dimple.outside_class(law) for law in (PRINCIPAL, TENSION_ONLY))
