"""Generations that meet damaged files, a full disk, or a wish that cannot be met: nothing is lost, and it is said."""

import os
import re
import resource
from dataclasses import dataclass

import h5py
import pytest

from creepkit.dataset import storage
from creepkit.errors import DatasetError
from helpers.dataset_runs import ROWS, assert_same, left_behind, run, run_here, shards_of, whole_of
from helpers.planted_sampling import Planted, Raising


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The data set as it is when nothing goes wrong."""
    return whole_of(tmp_path_factory)


# ---- files that are in the way -------------------------------------------------------------------------------------


@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "text"])
def test_a_damaged_shard_is_made_again(whole, tmp_path, caplog, damage):
    to = tmp_path / "a.h5"
    run_here(to, part=(1, 1))
    path = shards_of(to)[1]
    held = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        place = file["hold_outputs"].id.get_chunk_info(0)
    held[place.byte_offset + place.size // 2] ^= 0xFF if damage == "flipped" else 0
    path.write_bytes({"truncated": held[: len(held) // 2], "flipped": held, "empty": b"", "text": b"no"}[damage])
    assert_same(run_here(to), whole)
    assert re.search(r"00001\.h5: .*; it is simulated again", caplog.text)


def test_a_shard_of_another_data_set_is_not_counted(whole, tmp_path, caplog):
    other = tmp_path / "other.h5"
    run_here(other, seed=1, part=(1, 1))
    (tmp_path / "a.h5.parts").mkdir()
    (tmp_path / "a.h5.parts" / "00000.h5").write_bytes(shards_of(other)[0].read_bytes())
    assert_same(run_here(tmp_path / "a.h5"), whole)
    assert "a shard of another data set; it is simulated again" in caplog.text


@pytest.mark.parametrize(
    ("change", "difference"),
    [
        ({"seed": 1}, "there and here seed is 0 and 1"),
        ({"design": Planted(low=60.0)}, "there and here design.low is 50.0 and 60.0"),
        ({"shard_rows": 32}, "there and here rows is 16 and 32"),
    ],
)
def test_a_folder_of_another_data_set_is_refused(tmp_path, change, difference):
    run_here(tmp_path / "a.h5", part=(1, 1))
    with pytest.raises(DatasetError, match=rf"a\.h5\.parts: holds shards of another data set \({difference}\)"):
        run_here(tmp_path / "a.h5", **change)


def test_a_target_that_is_something_else_is_refused_before_any_work(tmp_path, whole):
    to = tmp_path / "a.h5"
    to.write_text("precious")
    with pytest.raises(DatasetError, match=r"a\.h5: not an HDF5 file"):
        run_here(to)
    assert to.read_text() == "precious"
    to.unlink()
    storage.write_dataset(whole, to)
    with pytest.raises(
        DatasetError, match=r"holds another data set \(there and here seed is 0 and 1\); choose another name"
    ):
        run_here(to, seed=1)
    with pytest.raises(DatasetError, match="is a folder"):
        run_here(tmp_path)
    with pytest.raises(DatasetError, match="no shards can be written there"):
        run_here(to / "b.h5")
    assert [name for name in os.listdir(tmp_path) if name[0] != "."] == ["a.h5"]


def test_a_damaged_record_of_the_generation_is_said(tmp_path):
    (tmp_path / "a.h5.parts").mkdir()
    (tmp_path / "a.h5.parts" / "generation.json").write_text('{"seed": ')
    with pytest.raises(DatasetError, match=r"generation\.json, line 1: not JSON.*remove it"):
        run_here(tmp_path / "a.h5")


def test_a_full_disk_loses_nothing_that_was_done(tmp_path):
    """A limit on the size of files stands for the room on the disk: the answer is EFBIG in the place of ENOSPC."""
    to, other = tmp_path / "a.h5", tmp_path / "other.h5"
    expected = run_here(other, samples=300)
    shard, merged = max(path.stat().st_size for path in shards_of(other)), other.stat().st_size
    assert merged > 1.6 * shard

    def complaint(room):
        _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, most))
        try:
            with pytest.raises(DatasetError) as caught:
                run_here(to, samples=300)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        return str(caught.value)

    assert re.search(r"0000\d\.h5: cannot be written: File too large; free some space", complaint(shard // 2))
    assert shards_of(to) == []
    assert re.search(r"a\.h5: cannot be written: File too large; free some space", complaint(3 * shard // 2))
    made = {path: path.stat().st_mtime_ns for path in shards_of(to)}
    assert len(made) * ROWS >= len(expected)
    assert left_behind(tmp_path / "a.h5.parts") == ["generating.lock"]
    assert_same(run_here(to, samples=300), expected)
    assert made == {path: path.stat().st_mtime_ns for path in shards_of(to)}


# ---- what cannot be asked for --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"samples": 0}, "samples is 0; allowed are whole numbers from 1 to"),
        ({"samples": 2.5}, "samples is 2.5; allowed are whole numbers from 1 to"),
        ({"seed": 1.5}, "seed is 1.5; allowed are whole numbers from zero on"),
        ({"seed": -1}, "seed is -1; allowed"),
        ({"samples": None}, "say either how many accepted samples"),
        ({"draws": 5}, "say either how many accepted samples"),
        ({"workers": 0}, "workers is 0; allowed are whole numbers from 1 to 1024"),
        ({"part": (3, 2)}, "part 3/2 is none; allowed are 1/N to N/N"),
        ({"cluster": "scheduler"}, "'scheduler' is no address of a dask scheduler; write tcp://host:port"),
        ({"cluster": "tcp://127.0.0.1:9"}, "no dask scheduler answers at tcp://127.0.0.1:9"),
    ],
)
def test_what_cannot_be_asked_for(tmp_path, how, message, monkeypatch):
    monkeypatch.setattr("creepkit.jobs.worker_pools.CONNECT_TIMEOUT", 0.5)
    with pytest.raises(DatasetError, match=message):
        run(tmp_path / "a.h5", **how)


def test_a_design_of_which_nothing_is_accepted_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr("creepkit.jobs.shard_progress.MOST_DRAWS_WITHOUT_ACCEPTED", 64)
    with pytest.raises(
        DatasetError, match="none of the first 64 draws was accepted; see 'creepkit generate --dry-run'"
    ):
        run_here(tmp_path / "a.h5", Planted(low=130.0))


def test_a_design_of_which_everything_fails_is_given_up(tmp_path):
    with pytest.raises(DatasetError, match="the first 8 simulations all failed: ZeroDivisionError"):
        run_here(tmp_path / "a.h5", Planted((Raising(),)))


@dataclass(frozen=True)
class Unthought(Planted):
    """A design whose author did not think of every row."""

    def draw(self, first, count, seed):
        raise IndexError("row 3 of\n2")


def test_a_design_that_cannot_be_drawn_is_said(tmp_path):
    with pytest.raises(DatasetError, match="shard 0 cannot be simulated: IndexError: row 3 of 2"):
        run_here(tmp_path / "a.h5", Unthought())


def test_a_file_without_a_name(tmp_path):
    with pytest.raises(DatasetError, match="'' is no name of a file; name the HDF5 file to write"):
        run_here("")


def test_workers_that_cannot_start_are_said(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONHOME", str(tmp_path))
    with pytest.raises(DatasetError, match="a worker process ended as it started"):
        run(tmp_path / "a.h5")
