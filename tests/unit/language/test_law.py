"""The language says in one sentence what is wrong with a law, and laws behave as values."""

import pickle

import pytest
import sympy

from creepkit.errors import LawError
from creepkit.language import (
    GAS_CONSTANT,
    CreepLaw,
    Elastic,
    Param,
    State,
    arrhenius,
    parameters,
    states,
    strain,
    stress,
    temperature,
    time,
    wachtman,
)
from creepkit.laws.norton import NORTON

A, n, B = parameters("A n B")
RATE = Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0)
EXPONENT = Param("stress exponent", bounds=(1, 8))
(omega,) = states("omega")


def law(**changes):
    given = {"name": "trial", "terms": {"power law": A * stress**n}, "params": {A: RATE, n: EXPONENT}}
    return CreepLaw(**{**given, **changes})


BAD_LAWS = {
    "no name": ({"name": " "}, "a law needs a name"),
    "name of two lines": ({"name": "a\nimport os"}, "cannot name a law or term: write one line"),
    "label with quotes": ({"terms": {'"""': A * stress**n}}, "without quotes or backslashes"),
    "title of two lines": ({"title": "a\nb"}, "title or reference"),
    "no terms": ({"terms": {}}, "has no terms"),
    "terms not named": ({"terms": A * stress**n}, "has no terms"),
    "text": ({"terms": {"power law": "A*stress**n"}}, "text is never evaluated"),
    "a maximum of 1500": (
        {
            "terms": {
                "power law": A * stress**n * sympy.Max(*(stress - k * strain for k in range(1500)), evaluate=False)
            }
        },
        "the expression is too large",
    ),
    "a condition as a term": ({"terms": {"power law": sympy.Gt(A * stress, n)}}, "not finite and real"),
    "unknown symbol": ({"terms": {"power law": A * stress**n * B}}, "unknown symbol B in a rate; declared are A, mean"),
    "foreign stress": ({"terms": {"power law": A * sympy.Symbol("stress") ** n}}, "import it from creepkit.language"),
    "positive symbol": (
        {"terms": {"x": sympy.Symbol("A", positive=True) * stress**n}, "params": {A: RATE, n: EXPONENT}},
        "'A' is not a plain real one",
    ),
    "unused": ({"params": {A: RATE, n: EXPONENT, B: EXPONENT}}, "parameter B is declared but not used"),
    "reserved name": (
        {"terms": {"x": A * sympy.Symbol("time", real=True)}, "params": {A: RATE, time: EXPONENT}},
        "'time' is a word of the language",
    ),
    "name used twice": ({"params": {A: RATE, n: EXPONENT}, "states": {n: State(0, A)}}, "the name 'n' is used twice"),
    "not an identifier": (
        {"terms": {"x": sympy.Symbol("2x", real=True) * stress}, "params": {sympy.Symbol("2x", real=True): EXPONENT}},
        "'2x' is not a plain name",
    ),
    "not finite": ({"terms": {"x": A * stress**n + sympy.zoo}}, "not finite and real"),
    "stray constraint": ({"constraints": (B >= 0,)}, "a constraint mentions unknown symbol B"),
    "constraint that cannot hold": ({"constraints": (sympy.false,)}, "constraint False is not a relation"),
}


BAD_PARAMS = {
    "reversed bounds": ({"bounds": (8, 1)}, r"bounds are reversed or empty, \(8, 1\)"),
    "infinite bounds": ({"bounds": (0, float("inf"))}, "must be finite"),
    "log of zero": ({"bounds": (0, 1), "scale": "log", "unit": "1/s"}, "a log scale needs bounds above zero"),
    "missing unit": ({"scale": "log"}, 'missing unit; write unit="1/s"'),
    "no meaning": ({"meaning": " "}, "empty meaning"),
    "meaning of two lines": ({"meaning": "a\nb"}, "one line of text"),
    "off not finite": ({"off": float("nan")}, "off = nan must be a finite number"),
}


BAD_STATES = {
    "no initial value": ({"initial": float("nan")}, "initial = nan must be a finite number"),
    "already broken": ({"initial": 0.5, "limit": 0.5}, "it starts at its limit, 0.5, so the material would never last"),
}
BAD_ELASTIC = {
    "no modulus": ({"E": 0}, "E = 0 MPa is not a modulus"),
    "incompressible": ({"E": 2e5, "nu": 0.5}, r"nu = 0.5 is outside \(-1, 0.5\)"),
    "modulus of stress": ({"E": 2e5 * stress}, "may depend on temperature alone, found stress"),
}
BAD_VALUES = {
    "one missing": ({"A": 1e-12}, "needs a value for n"),
    "one too many": ({"A": 1e-12, "n": 5, "q": 1}, "has no parameter 'q'"),
    "infinite": ({"A": 1e-12, "n": float("inf")}, "inf is not a finite number"),
    "negative": ({"A": -1e-12, "n": 5}, "is negative; it must be positive"),
}
BAD = [
    *((law, *case) for case in BAD_LAWS.values()),
    *((lambda **given: Param(**{"meaning": "exponent", "bounds": (1, 8), **given}), *c) for c in BAD_PARAMS.values()),
    *((lambda **given: State(**{"initial": 0.0, "rate": A, **given}), *case) for case in BAD_STATES.values()),
    *((Elastic, *case) for case in BAD_ELASTIC.values()),
    *((lambda **given: NORTON.values(given), *case) for case in BAD_VALUES.values()),
]


