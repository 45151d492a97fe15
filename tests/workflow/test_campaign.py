"""Campaigns that are killed, run out of room, meet one another or damaged files: nothing is lost or counts twice."""

import os
import re
import resource
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit"))

from planted_campaign import BAR, Deadly, Planted, Raising, Strong, Visible, strain, stress_of

from creepkit.dataset import campaign, store
from creepkit.dataset.campaign import generate
from creepkit.dataset.columns import COLUMNS
from creepkit.dataset.shards import Campaign
from creepkit.dataset.worker import attempt
from creepkit.errors import DatasetError

ROWS = 16


def run(to, design=None, **how):
    """A campaign with worker processes."""
    how = {"samples": 40, "seed": 0, "workers": 2, "rows": ROWS, **how}
    return generate(design or Planted(), BAR, to=to, **how)


@dataclass
class Here:
    """A worker that is this very process: where no process matters, none is started."""

    campaign: Campaign
    asked: list = field(default_factory=list)

    @property
    def free(self):
        return 1 - len(self.asked)

    def submit(self, number):
        self.asked.append(number)

    def answers(self, timeout):
        found = [attempt(self.campaign, number) for number in self.asked]
        self.asked.clear()
        return found


def run_here(to, design=None, **how):
    """The same campaign without processes."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(campaign, "_crew", lambda one, workers, cluster: nullcontext(Here(one)))
        return run(to, design, **how)


def assert_same(one, other):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert dict(one.failures) == dict(other.failures)


def shards_of(to):
    return sorted(to.with_name(f"{to.name}.parts").glob("[0-9]*.h5"))


def left_behind(folder):
    """Temporary files and claims."""
    return [p.name for p in folder.rglob("*") if p.name.endswith(".part") or p.name.endswith(".claim")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The data set as it is when nothing goes wrong."""
    return run_here(tmp_path_factory.mktemp("whole") / "a.h5")


# ---- a campaign as it should be ------------------------------------------------------------------------------------


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


def test_a_finished_campaign_is_not_made_again_and_a_larger_one_goes_on(tmp_path):
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


def test_nothing_is_left_behind(tmp_path):
    run_here(tmp_path / "a.h5")
    assert left_behind(tmp_path) == ["merging.claim"]


# ---- deaths --------------------------------------------------------------------------------------------------------


def strong_enough(rows):
    return next(row for row in rows if stress_of(row) <= 120.0)


def test_a_worker_that_is_killed_is_replaced(whole, tmp_path, caplog):
    once = tmp_path / "killed"
    deadly = Deadly(stress_of(strong_enough(range(20, 32))), str(once))
    data = run(tmp_path / "a.h5", Planted((*Planted().criteria, deadly)), workers=1)
    assert once.exists()
    assert_same(data, whole)
    assert "a worker process died (signal SIGKILL); its shard 1 is simulated again" in caplog.text


def test_a_sample_that_kills_its_worker_each_time_fails(whole, tmp_path):
    row = strong_enough(range(20, 32))
    deadly = Deadly(stress_of(row))
    data = run(tmp_path / "a.h5", Planted((Strong(), deadly, Visible())), samples=None, draws=48, workers=1)
    assert data.failures == {row: "its process died 2 times while it was simulated"}
    others = np.delete(np.arange(48), row)
    np.testing.assert_array_equal(data.values[others][:, :, 0] > 0, whole.values[others][:, :, 0] > 0)
    assert data.reasons[row] == -1


SCRIPT = """
import sys
from planted_campaign import *
from creepkit.dataset.campaign import generate
data = generate(Planted((Strong(), Visible(log={log!r}, seconds={seconds}))), BAR, samples={samples}, seed=0,
                to={to!r}, workers={workers}, rows=16)
"""


def started(to, log="", seconds=0.0, samples=40, workers=2, **how):
    """A campaign in a process of its own; a script without a main guard."""
    program = SCRIPT.format(to=str(to), log=str(log), seconds=seconds, samples=samples, workers=workers)
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1] / "unit")}
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
def test_a_campaign_that_is_killed_goes_on_where_it_was(whole, tmp_path, workers_too):
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
    assert left_behind(tmp_path) == ["merging.claim"]


def test_ctrl_c_ends_the_workers_and_counts_no_death(tmp_path):
    to = tmp_path / "a.h5"
    first = started(to, seconds=0.1, workers=1)
    wait_for(lambda: len(children(first.pid)) == 1 and list(to.with_name("a.h5.parts").glob("*.claim")))
    workers = children(first.pid)
    time.sleep(0.5)
    first.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in first.communicate()[1]
    assert not any(Path(f"/proc/{pid}").exists() for pid in workers)
    assert [path.read_bytes() for path in to.with_name("a.h5.parts").glob("*.claim")] == [b""]


def test_a_claim_of_the_dead_does_not_block(whole, tmp_path):
    to = tmp_path / "a.h5"
    parts = tmp_path / "a.h5.parts"
    parts.mkdir()
    (parts / "00000.claim").write_text("3\n")
    (parts / "00001.claim").write_bytes(b"\xff\x00garbage")
    assert_same(run_here(to), whole)


def test_two_campaigns_in_one_folder_share_the_work(whole, tmp_path):
    to, log = tmp_path / "a.h5", tmp_path / "log"
    both = [started(to, log, seconds=0.02, workers=1) for _ in range(2)]
    assert [process.communicate()[1] for process in both] == ["", ""]
    data = store.read(to)
    assert_same(data, whole)
    made = [store.read(path) for path in shards_of(to)]
    assert log.stat().st_size == sum((part.status >= 0).sum() for part in made)
    assert len(made) <= len(data) // ROWS + 2


