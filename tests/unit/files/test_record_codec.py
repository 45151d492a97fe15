"""Records as JSON and back: what is written is read, and whatever else is there is one sentence with its place."""

import enum
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import CreepkitError, FitError
from creepkit.files.json_documents import DocumentFormat, check_heading, json_text, parse_json, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError, ValueCodec
from creepkit.limits import numbers
from helpers.mistakes import said_otherwise

NOTE = FileKind("a note", FitError, "give a note")


class Colour(enum.Enum):
    RED = 1
    BLUE = 2


class Span(NamedTuple):
    low: float
    steps: int


@dataclass(frozen=True)
class Inner:
    name: str
    size: float = 1.0

    def __post_init__(self) -> None:
        if self.size == 13:
            raise FitError("the size is 13, which is unlucky")


@dataclass(frozen=True, eq=False)
class Outer:
    inner: Inner
    several: tuple[Inner, ...]
    table: Mapping[str, float]
    weights: Literal["equal", "paper"] | Mapping[str, float]
    values: Floats
    counts: Ints
    flags: Bools
    span: Span
    colour: Colour
    strength: float | None
    pair: tuple[float, int]
    lists: list[float]
    anything: Any
    law: complex
    count: int = 3
    cache: object = field(default=None)


COMPLEX = ValueCodec(lambda z: [z.real, z.imag], lambda data, place: complex(*data))
CODEC = RecordCodec(
    omitted={Outer: ("cache",)},
    ranges={Outer: {"values": numbers(nan=True, infinite=True), "strength": numbers(low=0.0, above=True)}},
    values={complex: COMPLEX},
)
OUTER = Outer(
    inner=Inner("a", 2.0),
    several=(Inner("b"), Inner("c")),
    table={"x": 1.0},
    weights={"y": 2.0},
    values=np.array([[1.0, np.nan], [np.inf, -np.inf]]),
    counts=np.array([1, 2]),
    flags=np.array([True, False]),
    span=Span(0.5, 4),
    colour=Colour.BLUE,
    strength=None,
    pair=(1.5, 2),
    lists=[1.0],
    anything={"free": [1, "two"]},
    law=1 + 2j,
    cache=object(),
)
DATA = CODEC.to_json(OUTER)


def test_what_is_written_is_read():
    text = json_text(DATA)
    again = CODEC.from_json(Outer, parse_json(text, "note", NOTE))
    assert CODEC.to_json(again) == DATA
    np.testing.assert_array_equal(again.values, OUTER.values)
    assert again.counts.dtype == np.int64
    assert again.flags.dtype == np.bool_
    assert again.several == OUTER.several
    assert (again.span, again.colour, again.law, again.cache) == (OUTER.span, Colour.BLUE, 1 + 2j, None)
    assert isinstance(again.lists, list)
    assert DATA["values"] == [[1.0, None], ["inf", "-inf"]]
    assert "cache" not in DATA


def test_what_does_not_fit_is_one_sentence_with_its_place():
    cases = (
        ({"colours": 1}, "the document: unknown key 'colours'; did you mean 'colour'"),
        ({"inner": {"size": 2.0}}, "inner: 'name' is missing"),
        ({"inner": None}, "inner is null; allowed is an object"),
        ({"inner": {"name": "a", "size": 13}}, "inner: the size is 13, which is unlucky"),
        ({"inner": {"name": "a", "size": True}}, "inner.size is True; allowed is a finite number"),
        ({"inner": {"name": "a", "size": "inf"}}, "inner.size is 'inf'; allowed is a finite number"),
        ({"inner": {"name": "a", "size": 10**400}}, "inner.size is 1000.*; allowed is a finite number"),
        ({"several": [{"name": "b"}, {"name": 3}]}, "several.1.name is 3; allowed is a text"),
        ({"table": {"x": []}}, "table.x is a list; allowed is a (finite )?number"),
        ({"weights": "noise"}, "weights is 'noise'; allowed is 'equal' or 'paper'"),
        ({"weights": [1.0]}, "weights is a list, which is none of its kinds"),
        ({"values": [[1.0], [1.0, 2.0]]}, "values holds lists of different lengths"),
        ({"values": [["one"]]}, "values.0.0 is 'one'; allowed is a number"),
        ({"counts": [1.5]}, "counts.0 is 1.5; allowed is a whole number"),
        ({"counts": [10**30]}, "counts holds"),
        ({"flags": [1]}, "flags.0 is 1; allowed is true or false"),
        ({"span": [0.5]}, "span is a list of 1; allowed is one of 2"),
        ({"colour": "GREEN"}, "colour is 'GREEN'; allowed is 'RED' or 'BLUE'"),
        ({"strength": 0.0}, "strength is 0.0; allowed is a finite number above 0"),
        ({"pair": [1.0, 2.0]}, "pair.1 is 2.0; allowed is a whole number"),
        ({"inner": {"name": "a\u202eb"}}, r"inner.name holds the character U\+202E, which cannot be printed"),
    )
    calls = ((partial(CODEC.from_json, Outer, {**DATA, **changes}), f"^{message}") for changes, message in cases)
    assert said_otherwise(calls, RecordError) == []


