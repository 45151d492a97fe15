"""Data sets in files: what is written is read, with h5py alone too; what is something else is said in a sentence."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import creepkit
from creepkit.dataset import storage
from creepkit.dataset.dataset import COLUMNS
from creepkit.dataset.generation import GenerationJob
from creepkit.dataset.simulation import simulate_rows
from creepkit.errors import DatasetError
from helpers.dataset_runs import assert_same
from helpers.planted_sampling import BAR, GRID, Planted, Raising, strain, stress_of
from helpers.written_files import names_in


def simulated(tmp_path, design=None, first=0, rows=32, seed=0, specimen=BAR):
    job = GenerationJob(design or Planted(), specimen, seed, tmp_path / "parts", rows)
    return simulate_rows(job.design, job.header, seed, first, rows)


@pytest.fixture
def data(tmp_path):
    raising = Raising(stress_of(next(r for r in range(32) if stress_of(r) <= 120.0)))
    return simulated(tmp_path, Planted((*Planted().criteria, raising)))


def test_histories_are_those_of_nortons_law_under_constant_load(data):
    for row in np.flatnonzero(data.reasons == 0):
        expected = strain(data.values_of(row), data.conditions_of(row), GRID.values)
        np.testing.assert_allclose(data.values[row, :, 0], expected, rtol=1e-4, atol=1e-12)
        marks = strain(data.values_of(row), data.conditions_of(row), np.array([0.0, 2000.0, 2000.0, 3600.0]))
        np.testing.assert_allclose(data.hold_outputs[row, :, 0], marks, rtol=1e-4, atol=1e-12)


def test_samples_fall_out_for_the_first_criterion_that_they_do_not_meet(data):
    strong = data.conditions[:, 0] <= 120.0
    np.testing.assert_array_equal(data.reasons == 1, ~strong)
    assert np.isnan(data.values[~strong]).all()
    assert (data.status[~strong] == -1).all()
    visible = np.array([strain(data.values_of(r), data.conditions_of(r), GRID.values)[-1] > 1e-5 for r in range(32)])
    np.testing.assert_array_equal(data.reasons == 2, strong & ~visible)
    assert np.isfinite(data.values[data.reasons == 2]).all()


def test_a_failed_sample_is_data_with_its_text(data):
    (row,) = np.flatnonzero(data.reasons == -1)
    assert data.failures == {row: "ZeroDivisionError: stress of no use"}
    assert np.isfinite(data.values[row]).all()


def test_a_sample_that_does_not_converge_at_all_has_failed(tmp_path):
    @dataclass(frozen=True)
    class Stuck(type(BAR)):
        def predict_batch(self, law, theta, histories, nuisances, sensitivities):
            found = super().predict_batch(law, theta, histories, nuisances, sensitivities)
            nothing = np.full_like(found.values, np.nan)
            return replace(found, values=nothing, status=found.status + 2, end_times=found.end_times * 0)

    stuck = simulated(tmp_path, specimen=Stuck(), rows=7)
    assert set(stuck.failures.values()) == {"not converged from 0 s on, with nothing to show before"}
    assert len(stuck.failures) == (stuck.reasons == -1).sum() == (stuck.conditions[:, 0] <= 120.0).sum()


def test_what_is_written_is_read(data, tmp_path):
    again = storage.read_dataset(storage.write_dataset(data, tmp_path / "a.h5"))
    assert_same(again, data)
    assert again.law == data.law
    assert again.specimen == BAR
    assert again.grid == GRID
    assert again.outputs == ("strain",)
    assert again.reason_names == ("accepted", "strong", "visible", "raising")
    assert again.design_document == data.design_document
    assert again.provenance == data.provenance
    assert names_in(tmp_path) == ["a.h5"]


def test_only_accepted_samples_may_be_read(data, tmp_path):
    path = storage.write_dataset(data, tmp_path / "a.h5")
    assert_same(storage.read_dataset(path, accepted_only=True), data.accepted)
    assert len(data.accepted) == (data.reasons == 0).sum() > 0


def test_h5py_alone_reads_a_data_set(data, tmp_path):
    path = storage.write_dataset(data, tmp_path / "a.h5")
    program = f"""
