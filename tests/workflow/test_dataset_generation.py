"""Generations that are killed, meet one another or a cluster: nothing is lost or counts twice."""

import os
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from creepkit.dataset import generation
from creepkit.errors import DatasetError
from helpers.dataset_runs import ROWS, assert_same, left_behind, run, run_here, shards_of, whole_of
from helpers.planted_sampling import Deadly, Planted, Strong, Visible, strain, stress_of


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The data set as it is when nothing goes wrong."""
    return whole_of(tmp_path_factory)


# ---- a generation as it should be ------------------------------------------------------------------------------------


def test_the_leading_shards_that_hold_enough_are_taken_whoever_made_them(whole, tmp_path):
    """With the progress of it, for the sake of the time that workers take to start."""
    told = []
    assert_same(run(tmp_path / "a.h5", progress=lambda *words: told.append(words)), whole)
    np.testing.assert_array_equal(whole.index, np.arange(len(whole)))
    counts = (whole.reasons.reshape(-1, ROWS) == 0).sum(axis=1)
    assert counts.sum() >= 40 > counts[:-1].sum()
    assert {word[0] for word in told} == {"accepted samples", "shards merged"}
    last = [word for word in told if word[0] == "accepted samples"][-1]
    assert last[1:3] == (40, 40)
    assert re.fullmatch(r"[\d.]+/s, \d+ s left, \d+ % accepted", last[3])


def test_samples_are_those_of_the_design_and_its_law(whole):
    draws = Planted().draw(0, len(whole), 0)
    np.testing.assert_array_equal(whole.parameters, draws.parameters)
    np.testing.assert_array_equal(whole.conditions, draws.conditions)
    for row in np.flatnonzero(whole.reasons == 0):
        expected = strain(whole.values_of(row), whole.conditions_of(row), whole.times(row))
        np.testing.assert_allclose(whole.values[row, :, 0], expected, rtol=1e-4, atol=1e-12)


def test_draws_are_counted_whatever_becomes_of_them(whole, tmp_path):
    part = run_here(tmp_path / "a.h5", samples=None, draws=20)
    assert_same(part, whole.rows(slice(0, 20)))


def test_a_finished_data_set_is_not_made_again_and_a_larger_one_goes_on(tmp_path):
    log, to = tmp_path / "log", tmp_path / "a.h5"
    design = Planted((Strong(), Visible(log=str(log))))
    first = run_here(to, design)
    looked = log.stat().st_size
    assert_same(run_here(to, design), first)
    assert log.stat().st_size == looked
    more = run_here(to, design, samples=60)
    assert len(more) > len(first)
    assert log.stat().st_size == (more.status >= 0).sum()
    assert_same(more.rows(slice(0, len(first))), first)


def test_parts_of_a_job_array_become_one_file(whole, tmp_path):
    to = tmp_path / "a.h5"
    one, two = (run_here(to, part=(k, 2)) for k in (1, 2))
    assert set(one.index // ROWS % 2) == {0}
    assert set(two.index // ROWS % 2) == {1}
    assert not to.exists()
    made = {path: path.stat().st_mtime_ns for path in shards_of(to)}
    assert_same(run_here(to), whole)
    assert made.items() <= {path: path.stat().st_mtime_ns for path in shards_of(to)}.items()


# ---- deaths --------------------------------------------------------------------------------------------------------


def strong_enough(rows):
    return next(row for row in rows if stress_of(row) <= 120.0)


def test_a_worker_that_is_killed_is_replaced(whole, tmp_path, caplog):
    once = tmp_path / "killed"
    deadly = Deadly(stress_of(strong_enough(range(20, 32))), str(once))
    data = run(tmp_path / "a.h5", Planted((*Planted().criteria, deadly)), workers=1)
    assert once.exists()
    assert_same(data, whole)
    assert "a worker process died (signal SIGKILL); its shard 1 is done again" in caplog.text


@pytest.mark.nightly
def test_a_sample_that_kills_its_worker_each_time_is_said(tmp_path):
    deadly = Deadly(stress_of(strong_enough(range(20, 32))))
    with pytest.raises(DatasetError, match="shard 1: its worker process died 3 times, the last time by signal SIGKILL"):
        run(tmp_path / "a.h5", Planted((Strong(), deadly, Visible())), samples=None, draws=48, workers=1)
    assert len(shards_of(tmp_path / "a.h5")) == 1


SCRIPT = """
import sys
from helpers.planted_sampling import *
from creepkit.dataset.generation import generate
from creepkit.jobs.worker_pools import ParallelExecution
data = generate(Planted((Strong(), Visible(log={log!r}, seconds={seconds}))), BAR, samples={samples}, seed=0,
                to={to!r}, execution=ParallelExecution({workers}, shard_rows=16))
