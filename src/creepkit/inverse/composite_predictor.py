"""Predictors of several specimens as one, what a predictor offers, and what it need not know itself.

Finite differences replace derivatives that a predictor does not give. Nuisances of programs and rates become other
histories, and a law with rate factors in time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError, SolveError
from creepkit.inverse.rate_nuisances import law_with_rate_factors, rate_parameters
from creepkit.language import CreepLaw
from creepkit.records import (
    PROGRAM_NUISANCES,
    RATE_NUISANCES,
    History,
    NuisanceValues,
    Prediction,
    Predictor,
    Status,
    SupportsReducedOrderModel,
    SupportsRefinement,
    SupportsRupturePrediction,
    SupportsSearchTolerance,
    TimesToStrain,
    broadcast_candidates,
    call_of_plugin,
    checked_prediction,
    is_length_nuisance,
    kind_and_start,
    outputs_of_test,
    predict_with,
    with_program_nuisances,
)

TRANSFORMING_NUISANCES = (*PROGRAM_NUISANCES, *RATE_NUISANCES)
"""Kinds that every predictor follows as other histories, or by another law."""


@dataclass(frozen=True)
class CompositePredictor:
    """Predictors of different specimens as one: each history goes to the predictor of its specimen."""

    predictors: Mapping[str, Predictor]

    @property
    def name(self) -> str:
        """The names of all, joined."""
        return " + ".join(getattr(p, "name", type(p).__name__) for p in self.predictors.values())

    def predictor_for(self, history: History) -> Predictor:
        """The predictor of one history."""
        if history.specimen not in self.predictors:
            raise FitError(
                f"history '{history.name}' is of specimen '{history.specimen}', for which using= names no predictor; "
                f"it names {', '.join(self.predictors)}"
            )
        return self.predictors[history.specimen]

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict each group of histories with its predictor; outputs that a test does not have are NaN.

        theta : (candidates, parameters) internal values.
        """
        predictions = []
        for predictor, tests in self.groups(histories):
            group_nuisances = {k: v[:, tests] for k, v in (nuisances or {}).items() if supports_nuisance(predictor, k)}
            group_histories = [histories[k] for k in tests]
            prediction = predict(
                predictor, law, theta, group_histories, nuisances=group_nuisances, sensitivities=sensitivities
            )
            predictions.append((tests, prediction))
        for kind in nuisances or {}:
            if not any(supports_nuisance(self.predictor_for(h), kind) for h in histories):
                raise SolveError(f"none of the predictors {self.name} knows the nuisance '{kind}'")
        return concatenated_tests(predictions, histories)

    def groups(self, histories: Sequence[History]) -> list[tuple[Predictor, list[int]]]:
        """Each predictor with the positions of its histories."""
        chosen = [self.predictor_for(h) for h in histories]
        distinct = list({id(p): p for p in chosen}.values())
        return [(one, [k for k, p in enumerate(chosen) if p is one]) for one in distinct]


def predict(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    *,
    nuisances: NuisanceValues | None = None,
    sensitivities: bool = False,
) -> Prediction:
    """Predict, mentioning nuisances only where there are any: a closed form need not know of them.

    theta : (candidates, parameters) internal values. Nuisances of programs and rates, which the predictor does not
    differentiate itself, become other histories, and a law with further parameters.
    """
    if isinstance(predictor, CompositePredictor):
        return predictor.predict(law, theta, histories, nuisances=nuisances, sensitivities=sensitivities)
    given, own_kinds = dict(nuisances or {}), getattr(predictor, "program_nuisances", ())
    transformed = {
        key: given.pop(key)
        for key in list(given)
        if kind_and_start(key)[0] in TRANSFORMING_NUISANCES and kind_and_start(key)[0] not in own_kinds
    }
    if transformed:
        return _predict_transformed(predictor, law, theta, histories, given, transformed, sensitivities)
    return predict_with(predictor, law, theta, histories, nuisances=given, sensitivities=sensitivities)


