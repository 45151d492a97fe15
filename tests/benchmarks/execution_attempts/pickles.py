"""Pickles that make the canary when they are loaded."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

from execution_attempts.canaries import planted


class _Run:
    """Pickled as a call of exec."""

    def __init__(self, source: str) -> None:
        self.source = source

    def __reduce__(self) -> tuple[Any, ...]:
        return exec, (self.source, {})


def pickle_that_runs(folder: Path) -> bytes:
    """A pickle whose loading makes the canary in a folder."""
    return pickle.dumps(_Run(planted(folder)))