# ---- files that are in the way -------------------------------------------------------------------------------------


@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "text"])
def test_a_damaged_shard_is_made_again(whole, tmp_path, caplog, damage):
    to = tmp_path / "a.h5"
    run_here(to, part=(1, 1))
    path = shards_of(to)[1]
    held = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        place = file["marks"].id.get_chunk_info(0)
    held[place.byte_offset + place.size // 2] ^= 0xFF if damage == "flipped" else 0
    path.write_bytes({"truncated": held[: len(held) // 2], "flipped": held, "empty": b"", "text": b"no"}[damage])
    assert_same(run_here(to), whole)
    assert re.search(r"00001\.h5: .*; it is simulated again", caplog.text)


def test_a_shard_of_another_campaign_is_not_counted(whole, tmp_path, caplog):
    other = tmp_path / "other.h5"
    run_here(other, seed=1, part=(1, 1))
    (tmp_path / "a.h5.parts").mkdir()
    (tmp_path / "a.h5.parts" / "00000.h5").write_bytes(shards_of(other)[0].read_bytes())
    assert_same(run_here(tmp_path / "a.h5"), whole)
    assert "a shard of another campaign; it is simulated again" in caplog.text


@pytest.mark.parametrize(
    ("change", "difference"),
    [
        ({"seed": 1}, "there and here seed is 0 and 1"),
        ({"design": Planted(low=60.0)}, "there and here design.low is 50.0 and 60.0"),
        ({"rows": 32}, "there and here rows is 16 and 32"),
    ],
)
def test_a_folder_of_another_campaign_is_refused(tmp_path, change, difference):
    run_here(tmp_path / "a.h5", part=(1, 1))
    with pytest.raises(DatasetError, match=rf"a\.h5\.parts: holds shards of another campaign \({difference}\)"):
        run_here(tmp_path / "a.h5", **change)


def test_a_target_that_is_something_else_is_refused_before_any_work(tmp_path, whole):
    to = tmp_path / "a.h5"
    to.write_text("precious")
    with pytest.raises(DatasetError, match=r"a\.h5: not an HDF5 file"):
        run_here(to)
    assert to.read_text() == "precious"
    store.write(whole, to)
    with pytest.raises(
        DatasetError, match=r"holds another data set \(there and here seed is 0 and 1\); choose another name"
    ):
        run_here(to, seed=1)
    with pytest.raises(DatasetError, match="is a folder"):
        run_here(tmp_path)
    with pytest.raises(DatasetError, match="no shards can be written there"):
        run_here(to / "b.h5")
    assert os.listdir(tmp_path) == ["a.h5"]


def test_a_damaged_account_of_the_campaign_is_said(tmp_path):
    (tmp_path / "a.h5.parts").mkdir()
    (tmp_path / "a.h5.parts" / "campaign.json").write_text('{"seed": ')
    with pytest.raises(DatasetError, match=r"campaign\.json: damaged; remove it"):
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

    assert re.search(r"0000\d\.h5: cannot be written: File too large; make room and start again", complaint(shard // 2))
    assert shards_of(to) == []
    assert re.search(r"a\.h5: cannot be written: File too large; make room and start again", complaint(3 * shard // 2))
    made = {path: path.stat().st_mtime_ns for path in shards_of(to)}
    assert len(made) * ROWS >= len(expected)
    assert left_behind(tmp_path / "a.h5.parts") == ["merging.claim"]
    assert_same(run_here(to, samples=300), expected)
    assert made == {path: path.stat().st_mtime_ns for path in shards_of(to)}


# ---- what cannot be asked for --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"samples": 0}, "samples is 0; ask for a whole number, at least one"),
        ({"samples": 2.5}, "samples is 2.5; ask for a whole number"),
        ({"seed": 1.5}, "seed is 1.5; allowed are whole numbers from zero on"),
        ({"seed": -1}, "seed is -1; allowed"),
        ({"samples": None}, "say either how many accepted samples"),
        ({"draws": 5}, "say either how many accepted samples"),
        ({"workers": 0}, "workers is 0; allowed are whole numbers above zero"),
        ({"part": (3, 2)}, "part 3/2 is none; allowed are 1/N to N/N"),
        ({"cluster": "scheduler"}, "'scheduler' is no address of a dask scheduler; write tcp://host:port"),
        ({"cluster": "tcp://127.0.0.1:9"}, "no dask scheduler answers at tcp://127.0.0.1:9"),
    ],
)
def test_what_cannot_be_asked_for(tmp_path, how, message, monkeypatch):
    monkeypatch.setattr("creepkit.dataset.cluster.WAIT", 0.5)
    with pytest.raises(DatasetError, match=message):
        run(tmp_path / "a.h5", **how)


def test_a_design_of_which_nothing_is_accepted_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr("creepkit.dataset.ledger.HOPELESS", 64)
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


# ---- a cluster -----------------------------------------------------------------------------------------------------


def test_a_dask_cluster_makes_the_same_data_set(whole, tmp_path):
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, protocol="tcp") as cluster:
        data = run(tmp_path / "a.h5", cluster=cluster.scheduler_address, workers=None)
    assert_same(data, whole)
    assert len(shards_of(tmp_path / "a.h5")) >= len(whole) // ROWS
