"""How accurately a creep history is integrated; step control itself is in `step_control.hpp`."""

from __future__ import annotations

from typing import NamedTuple


class IntegrationSettings(NamedTuple):
    """How accurately, and how far, to integrate.

    rtol : local error allowed in a step, relative to strain and to each state.
    smallest : strain below which the error is relative to this instead.
    strain_limit : creep strain at which the point has burst.
    max_steps : cap on steps, accepted and rejected, of one history, beside 20 for each further straight piece of its
        programs.
    first, longest : first and longest step, as shares of a segment (in its transformed time).
    """

    rtol: float = 1e-5
    smallest: float = 1e-7
    strain_limit: float = 1.0
    max_steps: int = 2000
    first: float = 0.02
    longest: float = 0.2
