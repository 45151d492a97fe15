"""The package that a law came from; hard limits of parameters."""

import json
import math

import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, LawError
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.registry import default_registry

A, n = parameters("A n")


pytestmark = pytest.mark.usefixtures("own_registry")


def test_a_law_tells_which_package_it_came_from() -> None:
    known = default_registry()
    sum_of_two = (ck.law("logarithmic") + ck.law("norton")).times(ck.arrhenius())
    version = ck.__version__
    assert known.distributions_of(ck.law("logarithmic").fix(n=4)) == "creepkit-logarithmic 0.1.0"
    assert known.distributions_of(sum_of_two) == f"creepkit {version}, creepkit-logarithmic 0.1.0"
    assert known.distributions_of(limited(None)) == ""


# ---- limits --------------------------------------------------------------------------------------------------------


def limited(limits, off=None) -> CreepLaw:
    rate = Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log")
    return CreepLaw("limited", {"creep": A * stress**n}, {A: rate, n: Param("n", (1, 8), off=off, limits=limits)})


def test_values_outside_the_physical_limits_are_refused() -> None:
    law = limited((0.5, 12), off=0.0)
    assert law.values({"A": 1e-16, "n": 10.0})["n"] == 10.0, "bounds are where a fit looks, not what is possible"
    assert law.values({"A": 1e-16, "n": 0.0})["n"] == 0.0, "off is allowed"
    with pytest.raises(LawError, match=r"'limited', parameter 'n': 13 is not physical, which is from 0.5 to 12 \(or 0"):
        law.values({"A": 1e-16, "n": 13.0})
    with pytest.raises(LawError, match="not physical"):
        ck.simulate(law, "uniaxial", {"A": 1e-16, "n": 0.1}, loading=ck.constant_stress(50), times=[1.0])


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ((2, 12), r"bounds \(1, 8\) must lie within the limits \(2, 12\)"),
        (3, "two numbers|a number, a number"),
        (("a", 9), "a number"),
    ],
)
def test_limits_hold_the_bounds(limits, said: str) -> None:
    with pytest.raises(CreepkitError, match=said):
        limited(limits)


@pytest.mark.parametrize("limits", [None, (0.5, 12), (0.5, math.inf), (-math.inf, math.inf)])
def test_limits_travel_in_json_and_are_no_mathematics(limits) -> None:
    law = limited(limits)
    data = json.loads(json.dumps(law_to_json(law), allow_nan=False))
    assert law_from_json(data) == law
    assert law.fingerprint == limited(None).fingerprint
    assert (data["params"][1]["limits"] is not None) == (limits is not None)


def test_sums_and_temperature_keep_limits() -> None:
    law = (limited((0.5, 12)) + ck.law("norton")).times(ck.arrhenius()).with_temperature(n_1=ck.linear())
    assert law.table["n_1"].limits == (0.5, 12.0)
    assert "physical from 0.5 to 12" in str(law)