def _predict_transformed(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    transformed: NuisanceValues,
    sensitivities: bool,
) -> Prediction:
    """Predict other histories, by a law with rate factors, in place of the nuisances `transformed`.

    theta : (candidates, parameters) internal values. Consecutive candidates with the same programs are one batch, and
    so are tests with the same rate factors.
    """
    if max(len(values) for values in transformed.values()) > 1:
        theta, everything = broadcast_candidates(theta, {**nuisances, **transformed}, len(histories))
        nuisances, transformed = ({key: everything[key] for key in part} for part in (nuisances, transformed))
        joint = np.stack([*transformed.values()], axis=-1).reshape(len(theta), -1)
        ends = [0, *(np.flatnonzero((np.diff(joint, axis=0) != 0.0).any(axis=1)) + 1), len(theta)]
        if len(ends) > 2:
            parts = []
            for first, end in pairwise(ends):
                own = {key: values[first:end] for key, values in nuisances.items()}
                same = {key: values[first : first + 1] for key, values in transformed.items()}
                batch = (predictor, law, theta[first:end], histories, own, same, sensitivities)
                parts.append(_predict_transformed(*batch))
            return concatenated_candidates(parts)
    values_of_tests = [{key: float(values[0, k]) for key, values in transformed.items()} for k in range(len(histories))]
    changed = [with_program_nuisances(h, values) for h, values in zip(histories, values_of_tests, strict=True)]
    keys = tuple(key for key in transformed if kind_and_start(key)[0] in RATE_NUISANCES)
    if not keys:
        return predict_with(predictor, law, theta, changed, nuisances=nuisances, sensitivities=sensitivities)
    law = law_with_rate_factors(law, keys)
    rates = np.array([[values[key] for key in keys] for values in values_of_tests])
    parameters, scales = rate_parameters(keys, rates, changed)
    groups = []
    for row in np.unique(parameters, axis=0):
        tests = [int(k) for k in np.flatnonzero((parameters == row).all(axis=1))]
        extended = np.concatenate([theta, np.tile(row, (len(theta), 1))], axis=1)
        own = {key: values[:, tests] for key, values in nuisances.items()}
        group = [changed[k] for k in tests]
        prediction = predict_with(predictor, law, extended, group, nuisances=own, sensitivities=sensitivities)
        if prediction.jacobian is not None:
            by_parameter, by_rate = np.split(prediction.jacobian, [theta.shape[1]], axis=-1)
            slopes = {key: by_rate[..., k] * scales[tests, k, None, None] for k, key in enumerate(keys)}
            merged = {**prediction.nuisance_jacobian, **slopes}
            prediction = replace(prediction, jacobian=by_parameter, nuisance_jacobian=merged)
        groups.append((tests, prediction))
    return groups[0][1] if len(groups) == 1 else concatenated_tests(groups, histories)


def prediction_errors_of(predictor: Predictor) -> dict[str, float]:
    """{output: standard deviation} of what a predictor says that it is wrong by; the largest of several predictors."""
    largest: dict[str, float] = {}
    for one in _single(predictor):
        for name, standard_deviation in getattr(one, "error", {}).items():
            largest[name] = max(standard_deviation, largest.get(name, 0.0))
    return largest


def _single(predictor: Predictor) -> Sequence[Predictor]:
    return [*predictor.predictors.values()] if isinstance(predictor, CompositePredictor) else [predictor]


def supports_nuisance(predictor: Predictor, key: str) -> bool:
    """Whether a predictor knows an explicit nuisance: it names those it does in `nuisances`; some all can follow."""
    kind = kind_and_start(key)[0]
    return kind in TRANSFORMING_NUISANCES or kind in getattr(predictor, "nuisances", ())


def predicts_rupture(predictor: Predictor, history: History) -> bool:
    """Whether the predictor of a history follows specimens to their rupture."""
    return isinstance(predictor_for(predictor, history), SupportsRupturePrediction)


