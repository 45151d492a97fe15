"""The key `noise_correlation`: `amplitude width -0.31; amplitude shape 0.2`, correlations of the noise of one frame."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from creepkit.errors import HistoryError, nearest
from creepkit.readers.conditions import StatedConditions
from creepkit.records.noise_correlations import can_hold_together

KEY = "noise_correlation"


def read_noise_correlation(conditions: StatedConditions, outputs: Collection[str]) -> dict[tuple[str, str], float]:
    """{(output, output): correlation} as the head states them; HistoryError for what cannot be one."""
    entry = conditions.take_entry(KEY)
    known, correlations = list(outputs), dict[tuple[str, str], float]()
    if entry is None or not entry.text:
        return correlations
    location, text = entry.location, entry.text
    for item in text.split(";"):
        words = item.split()
        if len(words) != 3:
            raise HistoryError(
                f"{location}: {KEY} holds '{item.strip()}'; write two outputs and a number between -1 and 1, as in "
                "'amplitude width -0.31; amplitude shape 0.2'"
            )
        first, second, number = words
        for name in (first, second):
            if name not in known:
                raise HistoryError(f"{location}: {KEY} names '{name}', which is no column; {nearest(name, known)}")
        pair = first, second
        if first == second or pair in correlations or pair[::-1] in correlations:
            problem = "correlates with itself" if first == second else f"and {second} are given twice"
            raise HistoryError(f"{location}: {KEY}: {first} {problem}; give each pair of two outputs once")
        value = replace(entry, text=number).number(f"{KEY} of {first} {second}")
        if not -1.0 < value < 1.0:
            raise HistoryError(f"{location}: {KEY} of {first} {second} is {value:g}; allowed is between -1 and 1")
        correlations[pair] = value
    if not can_hold_together(correlations):
        raise HistoryError(
            f"{location}: the correlations '{text}' cannot all hold: their matrix is not positive definite; correct one"
        )
    return correlations


def noise_correlation_text(correlations: Mapping[tuple[str, str], float]) -> str:
    """The text of the key, from which the same numbers are read."""
    return "; ".join(f"{first} {second} {float(value)!r}" for (first, second), value in correlations.items())
