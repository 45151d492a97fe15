"""Progress of a generation: the record of finished shards, and the rate with the time left."""

from __future__ import annotations

import itertools
import time
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

from creepkit import limits
from creepkit.dataset.shards import GenerationJob
from creepkit.errors import DatasetError
from creepkit.jobs.progress import ProgressCallback, duration_text

MOST_DRAWS_WITHOUT_ACCEPTED = 16384
"""Draws after which a design is given up of which none was accepted."""


@dataclass
class ProgressRecord:
    """The shards of a job that are done, and how many are wanted.

    samples : accepted ones wanted; or draws : rows wanted, accepted or not. part : (k, n), only shards k-1, k-1+n ...,
        and as many samples as make an n-th of all.
    done : {shard: accepted samples} of this part.
    """

    job: GenerationJob
    samples: int | None
    draws: int | None
    part: tuple[int, int] | None = None
    done: dict[int, int] = field(default_factory=dict)

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
            if path.stem.isdigit() and (self.part is None or int(path.stem) % self.part[1] == self.part[0] - 1):
                self.mark_done(int(path.stem), self.job.accepted_count(int(path.stem)))

    def mark_done(self, number: int, accepted: int | None) -> None:
        """A shard is done."""
        if accepted is not None:
            self.done[number] = accepted
        drawn = len(self.done) * self.job.rows
        if self.samples is not None and drawn >= MOST_DRAWS_WITHOUT_ACCEPTED and not self.accepted:
            raise DatasetError(
                f"none of the first {drawn} draws was accepted; see 'creepkit surrogate generate --dry-run', change "
                "the design, or ask for draws instead of samples"
            )

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

    def next_shard(self, running: Collection[int]) -> int | None:
        """The next shard to simulate; None when those done and running are expected to be enough."""
        expected = 0.0
        for number in self._shard_numbers():
            if self.samples is not None and expected >= self.target:
                break
            if number in self.done:
                expected += self._contribution(number)
            elif number in running:
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
