"""At which times a simulated test is looked at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.errors import DatasetError

PAPER_INTERVAL, PAPER_END = 150.0, 43200.0
"""s; Materials and Methods of the paper: 289 frames from 0 to 12 h."""

MOST_FRAMES = 100_000
"""Frames of a sample: a typing error should not ask for all the memory."""

RELATIVE_TIMES = (0.0, 60 / 43200, 240 / 43200, *(k / 48 for k in range(1, 49)))
"""Of the end of a test: 51 frames, two of them in the fast start; 900 s apart in 12 h."""


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """The times of all samples of a design.

    values : (frames,) s, or shares of each sample's end when `relative`; strictly increasing.
    """

    values: Floats
    relative: bool = False

    def __post_init__(self) -> None:
        values = frozen(self.values)
        if values.ndim != 1 or values.size < 2 or not np.isfinite(values).all():
            raise DatasetError(f"a time grid needs two or more finite times, found {values.tolist()[:3]}")
        if values[0] < 0 or (np.diff(values) <= 0).any():
            raise DatasetError("the times of a grid must start at or after 0 and increase")
        if self.relative and values[-1] > 1:
            raise DatasetError(f"a relative grid holds shares of the end, from 0 to 1; the last is {values[-1]:g}")
        object.__setattr__(self, "values", values)

    @classmethod
    def every(cls, interval: float = PAPER_INTERVAL, end: float = PAPER_END) -> TimeGrid:
        """Frames `interval` s apart from 0 to `end` s."""
        if not (0 < interval <= end < np.inf):
            raise DatasetError(f"frames every {interval:g} s until {end:g} s: the interval must lie from 0 to the end")
        if end / interval > MOST_FRAMES:
            raise DatasetError(
                f"frames every {interval:g} s until {end:g} s are {end / interval:.0f}; at most {MOST_FRAMES} are simulated"
            )
        frames = int(np.floor(end / interval * (1 + 1e-12)))
        return cls(interval * np.arange(frames + 1, dtype=float))

    @property
    def frames(self) -> int:
        """How many times there are."""
        return int(self.values.size)

    @property
    def end(self) -> float:
        """The last time, s; a relative grid has none of its own (DatasetError)."""
        if self.relative:
            raise DatasetError("a relative grid has no end of its own; give the condition end_time")
        return float(self.values[-1])

    def times(self, end_time: float) -> Floats:
        """The times, s, of a test that ends at `end_time`, (frames,); those of an absolute grid may lie beyond it."""
        return self.values * end_time if self.relative else self.values

    def document(self) -> dict[str, Any]:
        """As JSON-able data."""
        return {"values": self.values.tolist(), "relative": self.relative}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TimeGrid):
            return NotImplemented
        return self.relative == other.relative and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash((self.values.tobytes(), self.relative))
