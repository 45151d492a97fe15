"""Whatever stands in an identification file, reading it gives an identification or one CreepkitError."""

import copy
import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from creepkit.errors import CreepkitError
from creepkit.inverse.identification import Identification, IdentificationSettings
from creepkit.inverse.identification_document import (
    identification_from_json,
    identification_to_json,
    read_identification,
)
from creepkit.inverse.identify import identify
from creepkit.laws.norton import NORTON
from helpers.steady_rate_predictor import Steady, planted

ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=12,
)
FUZZ = settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def valid():
    tests = planted(NORTON, {"A": 1e-16, "n": 5.0}, [(s, 1050.0) for s in (30, 50, 80)], seed=1, noise=1e-5)
    fit = identify(NORTON, tests, Steady(), settings=IdentificationSettings(starts=1, sobol_points=4, frames=10))
    return json.loads(json.dumps(identification_to_json(fit)))


def read(data):
    """Read: the answer, or the one error that reading may raise."""
    try:
        return identification_from_json(data)
    except CreepkitError as error:
        return error


def is_an_answer_or_one_sentence(found):
    return isinstance(found, Identification) or "\n" not in str(found)


@FUZZ
@given(ANYTHING)
def test_any_json(data):
    assert is_an_answer_or_one_sentence(read(data))


@FUZZ
@given(st.data())
def test_valid_files_with_one_part_changed(valid, data):
    changed = copy.deepcopy(valid)
    place, key = changed, data.draw(st.sampled_from(sorted(changed)))
    while isinstance(place[key], (dict, list)) and place[key] and data.draw(st.booleans()):
        place = place[key]
        key = data.draw(st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))))
    place[key] = data.draw(ANYTHING)
    assert is_an_answer_or_one_sentence(read(changed))


@FUZZ
@given(st.binary(max_size=200))
def test_any_bytes(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("fuzz") / "fit.json"
    path.write_bytes(content)
    with pytest.raises(CreepkitError, match=r"fit\.json"):
        read_identification(path)
