"""Which shards are done, which are next, and whether there are enough."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from creepkit.dataset.shards import Campaign, accepted_count
from creepkit.errors import DatasetError

MOST_DRAWS_WITHOUT_ACCEPTED = 16384
"""Draws after which a design of which none was accepted is given up."""


@dataclass
class ProgressRecord:
    """The account of a campaign.

    samples : accepted ones wanted; or draws : rows wanted, accepted or not. part : (k, n), only shards k-1, k-1+n ...,
    and so many samples as make an n-th of all.
    done : {shard: accepted samples} of this part. at_work : shards that are being simulated, here or elsewhere.
    """

    campaign: Campaign
    samples: int | None
    draws: int | None
    part: tuple[int, int] | None = None
    done: dict[int, int] = field(default_factory=dict)
    running: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        for name, value in (("samples", self.samples), ("draws", self.draws)):
            if value is not None and (not isinstance(value, int | np.integer) or value < 1):
                raise DatasetError(f"{name} is {value!r}; ask for a whole number, at least one")
        if (self.samples is None) == (self.draws is None):
            raise DatasetError("say either how many accepted samples are wanted (samples), or how many draws (draws)")
        if self.part is not None and not 1 <= self.part[0] <= self.part[1]:
            raise DatasetError(f"part {self.part[0]}/{self.part[1]} is none; allowed are 1/N to N/N")

    def scan_finished(self) -> None:
        """Find the shards that are done already."""
        for path in sorted(self.campaign.folder.glob("[0-9]*.h5")):
            if path.stem.isdigit() and self._in_part(int(path.stem)):
                self.mark_done(int(path.stem), accepted_count(self.campaign, int(path.stem)))

    def mark_done(self, number: int, accepted: int | None) -> None:
        """A shard is done."""
        self.running.discard(number)
        if accepted is not None:
            self.done[number] = accepted
        self._check_acceptance()

    @property
    def target(self) -> int:
        """What `reached` has to come to: accepted samples, or rows."""
        if self.samples is None:
            return self.campaign.rows * len(list(self._shard_numbers()))
        return self.samples if self.part is None else -(-self.samples // self.part[1])

    @property
    def count(self) -> int:
        """Accepted samples, or rows, of all shards that are done."""
        return sum(self._contribution(number) for number in self.done)

    @property
    def acceptance_rate(self) -> float:
        """Accepted samples per draw, so far; 1 before the first are known."""
        return self.accepted / (len(self.done) * self.campaign.rows) if self.done else 1.0

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
        """The next shard to simulate; None when what is done and at work should do."""
        expected = 0.0
        for number in self._shard_numbers():
            if self.samples is not None and expected >= self.target:
                break
            if number in self.done:
                expected += self._contribution(number)
            elif number in self.running:
                expected += self.acceptance_rate * self.campaign.rows
            else:
                return number
        return None

    def _shard_numbers(self) -> Iterable[int]:
        """The shards that may be needed, first ones first."""
        first, step = (0, 1) if self.part is None else (self.part[0] - 1, self.part[1])
        if self.draws is None:
            return itertools.count(first, step)
        return range(first, -(-self.draws // self.campaign.rows), step)

    def _contribution(self, number: int) -> int:
        return self.done[number] if self.draws is None else self.campaign.rows

    def _in_part(self, number: int) -> bool:
        return self.part is None or number % self.part[1] == self.part[0] - 1

    def _check_acceptance(self) -> None:
        drawn = len(self.done) * self.campaign.rows
        if self.samples is not None and drawn >= MOST_DRAWS_WITHOUT_ACCEPTED and not self.accepted:
            raise DatasetError(
                f"none of the first {drawn} draws was accepted; see 'creepkit generate --dry-run', change the "
                "design, or ask for draws instead of samples"
            )
