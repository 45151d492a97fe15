"""What a data set holds of each sample, and how that lies in a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np


class Column(NamedTuple):
    """An array whose first axis is the sample.

    stored, held : types in a file and in memory. axes : the other axes, named for the sizes of a data set.
    chunk : samples that are compressed together.
    """

    file_type: type
    memory_type: type
    axes: tuple[str, ...] = ()
    chunk: int = 4096


COLUMNS = {
    "parameters": Column(np.float64, np.float64, ("parameter_names",), 256),
    "conditions": Column(np.float64, np.float64, ("condition_names",), 256),
    "values": Column(np.float32, np.float32, ("frames", "outputs"), 64),
    "marks": Column(np.float32, np.float32, ("marks", "outputs"), 256),
    "status": Column(np.int8, np.int64),
    "end_times": Column(np.float64, np.float64),
    "reasons": Column(np.int8, np.int64),
    "index": Column(np.int64, np.int64),
}

HOLD_TIMES = 4
"""Ends of the first ramp, of the first hold, of the second ramp, and of the test."""


def empty_columns(sizes: Mapping[str, int]) -> dict[str, Any]:
    """Every column with no samples in it yet; sizes : of its axes, by their names."""
    shapes = {name: tuple(sizes[axis] for axis in column.axes) for name, column in COLUMNS.items()}
    return {name: np.empty((0, *shapes[name]), column.memory_type) for name, column in COLUMNS.items()}
