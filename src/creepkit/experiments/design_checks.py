"""What a design is asked for, checked, and what its expectations take for granted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.inverse.uncertainty.quantities import DerivedQuantity


def check_arguments(goal: object, budget: object, seed: object) -> None:
    """FitError for a goal, a budget or a seed that is none."""
    if goal is not None and not isinstance(goal, str | DerivedQuantity):
        raise FitError(f"the goal is 'law', 'parameters', or a quantity such as ck.rate_at(60.0); found {goal!r:.60}")
    if budget is not None and not (isinstance(budget, int | float) and 0 < budget < np.inf):
        raise FitError(f"the budget is {budget!r:.40} h; it must be above zero")
    if not (isinstance(seed, int) and seed >= 0):
        raise FitError(f"the seed is {seed!r:.40}; it must be a whole number from 0 on")


def notes_of(laws: Sequence[Identification]) -> tuple[str, ...]:
    """What an expectation takes for granted."""
    notes = []
    scatters = any(n.kind == "rate" and n.sd is None for n in laws[0].settings.nuisances)
    if scatters and len(laws[0].histories) < MINIMUM_TESTS and laws[0].noise_model.rate == 0.0:
        notes.append(
            f"fewer than {MINIMUM_TESTS} tests do not show by how much the rate scatters from test to test; it is "
            'taken as none: give Nuisance("rate", sd=...) where it is known'
        )
    for fit in laws:
        if fit.adequacy is not None and fit.adequacy.verdict == "leaves a discrepancy":
            notes.append(
                f"{fit.law.name} does not explain the tests that were made: what a test is expected to tell holds for "
                "laws that do; find one first"
            )
    return tuple(notes)
