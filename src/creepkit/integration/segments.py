"""A load program as segments: stress (or prescribed stress) and temperature as straight lines between breakpoints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.records import Program


class Segment(NamedTuple):
    """start and end, s; driving stress, MPa, and temperature, K, at both."""

    start: float
    end: float
    stress: float
    end_stress: float
    temperature: float
    end_temperature: float


@njit(cache=True, error_model="numpy")
def segment_from_row(row: Floats) -> Segment:
    """A segment from its row of six numbers."""
    return Segment(row[0], row[1], row[2], row[3], row[4], row[5])


@njit(cache=True, error_model="numpy")
def stress_rate(segment: Segment) -> float:
    """Slope of the driving stress, MPa/s."""
    return (segment.end_stress - segment.stress) / (segment.end - segment.start)


@njit(cache=True, error_model="numpy")
def temperature_rate(segment: Segment) -> float:
    """Slope of the temperature, K/s."""
    return (segment.end_temperature - segment.temperature) / (segment.end - segment.start)


def merge_programs(*programs: Program, end: float) -> Floats:
    """Merge programs from 0 to `end` (s) into segments, (segments, 2 + 2 programs); every breakpoint is a boundary.

    Columns: start and end, s, then the values of each program at both.
    """
    marks = np.concatenate([*(program.times for program in programs), [0.0, end]])
    marks = np.unique(marks[marks <= end])
    starts, ends = marks[:-1], marks[1:]
    columns = [starts, ends]
    for program in programs:
        columns += [program.at(starts), _just_before(program, ends)]
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _just_before(program: Program, times: Floats) -> Floats:
    """Values of a program as each time is approached from the left."""
    after = np.searchsorted(program.times, times, side="left")
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, program.times.size - 1)
    width = program.times[after] - program.times[before]
    share = np.divide(times - program.times[before], width, out=np.zeros_like(times), where=width > 0)
    values = program.values
    return np.asarray(values[before] + np.minimum(share, 1.0) * (values[after] - values[before]))
