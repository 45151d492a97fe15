"""Tests whose creep rates lie far from the law's, which more often says something of the tests than of the material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification

FAR, OUTLYING = 3.0, 2.0
"""Factors on the law's rate beyond which a test lies apart: of any test, and of one that lies outside of the others.
Heats of one steel differ by a factor of two or so; a load in ksi, or a time in minutes, by far more."""


OUTSIDE = 4.0
"""Robust standard deviations of ln factors beyond which a test lies outside of the others."""


MOST_NAMED = 6


def tests_apart(tests: Sequence[TestFit]) -> tuple[TestFit, ...]:
    """Tests that lie apart from the law by their own factors on its rate, the farthest first."""
    known = [one for one in tests if 0.0 < one.rate_factor < np.inf]
    if not known:
        return ()
    logs = np.log([one.rate_factor for one in known])
    distances = np.abs(logs - np.median(logs))
    spread = 1.4826 * float(np.median(distances))
    outside = (distances > OUTSIDE * spread) & (distances > np.log(OUTLYING)) & (len(known) > 2)
    apart = (np.abs(logs) > np.log(FAR)) | outside
    return tuple(known[k] for k in np.argsort(-np.abs(logs), kind="stable") if apart[k])


def apart_sentence(fit: Identification) -> str:
    """Which tests lie apart by which factor, and what to check first; "" where none does."""
    apart = tests_apart(fit.tests)
    if not apart:
        return ""
    named = [f"'{one.name}' {one.rate_factor:.3g} times ({one.condition})" for one in apart[:MOST_NAMED]]
    more = f" and {len(apart) - MOST_NAMED} more" if len(apart) > MOST_NAMED else ""
    return (
        f"creep rates that lie far from the law's: {', '.join(named)}{more}. Check the units of load and time of these "
        "tests, and their conditions, first: a unit that was misread is the usual cause, and one such test draws the "
        "law away from all others"
    )