def predictor_for(predictor: Predictor, history: History) -> Predictor:
    """Which predictor a history goes to."""
    return predictor.predictor_for(history) if isinstance(predictor, CompositePredictor) else predictor


def compared_outputs(predictor: Predictor, history: History) -> tuple[str, ...]:
    """What is both measured and predicted of a history, in the predictor's order; the first grows with creep."""
    known = outputs_of_test(predictor_for(predictor, history), history) or tuple(history.outputs)
    return tuple(name for name in known if name in history.outputs)


def underlying_specimen(predictor: Predictor) -> Predictor:
    """The specimen of a surrogate or a reduced-order model; anything else is taken for the specimen itself."""
    return _derived(predictor, lambda p: getattr(p, "specimen", p)) or predictor


def outside_class(predictor: Predictor, law: CreepLaw) -> str:
    """Why a predictor does not know the class of a law, in a sentence; "" where it does, or knows every law."""
    reasons = (p.outside_class(law) for p in _single(predictor) if hasattr(p, "outside_class"))
    return next(filter(None, reasons), "")


def predictor_for_law(predictor: Predictor, law: CreepLaw) -> Predictor:
    """The predictor itself, or its specimen where the law is outside the class of laws that it knows."""
    known = _derived(predictor, lambda p: underlying_specimen(p) if outside_class(p, law) else None)
    return predictor if known is None else known


def predictors_for_law(
    law: CreepLaw, using: Predictor | Mapping[str, Predictor], through: Predictor | None
) -> tuple[Predictor, Predictor | None, tuple[str, ...]]:
    """Predictors that know a law, in the place of `using` and `through` of identify(), and notes of what changed."""
    asked = CompositePredictor(dict(using)) if isinstance(using, Mapping) else using
    chosen, notes = predictor_for_law(asked, law), []
    if chosen is not asked:
        notes.append(f"identified with {_name(chosen)} in the place of {_name(asked)}: {outside_class(asked, law)}")
    on_the_way = through_for_law(through, law)
    if through is not None and on_the_way is None:
        notes.append(f"identified without {_name(through)} on the way: {outside_class(through, law)}")
    return chosen, on_the_way, tuple(notes)


def through_for_law(through: Predictor | None, law: CreepLaw) -> Predictor | None:
    """A cheaper predictor on the way to the values, or None where it does not know the law."""
    return None if through is None or outside_class(through, law) else through


def _name(predictor: Predictor) -> str:
    return f"'{getattr(predictor, 'name', type(predictor).__name__)}'"


def reduced_order_model_of(predictor: Predictor) -> Predictor | None:
    """The reduced-order model of a predictor, or None where it has none."""
    return _derived(predictor, lambda p: p.reduced_order_model() if isinstance(p, SupportsReducedOrderModel) else None)


def refined_of(predictor: Predictor) -> Predictor | None:
    """The more exact predictor of a predictor, or None where it has none."""
    return _derived(predictor, lambda p: p.refined() if isinstance(p, SupportsRefinement) else None)


def search_predictor_of(predictor: Predictor) -> Predictor:
    """The predictor at the tolerances that a global search needs: itself where it has no others."""
    result = _derived(predictor, lambda p: p.for_search() if isinstance(p, SupportsSearchTolerance) else None)
    return predictor if result is None else result


def _derived(predictor: Predictor, derive: Callable[[Predictor], Predictor | None]) -> Predictor | None:
    """What each predictor gives, in a composite one beside those that give nothing; None if none gives anything."""
    if not isinstance(predictor, CompositePredictor):
        return derive(predictor)
    derived = {name: _derived(p, derive) for name, p in predictor.predictors.items()}
    if all(p is None for p in derived.values()):
        return None
    return CompositePredictor({name: derived[name] or p for name, p in predictor.predictors.items()})


RELATIVE_STEP = 1e-4
"""Of internal parameters (ln of a coefficient, an exponent), relative to the larger of their size and one."""


