"""Checks of a specimen: its own record, what it makes of loads, their steps, lengths and laws."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.language import parameters, stress
from creepkit.language.law import CreepLaw
from creepkit.records import (
    Dimension,
    Load,
    Loading,
    Output,
    PointLoading,
    Program,
    RecordedLoading,
    Status,
    dimensions_of,
    loading_of,
    loads_of,
    typical_history,
)
from creepkit.records.loading import held_otherwise
from creepkit.registry import default_registry
from creepkit.testing.predictor_checks import (
    SAME,
    STEPPING,
    PredictorCase,
    largest_difference,
    norton_at,
    nuisance_value,
    prediction_or_refusal,
    refusal_of,
)
from creepkit.testing.reports import finding

UNKNOWN_LOAD, UNKNOWN_LENGTH = "no_such_load", "no_such_length"


STEPPED = ((0.0, 0.8), (0.3, 1.0), (0.6, 0.85))
"""(time, level) of a load with steps, relative to the duration of the test and the typical level."""


FOLLOWED = 1e-3
"""By so much, of the largest value of an output, a test with steps differs from one in which a level is held."""


@finding("quantities of outputs")
def check_quantities(case: PredictorCase) -> str:
    """Outputs have a quantity, unit and noise."""
    plain = [str(o) for o in case.predictor.outputs if not isinstance(o, Output)]
    assert not plain, f"'{plain[0]}' is a plain name; write ck.Output('{plain[0]}', 'length') with its quantity"
    return "stated"


@finding("reference stress")
def check_reference_stress(case: PredictorCase) -> str:
    """The stress that stands for a test is positive, MPa."""
    if not case.predictor.states("reference_stress"):
        assert {load.name for load in loads_of(case.predictor)} == {"stress"}, (
            "reference_stress(history) is missing; return the von Mises stress, MPa, that stands for a test"
        )
        return "the load itself, MPa"
    found = np.atleast_1d(np.asarray(case.predictor.reference_stress(case.histories[0]), float))
    detail = f"{', '.join(f'{value:.4g}' for value in found[:3])} MPa"
    assert found.size and (np.isfinite(found) & (found > 0)).all(), f"{detail}; return finite stresses above zero"
    return detail


@finding("frozen")
def check_frozen(case: PredictorCase) -> str:
    """The record cannot change, is a key of dictionaries, and a copy with the same fields equals it."""
    specimen: Any = case.predictor
    settings = getattr(type(specimen), "__dataclass_params__", None)
    assert settings is None or settings.frozen, (
        f"{type(specimen).__name__} can be changed after it was made; write @dataclass(frozen=True) over its class"
    )
    try:
        hash(specimen)
    except TypeError as error:
        raise AssertionError(
            f"{error}; a specimen is a key of dictionaries: let every field be hashable, a tuple for a list"
        ) from None
    if settings is not None and hasattr(specimen, "replace"):
        lengths = {length.name: length.default for length in specimen.dimensions}
        same = specimen.replace(**{name: value for name, value in lengths.items() if hasattr(specimen, name)})
        equal = same == specimen and hash(same) == hash(specimen)
        assert equal, "replace() with its own lengths gives another specimen"
    return "hashable; a copy with the same lengths is equal"


@finding("loads")
def check_loads(case: PredictorCase) -> str:
    """Loads are declared, and another is refused."""
    loads: tuple[Any, ...] = loads_of(case.predictor)
    assert loads, "none is declared; state loads = (ck.Load('force', 'force'),)"
    wrong = [load for load in loads if not isinstance(load, Load)]
    assert not wrong, f"{wrong[0]!r} is no load; write ck.Load('force', 'force')"
    other = case.histories[0].replace(loading=RecordedLoading(Program.constant(1.0), UNKNOWN_LOAD))
    return refusal_of(
        lambda: prediction_or_refusal(lambda: case.predict(histories=[other])),
        f"a test under '{UNKNOWN_LOAD}' is simulated; call creepkit.records.check_load() in predict()",
    )


@finding("load {}", each=lambda case: loads_of(case.predictor))
def check_load(case: PredictorCase, load: Load) -> str:
    """Every load that is declared works."""
    plan = typical_history(case.predictor, load.name, frames=8)
    found = case.predictor.predict(case.law, case.theta, [plan])
    status = Status(int(found.status[0, 0]))
    assert status is Status.COMPLETE and np.isfinite(found.of(0)).all(), (
        f"a typical test ends early, {status.text}{f': {found.reason}' if found.reason else ''}; state the range of "
        f"this load, conditions = {{'{load.name}': (low, high)}}"
    )
    told = f"{load.quantity} in {load.unit or 'no unit'}"
    if (other := held_otherwise(plan.loading)) is not None:
        with suppress(CreepkitError):
            swapped = prediction_or_refusal(lambda: case.predict(histories=[plan.replace(loading=other[0])]))
            if largest_difference(found.of(0), swapped.of(0)) <= FOLLOWED:
                told += "; a held load counts as a held true stress here, which under a load grows as exp(strain)"
    return told


@finding("steps of load {}", each=lambda case: loads_of(case.predictor))
def check_load_steps(case: PredictorCase, load: Load) -> str:
    """A load that steps up and down is followed, or refused in a sentence; before its first step nothing shows it."""
    plan = typical_history(case.predictor, load.name, frames=7)
    point = isinstance(plan.loading, PointLoading)
    program = plan.loading.stress["11"] if isinstance(plan.loading, PointLoading) else plan.loading.program()
    value, end = float(program.values[-1]), float(plan.times[-1])
    steps = [(share * end, level * value) for share, level in STEPPED]
    ramp = 0.0 if load.name in ("stress", "strain") else 5.0

    def loading(steps: list[tuple[float, float]]) -> Loading:
        return PointLoading(stress={"11": steps}) if point else loading_of(load.name, steps, ramp=ramp)

    try:
        stepped = prediction_or_refusal(lambda: case.predict(histories=[plan.replace(loading=loading(steps))])).of(0)
    except CreepkitError as error:
        return _refused(error, "say in a SolveError that only a load that is held can be predicted")
    held = [case.predict(histories=[plan.replace(loading=loading([(0.0, level)]))]).of(0) for _, level in steps]
    for alone, (_, level) in zip(held, steps, strict=True):
        assert largest_difference(stepped, alone) > FOLLOWED, (
            f"a test of steps is simulated as one of {level:.4g} {load.unit} held; follow "
            "history.loading.program() over time, or refuse such a loading with a SolveError"
        )
    before = plan.times < steps[1][0]
    gap = largest_difference(stepped[before], held[0][before])
    assert gap <= STEPPING, f"{gap:.1e} before the first step; what is seen before a step must not depend on it"
    return f"followed, {gap:.1e} before the first step"


def _refused(error: CreepkitError, remedy: str) -> str:
    """A refusal in a sentence passes; an exception of the plugin's code, such as a KeyError, does not."""
    text, cause = " ".join(str(error).split()), error.__cause__
    crash = cause is not None and not isinstance(cause, CreepkitError) and type(cause).__name__ in text
    assert not crash, f"{text}; {remedy}"
    return f"refused: {text}"


