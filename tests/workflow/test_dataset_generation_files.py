"""Generations that meet damaged files, a full disk, or a wish that cannot be met: nothing is lost, and it is said."""

import re
import resource

import h5py
import pytest

from creepkit.errors import DatasetError
from helpers.dataset_runs import ROWS, assert_same, left_behind, run_here, shards_of, whole_of


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


@pytest.mark.nightly
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
