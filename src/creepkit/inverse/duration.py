"""How long tests lasted, those of which only a minimum creep rate or an end is known among them."""

from __future__ import annotations

from creepkit.language import CreepLaw, strain, time
from creepkit.records import UNKNOWN_DURATION, History

STRAIN_OF_UNKNOWN_DURATION = 0.05
"""Creep strain to which a test of unknown duration is followed, at its minimum rate: products of minimum rate and time
to rupture (Monkman and Grant 1956) lie mostly between 0.02 and 0.2."""


def compares_minimum_rate(history: History) -> bool:
    """Whether a test is compared by its minimum rate: it states one and has no frames, which would hold it already."""
    return history.minimum_rate is not None and not history.outputs


def followed_duration(history: History) -> float:
    """For how long a test lasted, s: to its rupture or last time, else to STRAIN_OF_UNKNOWN_DURATION at its rate."""
    if duration_known(history) or history.minimum_rate is None:
        return history.rupture_time or float(history.times[-1])
    return STRAIN_OF_UNKNOWN_DURATION / history.minimum_rate


def duration_known(history: History) -> bool:
    """Whether it is known how long a test lasted; of a minimum creep rate alone it is not."""
    if not compares_minimum_rate(history) or history.end_known:
        return True
    return float(history.times[-1]) > UNKNOWN_DURATION


def needs_durations(law: CreepLaw) -> bool:
    """Whether the minimum rate of a law depends on how long the test lasted: it has a rate of strain or time.

    Over a duration that is assumed from the measured rate such a law would predict that rate from itself.
    """
    return law.uses(strain) or law.uses(time)
