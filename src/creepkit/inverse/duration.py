"""How long tests lasted, those of which only a minimum creep rate or an end is known among them."""

from __future__ import annotations

from creepkit.records import UNKNOWN_DURATION, History

STRAIN_OF_UNKNOWN_DURATION = 0.05
"""Creep strain to which a test of unknown duration is followed, at its minimum rate: products of minimum rate and time
to rupture (Monkman and Grant 1956) lie mostly between 0.02 and 0.2."""


def compares_minimum_rate(history: History) -> bool:
    """Whether a test is compared by its minimum rate: it states one and has no frames, which would hold it already."""
    return history.minimum_rate is not None and not history.outputs


def followed_duration(history: History) -> float:
    """For how long a test lasted, s: to its rupture or last time, else to STRAIN_OF_UNKNOWN_DURATION at its rate."""
    last = history.rupture_time or float(history.times[-1])
    if history.minimum_rate is None or history.outputs or history.end_known or last > UNKNOWN_DURATION:
        return last
    return STRAIN_OF_UNKNOWN_DURATION / history.minimum_rate
