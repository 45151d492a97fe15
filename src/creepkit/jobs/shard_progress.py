"""Progress of sharded work: a lock for each shard, the record of finished shards, and the rate with the time left.

The operating system releases a lock when its process dies. The lock file names the sample being simulated, so that a
sample that kills its process is known. It counts as such only where the process that gave the shard out has seen the
death and goes on: where all of them are ended, by a batch system for example, the sample is not to blame. On a file
system without locks a shard may be simulated twice, with the same result, and counts once.
"""

from __future__ import annotations

import errno
import itertools
import os
import re
import stat
import time
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TypeAlias

from creepkit import limits
from creepkit.errors import CreepkitError, DatasetError
from creepkit.files.locking import lock_file
from creepkit.files.owners import check_owner, check_owner_by_name
from creepkit.jobs.worker_process import ShardedJob

OPEN_FLAGS = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_NOINHERIT", "O_BINARY"))
"""Neither through a link to another file, nor waiting for a pipe; a flag counts where the system has it."""


MOST_DIGITS = 19
"""Digits of the number of a sample; longer ones are damage."""


DIED, INTERRUPTED = b"died", b"interrupted"
"""What a lock file says of a sample: its process died and ours saw it, or all processes of the work were ended."""


GRACE = 1.0
"""s for which a process that sees another one die must outlive it: a batch system ends both, one after the other."""


class ShardLock:
    """The lock of a shard; a context, `held` in it when no other process has it.

    The file is its owner's alone: whoever may read a file may lock it. `error` is raised for that of another user.

    deaths : {sample: how often its process died in it, while the one that gave it the shard went on}.
    interruptions : {sample: how often it was being simulated when all processes of the work were ended}.
    """

    def __init__(self, path: Path, error: type[CreepkitError] = DatasetError) -> None:
        self._path = path
        self._error = error
        self._file = -1
        self._last_started: int | None = None
        self._removed_at_exit = False
        self.held = False
        self.deaths: Counter[int] = Counter()
        self.interruptions: Counter[int] = Counter()

    def __enter__(self) -> ShardLock:
        check_owner_by_name(self._path, self._error)
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | OPEN_FLAGS, 0o600)
        try:
            status = os.fstat(self._file)
            if not stat.S_ISREG(status.st_mode):
                raise OSError(errno.EINVAL, f"{self._path.name} is no regular file", str(self._path))
            check_owner(self._path, status, self._error)
            if hasattr(os, "fchmod"):
                with suppress(OSError):  # of root's, or on a file system without modes
                    os.fchmod(self._file, 0o600)
            self.held = lock_file(self._file)
            if self.held:
                self._read()
        except BaseException:
            os.close(self._file)
            raise
        return self

    def record_start(self, sample: int) -> None:
        """Note that a sample is being simulated now."""
        self._write(b"%d\n" % sample)

    def count_death(self) -> None:
        """Count that the process that simulated last has died, and not been ended with all others of the work."""
        if self._last_started is not None:
            self.interruptions[self._last_started] -= 1
            self.deaths[self._last_started] += 1
            self._last_started = None

    def remove(self) -> None:
        """Take the file away: the shard is done; on Windows, where an open file stays, after it is closed."""
        try:
            self._path.unlink(missing_ok=True)
        except PermissionError:
            self._removed_at_exit = True

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.held:  # what ends here, be it by an error, has not died
            self._write(b"")
        os.close(self._file)
        if self._removed_at_exit:
            with suppress(OSError):  # another process may have opened it since
                self._path.unlink()

    def _read(self) -> None:
        """Read what is known of samples: lines "died 7", "interrupted 7", and last "7", the one that was begun last."""
        for line in os.read(self._file, 1 << 20).splitlines():
            *words, number = line.split() or [b""]
            if not number.isdigit() or len(number) >= MOST_DIGITS:
                continue
            self._last_started = int(number) if not words else None
            if words == [DIED]:
                self.deaths[int(number)] += 1
            elif words == [INTERRUPTED]:
                self.interruptions[int(number)] += 1
        if self._last_started is not None:
            self.interruptions[self._last_started] += 1

    def _write(self, begun: bytes) -> None:
        """Write what is known of samples, and the line of the one that begins now."""
        known = (
            b"%s %d\n" % (word, sample)
            for word, counts in ((DIED, self.deaths), (INTERRUPTED, self.interruptions))
            for sample in counts.elements()
        )
        content = b"".join(known) + begun
        os.lseek(self._file, 0, os.SEEK_SET)
        os.ftruncate(self._file, 0)
        os.write(self._file, content)


def count_death(path: Path) -> None:
    """Count the death of a process that held the lock of a shard, seen by this one, which goes on.

    The lock is held meanwhile for GRACE, so that nothing is counted where this process is ended as well, and no other
    takes the shard up.
    """
    with ShardLock(path) as lock:
        if lock.held:
            time.sleep(GRACE)
            lock.count_death()


MOST_DRAWS_WITHOUT_ACCEPTED = 16384
"""Draws after which a design is given up of which none was accepted."""


