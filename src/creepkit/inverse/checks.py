"""What cannot be identified, each in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.fences import Fences
from creepkit.inverse.frames import measured
from creepkit.inverse.growth import growth
from creepkit.inverse.objective import Objective
from creepkit.inverse.scales import LOGARITHMIC
from creepkit.inverse.together import outputs_of, predictor_of
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

PUSH = 1.0
"""Force of the data against the bounds of a coefficient, in units of misfit per frame and ln, that is an error."""
FAR = 0.1
"""In ln beyond the bounds of a coefficient: no wall gives way so far unless the search never came back inside."""
VISIBLE = 5.0
"""Growth of an output, in units of its noise, that is creep."""


def check_bounds(objective: Objective, u: Floats, force: Floats) -> None:
    """A coefficient that the data push hard against its bounds is an error: the answer would be the bound's.

    force : (parameters,) derivative of half the chi-square of the data to u.
    """
    law, coordinates, fences = objective.law, objective.coordinates, Fences(objective)
    theta = coordinates.theta(u)
    limit = PUSH * int(objective.entries.present.sum())
    for k, beyond in zip(coordinates.walled, fences.outside(theta), strict=True):
        name, param = law.names[k], law.table[law.names[k]]
        pushed = fences.SLOPE**2 * abs(beyond) > limit and (abs(force[k]) > limit or abs(beyond) > FAR)
        if k in coordinates.coefficients and pushed:
            low, high = param.bounds
            side = "below" if beyond < 0 else "above"
            raise FitError(
                f"law '{law.name}': the bounds exclude the data, which push {name} {side} them "
                f"({low:g} to {high:g} {param.unit}); widen them or choose another law"
            )


def check_growth(objective: Objective) -> None:
    """Some strain must rise above the floor of its scale, or some other output grow beyond its noise."""
    entries = objective.entries
    for position, (name, scale) in enumerate(zip(entries.outputs, entries.scales, strict=True)):
        mine = entries.leading & (entries.output == position)
        if name in LOGARITHMIC:
            if (mine & (entries.measured > 2 * scale.floor)).any():
                return
            continue
        for k, history in enumerate(objective.histories):
            values = entries.measured[k, mine[k]]
            if values.size and np.ptp(values) > VISIBLE * entries.noise[position] and _creeps(history, name):
                return
    grown = dict.fromkeys(entries.outputs[k] for k in entries.output[entries.leading])
    raise FitError(
        f"no {' or '.join(grown)} of these histories rises above its noise while the load is held; there is no creep "
        "to identify a law from"
    )


def _creeps(history: History, output: str) -> bool:
    """Whether a bulge test grows while its pressure is held: a jump of pressure alone moves it elastically."""
    return history.loading.quantity != "pressure" or growth(history, output).visible


def check_histories(law: CreepLaw, histories: Sequence[History], using: Predictor) -> None:
    """There must be parameters, and named histories with enough finite outputs to find them from."""
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    if not law.params:
        raise FitError(f"law '{law.name}' has no parameter left to identify")
    names = [h.name for h in histories]
    for history in histories:
        if names.count(history.name) > 1:
            raise FitError(f"two histories are called '{history.name}'; give each its own name")
        _check_outputs(history, using)
    frames = sum(int(h.used.sum()) for h in histories)
    if frames <= len(law.params):
        raise FitError(f"law '{law.name}' has {len(law.params)} parameters and the histories only {frames} frames")


def _check_outputs(history: History, using: Predictor) -> None:
    """Frames without a number are left out, output by output; an infinite one is a mistake."""
    outputs = outputs_of(using, history)
    if not outputs:
        known = ", ".join(getattr(predictor_of(using, history), "outputs", ())) or "nothing"
        raise FitError(
            f"history '{history.name}' has none of the outputs that are predicted ({known}); "
            f"it has {', '.join(history.outputs) or 'none'}"
        )
    used = history.used & (history.times > 0)
    if int((used & measured(history)).sum()) < 2:
        raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
    for name in outputs:
        if np.isinf(history.outputs[name][used]).any():
            raise FitError(f"history '{history.name}' has an infinite {name}; mark the frame unused")
