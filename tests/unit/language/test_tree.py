"""Laws and expressions go to JSON and come back equal, bit for bit; anything else is one LawError."""

import copy
import json
import re
from dataclasses import fields

import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from creepkit.errors import LawError
from creepkit.language import (
    CreepLaw,
    Param,
    State,
    activated,
    arrhenius,
    exponential,
    inverse_temperature,
    linear,
    parameters,
    states,
    strain,
    stress,
    temperature,
    time,
)
from creepkit.language.expression_trees import _NODE_TYPES, DEPTH_LIMIT
from creepkit.language.law_codec import expression_from_tree, expression_to_tree, law_from_json, law_to_json
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING

A, n = parameters("A n")
(omega,) = states("omega")
SYMBOLS = {s.name: s for s in (A, n, stress, strain, time, temperature, omega)}

DAMAGE = CreepLaw(
    name="damage",
    title="Power law with damage",
    terms={"creep": A * (stress / (1 - omega)) ** n, "threshold": A * sympy.Max(stress - 10, 0)},
    params={A: Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0), n: Param("exponent", (1, 8))},
    states={omega: State(0.0, A * stress**n, meaning="damage", limit=0.99)},
    constraints=(n >= 1, omega < 1),
)
LAWS = [
    NORTON,
    STRAIN_HARDENING,
    TIME_HARDENING,
    HYPERBOLIC_SINE,
    DRIFTING_EXPONENT,
    COMBINED,
    DAMAGE,
    NORTON + HYPERBOLIC_SINE,
    DAMAGE + DAMAGE,
    COMBINED.times(arrhenius()),
    COMBINED.times(arrhenius(T_ref=1234.567, Q=4.1e5)),
    NORTON.with_temperature(n=linear()),
    NORTON.with_temperature(A=exponential(), n=inverse_temperature(1001.1)),
    HYPERBOLIC_SINE.with_temperature(B=activated()).times(arrhenius()),
    DRIFTING_EXPONENT.with_temperature(n_0=linear()),
    STRAIN_HARDENING.fix(m=0),
    COMBINED.fix(n_1=2.7, B=81.3),
    COMBINED.times(arrhenius()).at(1100.1),
    COMBINED.only("hyperbolic sine"),
    COMBINED.without("time hardening"),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_law_comes_back_equal_with_the_same_fingerprint(law):
    rebuilt = law_from_json(json.loads(json.dumps(law_to_json(law))))
    assert all(getattr(rebuilt, f.name) == getattr(law, f.name) for f in fields(law) if f.name != "examples")
    assert rebuilt.fingerprint == law.fingerprint
    assert rebuilt.names == law.names
    assert list(rebuilt.terms) == list(law.terms)


EXPRESSIONS = [
    sympy.Integer(-3),
    sympy.Rational(1, 3) * stress,
    sympy.Float(0.1) + stress,
    sympy.Piecewise((sympy.Float(0), stress > 1), (sympy.Float(-3), True)),
    sympy.Float(2.5e-310) + stress,
    sympy.Float(1073.15) ** n,
    sympy.pi * stress + sympy.E,
    sympy.sqrt(2) * sympy.sqrt(stress),
    sympy.exp(-time / n) * sympy.log(stress),
    sympy.sinh(stress) + sympy.cosh(stress) + sympy.tanh(stress) + sympy.coth(stress),
    sympy.asinh(stress) + sympy.erf(stress) * sympy.sign(stress),
    sympy.Max(stress - n, 0) + sympy.Min(stress, n, 3),
    sympy.Heaviside(stress - n) + sympy.Heaviside(stress - n, 1),
    sympy.Abs(stress) * sympy.sin(time) + sympy.cos(time) * sympy.atan(n),
    sympy.Piecewise((stress**n, stress > 1), (n, sympy.And(stress > 0, time < 1)), (stress, True)),
    sympy.Piecewise((1, sympy.Or(stress > 1, time <= 2)), (0, True)),
]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_an_expression_comes_back_equal(expression):
    rebuilt = expression_from_tree(json.loads(json.dumps(expression_to_tree(expression))), SYMBOLS)
    assert rebuilt == expression
    assert sympy.srepr(rebuilt) == sympy.srepr(expression)


@pytest.mark.parametrize("value", [0.1, 1 / 3, 5e-324, 1.7976931348623157e308, -1073.15, 2.0**-1074 * 3, 0.0])
def test_a_float_comes_back_bit_for_bit(value):
    rebuilt = expression_from_tree(json.loads(json.dumps(expression_to_tree(sympy.Float(value) + stress))), SYMBOLS)
    assert float(rebuilt.subs(stress, 0)).hex() == value.hex()


def test_a_tree_is_readable():
    assert expression_to_tree(A * stress**n) == ["mul", "A", ["pow", "stress", "n"]]


nested = "stress"
for _ in range(DEPTH_LIMIT + 1):
    nested = ["exp", nested]
bottomless = []
for _ in range(100_000):
    bottomless = ["exp", bottomless]

BAD_TREES = {
    "unknown head": (["eval", "stress"], "no known head"),
    "text of Python": ("__import__('os')", "not declared"),
    "undeclared": (["mul", "A", "B"], "mentions 'B', not declared"),
    "no head": ([], "no known head"),
    "null": (None, "holds None; allowed are names"),
    "bare float": (1.5, "holds 1.5; allowed are names, integers"),
    "object": ({"mul": 1}, "allowed are names"),
    "too few": (["pow", "stress"], "'pow' does not take 1 argument"),
    "too many": (["exp", "stress", "n"], "'exp' does not take 2 argument"),
    "condition for a number": (["exp", ["ge", "n", 0]], "where a number is needed"),
    "number for a condition": (["piecewise", ["n", "n"]], "where a condition is needed"),
    "branch": (["piecewise", "n"], r"write \[expression, condition\]"),
    "not finite": (["float", float("nan")], "not a finite number"),
    "float in words": (["float", "0x1p3"], "not a finite number"),
    "float of huge exponent": (["float", 1, 10**9, 53], "not a finite number"),
    "no fraction": (["rational", 1, 0], "not a fraction"),
    "giant integer": (10**5000, "integer of more than 300 digits"),
    "tower": (["pow", 9, ["pow", 9, ["pow", 9, 9]]], "exponent outside -1000 to 1000"),
    "giant exponential": (["exp", ["exp", ["exp", 9]]], "not a real number between"),
    "one over zero": (["pow", 0, -1], "not a real number between"),
    "logarithm of zero": (["log", 0], "not a real number between"),
    "condition on a condition": (
        ["piecewise", ["n", ["ge", "n", ["piecewise", ["A", ["ge", "A", "n"]], ["A", ["true"]]]]], ["A", ["true"]]],
        "holds another 'piecewise'",
    ),
    "too deep": (nested, "at most 60 levels"),
    "bottomless": (bottomless, "at most 60 levels"),
    "too long": (["add", *["stress"] * 6000], "5000 nodes|does not take"),
}


@pytest.mark.parametrize("case", BAD_TREES)
def test_a_bad_tree_is_one_sentence(case):
    tree, message = BAD_TREES[case]
    with pytest.raises(LawError, match=message) as error:
        expression_from_tree(tree, SYMBOLS)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        (sympy.gamma(stress), "cannot be written to a file"),
        (sympy.Symbol("A", positive=True) * stress, "carries assumptions"),
        (sympy.zoo, "cannot be written"),
        (sympy.Add(*(stress**k for k in range(3000))), "too large"),
    ],
    ids=["gamma", "assumptions", "infinity", "large"],
)
def test_what_cannot_be_written(expression, message):
    with pytest.raises(LawError, match=message):
        expression_to_tree(expression)


