"""How fast a campaign goes, and when it will be done."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from creepkit.dataset.ledger import ProgressRecord

ProgressCallback: TypeAlias = Callable[[str, int, int, str], None]
"""Called with a task, how much of it is done, of how much, and a note on rate, time left and share accepted."""


class ProgressReporter:
    """Tells the progress of a campaign; rates count what was done since it was made."""

    def __init__(self, record: ProgressRecord, progress: ProgressCallback | None) -> None:
        self._record = record
        self._progress = progress
        self._start = time.monotonic()
        self._initial_count = record.count
        self._last_reported = -1

    def report(self) -> None:
        """Tell how far it is, when that has changed."""
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


def duration_text(seconds: float) -> str:
    """A time in words, such as 12 min."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