_OTHER_LAWS = {"a law with other parameters": ("B", "m", 1.0), "another law with the same parameters": ("A", "n", 2.0)}
"""{name: (coefficient, exponent, factor)} of laws that are Norton's."""


@finding("{}", each=lambda case: _OTHER_LAWS)
def check_other_law(case: PredictorCase, name: str) -> str:
    """Norton's law under other names of its parameters, and half of it doubled, is predicted as Norton's, or refused.

    A specimen that reads values["A"] for itself fails at the first and is wrong by a factor of two at the second.
    """
    coefficient, exponent, factor = _OTHER_LAWS[name]
    history, norton = case.histories[0], default_registry().law("norton")
    rate, values = norton_at(case.predictor, history)
    A, n = parameters(f"{coefficient} {exponent}")
    kinds = dict(zip((A, n), norton.params.values(), strict=True))
    law = CreepLaw(name, {"creep": factor * A * stress**n}, kinds, title=name)
    own, predicted = {coefficient: rate / factor, exponent: 4.0}, []
    for one, given in ((norton, values), (law, own)):
        theta = one.to_internal(one.values(given))
        try:
            found = prediction_or_refusal(partial(case.predict, theta, [history], law=one))
        except CreepkitError as error:
            return _refused(error, "integrate the law that is given, or refuse all but those known")
        predicted.append(found.of(0))
    gap = largest_difference(*predicted)
    assert gap <= STEPPING, (
        f"{gap:.1e} off; use the rate of the law that is given, ck.lower(law, 'numpy').rate(), or refuse every law but "
        "the one known: if law != ck.law('norton')"
    )
    return f"{gap:.1e}"


@finding("length {}", each=lambda case: dimensions_of(case.predictor))
def check_length(case: PredictorCase, length: Any) -> str:
    """Each length is followed when a test states it, as it is when it is a nuisance parameter."""
    assert isinstance(length, Dimension), f"{length!r} is none; write ck.dimension(50.0) for a field"
    kinds = case.predictor.nuisances
    kind = next((kind for kind in length.names if kind in kinds), None)
    assert kind is not None, f"it is no nuisance parameter; add '{length.name}' to nuisances"
    if not length.of_piece:
        return "of the observation; no test states it as geometry"
    history, (value, _) = case.histories[0], nuisance_value(case, length.name)
    stated = history.replace(geometry={**history.geometry, length.name: value})
    plain, found = (case.predict(histories=[one]).values for one in (history, stated))
    assert largest_difference(plain, found) > 0.0, (
        f"a test that states {value:g} mm is simulated as one of {length.default:g} mm; follow its geometry"
    )
    other = case.predict(histories=[history], nuisances={kind: np.array([[value]])}).values
    gap = largest_difference(found, other)
    assert gap <= SAME, f"{gap:.1e}; geometry and nuisance parameter of one length differ"
    return f"{gap:.1e} between geometry and nuisance parameter"


@finding("an unknown length is refused")
def check_unknown_length(case: PredictorCase) -> str | None:
    """A test that states a length that there is not is an error."""
    if not dimensions_of(case.predictor):
        return None
    foreign = case.histories[0].replace(geometry={UNKNOWN_LENGTH: 1.0})
    return refusal_of(
        lambda: prediction_or_refusal(lambda: case.predict(histories=[foreign])),
        f"a test that states '{UNKNOWN_LENGTH}' is simulated; call creepkit.records.check_geometry() in predict()",
    )
