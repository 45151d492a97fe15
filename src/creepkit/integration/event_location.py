"""How an integration ends: codes of `event_location.hpp`."""

REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS = range(6)
"""Codes of an ending; whatever it is, the history so far is kept."""