"""


def started(to, log="", seconds=0.0, samples=40, workers=2, **how):
    """A generation in a process of its own; a script without a main guard."""
    program = SCRIPT.format(to=str(to), log=str(log), seconds=seconds, samples=samples, workers=workers)
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    env = {**os.environ, "PYTHONPATH": path.rstrip(os.pathsep)}
    # a test run in the background of a shell inherits that SIGINT is ignored
    program = f"import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n{program}"
    return subprocess.Popen([sys.executable, "-c", program], env=env, stderr=subprocess.PIPE, text=True, **how)


def children(pid):
    return [int(line) for path in Path(f"/proc/{pid}/task").glob("*/children") for line in path.read_text().split()]


def wait_for(what, seconds=60.0):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.parametrize("workers_too", [True, False])
@pytest.mark.nightly
def test_a_generation_that_is_killed_goes_on_where_it_was(whole, tmp_path, workers_too):
    to, log = tmp_path / "a.h5", tmp_path / "log"
    first = started(to, log, seconds=0.03, workers=1)
    wait_for(lambda: len(shards_of(to)) >= 1)
    workers = children(first.pid)
    assert len(workers) == 1
    for pid in [first.pid, *(workers if workers_too else [])]:
        os.kill(pid, signal.SIGKILL)
    first.wait()
    first.stderr.close()
    wait_for(lambda: not any(Path(f"/proc/{pid}/stat").exists() for pid in workers))
    assert not to.exists()
    made = {path: path.stat().st_mtime_ns for path in shards_of(to)}
    assert_same(run_here(to), whole)
    assert made.items() <= {path: path.stat().st_mtime_ns for path in shards_of(to)}.items()
    assert left_behind(tmp_path) == ["generating.lock"]


def test_two_generations_in_one_folder_do_not_do_the_work_twice(whole, tmp_path):
    to, parts = tmp_path / "a.h5", tmp_path / "a.h5.parts"
    parts.mkdir()
    with generation.generating_alone(parts, None), pytest.raises(DatasetError, match="another process is making these"):
        run_here(to)
    with generation.generating_alone(parts, (1, 2)):
        assert_same(run_here(to), whole)


# ---- a cluster -----------------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_a_dask_cluster_makes_the_same_data_set(whole, tmp_path):
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, protocol="tcp") as cluster:
        data = run(tmp_path / "a.h5", cluster=cluster.scheduler_address, workers=None)
    assert_same(data, whole)
    assert len(shards_of(tmp_path / "a.h5")) >= len(whole) // ROWS


# ---- dataset generation files ----------------------------------------------------------------------------------------

# Generations that meet damaged files, a full disk, or a wish that cannot be met: nothing is lost, and it is said.


# ---- files that are in the way -------------------------------------------------------------------------------------


def test_a_damaged_shard_is_made_again(whole, tmp_path, caplog):
    to = tmp_path / "a.h5"
    run_here(to, part=(1, 1))
    path = shards_of(to)[1]
    held = path.read_bytes()
    with h5py.File(path) as file:
        chunk = file["hold_outputs"].id.get_chunk_info(0)
    place = chunk.byte_offset + chunk.size // 2
    flipped = held[:place] + bytes([held[place] ^ 0xFF]) + held[place + 1 :]
    for damaged in (held[: len(held) // 2], flipped, b"", b"no"):
        path.write_bytes(damaged)
        to.unlink(missing_ok=True)
        caplog.clear()
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
