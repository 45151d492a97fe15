"""Progress of long work: what is called with it, and its tasks and times in words."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeAlias

ProgressCallback: TypeAlias = Callable[[str, int, int, str], None]
"""Called with a task, how much of it is done, of how much, and a note on rate, time left and acceptance."""


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
