"""Tests that press a piece: how files tell them, and their stress and strain.

A piece that is pressed gains area, where a bar under tension loses it. A file tells this by a word, or by negative
stresses and strains. With e = 1 - h / h_0 of the height the logarithmic strain is -ln(1 - e), and the true stress the
nominal one times 1 - e, which is what a law of a bar is given. The height is its gauge length, unless one is stated.
"""

from __future__ import annotations

import re

import numpy as np

from creepkit.arrays import Floats
from creepkit.readers.conditions import StatedConditions
from creepkit.records import Loading, Program, RecordedLoading
from creepkit.records.loading import held_of

_COMPRESSION = re.compile(r"\bcompres(?:s(?:ion|ive|ed|ione)|i[oó]n)\b|druckkriech|stauchversuch", re.IGNORECASE)
"""Of a test that presses, in English, French and German; a compressor disc is none."""


_TENSION = re.compile(r"tensi|traction|trazione|tracci|zug", re.IGNORECASE)
"""Beside them of a machine for both."""


def is_compression(conditions: StatedConditions, name: str) -> bool:
    """Whether a test says of itself, in its name, titles, labels or signs, that it is one of compression."""
    said = (name, conditions.text_of("name"), *conditions.labels, *conditions.labels.values(), *conditions.assumed)
    return any(_COMPRESSION.search(text) and not _TENSION.search(text) for text in said)


def take_height(conditions: StatedConditions, name: str) -> None:
    """Make the height of a piece that is compressed its gauge length, where none is stated."""
    if {"height", "gauge_length"} & conditions.geometry.keys() == {"height"} and is_compression(conditions, name):
        height = conditions.geometry["gauge_length"] = conditions.geometry.pop("height")
        conditions.record_assumption(f"the height {height:g} mm is the gauge length")


def as_shortening(conditions: StatedConditions, strain: Floats) -> Floats:
    """Strain (frames,) - under a stress that is stated as negative, below zero as well.

    strain : (frames,) -.
    """
    if strain[np.isfinite(strain)].sum() <= 0.0:
        return strain
    conditions.record_assumption("shortening is a negative strain, as its stress is negative", first=True)
    return -strain


def as_compressed(loading: Loading, times: Floats, strain: Floats, measure: str) -> tuple[Loading, Floats]:
    """The loading with the true stress, and the logarithmic shortening (frames,) -, of a piece that is compressed.

    times, strain : (frames,) s and -, of which shortening may be negative; measure : "engineering" or "logarithmic".
    """
    known = np.isfinite(strain)
    shortening = -strain if strain[known].sum() < 0.0 else strain
    if measure == "engineering":
        shortening = -np.log1p(-np.minimum(shortening, 0.99))
    if held_of(loading) == "stress" or not known.any():
        return loading, shortening
    at = np.concatenate([[0.0], times[known & (times > 0.0)]])
    grown = np.interp(at, times[known], shortening[known])
    return RecordedLoading(Program(at, loading.program().at(at) * np.exp(-grown)), "stress", "stress"), shortening