NUISANCE_STEPS = {
    **{"modulus": 1e-3, "temperature": 0.1},
    **{"temperature step": 1.0, "temperature drift": 1.0, "rate step": 0.02, "rate drift": 0.02, "load step": 5e-3},
}
"""relative, K, K, K, ln, ln, relative: of central differences, well above the error of a solver's steps."""


LENGTH_STEP = 2e-3
"""The same for lengths, relative."""


def predict_with_sensitivities(
    predictor: Predictor, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues
) -> Prediction:
    """The prediction of one candidate with its derivatives to parameters and nuisances.

    theta : (parameters,) internal. What the predictor does not differentiate itself comes from differences.
    """
    prediction = predict(predictor, law, theta[None], histories, nuisances=nuisances, sensitivities=True)
    numeric = prediction.jacobian is None
    kinds = [kind for kind in nuisances if kind not in prediction.nuisance_jacobian]
    if not (numeric or kinds):
        return prediction
    on = np.isfinite(theta)  # a coefficient that is off stays off, and has a derivative of zero
    steps = RELATIVE_STEP * np.maximum(np.abs(np.where(on, theta, 0.0)), 1.0) if numeric else np.zeros(0)
    nuisance_steps = [_nuisance_step(key, nuisances[key]) for key in kinds]
    count = steps.size + len(kinds)
    moved = np.zeros((count, theta.size))  # one step in each parameter, then in each nuisance of all tests at once
    moved[: steps.size, : steps.size] = np.diag(steps)
    shifted = {key: np.tile(values, (2 * count, 1)) for key, values in nuisances.items()}
    for k, (kind, step) in enumerate(zip(kinds, nuisance_steps, strict=True), steps.size):
        shifted[kind][k] += step
        shifted[kind][count + k] -= step
    batch = predict(predictor, law, np.concatenate([theta + moved, theta - moved]), histories, nuisances=shifted)
    with np.errstate(invalid="ignore"):  # of values that are not finite, whose derivatives are NaN
        differences = batch.values[:count] - batch.values[count:]
    jacobian = np.moveaxis(differences[: steps.size], 0, -1) / (2 * steps) if numeric else None
    nuisance_jacobian = {
        kind: differences[steps.size + k][None] / (2 * nuisance_steps[k]) for k, kind in enumerate(kinds)
    }
    return replace(
        prediction,
        jacobian=prediction.jacobian if jacobian is None else jacobian[None],
        nuisance_jacobian={**prediction.nuisance_jacobian, **nuisance_jacobian},
    )


def _nuisance_step(key: str, values: Floats) -> float:
    """The step of central differences in a nuisance; values : (1, tests), of a length in mm."""
    kind = kind_and_start(key)[0]
    return LENGTH_STEP * float(np.max(np.abs(values))) if is_length_nuisance(kind) else NUISANCE_STEPS[kind]


def predict_to_rupture(
    predictor: Predictor, law: CreepLaw, theta: Floats, histories: Sequence[History], *, sensitivities: bool = False
) -> Prediction:
    """Predict with `times_to_strain`; tests whose predictor follows none to rupture reach no strain and never break.

    theta : (candidates, parameters) internal values.
    """
    whole = [(predictor, [*range(len(histories))])]
    predictions = []
    for one, tests in predictor.groups(histories) if isinstance(predictor, CompositePredictor) else whole:
        group = [histories[k] for k in tests]
        if isinstance(one, SupportsRupturePrediction):
            follow = partial(one.predict_to_rupture, law, theta, group, sensitivities=sensitivities)
            prediction = call_of_plugin(follow, one, "predict_to_rupture()", SolveError)
            checked_prediction(prediction, one, group, *theta.shape)
        else:
            prediction = predict(one, law, theta, group, sensitivities=sensitivities)
            prediction = replace(prediction, times_to_strain=_without_rupture(prediction, len(law.names)))
        predictions.append((tests, prediction))
    return predictions[0][1] if len(predictions) == 1 else concatenated_tests(predictions, histories)