def _changed(*path, to):
    data = copy.deepcopy(law_to_json(DAMAGE))
    place = data
    for key in path[:-1]:
        place = place[key]
    if to is KeyError:
        del place[path[-1]]
    else:
        place[path[-1]] = to
    return data


BAD_FILES = {
    "not an object": ([], "this is not a law that creepkit wrote"),
    "a later version": (
        _changed("version", to=3),
        "in version 3 of the format; this one reads version 2: written by a newer",
    ),
    "same name": (_changed("params", 1, "name", to="A"), "state or condition name 'A' is used twice"),
    "undeclared": (_changed("terms", 0, "expression", to=["mul", "A", "q"]), "'creep': the expression mentions 'q'"),
    "bad state": (_changed("states", 0, "rate", to=["boom"]), "rate of state 'omega': "),
    "bad constraint": (_changed("constraints", 0, to=["add", "n", 1]), "a constraint: "),
    "another fingerprint": (_changed("fingerprint", to="0" * 500), "but the file says '0{37}[.]{3}'"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_law_file_is_one_sentence_that_names_the_file(case):
    data, message = BAD_FILES[case]
    with pytest.raises(LawError, match=message) as error:
        law_from_json(data, "laws/mine.json")
    assert str(error.value).startswith("laws/mine.json: ")
    assert "\n" not in str(error.value)


# ---- tree fuzz -------------------------------------------------------------------------------------------------------

# Whatever a law file holds, reading it gives a law or a LawError, soon.


FUZZ_SYMBOLS = {s.name: s for s in (A, n, stress, time)}
ORIGINALS = [law_to_json(law) for law in (NORTON.times(arrhenius()), DRIFTING_EXPONENT, COMBINED)]

LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([0, 1, -1, 2, 9, 10**9, 10**299, 10**400, -(10**400)])
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["A", "n", "stress", "time", "creepkit-law"])
)
JSON = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=8), inner, max_size=5),
    max_leaves=20,
)
SMALL = st.integers(-3, 12) | st.sampled_from([999, 10**9, 10**299])
NUMBERS = (
    st.sampled_from(["A", "n", "stress", "time", "stress", "n"])
    | SMALL
    | st.floats(allow_nan=False, allow_infinity=False).map(lambda x: ["float", x])
    | st.tuples(st.integers(), st.integers(1)).map(lambda pq: ["rational", *pq])
    | st.tuples(st.integers(), st.integers(-2000, 2000), st.integers(2, 1000)).map(lambda t: ["float", *t])
)


