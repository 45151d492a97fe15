"""Checks of every predictor: shapes, ends, batches, sensitivities, nuisances and cheaper or finer models of it."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, quoted
from creepkit.language.law import CreepLaw
from creepkit.records import (
    History,
    Output,
    Prediction,
    Status,
    dimension_named,
    outputs_of,
    outputs_of_tests,
    predict_with,
    typical_history,
)
from creepkit.testing.reports import ConformanceCheck

SAME = 1e-6
"""Relative difference, of the largest value of an output, that counts as none."""


STEPPING = 2e-3
"""By which values may differ that were integrated in other steps, relative as SAME."""


STEPPING_NOISE = 3e-5
"""Of the largest value of an output: by so much neighbouring runs with steps of their own may differ at random."""


SENSITIVITY_TOLERANCE = 0.02
"""Of the largest derivative; beside it, what two steps of the difference disagree by."""


REDUCED_TOLERANCE, REFINED_TOLERANCE = 0.25, 0.1
"""By how much a reduced-order model and a refined predictor may differ, of the largest value of an output."""


UNKNOWN_NUISANCE = "no_such_kind"


STEPS = {"temperature": 0.5, "modulus": 0.01}
"""Of central differences in nuisances; lengths move by half a per cent."""


@dataclass(frozen=True)
class PredictorCase:
    """A predictor with a law, values and tests at which it is checked.

    theta : (1, parameters) internal values. histories : two or more tests of different lengths.
    """

    predictor: Any
    law: CreepLaw
    theta: Floats
    histories: Sequence[History]
    kind: str = "predictor"

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
        using: Any = None,
        law: CreepLaw | None = None,
    ) -> Prediction:
        """A prediction that was checked for shape.

        theta : (candidates, parameters) internal values. nuisances : {kind: (candidates or 1, tests)}.
        """
        return predict_with(
            self.predictor if using is None else using,
            self.law if law is None else law,
            self.theta if theta is None else theta,
            self.histories if histories is None else histories,
            nuisances=nuisances,
            sensitivities=sensitivities,
        )


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


def check_shapes(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Arrays are of the shapes and types asked for; values are finite up to a row's end, and NaN beyond."""
    found = case.predict(case.candidates)
    sizes = ", ".join(str(h.times.size) for h in case.histories)
    yield ConformanceCheck("shapes", True, f"{len(case.candidates)} candidates, tests of {sizes} times")
    if (found.status[0] == Status.OUTSIDE_CLASS).all():
        detail = f"{found.reason or 'the law is outside its class'}; give law= and values= that it knows"
        yield ConformanceCheck("predicts the law", False, detail)
        return
    ended = found.status[0] != int(Status.COMPLETE)
    outside = found.status[0] == int(Status.OUTSIDE_DOMAIN)
    if (ended & ~outside).any():
        k = int(np.flatnonzero(ended & ~outside)[0])
        detail = (
            f"test '{case.histories[k].name}' ended at {found.end_times[0, k]:g} s, "
            f"{Status(int(found.status[0, k])).text}"
            f"{f': {found.reason}' if found.reason else ''}; give histories= and values= that last to their end"
        )
        yield ConformanceCheck("a moderate test lasts to its end", False, detail)
    yield _check_ends(case, found)
    yield _check_rest(case, found)


def _check_ends(case: PredictorCase, found: Prediction) -> ConformanceCheck:
    name = "NaN after an end only"
    for c in range(found.status.shape[0]):
        for k, history in enumerate(case.histories):
            values, end = found.of(k, c), float(found.end_times[c, k])
            status, missing = Status(int(found.status[c, k])), np.isnan(values).any(axis=1)
            where = f"test '{history.name}', candidate {c}"
            if np.isinf(values).any():
                return ConformanceCheck(name, False, f"{where}: a value is infinite; end the row there, NaN after it")
            if not np.isnan(found.values[c, k, history.times.size :]).all():
                return ConformanceCheck(name, False, f"{where}: values beyond its last time; pad them with NaN")
            if status in (Status.COMPLETE, Status.OUTSIDE_DOMAIN) and missing.any():
                time = history.times[int(np.argmax(missing))]
                detail = f"{where}: NaN at {time:g} s and status complete; state how and when it ended"
                return ConformanceCheck(name, False, detail)
            before = history.times < end * (1 - 1e-9)
            if status is Status.RUPTURED and (missing & before).any():
                time = history.times[int(np.argmax(missing & before))]
                detail = f"{where}: NaN at {time:g} s, before its end at {end:g} s; values until then are wanted"
                return ConformanceCheck(name, False, detail)
            after = history.times > end * (1 + 1e-9)
            if status is Status.RUPTURED and (~missing & after).any():
                time = history.times[int(np.argmax(~missing & after))]
                detail = f"{where}: values at {time:g} s, after its end at {end:g} s; NaN is wanted there"
                return ConformanceCheck(name, False, detail)
    ended = int((found.status != int(Status.COMPLETE)).sum())
    return ConformanceCheck(name, True, f"{ended} of {found.status.size} rows ended early")