import json, sys, h5py
with h5py.File({str(path)!r}) as f:
    good = f["reasons"][:] == 0
    strain = f["values"][good][:, :, list(f.attrs["outputs"]).index("strain")]
    A = f["parameters"][good][:, list(f.attrs["parameter_names"]).index("A")]
    times, relative = f["time_grid"][:], f["time_grid"].attrs["relative"]
    failed = dict(zip(f["failures/rows"][:].tolist(), f["failures/texts"].asstr()[:].tolist()))
    told = f.attrs["format"], int(f.attrs["layout"]), f.attrs["units"], json.loads(f.attrs["law"])["name"]
    print(json.dumps([strain.tolist(), A.tolist(), times.tolist(), bool(relative), failed, told]))
assert "creepkit" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    strains, A, times, relative, failed, told = json.loads(done.stdout)
    good = data.accepted
    np.testing.assert_array_equal(np.float32(strains), good.values[..., 0])
    np.testing.assert_array_equal(A, good.parameters[:, 0])
    np.testing.assert_array_equal(times, GRID.values)
    assert (relative, told) == (False, ["creepkit-dataset", 1, "MPa, mm, s, K", "norton"])
    assert {int(row): text for row, text in failed.items()} == data.failures


def test_rows_keep_what_belongs_to_them(data):
    (row,) = data.failures
    part = data.rows([31, row])
    assert_same(part.rows([1]), data.rows([row]))
    assert part.failures == {1: data.failures[row]}
    assert part.values_of(0) == data.values_of(31)
    assert part.index.tolist() == [31, row]
    assert part.planned_test(0).loading.program() == data.planned_test(31).loading.program()
    np.testing.assert_array_equal(part.times(0), GRID.values)


# ---- files that are something else ---------------------------------------------------------------------------------