def _without_rupture(prediction: Prediction, parameters: int) -> TimesToStrain:
    """Times to strain of tests that are followed to none."""
    shape = prediction.values.shape[:3]
    no_strains, no_ruptures = np.full(shape, np.nan), np.full(shape[:2], np.nan)
    jacobians = np.full((*shape, parameters), np.nan), np.full((*shape[:2], parameters), np.nan)
    return TimesToStrain(
        no_strains, np.full(shape, np.inf), no_ruptures, np.array([t[-1] for t in prediction.times]), *jacobians
    )


TIMES_TO_STRAIN_FILLS = {
    **{"times": np.nan, "log_time_derivatives": np.inf, "rupture_times": np.nan},
    **{"time_jacobian": np.nan, "rupture_jacobian": np.nan},
}
"""What the times to strain of tests hold where they have no frame."""


def concatenated_tests(groups: Sequence[tuple[list[int], Prediction]], histories: Sequence[History]) -> Prediction:
    """One prediction, in the order of the histories, of groups of tests; with the union of outputs."""
    outputs = tuple(dict.fromkeys(name for _, prediction in groups for name in prediction.outputs))
    candidates, longest = len(groups[0][1].values), max(h.times.size for h in histories)
    shape = (candidates, len(histories), longest, len(outputs))
    columns = [[outputs.index(name) for name in prediction.outputs] for _, prediction in groups]

    def gathered(arrays: Sequence[Any], axes: int, fill: float) -> Any:
        """Arrays (candidates, tests[, times[, outputs]], ...) of the groups as one, None where one of them is."""
        if any(array is None for array in arrays):
            return None
        out = np.full((*shape[:axes], *arrays[0].shape[axes:]), fill)
        for (tests, _), array, of_group in zip(groups, arrays, columns, strict=True):
            index = [range(candidates), tests, *(range(size) for size in array.shape[2:3]), of_group]
            out[np.ix_(*index[:axes])] = array
        return out

    predictions = [prediction for _, prediction in groups]
    kinds = {kind for prediction in predictions for kind in prediction.nuisance_jacobian}
    times_to_strain = [prediction.times_to_strain for prediction in predictions]
    whole = None
    if all(times_to_strain):
        arrays = {
            name: gathered([getattr(times, name) for times in times_to_strain], 2 if "rupture" in name else 3, fill)
            for name, fill in TIMES_TO_STRAIN_FILLS.items()
        }
        horizon = np.zeros(len(histories))
        for (tests, _), times in zip(groups, times_to_strain, strict=True):
            horizon[tests] = times.horizon  # type: ignore[union-attr]
        whole = TimesToStrain(horizon=horizon, **arrays)
    return Prediction(
        gathered([p.values for p in predictions], 4, np.nan),
        outputs,
        np.array([h.times.size for h in histories], np.int64),
        gathered([p.status for p in predictions], 2, int(Status.COMPLETE)),
        gathered([p.end_times for p in predictions], 2, np.inf),
        gathered([p.jacobian for p in predictions], 4, np.nan),
        tuple(h.times for h in histories),
        {
            kind: gathered([p.nuisance_jacobian.get(kind, np.zeros_like(p.values)) for p in predictions], 4, 0.0)
            for kind in kinds
        },
        whole,
    )


def concatenated_candidates(parts: Sequence[Prediction]) -> Prediction:
    """The predictions of consecutive candidates as one."""
    names = "values", "status", "end_times"
    arrays: dict[str, Any] = {name: np.concatenate([getattr(p, name) for p in parts]) for name in names}
    jacobians = [part.jacobian for part in parts if part.jacobian is not None]
    return replace(
        parts[0],
        **arrays,
        jacobian=np.concatenate(jacobians) if jacobians else None,
        nuisance_jacobian={
            key: np.concatenate([part.nuisance_jacobian[key] for part in parts]) for key in parts[0].nuisance_jacobian
        },
    )
