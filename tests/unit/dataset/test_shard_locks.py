"""Locks of shards: whose they are, who may read them, and which deaths are a sample's own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from creepkit.dataset import shards
from creepkit.errors import DatasetError, StudyError
from creepkit.jobs import shard_progress
from creepkit.jobs.shard_progress import ShardLock, count_death
from helpers.other_users import HAS_OWNERS, give_to_another_user


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shard_progress, "GRACE", 0.0)


KILLED = """
import os, signal, sys
from pathlib import Path
from creepkit.jobs.shard_progress import ShardLock
with ShardLock(Path(sys.argv[1])) as lock:
    lock.record_start(3)
    lock.record_start(int(sys.argv[2]))
    os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
"""


def kill_at(path: Path, sample: int) -> None:
    assert subprocess.run([sys.executable, "-c", KILLED, str(path), str(sample)], check=False).returncode != 0


def known(path: Path) -> tuple[dict[int, int], dict[int, int]]:
    with ShardLock(path) as lock:
        return +lock.deaths, +lock.interruptions


def test_a_death_is_the_samples_own_where_its_parent_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "1.lock"
    for times in (1, 2):
        kill_at(path, 7)
        count_death(path)
        assert known(path) == ({7: times}, {})
    kill_at(path, 8)  # and nobody has seen it
    assert known(path) == ({7: 2}, {8: 1})
    count_death(path)  # of a worker that simulated nothing
    assert known(path) == ({7: 2}, {8: 1})


@pytest.mark.parametrize("planted", [b"0\n0\n1\n1\n", b"\xff\x00garbage", b"died\n0 died\n" + b"9" * 40])
def test_numbers_in_a_lock_are_no_deaths(tmp_path: Path, planted: bytes) -> None:
    (tmp_path / "1.lock").write_bytes(planted)
    deaths, interruptions = known(tmp_path / "1.lock")
    assert deaths == {}
    assert sum(interruptions.values()) <= 1


def test_a_sample_that_was_interrupted_often_is_simulated_and_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "1.lock"
    for times in range(shards.SUSPICIOUS_INTERRUPTIONS):
        kill_at(path, 7)
        with ShardLock(path) as lock:
            lock_check = shards._death_check(lock, path)
            assert caplog.text == "", times
            if times + 1 < shards.SUSPICIOUS_INTERRUPTIONS:
                lock_check(7)
    with ShardLock(path) as lock:
        shards._death_check(lock, path)(7)
    assert "sample 7 was being simulated each of the 3 times that this work was killed" in caplog.text
    assert "use fewer workers or a machine with more" in caplog.text


@HAS_OWNERS
def test_a_lock_is_for_its_owner_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "1.lock"
    path.touch()
    path.chmod(0o666)
    for _ in range(2):
        with ShardLock(path):
            assert path.stat().st_mode & 0o777 == 0o600
        path.unlink()
    path.touch()
    give_to_another_user(path, monkeypatch)
    for error in (DatasetError, StudyError):
        with pytest.raises(error, match=r"1.lock: belongs to another user \(mallory\)"), ShardLock(path, error):
            pass


def test_waiting_for_others_is_said_once(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 9.0, 11.0, 12.0])
    monkeypatch.setattr(shards.time, "monotonic", lambda: next(clock))
    waiting, locks = shards.Waiting(), [Path("a.parts/00003.lock")]
    waiting.note(locks)
    waiting.note(locks)
    assert caplog.text == ""
    waiting.note(locks)
    waiting.note(locks)
    assert caplog.text.count("another process holds a.parts/00003.lock; waiting for it to finish or end") == 1


def test_work_of_this_process_is_no_waiting(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 20.0, 29.0])
    monkeypatch.setattr(shards.time, "monotonic", lambda: next(clock))
    waiting = shards.Waiting()
    for locks in ([Path("1.lock")], [], [Path("1.lock")], [Path("1.lock")]):
        waiting.note(locks)
    assert caplog.text == ""
