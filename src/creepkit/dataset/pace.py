"""How fast a campaign goes, and when it will be done."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from creepkit.dataset.ledger import Ledger

Progress: TypeAlias = Callable[[str, int, int, str], None]
"""Called with a task, how much of it is done, of how much, and a note on rate, time left and share accepted."""


class Pace:
    """Tells the progress of a campaign; rates count what was done since it was made."""

    def __init__(self, ledger: Ledger, progress: Progress | None) -> None:
        self._ledger = ledger
        self._progress = progress
        self._start = time.monotonic()
        self._before = ledger.reached
        self._told = -1

    def tell(self) -> None:
        """Tell how far it is, when that has changed."""
        done = self._ledger.reached
        if self._progress is None or done == self._told:
            return
        self._told = done
        what = "accepted samples" if self._ledger.draws is None else "draws"
        self._progress(what, min(done, self._ledger.target), self._ledger.target, self._note(done))

    def _note(self, done: int) -> str:
        rate = (done - self._before) / max(time.monotonic() - self._start, 1e-3)
        accepted = f"{100 * self._ledger.share:.0f} % accepted" if self._ledger.done else ""
        if rate <= 0:
            return accepted
        left = max(self._ledger.target - done, 0) / rate
        return f"{rate:.3g}/s, {duration(left)} left, {accepted}"


def duration(seconds: float) -> str:
    """A time in words, such as 12 min."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
