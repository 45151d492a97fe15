"""Progress of sharded work: the record of finished shards, and the rate with the time left."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

from creepkit import limits
from creepkit.errors import DatasetError
from creepkit.jobs.worker_process import ShardedJob

MOST_DRAWS_WITHOUT_ACCEPTED = 16384
"""Draws after which a design is given up of which none was accepted."""


@dataclass
class ProgressRecord:
    """The shards of a job that are done, and how many are wanted.

    samples : accepted ones wanted; or draws : rows wanted, accepted or not. part : (k, n), only shards k-1, k-1+n ...,
        and as many samples as make an n-th of all.
    done : {shard: accepted samples} of this part. running : shards that are being simulated.
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
