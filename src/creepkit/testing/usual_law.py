"""The law that predictors are checked with, its values, and how a prediction is told from a refusal or a crash."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError, SolveError
from creepkit.language import arrhenius
from creepkit.language.law import CreepLaw
from creepkit.records import History, Prediction, Status, predict_with
from creepkit.registry import default_registry

TYPICAL_STRAIN = 0.005


NORTON_REFERENCE = 1050.0
"""K, at which a law with temperature has its rate coefficient."""


def law_of_check(predictor: Any, law: CreepLaw | str | None, history: History) -> tuple[CreepLaw, Mapping[str, float]]:
    """The law that a predictor is checked with, and values of it: Norton's, with temperature if the predictor can."""
    norton = default_registry().law("norton")
    if law is not None:
        chosen = default_registry().law(law) if isinstance(law, str) else law
        return chosen, chosen.center()
    rate, values = norton_at(predictor, history)
    warm = norton.times(arrhenius(T_ref=NORTON_REFERENCE))
    change = 1.0 / NORTON_REFERENCE - 1.0 / history.mean_temperature
    values_warm = {**values, "A": float(rate * np.exp(-3e5 / 8.314462618 * change)), "Q": 3e5}
    try:
        prediction_or_refusal(
            lambda: predict_with(predictor, warm, warm.to_internal(warm.values(values_warm)), [history])
        )
    except CreepkitError:  # a closed form of Norton's law alone
        predict_with(predictor, norton, norton.to_internal(norton.values(values)), [history])  # says why it cannot
        return norton, values
    return warm, values_warm


def norton_at(predictor: Any, history: History) -> tuple[float, dict[str, float]]:
    """A, MPa^-4/s, and values of Norton's law with n = 4: a creep strain of half a per cent at the end of a test."""
    record = getattr(predictor, "specimen", predictor)
    level = 100.0
    if hasattr(record, "reference_stress"):
        found = float(np.max(record.reference_stress(history), initial=0.0))
        level = found if 0.0 < found < np.inf else level
    rate = TYPICAL_STRAIN / float(history.times[-1]) / level**4
    return rate, {"A": rate, "n": 4.0}


def prediction_or_refusal(call: Callable[[], Prediction]) -> Prediction:
    """A prediction; CreepkitError where it is refused, as by status for a stated reason, or where the code fails."""
    found = call()
    refused = np.isin(found.status, (int(Status.NOT_CONVERGED), int(Status.OUTSIDE_CLASS)))
    if found.reason and refused.all():
        raise SolveError(found.reason)
    return found


def is_crash(error: CreepkitError) -> bool:
    """Whether an error of ours reports an exception of the plugin's code, such as a KeyError, and is no refusal."""
    cause = error.__cause__
    return cause is not None and not isinstance(cause, CreepkitError) and type(cause).__name__ in str(error)
