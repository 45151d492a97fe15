"""How long tests lasted, those of which only a minimum creep rate or an end is known among them."""

from __future__ import annotations

from collections.abc import Sequence

from creepkit.inverse.rupture_use import has_tertiary_creep
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


UNTESTABLE = (
    "no test has a curve: how the rate of this law falls with strain or time rests on the stated durations alone, at "
    "whose end its rate is taken for the minimum; its values and intervals, n and Q among them, are not tested by "
    "minimum rates and may exclude the true ones"
)
"""What is said of a law whose rates rest on durations."""


def rests_on_durations(law: CreepLaw, histories: Sequence[History]) -> bool:
    """Whether a hardening law is compared with minimum rates of tests without curves.

    Its rate falls with strain or time and has neither a minimum nor a steady state, so that its value at the end of
    each test, a time that damage decides, is compared with the rate.
    """
    compared = [history for history in histories if history.outputs or compares_minimum_rate(history)]
    curves = any(history.outputs for history in compared)
    return bool(compared) and not curves and needs_durations(law) and not has_tertiary_creep(law)
