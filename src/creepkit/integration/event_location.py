"""How an integration ends: codes of `event_location.hpp`."""

REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS = range(6)
"""Codes of an ending; whatever it is, the history so far is kept."""


TERMINATION_MARGIN = 1e-7
"""Fraction of the time passed, within which a limit ahead ends a simulation whose steps have shrunk to nothing."""