def sentence(path):
    with pytest.raises(DatasetError) as caught:
        storage.read_dataset(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_no_file_a_folder_and_text(tmp_path):
    assert "there is no such file" in sentence(tmp_path / "none.h5")
    assert "is a folder" in sentence(tmp_path)
    (tmp_path / "text.h5").write_text("A,n\n1,2\n")
    assert "not an HDF5 file; give a data set" in sentence(tmp_path / "text.h5")
    (tmp_path / "empty.h5").touch()
    assert "not an HDF5 file" in sentence(tmp_path / "empty.h5")


def test_every_truncation_of_a_file_is_noticed(data, tmp_path):
    whole = storage.write_dataset(data, tmp_path / "a.h5").read_bytes()
    for length in range(0, len(whole), max(len(whole) // 23, 1)):
        (tmp_path / "cut.h5").write_bytes(whole[:length])
        sentence(tmp_path / "cut.h5")


# ---- files that mean harm ------------------------------------------------------------------------------------------


DAMAGED = "cannot be read, it seems damaged"


def said(name, value):
    """A change of an attribute."""
    return lambda file: file.attrs.__setitem__(name, value)


def replaced(name, values, **how):
    """A change of one array."""

    def change(file):
        kept = dict(file[name].attrs)
        del file[name]
        file.create_dataset(name, data=values, **how).attrs.update(kept)

    return change


def enormous(file):
    """Every array promises a million million samples; of none is anything there."""
    for name in COLUMNS:
        file[name].resize(10**12, axis=0)


def put_group(name):
    """A change that puts a group in the place of an array."""

    def change(file):
        del file[name]
        file.create_group(name)

    return change


def of_accepted(name, value):
    """A change of what an array says of the first accepted sample."""

    def change(file):
        file[name][np.flatnonzero(file["reasons"][:] == 0)[0]] = value

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (enormous, "its arrays have more than 100 MB unpacked"),
        (replaced("reasons", np.zeros(32)), "the array 'reasons' is float64 .*, which does not fit"),
        (replaced("parameters", np.zeros((32, 2), complex)), "the array 'parameters' is complex128 .*, which does not"),
        (replaced("parameters", np.full((32, 2), b"1e-12")), "the array 'parameters' is .*, which does not fit"),
        (lambda file: file["reasons"].resize(3, axis=0), r"the array 'reasons' is int8 \(3,\), which does not fit"),
        (replaced("time_grid", np.array([0.0, np.nan, 1000.0, 3600.0])), "a time grid needs two or more finite times"),
        (replaced("time_grid", np.array([0.0, 100.0, 100.0, 3600.0])), "must start at or after 0 and increase"),
        (replaced("time_grid", np.zeros((4, 4))), "a time grid needs two or more finite times"),
        (lambda file: file.__delitem__("failures"), DAMAGED),
        (lambda file: file.__delitem__("hold_outputs"), DAMAGED),
        (lambda file: file["time_grid"].attrs.__delitem__("relative"), DAMAGED),
        (put_group("time_grid"), DAMAGED),
        (put_group("failures/texts"), DAMAGED),
        (replaced("failures/rows", np.array([1, 2, 3])), "its failures are not of samples, each with one text"),
        (replaced("failures/rows", np.array([10**9])), "its failures are not of samples"),
        (of_accepted("status", 77), "sample .*: its status is none"),
        (of_accepted("reasons", 6), "sample .*: its reason is none"),
        (of_accepted("values", np.nan), "sample .*: its history is missing, though it was accepted"),
        (of_accepted("parameters", -1.0), "its parameters or conditions are no numbers of its law"),
        (of_accepted("parameters", np.nan), "its parameters or conditions are no numbers of its law"),
        (said("layout", 2), "its layout is 2, this creepkit reads layout 1; upgrade creepkit"),
        (said("layout", 0), "its layout is 0, this creepkit reads layout 1; generate it again"),
        (said("layout", 1.0), "its layout is 1.0, this"),
        (said("units", "Pa, m, s, K"), "its units are 'Pa, m, s, K'; allowed are 'MPa, mm, s, K'"),
        (said("law", "{"), "its law, line 1: not JSON: expecting property name"),
        (said("law", "{}"), "this is not a law that creepkit wrote"),
        (said("law", "[" * 100_000), "its law: lists nested too deep"),
        (said("specimen", '{"name": "bar of soap", "fields": {}}'), "'bar of soap' cannot be rebuilt here"),
        (said("specimen", '{"name": "uniaxial", "fields": {"colour": 1}}'), "'uniaxial' cannot be rebuilt here"),
        (said("design", "3"), "the attribute 'design' is no record"),
        (said("outputs", 3.0), DAMAGED),
        (lambda file: file.attrs.__delitem__("outputs"), DAMAGED),
        (said("outputs", ["a", "b"]), "the array 'values' is .*, which does not fit"),
        (said("parameter_names", ["n", "A"]), "its parameters are n, A, those of its"),
        (said("reason_texts", ["met"]), "not a text for each reason"),
    ],
)
def test_what_a_file_promises_is_checked(data, tmp_path, change, message):
    path = storage.write_dataset(data, tmp_path / "a.h5")
    with h5py.File(path, "r+") as file:
        change(file)
    assert re.search(message, sentence(path))


def test_nothing_from_a_file_is_unpickled():
    """Pickles travel between a campaign and its workers, through pipes; none is read from a file."""
    sources = {path: path.read_text() for path in Path(creepkit.__file__).parent.rglob("*.py")}
    unpickling = {path.name for path, text in sources.items() if "pickle.load" in text}
    assert unpickling == {"worker_process.py", "law_checks.py", "predictor_checks.py"}  # kits: of what they pickled
    assert not any("allow_pickle" in text or "torch.load" in text for text in sources.values())
