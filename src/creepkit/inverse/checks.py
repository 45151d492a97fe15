"""What cannot be identified, each in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.objective import Objective
from creepkit.inverse.search import Fences
from creepkit.language import CreepLaw
from creepkit.records import History

PUSH = 1.0
"""Force of the data against the bounds of a coefficient, in units of misfit per frame and ln, that is an error."""


def check_bounds(objective: Objective, u: Floats) -> None:
    """A coefficient that the data push hard against its bounds is an error: the answer would be the bound's."""
    law, coordinates, fences = objective.law, objective.coordinates, Fences(objective)
    theta = coordinates.theta(u)
    limit = PUSH * int(objective.present.sum())
    for k, beyond in zip(coordinates.rates, fences.outside(theta), strict=True):
        name, param = law.names[k], law.table[law.names[k]]
        if fences.SLOPE**2 * abs(beyond) > limit:
            low, high = param.bounds
            side = "below" if beyond < 0 else "above"
            raise FitError(
                f"law '{law.name}': the bounds exclude the data, which push {name} {side} them "
                f"({low:g} to {high:g} {param.unit}); widen them or choose another law"
            )


def check_strains(objective: Objective) -> None:
    """Some strain must rise above the floor of the scale."""
    if not (objective.present & (objective.measured > 2 * objective.scale.floor)).any():
        raise FitError("no strain of these histories rises above its noise; there is no creep to identify a law from")


def check_histories(law: CreepLaw, histories: Sequence[History]) -> None:
    """There must be parameters, and named histories with enough finite strains to find them from."""
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    if not law.params:
        raise FitError(f"law '{law.name}' has no parameter left to identify")
    names = [h.name for h in histories]
    for history in histories:
        if "strain" not in history.outputs:
            raise FitError(
                f"history '{history.name}' has no output 'strain'; it has {', '.join(history.outputs) or 'none'}"
            )
        if names.count(history.name) > 1:
            raise FitError(f"two histories are called '{history.name}'; give each its own name")
        used = history.used & (history.times > 0)
        if int(used.sum()) < 2:
            raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
        if not np.isfinite(history.outputs["strain"][used]).all():
            raise FitError(f"history '{history.name}' has a strain that is not a finite number; mark the frame unused")
    frames = sum(int(h.used.sum()) for h in histories)
    if frames <= len(law.params):
        raise FitError(f"law '{law.name}' has {len(law.params)} parameters and the histories only {frames} frames")