def test_a_record_may_be_changed_in_some_fields():
    changed = CODEC.updated(OUTER, {"inner": {"size": 5.0}, "count": 4})
    assert (changed.inner, changed.count, changed.pair) == (Inner("a", 5.0), 4, OUTER.pair)
    with pytest.raises(RecordError, match="inner: unknown key 'colour'"):
        CODEC.updated(OUTER, {"inner": {"colour": 1}})


def test_what_cannot_be_stored_is_said():
    with pytest.raises(RecordError, match="the record.inner is a set, which cannot be stored"):
        CODEC.to_json(Outer(**{**vars(OUTER), "inner": {1}}))


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=12,
)


def sentence(data):
    """What is wrong with the data; "" when nothing is."""
    try:
        CODEC.from_json(Outer, data)
    except CreepkitError as error:
        return str(error)
    return ""


@given(st.sampled_from(sorted({*DATA} - {"law"})), ANYTHING)  # the codec of `law` checks nothing
@settings(max_examples=300, deadline=None)
def test_any_change_gives_a_record_or_an_error(key, value):
    assert "\n" not in sentence({**DATA, key: value})


# ---- JSON ----------------------------------------------------------------------------------------------------------


def test_text_that_is_no_strict_json():
    keys = ",".join(f'"k{k}": 1' for k in range(50_000))
    cases = (
        ('{"a": 1, "a": 2}', "note: the key 'a' stands twice in one object; give a note"),
        ("[NaN]", "NaN is no number of JSON"),
        ("[-Infinity]", "-Infinity is no number of JSON"),
        ("[1e999]", "the number 1e999 is too large"),
        ("[" + "9" * 5000 + "]", "an integer too long"),
        ("[" * 100_000, "lists nested too deep"),
        ("[" * 300 + "]" * 300, "lists nested too deep"),
        ('{"a\\u001b": 1, "a\\u001b": 2}', r"the key 'a\\u001b' stands twice"),
        ("{" + keys + ', "k49999": 1}', "'k49999' stands twice"),
        ('{"a":\n', "note, line 2: not JSON: expecting value"),
        ("", "note, line 1: not JSON"),
    )
    assert (
        said_otherwise(((partial(parse_json, text, "note", NOTE), message) for text, message in cases), FitError) == []
    )


def test_numbers_that_json_does_not_know_are_not_written():
    for value in (math.nan, math.inf):
        with pytest.raises(ValueError, match="JSON"):
            json_text([value])


def test_a_document_says_its_format_and_version(tmp_path):
    document = DocumentFormat("test-note", 3, NOTE, "write it again")
    path = write_json({**document.heading, "a": 1}, tmp_path / "note.json", NOTE)
    data = read_json(path, NOTE)
    assert json.loads(path.read_text()) == data == {"format": "test-note", "version": 3, "a": 1}
    assert check_heading(data, "note", document) == {"a": 1}
    for wrong, message in (
        ({**data, "version": 2}, "note: in version 2 of the format; this one reads version 3: write it again"),
        ({**data, "version": 4}, "written by a newer creepkit"),
        ({**data, "version": True}, "in version True"),
        ({**data, "format": "other"}, "this is not a note that creepkit wrote"),
        ([data], "this is not a note that creepkit wrote"),
    ):
        with pytest.raises(FitError, match=message):
            check_heading(wrong, "note", document)
