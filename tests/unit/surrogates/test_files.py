"""Files of weights: round trips, and one sentence for each that is damaged, foreign or newer."""

import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

import creepkit as ck
from creepkit.errors import SurrogateError
from creepkit.files.written_lists import RECORD
from creepkit.inverse.composite_predictor import refined_of
from creepkit.surrogates.loading import load_surrogate, surrogate_by_name
from creepkit.surrogates.weight_files import read_weights, write_weights

HEADER = {"kind": "parameter-gru"}
WEIGHTS = {"a": np.arange(6.0, dtype=np.float32).reshape(2, 3), "b": np.array(3)}


def test_weights_and_header_come_back(tmp_path: Path) -> None:
    path = write_weights(tmp_path / "m.safetensors", WEIGHTS, {**HEADER, "curves": {"loss": [1.0, 0.5]}})
    tensors, header = read_weights(path)
    assert all(
        np.array_equal(tensors[name], WEIGHTS[name]) and tensors[name].dtype == WEIGHTS[name].dtype for name in WEIGHTS
    )
    assert header["curves"] == {"loss": [1.0, 0.5]}
    assert {p.name for p in tmp_path.iterdir()} == {RECORD, "m.safetensors"}


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    path = write_weights(tmp_path / "m.safetensors", WEIGHTS, HEADER)
    before = path.read_bytes()
    with pytest.raises(ValueError, match="JSON"):
        write_weights(path, WEIGHTS, {**HEADER, "loss": float("nan")})
    assert path.read_bytes() == before
    with pytest.raises(SurrogateError, match="cannot be written"):
        write_weights(tmp_path / "nowhere" / "m.safetensors", WEIGHTS, HEADER)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda raw: raw[: len(raw) - 7], "damaged, or not a safetensors file"),
        (lambda raw: b"", "damaged, or not a safetensors file"),
        (lambda raw: b"PK\x03\x04" + raw, "damaged, or not a safetensors file"),
        (lambda raw: raw.replace(b'\\"version\\": 2', b'\\"version\\": 9'), "written by a newer creepkit"),
        (lambda raw: raw.replace(b'\\"version\\": 2', b'\\"version\\":-1'), "in version -1 of the format"),
        (lambda raw: raw.replace(b"creepkit-surrogate", b"creepkit-something"), "this is not a surrogate that"),
        (lambda raw: raw.replace(b"parameter-gru", b"hyper-network"), "kind 'hyper-network' is unknown here"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_a_surrogate_says_why(tmp_path: Path, spoil, told: str) -> None:
    path = write_weights(tmp_path / "m.safetensors", WEIGHTS, {**HEADER, "recipe": {}, "metadata": {}})
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(SurrogateError, match=told) as caught:
        load_surrogate(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_weights_of_another_program_are_told_apart(tmp_path: Path) -> None:
    save_file(WEIGHTS, tmp_path / "other.safetensors")
    with pytest.raises(SurrogateError, match="written by another program"):
        load_surrogate(tmp_path / "other.safetensors")


def test_a_header_without_its_parts_says_so(tmp_path: Path) -> None:
    path = write_weights(tmp_path / "m.safetensors", WEIGHTS, {**HEADER, "recipe": {"training": {}}, "metadata": {}})
    with pytest.raises(SurrogateError, match="metadata: 'law' is missing"):
        load_surrogate(path)


def test_the_surrogate_of_the_dimple_is_the_reduced_order_model_of_the_bulge_specimen() -> None:
    model = surrogate_by_name("dimple")
    assert model == ck.specimen("bulge").reduced_order_model()
    assert refined_of(model) == ck.specimen("bulge").refined()


def test_names_that_nobody_knows(tmp_path: Path) -> None:
    with pytest.raises(SurrogateError, match="no surrogate is called 'dimpel'"):
        surrogate_by_name("dimpel")
    with pytest.raises(SurrogateError, match="there is no such file"):
        surrogate_by_name(tmp_path / "none.safetensors")


def test_the_header_is_plain_json(tmp_path: Path) -> None:
    raw = write_weights(tmp_path / "m.safetensors", WEIGHTS, HEADER).read_bytes()
    size = int.from_bytes(raw[:8], "little")
    told = json.loads(raw[8 : 8 + size])["__metadata__"]["creepkit"]
    assert json.loads(told) == {"format": "creepkit-surrogate", "version": 2, "kind": "parameter-gru"}