def _compound(inner):
    """Trees that are well formed in all but size: every head with arguments of its kind and number."""
    relation = st.tuples(st.sampled_from(["ge", "gt", "le", "lt"]), inner, inner).map(list)
    either = st.tuples(st.sampled_from(["and", "or"]), relation, relation).map(list)
    branches = st.lists(st.tuples(inner, relation | either).map(list), min_size=1, max_size=2)
    numeric = {name: head for name, head in _NODE_TYPES.items() if head.result_kind is sympy.Expr}
    heads = [
        st.tuples(st.just(name), st.lists(inner, min_size=head.fewest_arguments, max_size=min(head.most_arguments, 3)))
        for name, head in numeric.items()
    ]
    cases = st.tuples(branches, inner).map(lambda bi: ["piecewise", *bi[0], [bi[1], ["true"]]])
    return st.one_of(*heads).map(lambda head: [head[0], *head[1]]) | cases


TREES = st.recursive(NUMBERS, _compound, max_leaves=12)


def read(document):
    """The law in a document, or the sentence that says why there is none."""
    try:
        return law_from_json(document)
    except LawError as error:
        return str(error)


@given(TREES | JSON)
@settings(max_examples=400, deadline=None)
def test_any_tree_as_an_expression(tree):
    try:
        expression = expression_from_tree(tree, FUZZ_SYMBOLS)
    except LawError:
        return
    assert expression.free_symbols <= set(FUZZ_SYMBOLS.values())


def _places(data, path=()):
    """Every place in a document, as a path of keys."""
    yield path
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in inner:
        yield from _places(value, (*path, key))


@given(st.sampled_from(ORIGINALS), st.data())
@settings(max_examples=150, deadline=None)
def test_a_mutated_law_is_the_law_or_an_error(original, data):
    document = copy.deepcopy(original)
    path = data.draw(st.sampled_from([p for p in _places(document) if p]))
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = data.draw(JSON | TREES)
    law = read(document)
    if isinstance(law, CreepLaw):
        assert law.fingerprint == original["fingerprint"]
    else:
        assert "\n" not in law


@given(st.sampled_from(ORIGINALS), st.data())
@settings(max_examples=150, deadline=None)
def test_a_forged_file_with_its_own_fingerprint_is_harmless(original, data):
    """Such a law is an ordinary one: it goes to JSON and back."""
    document = copy.deepcopy(original)
    document["terms"][0]["expression"] = ["mul", document["terms"][0]["expression"], data.draw(TREES)]
    sentence = read(document)
    found = re.search(r"have fingerprint (\S+)", sentence) if isinstance(sentence, str) else None
    if found is None:
        return
    law = read({**document, "fingerprint": found[1]})
    assert isinstance(law, CreepLaw)
    assert law_from_json(json.loads(json.dumps(law_to_json(law)))) == law


def test_an_expression_that_sympy_fails_at_is_said():
    """Found by the test of mutated laws: sympy compares what is no number when it writes such a power."""
    document = copy.deepcopy(ORIGINALS[1])
    place = document
    path = ("terms", 0, "expression", 3, 2, 3, 3, 1, 2)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = ["pow", ["piecewise", ["A", ["ge", 0, 0]], ["A", ["true"]]], "A"]
    law = read(document)
    assert isinstance(law, str)
    assert "sympy fails at its expressions" in law
