"""Whatever a law file holds, reading it gives a law or a LawError, soon."""

import copy
import json

from hypothesis import given, settings
from hypothesis import strategies as st

from creepkit.errors import LawError
from creepkit.language import CreepLaw, arrhenius, parameters, stress, time
from creepkit.language.nodes import _HEADS
from creepkit.language.tree import from_tree, law_from_json, law_to_json
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
TREES = st.recursive(
    st.sampled_from(["A", "n", "stress", "time", 0, 1, -1, 2, 9, 999, ["pi"], ["true"], ["false"]])
    | st.floats(allow_nan=False, allow_infinity=False).map(lambda x: ["float", x])
    | st.tuples(st.integers(), st.integers()).map(lambda pq: ["rational", *pq])
    | st.tuples(st.integers(), st.integers(-3000, 3000), st.integers(0, 1100)).map(lambda t: ["float", *t]),
    lambda inner: st.tuples(st.sampled_from([*_HEADS, "piecewise"]), st.lists(inner, min_size=1, max_size=3)).map(
        lambda head: [head[0], *head[1]]
    )
    | st.tuples(inner, inner).map(list),
    max_leaves=25,
)


@given(JSON)
@settings(max_examples=150, deadline=None)
def test_any_json_as_a_law(data):
    try:
        assert isinstance(law_from_json(data), CreepLaw)
    except LawError as error:
        assert "\n" not in str(error)


@given(TREES | JSON)
@settings(max_examples=400, deadline=None)
def test_any_tree_as_an_expression(tree):
    try:
        expression = from_tree(tree, SYMBOLS)
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
    try:
        law = law_from_json(document)
    except LawError:
        return
    assert law.fingerprint == original["fingerprint"]


@given(st.sampled_from(ORIGINALS), st.data())
@settings(max_examples=100, deadline=None)
def test_a_tree_that_carries_its_own_fingerprint_is_harmless(original, data):
    """Even a forged file costs little: its numbers are found, or refused, in bounded time."""
    document = copy.deepcopy(original)
    document["terms"][0]["expression"] = ["mul", document["terms"][0]["expression"], data.draw(TREES)]
    try:
        law_from_json(document)
    except LawError as error:
        assert json.dumps(str(error))
