"""What predictors return, checked where it comes in, before a wrong shape fails far away or spoils a fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import SolveError
from creepkit.records.history import History
from creepkit.records.plugin_calls import call_of_plugin
from creepkit.records.prediction import NuisanceValues, Prediction, Status
from creepkit.records.specimen_lookup import outputs_of_tests

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.language.law import CreepLaw
    from creepkit.records.interfaces import Predictor

_REAL, _WHOLE, _NUMERIC = "f", "iu", "fiu"
"""Kinds of numbers, as numpy names them."""


_IN_WORDS = {_REAL: "real floating point numbers", _WHOLE: "whole numbers", _NUMERIC: "real numbers"}


def checked_prediction(
    prediction: Any, predictor: object, histories: Sequence[History], candidates: int, parameters: int
) -> Prediction:
    """The prediction itself; SolveError, naming the predictor, unless it is one of so many candidates and parameters.

    candidates : rows of theta, or of the nuisances where these are more.
    """
    who = predictor_in_words(predictor)
    if not isinstance(prediction, Prediction):
        raise SolveError(f"{who} returned a {type(prediction).__name__} from predict(); it must return a Prediction")
    names = outputs_of_tests(predictor, histories) or tuple(prediction.outputs)
    if tuple(prediction.outputs) != names:
        found = ", ".join(map(str, prediction.outputs)) or "none"
        raise SolveError(
            f"{who} predicted the outputs {found}; it must predict those that it names, {', '.join(names)}"
        )
    tests = (candidates, len(histories))
    frames = (*tests, max((h.times.size for h in histories), default=0), len(names))
    _check_array(who, "values", prediction.values, frames, _REAL)
    _check_array(who, "lengths", prediction.lengths, tests[1:], _WHOLE)
    _check_array(who, "status", prediction.status, tests, _WHOLE)
    _check_array(who, "end_times", prediction.end_times, tests, _NUMERIC)
    if prediction.jacobian is not None:
        _check_array(who, "jacobian", prediction.jacobian, (*frames, parameters), _REAL)
    for key, derivative in prediction.nuisance_jacobian.items():
        _check_array(who, f"nuisance_jacobian['{key}']", derivative, frames, _REAL)
    if prediction.status.size and not 0 <= prediction.status.min() <= prediction.status.max() < len(Status):
        unknown = next(int(code) for code in prediction.status.flat if not 0 <= code < len(Status))
        known = ", ".join(f"{int(status)} ({status.text})" for status in Status)
        raise SolveError(f"{who} returned the status {unknown}; known are {known}")
    lengths = [h.times.size for h in histories]
    if prediction.lengths.tolist() != lengths:
        raise SolveError(
            f"{who} returned the lengths {prediction.lengths.tolist()}; they must be the numbers of times of the "
            f"histories, {lengths}"
        )
    return prediction


def predictor_in_words(predictor: object) -> str:
    """What an error calls a predictor: by its name, else by its type."""
    own_name = getattr(predictor, "name", "")
    return f"predictor '{own_name}'" if isinstance(own_name, str) and own_name else f"a {type(predictor).__name__}"


def _check_array(who: str, name: str, array: object, shape: tuple[int, ...], kinds: str) -> None:
    if not isinstance(array, np.ndarray):
        raise SolveError(f"{who} returned a {type(array).__name__} as {name}; it must be an array of shape {shape}")
    if array.shape != shape:
        raise SolveError(f"{who} returned {name} of shape {array.shape}; it must be {shape} for what was asked")
    if array.dtype.kind not in kinds:
        raise SolveError(f"{who} returned {name} of type {array.dtype}; it must hold {_IN_WORDS[kinds]}")


def predict_with(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    *,
    nuisances: NuisanceValues | None = None,
    sensitivities: bool = False,
) -> Prediction:
    """The prediction of any predictor, checked for shape; SolveError where it is none, or where predict() raises.

    theta : (candidates, parameters) internal values. nuisances : {key: (candidates or 1, tests)}.
    """
    given = {"nuisances": nuisances} if nuisances else {}
    prediction = call_of_plugin(
        lambda: predictor.predict(law, theta, histories, sensitivities=sensitivities, **given),
        predictor,
        f"{predictor_in_words(predictor)}: predict()",
        SolveError,
    )
    candidates = max(len(theta), *(len(values) for values in nuisances.values())) if nuisances else len(theta)
    return checked_prediction(prediction, predictor, histories, candidates, theta.shape[1])