def _check_rest(case: PredictorCase, found: Prediction) -> ConformanceCheck:
    starts = [(k, h) for k, h in enumerate(case.histories) if h.times[0] == 0.0]
    for k, history in starts:
        bad = [str(o) for o, v in zip(found.outputs, found.of(k)[0], strict=True) if not np.isfinite(v)]
        if bad:
            detail = f"test '{history.name}': {bad[0]} is not finite at time zero; state what is seen at rest"
            return ConformanceCheck("finite at time zero", False, detail)
    return ConformanceCheck("finite at time zero", True, f"{len(starts)} tests")


def check_batches(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Candidates and tests together are what each is alone; the same call gives the same numbers; copies too."""
    thetas = case.candidates[:2]
    together = case.predict(thetas)
    gap, where = 0.0, ""
    for c in range(len(thetas)):
        for k, history in enumerate(case.histories):
            alone = case.predict(thetas[c : c + 1], [history])
            difference = largest_difference(alone.of(0), together.of(k, c))
            if difference > gap:
                gap, where = difference, f" at test '{history.name}', candidate {c}"
    detail = f"{gap:.1e}{where}" + ("" if gap <= SAME else "; one row must not depend on the others")
    yield ConformanceCheck("a batch equals one by one", gap <= SAME, detail)
    again = case.predict(thetas)
    same = np.array_equal(again.values, together.values, equal_nan=True)
    detail = "equal to the last bit" if same else "two calls differ; take no random numbers and keep no state"
    yield ConformanceCheck("deterministic", same, detail)
    copy = pickle.loads(pickle.dumps(case.predictor))
    gap = largest_difference(together.values, case.predict(thetas, using=copy).values)
    detail = f"{gap:.1e}" + ("" if gap <= SAME else "; a copy in another process must predict the same")
    yield ConformanceCheck("pickles", gap <= SAME, detail)


def check_sensitivities(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Derivatives to the law's internal parameters against central differences."""
    history = case.histories[:1]
    found = case.predict(histories=history, sensitivities=True)
    if found.jacobian is None:
        yield ConformanceCheck("sensitivities", True, "none, differences are taken in their place")
        return
    plain = case.predict(histories=history)
    gap = largest_difference(plain.values, found.values)
    detail = f"{gap:.1e}" + ("" if gap <= STEPPING else "; sensitivities=True must not change the values")
    yield ConformanceCheck("values with sensitivities", gap <= STEPPING, detail)
    steps = np.where(case.law.log_scale, 0.02, 5e-3 * np.maximum(1.0, np.abs(case.theta[0])))
    shifts = np.concatenate([sign * np.diag(steps) for sign in (1, -1, 2, -2)])
    values = case.predict(case.theta + shifts, history).values[:, 0].reshape(4, steps.size, *found.values.shape[2:])
    worst, of = 0.0, ""
    for p, name in enumerate(case.law.names):
        excess = _excess(found.jacobian[0, 0, ..., p], values[:, p], steps[p])
        if excess > worst:
            worst, of = excess, name
    passed = worst <= SENSITIVITY_TOLERANCE
    detail = f"{worst:.1e} beyond what differences leave open" if passed else (
        f"the derivative to {of} is off by {worst:.2g} of its largest value; it is to the internal parameter, the "
        "natural logarithm where the scale is log"
    )  # fmt: skip
    yield ConformanceCheck("sensitivities to the law", passed, detail)


def _excess(derivative: Floats, values: Floats, step: float) -> float:
    """Largest error of a derivative, relative, beyond what differences of two sizes disagree by.

    derivative : (times, outputs). values : (4, times, outputs) at steps 1, -1, 2 and -2.
    """
    narrow, wide = (values[0] - values[1]) / (2 * step), (values[2] - values[3]) / (4 * step)
    error = np.nanmax(np.abs(derivative - narrow), axis=0, initial=0.0)
    doubt = np.nanmax(np.abs(narrow - wide), axis=0, initial=0.0)
    size = np.nanmax(np.abs(narrow), axis=0, initial=0.0)
    noise = STEPPING_NOISE * np.nanmax(np.abs(values), axis=(0, 1), initial=0.0) / step
    if not np.isfinite(derivative[np.isfinite(narrow)]).all():
        return float("inf")
    return float(np.max(np.maximum(error - 2 * doubt - noise, 0.0) / np.maximum(size, 1e-300)))


def nuisance_value(case: PredictorCase, kind: str) -> tuple[float, float]:
    """A value of a nuisance in the middle of what happens, and the step of differences in it."""
    length = dimension_named(case.predictor, kind)
    if length is None:
        return (2.0, STEPS["temperature"]) if kind == "temperature" else (0.02, STEPS.get(kind, 0.005))
    low, high = length.bounds
    step = 0.002 * length.default
    for factor in (1.01, 0.99):
        value = float(np.clip(factor * length.default, low, high))
        try:
            case.predict(histories=case.histories[:1], nuisances={kind: np.array([[value + 2 * step]])})
        except CreepkitError:
            continue  # two lengths may bound one another
        if value != length.default:
            return value, step
    return float(length.default), step


def check_nuisances(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Each declared kind is taken, with its derivative where that is given; another kind is refused."""
    history = case.histories[:1]
    plain = case.predict(histories=history)
    for kind in getattr(case.predictor, "nuisances", ()):
        value, step = nuisance_value(case, kind)
        found = case.predict(histories=history, nuisances={kind: np.array([[value]])}, sensitivities=True)
        effect = largest_difference(plain.values, found.values)
        is_length = dimension_named(case.predictor, kind) is not None
        if is_length and effect == 0.0:
            detail = "no output depends on this length; let predict() follow it, or leave it out of the record"
            yield ConformanceCheck(f"nuisance {kind}", False, detail)
            continue
        detail = f"changes outputs by {effect:.1e}" if effect else "taken; no output depends on it here"
        slope = found.nuisance_jacobian.get(kind)
        if slope is not None:
            values = np.array([[value + sign * step] for sign in (1, -1, 2, -2)])
            moved = case.predict(np.repeat(case.theta, 4, axis=0), history, {kind: values}).values[:, 0]
            excess = _excess(slope[0, 0], moved, step)
            if not excess <= SENSITIVITY_TOLERANCE:
                detail = f"its derivative is off by {excess:.2g} of the largest; it is to the value in its own unit"
                yield ConformanceCheck(f"nuisance {kind}", False, detail)
                continue
            detail += f", derivative {excess:.1e} beyond what differences leave open"
        yield ConformanceCheck(f"nuisance {kind}", True, detail)
    yield must_refuse(
        "an undeclared nuisance is refused",
        lambda: case.predict(histories=history, nuisances={UNKNOWN_NUISANCE: np.array([[0.1]])}),
        f"nuisance '{UNKNOWN_NUISANCE}' is taken in silence; call creepkit.records.check_nuisances() in predict()",
    )


def must_refuse(name: str, call: Any, remedy: str) -> ConformanceCheck:
    """Whether a call raises an error of creepkit's, of one line; remedy : what to say where it raises none."""
    try:
        call()
    except CreepkitError as error:
        text = str(error)
        if "raised TypeError" in text and UNKNOWN_NUISANCE not in text:
            return ConformanceCheck(name, False, f"{text}; take nuisances= and sensitivities= in predict()")
        one_line = "\n" not in text
        return ConformanceCheck(
            name, one_line, text if one_line else f"in several lines, {quoted(repr(text), 80)}; say it in one"
        )
    return ConformanceCheck(name, False, remedy)


def check_related_models(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """A reduced-order model and a refined predictor have the same outputs and about the same values."""
    history = case.histories[-1:]
    wanted = case.predict(histories=history)
    for method, limit in (("reduced_order_model", REDUCED_TOLERANCE), ("refined", REFINED_TOLERANCE)):
        if not hasattr(case.predictor, method):
            continue
        model = getattr(case.predictor, method)()
        found = case.predict(histories=history, using=model)
        if tuple(found.outputs) != tuple(wanted.outputs):
            detail = f"it predicts {', '.join(found.outputs)}; it must predict {', '.join(wanted.outputs)}"
            yield ConformanceCheck(f"{method}()", False, detail)
            continue
        last = largest_difference(wanted.of(0)[-1:], found.of(0)[-1:])
        detail = f"{last:.1e} off at the last time" + (
            "" if last <= limit else f"; {limit:g} is allowed, relative to the output"
        )
        yield ConformanceCheck(f"{method}()", last <= limit, detail)


def check_outputs(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Outputs have names, and of a specimen a quantity, unit and noise."""
    outputs = tuple(getattr(case.predictor, "outputs", ()))
    if not outputs:
        yield ConformanceCheck("outputs", False, "none; state outputs = (ck.Output('deflection', 'length'),)")
        return
    plain = [str(o) for o in outputs if not isinstance(o, Output)]
    if plain and case.kind == "specimen":
        detail = f"'{plain[0]}' is a plain name; write ck.Output('{plain[0]}', 'length') with its quantity"
        yield ConformanceCheck("outputs", False, detail)
        return
    units = [f"{o} in {o.unit or 'no unit'}" if isinstance(o, Output) else str(o) for o in outputs]
    detail = ", ".join(units[:4]) + ("" if len(units) <= 4 else f" and {len(units) - 4} more")
    yield ConformanceCheck("outputs", True, detail)
    stated = outputs_of_tests(case.predictor, case.histories)
    if unknown := [name for name in stated if name not in outputs_of(case.predictor)]:
        detail = f"outputs_of_test() gives '{unknown[0]}'; name it among outputs or optional_outputs"
        yield ConformanceCheck("outputs_of_test()", False, detail)


def default_histories(predictor: object) -> list[History]:
    """Two tests of different lengths and loads, from the record of a specimen."""
    first = typical_history(predictor, frames=20)
    second = typical_history(predictor, level=0.45, frames=11, end=0.6 * float(first.times[-1]))
    return [first, second.replace(name=f"{second.name}, shorter")]
