"""What cannot be identified, each in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.fences import BoundPenalties
from creepkit.inverse.frames import frames_with_data
from creepkit.inverse.growth import detect_creep
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.scales import LOGARITHMIC_OUTPUTS
from creepkit.inverse.together import compared_outputs, predictor_for
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

FORCE_LIMIT = 1.0
"""Force of the data against the bounds of a coefficient, in units of misfit per frame and ln, that is an error."""
EXCESS_LIMIT = 0.1
"""In ln beyond the bounds of a coefficient: no wall gives way so far unless the search never came back inside."""
SIGNIFICANT_GROWTH = 5.0
"""Growth of an output, in units of its noise, that is creep."""


def check_bounds(residual_function: ResidualFunction, u: Floats, gradient: Floats) -> None:
    """A coefficient that the data push hard against its bounds is an error: the answer would be the bound's.

    force : (parameters,) derivative of half the chi-square of the data to u.
    """
    law, coordinates, bound_penalties = residual_function.law, residual_function.coordinates, BoundPenalties(residual_function)
    theta = coordinates.theta(u)
    force_limit = FORCE_LIMIT * int(residual_function.observations.present.sum())
    for k, excess in zip(coordinates.penalised, bound_penalties.bound_excess(theta), strict=True):
        name, param = law.names[k], law.table[law.names[k]]
        excluded = bound_penalties.WEIGHT**2 * abs(excess) > force_limit and (abs(gradient[k]) > force_limit or abs(excess) > EXCESS_LIMIT)
        if k in coordinates.coefficients and excluded:
            low, high = param.bounds
            side = "below" if excess < 0 else "above"
            raise FitError(
                f"law '{law.name}': the bounds exclude the data, which push {name} {side} them "
                f"({low:g} to {high:g} {param.unit}); widen them or choose another law"
            )


def check_creep(residual_function: ResidualFunction) -> None:
    """Some strain must rise above the floor of its scale, or some other output grow beyond its noise."""
    observations = residual_function.observations
    for position, (name, transform) in enumerate(zip(observations.outputs, observations.transforms, strict=True)):
        mask = observations.leading_output & (observations.output_index == position)
        if name in LOGARITHMIC_OUTPUTS:
            if (mask & (observations.values > 2 * transform.floor)).any():
                return
            continue
        for k, history in enumerate(residual_function.histories):
            values = observations.values[k, mask[k]]
            if values.size and np.ptp(values) > SIGNIFICANT_GROWTH * observations.noise[position] and _creeps_under_load(history, name):
                return
    output_names = dict.fromkeys(observations.outputs[k] for k in observations.output_index[observations.leading_output])
    raise FitError(
        f"no {' or '.join(output_names)} of these histories rises above its noise while the load is held; there is no creep "
        "to identify a law from"
    )


def _creeps_under_load(history: History, output: str) -> bool:
    """Whether a bulge test grows while its pressure is held: a jump of pressure alone moves it elastically."""
    return history.loading.quantity != "pressure" or detect_creep(history, output).shows_creep


def check_histories(law: CreepLaw, histories: Sequence[History], predictor: Predictor) -> None:
    """There must be parameters, and named histories with enough finite outputs to find them from."""
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    if not law.params:
        raise FitError(f"law '{law.name}' has no parameter left to identify")
    names = [h.name for h in histories]
    for history in histories:
        if names.count(history.name) > 1:
            raise FitError(f"two histories are called '{history.name}'; give each its own name")
        _check_outputs(history, predictor)
    frames = sum(int(h.used.sum()) for h in histories)
    if frames <= len(law.params):
        raise FitError(f"law '{law.name}' has {len(law.params)} parameters and the histories only {frames} frames")


def _check_outputs(history: History, predictor: Predictor) -> None:
    """Frames without a number are left out, output by output; an infinite one is a mistake."""
    outputs = compared_outputs(predictor, history)
    if not outputs:
        known = ", ".join(getattr(predictor_for(predictor, history), "outputs", ())) or "nothing"
        raise FitError(
            f"history '{history.name}' has none of the outputs that are predicted ({known}); "
            f"it has {', '.join(history.outputs) or 'none'}"
        )
    used = history.used & (history.times > 0)
    if int((used & frames_with_data(history)).sum()) < 2:
        raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
    for name in outputs:
        if np.isinf(history.outputs[name][used]).any():
            raise FitError(f"history '{history.name}' has an infinite {name}; mark the frame unused")
