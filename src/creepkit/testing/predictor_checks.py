"""Checks of every predictor: shapes, ends, batches, sensitivities, nuisances and cheaper or finer models of it."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, SolveError, quoted
from creepkit.language import arrhenius
from creepkit.language.law import CreepLaw
from creepkit.records import (
    History,
    Output,
    Prediction,
    Predictor,
    Status,
    dimension_named,
    outputs_of,
    outputs_of_tests,
    typical_history,
)
from creepkit.registry import default_registry
from creepkit.testing.reports import finding

SAME = 1e-6
"""Relative difference, of the largest value of an output, that counts as none."""


STEPPING = 2e-3
"""By which values may differ that were integrated in other steps, relative as SAME."""


STEPPING_NOISE = 3e-5
"""Of the largest value of an output: by so much neighbouring runs with steps of their own may differ at random."""


SENSITIVITY_TOLERANCE = 0.02
"""Of the largest derivative; beside it, what two steps of the difference disagree by."""


RELATED = {"reduced_order_model": 0.25, "refined": 0.1}
"""By how much such a model may differ, of the largest value of an output."""


STEPS = {"temperature": 0.5, "modulus": 0.01}
"""Of central differences in nuisances; lengths move by half a per cent."""


TYPICAL_STRAIN, NORTON_REFERENCE = 0.005, 1050.0
"""At the end of a test; K, at which a law with temperature has its rate coefficient."""


@dataclass(frozen=True)
class PredictorCase:
    """A predictor with a law, values and tests at which it is checked.

    theta : (1, parameters) internal values. histories : two or more tests of different lengths.
    """

    predictor: Predictor
    law: CreepLaw
    theta: Floats
    histories: Sequence[History]

    @property
    def candidates(self) -> Floats:
        """(3, parameters) internal values: the case's own, and with 0.8 and 10 000 times its rate."""
        log = self.law.log_scale
        first = int(np.flatnonzero(log)[0]) if log.any() else 0
        rows = np.repeat(self.theta, 3, axis=0)
        rows[1:, first] += np.log([0.8, 1e4]) if log.any() else 0.01 * np.abs(rows[1:, first])
        return rows

    def predict(
        self,
        theta: Floats | None = None,
        histories: Sequence[History] | None = None,
        nuisances: Mapping[str, Floats] | None = None,
        sensitivities: bool = False,
        using: Predictor | None = None,
        law: CreepLaw | None = None,
    ) -> Prediction:
        """A prediction that was checked for shape.

        theta : (candidates, parameters) internal values. nuisances : {kind: (candidates or 1, tests)}.
        """
        return (using or self.predictor).predict(
            law or self.law,
            self.theta if theta is None else theta,
            self.histories if histories is None else histories,
            nuisances=nuisances,
            sensitivities=sensitivities,
        )


def default_histories(predictor: Predictor) -> list[History]:
    """Two tests of different lengths and loads, from the record of a specimen."""
    first = typical_history(predictor, frames=20)
    second = typical_history(predictor, level=0.45, frames=11, end=0.6 * float(first.times[-1]))
    return [first, second.replace(name=f"{second.name}, shorter")]


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
    with suppress(CreepkitError):  # a closed form of Norton's law alone
        theta = warm.to_internal(warm.values(values_warm))
        prediction_or_refusal(lambda: predictor.predict(warm, theta, [history]))
        return warm, values_warm
    predictor.predict(norton, norton.to_internal(norton.values(values)), [history])  # says why it cannot
    return norton, values


def norton_at(predictor: Any, history: History) -> tuple[float, dict[str, float]]:
    """A, MPa^-4/s, and values of Norton's law with n = 4: a creep strain of half a per cent at the end of a test."""
    record = predictor.specimen
    stated = record.reference_stress(history) if record.states("reference_stress") else 0.0
    found = float(np.max(stated, initial=0.0))
    level = found if 0.0 < found < np.inf else 100.0
    rate = TYPICAL_STRAIN / float(history.times[-1]) / level**4
    return rate, {"A": rate, "n": 4.0}


def prediction_or_refusal(call: Callable[[], Prediction]) -> Prediction:
    """A prediction; CreepkitError where it is refused, as by status for a stated reason, or where the code fails."""
    found = call()
    refused = np.isin(found.status, (int(Status.NOT_CONVERGED), int(Status.OUTSIDE_CLASS)))
    if found.reason and refused.all():
        raise SolveError(found.reason)
    return found


def largest_difference(first: Floats, second: Floats) -> float:
    """Largest difference of values, relative to the largest of each output; inf where one of them is NaN.

    first, second : (..., outputs), in the units of the outputs.
    """
    if first.shape != second.shape or not np.array_equal(np.isnan(first), np.isnan(second)):
        return float("inf")
    axes = tuple(range(first.ndim - 1))
    size = np.nanmax(np.abs(first), axis=axes, initial=0.0)
    gap = np.nanmax(np.abs(first - second), axis=axes, initial=0.0)
    return float(np.max(gap / np.maximum(size, 1e-300)))


