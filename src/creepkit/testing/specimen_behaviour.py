"""Checks of what a specimen makes of steps of its load and of laws, and that it is a frozen record."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.language import Param, parameters, stress
from creepkit.language.law import CreepLaw
from creepkit.records import Load, Loading, PointLoading, Prediction, loading_of, loads_of, typical_history
from creepkit.registry import default_registry
from creepkit.testing.predictor_checks import STEPPING, PredictorCase, largest_difference
from creepkit.testing.reports import ConformanceCheck
from creepkit.testing.usual_law import is_crash, norton_at, prediction_or_refusal

LEVELS = (0.8, 1.0, 0.85)
"""Of a load with steps, relative to the typical one: neither its first nor its last level is the largest."""


STEP_TIMES = (0.0, 0.3, 0.6)
"""When the levels begin, relative to the duration of the test."""


FOLLOWED = 1e-3
"""By so much, of the largest value of an output, a test with steps differs from one in which a level is held."""


def check_load_steps(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """A load that steps up and down is followed, or refused in a sentence; before its first step nothing shows it."""
    loads: tuple[Any, ...] = loads_of(case.predictor)
    for load in loads:
        if not isinstance(load, Load):
            return  # check_loads() says so
        name = f"steps of load {load.name}"
        plan = typical_history(case.predictor, load.name, frames=7)
        value, end = _held_value(plan.loading), float(plan.times[-1])
        steps = [(share * end, level * value) for share, level in zip(STEP_TIMES, LEVELS, strict=True)]
        held = [plan.replace(loading=_loading(load, [(0.0, level * value)])) for level in LEVELS]
        tested = plan.replace(loading=_loading(load, steps))
        try:
            stepped = prediction_or_refusal(partial(case.predict, histories=[tested]))
        except CreepkitError as error:
            yield _refusal(name, error, "say in a SolveError that only a load that is held can be predicted")
            continue
        alone = [case.predict(histories=[test]).of(0) for test in held]
        followed = _followed(name, stepped, alone, [level * value for level in LEVELS], load)
        yield followed
        if not followed.passed:
            continue
        before = plan.times < STEP_TIMES[1] * end
        gap = largest_difference(stepped.of(0)[before], alone[0][before])
        detail = f"{gap:.1e}" + ("" if gap <= STEPPING else "; what is seen before a step must not depend on it")
        yield ConformanceCheck(f"before a step of load {load.name}", gap <= STEPPING, detail)


def _followed(name: str, stepped: Prediction, held: list[Floats], values: list[float], load: Load) -> ConformanceCheck:
    for alone, value in zip(held, values, strict=True):
        if largest_difference(stepped.of(0), alone) <= FOLLOWED:
            detail = (
                f"a test of steps is simulated as one of {value:.4g} {load.unit} held; follow "
                "history.loading.program() over time, or refuse such a loading with a SolveError"
            )
            return ConformanceCheck(name, False, detail)
    return ConformanceCheck(name, True, "followed")


def _held_value(loading: Loading) -> float:
    """The level that a typical test holds, in the unit of the load."""
    if isinstance(loading, PointLoading):
        return float(loading.stress["11"].values[-1])
    return float(loading.program().values[-1])


def _loading(load: Load, steps: list[tuple[float, float]]) -> Loading:
    """Steps (s, value) of a load; other than of a bar or a point after ramps of 5 s."""
    if load.name == "components":
        return PointLoading(stress={"11": steps})
    return loading_of(load.name, steps, ramp=0.0 if load.name in ("stress", "strain") else 5.0)


def _refusal(name: str, error: CreepkitError, remedy: str) -> ConformanceCheck:
    """A refusal in a sentence passes; an exception of the plugin's code does not."""
    text = " ".join(str(error).split())
    if is_crash(error):
        return ConformanceCheck(name, False, f"{text}; {remedy}")
    return ConformanceCheck(name, True, f"refused: {text}")


def check_other_laws(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Norton's law under other names of its parameters, and half of it doubled, is predicted as Norton's, or refused.

    A specimen that reads values["A"] for itself fails at the first and is wrong by a factor of two at the second.
    """
    history = case.histories[0]
    rate, values = norton_at(case.predictor, history)
    wanted: Floats | None = None
    norton = default_registry().law("norton")
    twice = _norton_like("norton-doubled", "A", "n", 2.0)
    renamed = _norton_like("norton-renamed", "B", "m", 1.0)
    for law, own, what in (
        (norton, values, "Norton's law"),
        (renamed, {"B": rate, "m": 4.0}, "a law with other parameters"),
        (twice, {"A": 0.5 * rate, "n": 4.0}, "another law with the same parameters"),
    ):
        try:
            theta = law.to_internal(law.values(own))
            found = prediction_or_refusal(partial(case.predict, theta, [history], law=law)).of(0)
        except CreepkitError as error:
            yield _refusal(what, error, "integrate the law that is given, or refuse all but those known")
            continue
        if wanted is None:
            wanted = found
            continue
        gap = largest_difference(wanted, found)
        detail = f"{gap:.1e}" + (
            ""
            if gap <= STEPPING
            else f" off, with {law.name}; use the rate of the law that is given, ck.lower(law, 'numpy').rate(), or "
            "refuse every law but the one known: if law != ck.law('norton')"
        )
        yield ConformanceCheck(what, gap <= STEPPING, detail)


def _norton_like(name: str, coefficient: str, exponent: str, factor: float) -> CreepLaw:
    """Norton's law with names of its own, times a factor."""
    A, n = parameters(f"{coefficient} {exponent}")
    return CreepLaw(
        name=name,
        title="Norton's law for a check of specimens",
        terms={"creep": factor * A * stress**n},
        params={
            A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
            n: Param("stress exponent", bounds=(1, 8)),
        },
        references=("F. H. Norton (1929), The Creep of Steel at High Temperatures",),
    )


def check_frozen(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """The record cannot change, is a key of dictionaries, and a copy with the same fields equals it."""
    specimen: Any = case.predictor
    settings = getattr(type(specimen), "__dataclass_params__", None)
    if settings is not None and not settings.frozen:
        kind = type(specimen).__name__
        detail = f"{kind} can be changed after it was made; write @dataclass(frozen=True) over its class"
        yield ConformanceCheck("frozen", False, detail)
        return
    try:
        hash(specimen)
    except TypeError as error:
        detail = f"{error}; a specimen is a key of dictionaries: let every field be hashable, a tuple for a list"
        yield ConformanceCheck("frozen", False, detail)
        return
    if settings is not None and hasattr(specimen, "replace"):
        lengths = {length.name: length.default for length in getattr(specimen, "dimensions", ())}
        same = specimen.replace(**{name: value for name, value in lengths.items() if hasattr(specimen, name)})
        if same != specimen or hash(same) != hash(specimen):
            yield ConformanceCheck("frozen", False, "replace() with its own lengths gives another specimen")
            return
    yield ConformanceCheck("frozen", True, "hashable; a copy with the same lengths is equal")