@dataclass
class ProgressRecord:
    """The shards of a job that are done, and how many are wanted.

    samples : accepted ones wanted; or draws : rows wanted, accepted or not. part : (k, n), only shards k-1, k-1+n ...,
        and as many samples as make an n-th of all.
    done : {shard: accepted samples} of this part. running : shards that are being simulated, here or elsewhere.
    """

    job: ShardedJob
    samples: int | None
    draws: int | None
    part: tuple[int, int] | None = None
    done: dict[int, int] = field(default_factory=dict)
    running: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        for name, value in (("samples", self.samples), ("draws", self.draws)):
            if value is not None:
                limits.check_number(name, value, limits.SAMPLES, DatasetError)
        if (self.samples is None) == (self.draws is None):
            raise DatasetError("say either how many accepted samples are wanted (samples), or how many draws (draws)")
        if self.part is not None and not 1 <= self.part[0] <= self.part[1]:
            raise DatasetError(f"part {self.part[0]}/{self.part[1]} is none; allowed are 1/N to N/N")

    def scan_finished(self) -> None:
        """Find the shards that are done already."""
        for path in sorted(self.job.folder.glob("[0-9]*.h5")):
            if path.stem.isdigit() and self._in_part(int(path.stem)):
                self.mark_done(int(path.stem), self.job.accepted_count(int(path.stem)))

    def mark_done(self, number: int, accepted: int | None) -> None:
        """A shard is done."""
        self.running.discard(number)
        if accepted is not None:
            self.done[number] = accepted
        self._check_acceptance()

    @property
    def target(self) -> int:
        """Value of `count` at which the job is done: accepted samples, or rows."""
        if self.samples is None:
            return self.job.rows * len(list(self._shard_numbers()))
        return self.samples if self.part is None else -(-self.samples // self.part[1])

    @property
    def count(self) -> int:
        """Accepted samples, or rows, of all shards that are done."""
        return sum(self._contribution(number) for number in self.done)

    @property
    def acceptance_rate(self) -> float:
        """Accepted samples per draw, so far; 1 before the first are known."""
        return self.accepted / (len(self.done) * self.job.rows) if self.done else 1.0

    @property
    def accepted(self) -> int:
        """Accepted samples so far."""
        return sum(self.done.values())

    def leading_run(self) -> list[int] | None:
        """The shortest leading run of done shards that is enough; None while there is none."""
        total, run = 0, []
        for number in self._shard_numbers():
            if self.samples is not None and total >= self.target:
                break
            if number not in self.done:
                return None
            run.append(number)
            total += self._contribution(number)
        return run

    def next_shard(self) -> int | None:
        """The next shard to simulate; None when those done and running are expected to be enough."""
        expected = 0.0
        for number in self._shard_numbers():
            if self.samples is not None and expected >= self.target:
                break
            if number in self.done:
                expected += self._contribution(number)
            elif number in self.running:
                expected += self.acceptance_rate * self.job.rows
            else:
                return number
        return None

    def _shard_numbers(self) -> Iterable[int]:
        """The shards that may be needed, first ones first."""
        first, step = (0, 1) if self.part is None else (self.part[0] - 1, self.part[1])
        if self.draws is None:
            return itertools.count(first, step)
        return range(first, -(-self.draws // self.job.rows), step)

    def _contribution(self, number: int) -> int:
        return self.done[number] if self.draws is None else self.job.rows

    def _in_part(self, number: int) -> bool:
        return self.part is None or number % self.part[1] == self.part[0] - 1

    def _check_acceptance(self) -> None:
        drawn = len(self.done) * self.job.rows
        if self.samples is not None and drawn >= MOST_DRAWS_WITHOUT_ACCEPTED and not self.accepted:
            raise DatasetError(
                f"none of the first {drawn} draws was accepted; see 'creepkit surrogate generate --dry-run', change "
                "the design, or ask for draws instead of samples"
            )


ProgressCallback: TypeAlias = Callable[[str, int, int, str], None]
"""Called with a task, how much of it is done, of how much, and a note on rate, time left and acceptance."""


class ProgressReporter:
    """Reports the progress of a job; rates count the work since the reporter was made."""

    def __init__(self, record: ProgressRecord, progress: ProgressCallback | None) -> None:
        self._record = record
        self._progress = progress
        self._start = time.monotonic()
        self._initial_count = record.count
        self._last_reported = -1

    def report(self) -> None:
        """Report the progress when it has changed."""
        done = self._record.count
        if self._progress is None or done == self._last_reported:
            return
        self._last_reported = done
        task = "accepted samples" if self._record.draws is None else "draws"
        self._progress(task, min(done, self._record.target), self._record.target, self._note(done))

    def _note(self, done: int) -> str:
        rate = (done - self._initial_count) / max(time.monotonic() - self._start, 1e-3)
        accepted = f"{100 * self._record.acceptance_rate:.0f} % accepted" if self._record.done else ""
        if rate <= 0:
            return accepted
        remaining = max(self._record.target - done, 0) / rate
        return f"{rate:.3g}/s, {duration_text(remaining)} left, {accepted}"


def series_of_task(task: str) -> tuple[str, str]:
    """Of "law 3 of 8: Garofalo" the series "law", whose members share a bar and a time left, and the rest; else "".

    A task that is none of a series is its own.
    """
    found = re.match(r"([a-z ]+) (\d+ of \d+: .+)", task)
    return (found[1], found[2]) if found else (task, "")


def duration_text(seconds: float) -> str:
    """A time in words, such as 12 min."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