@finding("outputs")
def check_outputs(case: PredictorCase) -> str:
    """Outputs have names, and those of a test are among them."""
    outputs = tuple(case.predictor.outputs)
    assert outputs, "none; state outputs = (ck.Output('deflection', 'length'),)"
    stated = outputs_of_tests(case.predictor, case.histories)
    unknown = [name for name in stated if name not in outputs_of(case.predictor)]
    assert not unknown, f"outputs_of_test() gives '{unknown[0]}'; name it among outputs or optional_outputs"
    units = [f"{o} in {o.unit or 'no unit'}" if isinstance(o, Output) else str(o) for o in outputs]
    return ", ".join(units[:4]) + ("" if len(units) <= 4 else f" and {len(units) - 4} more")


@finding("a moderate test lasts to its end")
def check_lasting(case: PredictorCase) -> str:
    """The law is predicted, and the tests with moderate values do not end early."""
    found = case.predict(case.candidates)
    outside = f"{found.reason or 'the law is outside its class'}; give law= and values= that it knows"
    assert not (found.status[0] == Status.OUTSIDE_CLASS).all(), outside
    for history, status, end in zip(case.histories, found.status[0], found.end_times[0], strict=True):
        assert status in (Status.COMPLETE, Status.OUTSIDE_DOMAIN), (
            f"test '{history.name}' ended at {end:g} s, {Status(int(status)).text}"
            f"{f': {found.reason}' if found.reason else ''}; give histories= and values= that last to their end"
        )
    return f"tests of {', '.join(str(h.times.size) for h in case.histories)} times"


@finding("NaN after an end only")
def check_ends(case: PredictorCase) -> str:
    """Values are finite up to a row's end, and NaN beyond."""
    found = case.predict(case.candidates)
    for c, k in np.ndindex(*found.status.shape):
        history, values, end = case.histories[k], found.of(k, c), float(found.end_times[c, k])
        status, missing = Status(int(found.status[c, k])), np.isnan(values).any(axis=1)
        where, times = f"test '{history.name}', candidate {c}", history.times
        assert not np.isinf(values).any(), f"{where}: a value is infinite; end the row there, NaN after it"
        beyond = found.values[c, k, times.size :]
        assert np.isnan(beyond).all(), f"{where}: values beyond its last time; pad them with NaN"
        ended = status is Status.RUPTURED
        faults = {
            "NaN at {} s and status complete; state how and when it ended": (
                missing & (status in (Status.COMPLETE, Status.OUTSIDE_DOMAIN))
            ),
            "NaN at {} s, before its end at {}; values until then are wanted": missing
            & (times < end * (1 - 1e-9))
            & ended,
            "values at {} s, after its end at {}; NaN is wanted there": ~missing & (times > end * (1 + 1e-9)) & ended,
        }
        for problem, at in faults.items():
            assert not at.any(), f"{where}: {problem.format(f'{times[np.argmax(at)]:g}', f'{end:g} s')}"
    return f"{int((found.status != int(Status.COMPLETE)).sum())} of {found.status.size} rows ended early"


@finding("a batch equals one by one")
def check_batches(case: PredictorCase) -> str:
    """Candidates and tests together are what each is alone."""
    thetas = case.candidates[:2]
    together, worst = case.predict(thetas), (0.0, "")
    for c, k in np.ndindex(len(thetas), len(case.histories)):
        alone = case.predict(thetas[c : c + 1], [case.histories[k]])
        where = f" at test '{case.histories[k].name}', candidate {c}"
        worst = max(worst, (largest_difference(alone.of(0), together.of(k, c)), where))
    assert worst[0] <= SAME, f"{worst[0]:.1e}{worst[1]}; one row must not depend on the others, nor on chance"
    return f"{worst[0]:.1e}{worst[1] if worst[0] else ''}"


@finding("pickles")
def check_pickling(case: PredictorCase) -> str:
    """A copy in another process predicts the same."""
    copy = pickle.loads(pickle.dumps(case.predictor))
    gap = largest_difference(case.predict().values, case.predict(using=copy).values)
    assert gap <= SAME, f"{gap:.1e}; a copy in another process must predict the same"
    return f"{gap:.1e}"


