"""Whether a law that curves contradict explains them with the true stress held in place of the load, or the reverse.

A bar thins as it creeps: under a constant load its true stress grows with exp(strain), and a rate s^n with
exp(n strain), by 16 % at n = 5 and a strain of 3 %. Which of the two a rig held is seldom written down.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.initial_search import StartingEstimate
from creepkit.records import History, is_logarithmic
from creepkit.records.loading import held_otherwise

LEAST_STRAIN = 0.02
"""Largest measured, from which on curves show what was held: the stress of a bar under load has grown by as much."""


HELD_INSTEAD = {
    "stress": "the true stress held in place of the load (control = stress)",
    "load": "the load held in place of the true stress (control = load)",
}
"""{what was held: the remedy}."""


def with_hold_tried(fit: Identification) -> Identification:
    """The identification, with what was held among the remedies where the law then explains its tests."""
    adequacy = fit.adequacy
    if adequacy is None or not adequacy.misses_shape() or adequacy.is_explained or fit.predictor is None:
        return fit
    others = [held_otherwise(history.loading) for history in fit.histories]
    held = {other[1] for other in others if other is not None}
    if None in others or len(held) != 1 or max(map(_largest_strain, fit.histories)) < LEAST_STRAIN:
        return fit
    tests = [h.replace(loading=other[0]) for h, other in zip(fit.histories, others, strict=True) if other is not None]
    settings = replace(fit.settings, weights="likelihood")
    start = StartingEstimate.from_identification(fit, values_only=True)
    with suppress(CreepkitError):
        otherwise = identify(fit.law, tests, fit.predictor, settings=settings, start=start).adequacy
        if otherwise is not None and otherwise.explains:
            remedies = (HELD_INSTEAD[held.pop()], *adequacy.remedies)
            return replace(fit, adequacy=replace(adequacy, remedies=remedies))
    return fit


def _largest_strain(history: History) -> float:
    values = [v[history.used] for name, v in history.outputs.items() if is_logarithmic(name)]
    return max((float(np.nanmax(v)) for v in values if np.isfinite(v).any()), default=0.0)
