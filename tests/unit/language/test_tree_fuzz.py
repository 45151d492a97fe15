"""Whatever a law file holds, reading it gives a law or a LawError, soon."""

import copy
import json
import re

import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from creepkit.errors import LawError
from creepkit.language import CreepLaw, arrhenius, parameters, stress, time
from creepkit.language.expression_trees import _NODE_TYPES
from creepkit.language.law_codec import expression_from_tree, law_from_json, law_to_json
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON

A, n = parameters("A n")
SYMBOLS = {s.name: s for s in (A, n, stress, time)}
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
        expression = expression_from_tree(tree, SYMBOLS)
    except LawError:
        return
    assert expression.free_symbols <= set(SYMBOLS.values())


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