@finding("sensitivities")
def check_sensitivities(case: PredictorCase) -> str:
    """Derivatives to the law's internal parameters against central differences."""
    history = case.histories[:1]
    found = case.predictor.predict_batch(case.law, case.theta, history, {}, True)
    if found.jacobian is None:
        return "none, differences are taken in their place"
    gap = largest_difference(case.predict(histories=history).values, found.values)
    assert gap <= STEPPING, f"values differ by {gap:.1e}; sensitivities=True must not change the values"
    steps = np.where(case.law.log_scale, 0.02, 5e-3 * np.maximum(1.0, np.abs(case.theta[0])))
    shifts = np.concatenate([sign * np.diag(steps) for sign in (1, -1, 2, -2)])
    values = case.predict(case.theta + shifts, history).values[:, 0].reshape(4, steps.size, *found.values.shape[2:])
    excess = [_excess(found.jacobian[0, 0, ..., p], values[:, p], steps[p]) for p in range(steps.size)]
    worst = int(np.argmax(excess))
    assert excess[worst] <= SENSITIVITY_TOLERANCE, (
        f"the derivative to {case.law.names[worst]} is off by {excess[worst]:.2g} of its largest value; it is to the "
        "internal parameter, the natural logarithm where the scale is log"
    )
    return f"{excess[worst]:.1e} beyond what differences leave open"


def _excess(derivative: Floats, values: Floats, step: float) -> float:
    """Largest error of a derivative, relative, beyond what differences of two sizes disagree by.

    derivative : (times, outputs). values : (4, times, outputs) at steps 1, -1, 2 and -2.
    """
    narrow, wide = (values[0] - values[1]) / (2 * step), (values[2] - values[3]) / (4 * step)
    if not np.isfinite(derivative[np.isfinite(narrow)]).all():
        return float("inf")
    error, doubt, size = (
        np.nanmax(np.abs(part), axis=0, initial=0.0) for part in (derivative - narrow, narrow - wide, narrow)
    )
    noise = STEPPING_NOISE * np.nanmax(np.abs(values), axis=(0, 1), initial=0.0) / step
    return float(np.max(np.maximum(error - 2 * doubt - noise, 0.0) / np.maximum(size, 1e-300)))


def nuisance_value(case: PredictorCase, kind: str) -> tuple[float, float]:
    """A value of a nuisance in the middle of what happens, and the step of differences in it."""
    length = dimension_named(case.predictor, kind)
    if length is None:
        return (2.0, STEPS["temperature"]) if kind == "temperature" else (0.02, STEPS.get(kind, 0.005))
    low, high = length.bounds
    step = 0.002 * length.default
    for value in (float(np.clip(factor * length.default, low, high)) for factor in (1.01, 0.99)):
        with suppress(CreepkitError):  # two lengths may bound one another
            case.predict(histories=case.histories[:1], nuisances={kind: np.array([[value + 2 * step]])})
            if value != length.default:
                return value, step
    return float(length.default), step


@finding("nuisance {}", each=lambda case: case.predictor.nuisances)
def check_nuisance(case: PredictorCase, kind: str) -> str:
    """Each declared kind is taken, with its derivative where that is given."""
    history, (value, step) = case.histories[:1], nuisance_value(case, kind)
    found = case.predict(histories=history, nuisances={kind: np.array([[value]])}, sensitivities=True)
    effect = largest_difference(case.predict(histories=history).values, found.values)
    assert effect or dimension_named(case.predictor, kind) is None, (
        "no output depends on this length; let predict() follow it, or leave it out of the record"
    )
    detail = f"changes outputs by {effect:.1e}" if effect else "taken; no output depends on it here"
    slope = found.nuisance_jacobian.get(kind)
    if slope is None:
        return detail
    values = np.array([[value + sign * step] for sign in (1, -1, 2, -2)])
    moved = case.predict(np.repeat(case.theta, 4, axis=0), history, {kind: values}).values[:, 0]
    excess = _excess(slope[0, 0], moved, step)
    assert excess <= SENSITIVITY_TOLERANCE, (
        f"its derivative is off by {excess:.2g} of the largest; it is to the value in its own unit"
    )
    return f"{detail}, derivative {excess:.1e} beyond what differences leave open"


def refusal_of(call: Callable[[], object], remedy: str) -> str:
    """The one line that a call is refused in; remedy : what to say where it is not."""
    try:
        call()
    except CreepkitError as error:
        assert "\n" not in str(error), f"in several lines, {quoted(repr(str(error)), 80)}; say it in one"
        return str(error)
    raise AssertionError(remedy)


@finding("{}()", each=lambda case: [method for method in RELATED if case.predictor.states(method)])
def check_related_model(case: PredictorCase, method: str) -> str:
    """A reduced-order model and a refined predictor have the same outputs and about the same values."""
    history = case.histories[-1:]
    wanted, found = (
        case.predict(histories=history, using=using) for using in (None, getattr(case.predictor, method)())
    )
    assert tuple(found.outputs) == tuple(wanted.outputs), (
        f"it predicts {', '.join(found.outputs)}; it must predict {', '.join(wanted.outputs)}"
    )
    last = largest_difference(wanted.of(0)[-1:], found.of(0)[-1:])
    detail = f"{last:.1e} off at the last time"
    assert last <= RELATED[method], f"{detail}; {RELATED[method]:g} is allowed, relative to the output"
    return detail
