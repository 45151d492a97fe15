"""Files of weights: round trips, and one sentence for each that is damaged, foreign or newer."""

import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

import creepkit as ck
from creepkit.errors import SurrogateError
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.files.writing import RECORD
from creepkit.surrogates.surrogate import SURROGATE, load_surrogate, surrogate

HEADER = {"kind": "parameter-gru"}
WEIGHTS = {"a": np.arange(6.0, dtype=np.float32).reshape(2, 3), "b": np.array(3)}


def test_weights_and_header_come_back(tmp_path: Path) -> None:
    path = write_safetensors(tmp_path / "m.safetensors", WEIGHTS, {**HEADER, "curves": {"loss": [1.0, 0.5]}}, SURROGATE)
    tensors, header = read_safetensors(path, SURROGATE)
    assert all(
        np.array_equal(tensors[name], WEIGHTS[name]) and tensors[name].dtype == WEIGHTS[name].dtype for name in WEIGHTS
    )
    assert header["curves"] == {"loss": [1.0, 0.5]}
    assert {p.name for p in tmp_path.iterdir()} == {RECORD, "m.safetensors"}


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda raw: raw[: len(raw) - 7], "damaged, or not a safetensors file"),
        (lambda raw: b"", "damaged, or not a safetensors file"),
        (lambda raw: b"PK\x03\x04" + raw, "damaged, or not a safetensors file"),
        (lambda raw: raw.replace(b'\\"version\\": 3', b'\\"version\\": 9'), "written by a newer creepkit"),
        (lambda raw: raw.replace(b'\\"version\\": 3', b'\\"version\\":-1'), "in version -1 of the format"),
        (lambda raw: raw.replace(b"creepkit-surrogate", b"creepkit-something"), "this is not a surrogate that"),
        (lambda raw: raw.replace(b"parameter-gru", b"hyper-network"), "allowed is 'parameter-gru'"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_a_surrogate_says_why(tmp_path: Path, spoil, told: str) -> None:
    path = write_safetensors(tmp_path / "m.safetensors", WEIGHTS, {**HEADER, "recipe": {}, "metadata": {}}, SURROGATE)
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(SurrogateError, match=told) as caught:
        load_surrogate(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def file_of(entries: object, size: int, metadata: object = None) -> bytes:
    """A file with this header and so many bytes behind it."""
    heading = {"creepkit": json.dumps(SURROGATE.heading)} if metadata is None else metadata
    header = json.dumps({"__metadata__": heading, **entries}).encode()  # type: ignore[dict-item]
    return len(header).to_bytes(8, "little") + header + bytes(size)


def entry(dtype: object = "F32", shape: object = (2, 3), offsets: object = (0, 24)) -> dict[str, object]:
    return {"dtype": dtype, "shape": shape, "data_offsets": offsets}


@pytest.mark.parametrize(
    ("entries", "size"),
    [
        ({"a": entry()}, 23),
        ({"a": entry(shape=(2, 4))}, 24),
        ({"a": entry(), "b": entry(offsets=(25, 49))}, 49),
        ({"a": entry(dtype="BF16")}, 12),
        ({"a": entry(shape=(2**62, 2**62, 0), offsets=(0, 0))}, 0),
        ({"a": entry(shape=(1,) * 100 + (6,))}, 24),
        ({"a": 1}, 24),
    ],
)  # fmt: skip
def test_a_header_that_does_not_describe_its_file_is_refused(tmp_path: Path, entries: object, size: int) -> None:
    path = tmp_path / "m.safetensors"
    path.write_bytes(file_of({"a": entry()}, 24))
    assert read_safetensors(path, SURROGATE)[0]["a"].shape == (2, 3)
    path.write_bytes(file_of(entries, size))
    with pytest.raises(SurrogateError, match="damaged, or not a safetensors file"):
        read_safetensors(path, SURROGATE)


def test_arrays_are_those_of_the_reference_reader(tmp_path: Path) -> None:
    """The package safetensors reads the same numbers, of every type that NumPy has."""
    rng = np.random.default_rng(0)
    types = ("?", "u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8")
    arrays = {f"of {name}": rng.integers(0, 2, (3, k)).astype(name) for k, name in enumerate(types)}
    arrays |= {"number": np.array(7.5), "text of ä": rng.normal(size=(2, 1, 4)).astype("f4")}
    path = write_safetensors(tmp_path / "m.safetensors", arrays, HEADER, SURROGATE)
    found, expected = read_safetensors(path, SURROGATE)[0], load_file(path)
    assert found.keys() == expected.keys() == arrays.keys()
    for name, array in expected.items():
        assert (
            (found[name].dtype, found[name].shape)
            == (array.dtype, array.shape)
            == (arrays[name].dtype, arrays[name].shape)
        )
        np.testing.assert_array_equal(found[name], array)
        assert found[name].flags.writeable
        assert found[name].flags.aligned


def test_weights_of_another_program_are_told_apart(tmp_path: Path) -> None:
    save_file(WEIGHTS, tmp_path / "other.safetensors")
    with pytest.raises(SurrogateError, match="written by another program"):
        load_surrogate(tmp_path / "other.safetensors")


def test_a_header_without_its_parts_says_so(tmp_path: Path) -> None:
    path = write_safetensors(
        tmp_path / "m.safetensors", WEIGHTS, {**HEADER, "recipe": {"training": {}}, "metadata": {}}, SURROGATE
    )
    with pytest.raises(SurrogateError, match="metadata: 'law' is missing"):
        load_surrogate(path)


def test_the_surrogate_of_the_dimple_is_the_reduced_order_model_of_the_bulge_specimen() -> None:
    model = surrogate("dimple")
    assert model == ck.specimen("bulge").reduced_order_model()
    assert model.refined() == ck.specimen("bulge").refined()


def test_names_that_nobody_knows(tmp_path: Path) -> None:
    with pytest.raises(SurrogateError, match="no surrogate is called 'dimpel'"):
        surrogate("dimpel")
    with pytest.raises(SurrogateError, match="there is no such file"):
        surrogate(tmp_path / "none.safetensors")