@pytest.mark.parametrize(("make", "given", "message"), BAD)
def test_what_is_wrong_is_said_in_one_sentence(make, given, message):
    with pytest.raises(LawError, match=message) as error:
        make(**given)
    assert "\n" not in str(error.value)


def test_param_knows_its_middle_its_internal_form_and_what_it_admits():
    assert RATE.center == pytest.approx(10**-22.5)
    assert EXPONENT.center == 4.5
    assert RATE.to_internal(0.0) == -float("inf")
    assert RATE.from_internal(RATE.to_internal(1e-12)) == pytest.approx(1e-12, rel=1e-13)
    assert RATE.within_bounds(0.0)
    assert RATE.within_bounds(1e-40)
    assert not RATE.within_bounds(1e-4)
    assert not EXPONENT.within_bounds(0.0)
    assert not EXPONENT.within_bounds(float("nan"))


def test_values_come_back_complete_and_in_the_law_s_order():
    assert list(NORTON.values({"n": 5, "A": 0}).items()) == [("A", 0.0), ("n", 5.0)]


# ---- fingerprint ---------------------------------------------------------------------------------------------------


def test_titles_bounds_and_references_do_not_enter_the_fingerprint():
    wide = Param("another meaning", bounds=(0.5, 20))
    other = law(name="other", title="Other", references=("Somebody (1950)",), params={A: RATE, n: wide})
    assert other.fingerprint == law().fingerprint


@pytest.mark.parametrize(
    "changed",
    [
        law(terms={"power law": A * stress ** (n + 1)}),
        law(terms={"another name": A * stress**n}),
        law(params={A: Param("rate coefficient", bounds=(1e-40, 1e-5)), n: EXPONENT}),
        law(terms={"power law": A * stress**B}, params={A: RATE, B: EXPONENT}),
        law(terms={"power law": A * (1 + omega) * stress**n}, states={omega: State(0, A * stress)}),
    ],
)
def test_mathematics_enters_the_fingerprint(changed):
    assert changed.fingerprint != law().fingerprint


def test_the_fingerprint_of_a_power_tower_is_found_in_no_time():
    tower = law(terms={"x": A * time ** (time ** (time**n))})
    assert tower.fingerprint.count("-") == 1


def test_a_parameter_may_be_called_as_a_function_is():
    exp, lambda_ = parameters("exp lambda")
    odd = law(terms={"x": exp * sympy.exp(stress / lambda_)}, params={exp: RATE, lambda_: EXPONENT})
    assert odd.fingerprint == pickle.loads(pickle.dumps(odd)).fingerprint


# ---- print ---------------------------------------------------------------------------------------------------------


def test_latex_shows_arrhenius_as_people_write_it():
    expected = r"A \sigma_e^{n} \exp\!\left[-\frac{Q}{R}\left(\frac{1}{T} - \frac{1}{1073.15\,\mathrm{K}}\right)\right]"
    assert NORTON.times(arrhenius(T_ref=1073.15)).latex() == r"\dot{\varepsilon}_{cr} = " + expected
    params = {A: RATE, B: Param("activation energy", unit="J/mol", bounds=(1e4, 9e5))}
    about_none, in_kelvin = (
        law(terms={"x": A * sympy.exp(-B / (R * temperature))}, params=params) for R in (GAS_CONSTANT, 1)
    )
    assert ["A*exp(-B/(R*T))" in str(about_none), "A*exp(-B/temperature)" in str(in_kelvin)] == [True, True]
    assert about_none.latex().endswith(r"A \exp\!\left[-\frac{B}{R T}\right]")


# ---- elastic -------------------------------------------------------------------------------------------------------


def test_wachtman_modulus():
    """E = E0 - b T exp(-T0/T), Wachtman et al. (1961): at T = T0 the exponential is 1/e."""
    assert Elastic(E=wachtman(2e5, 40.0, 500.0)).at(500.0).E == pytest.approx(2e5 - 40 * 500 / 2.718281828459045)
