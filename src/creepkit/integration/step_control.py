"""How accurately a creep history is integrated; step control itself is in `step_control.hpp`."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from creepkit.integration.time_discretisation import Tableau

_SAFETY, _LEAST, _MOST = 0.9, 0.1, 8.0


INITIAL_ERROR_FACTOR = 10.0
"""From a virgin state strain is a sum of broken powers of s, on which the first step is of order 1 and its error is up
to 2.5 times the estimate; afterwards the estimate exceeds the error some twenty times."""


class IntegrationSettings(NamedTuple):
    """How accurately, and how far, to integrate.

    rtol : local error allowed in a step, relative to strain and to each state.
    smallest : strain below which the error is relative to this instead.
    strain_limit : creep strain at which the point has burst.
    max_steps : cap on steps, accepted and rejected, of one history.
    first, longest : first and longest step, as shares of a segment (in its transformed time).
    """

    rtol: float = 1e-5
    smallest: float = 1e-7
    strain_limit: float = 1.0
    max_steps: int = 2000
    first: float = 0.02
    longest: float = 0.2


def step_factor(tableau: Tableau, error: float, growing: bool) -> float:
    """Factor on the step after an error; a step that follows a rejection does not grow."""
    if not isfinite(error):
        return _LEAST
    factor = _SAFETY * max(error, 1e-12) ** (-1.0 / (tableau.error_order + 1))
    return float(min(max(factor, _LEAST), _MOST if growing else 1.0))
