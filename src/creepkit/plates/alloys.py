"""The tests of each alloy, and what is wrong with them before any identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.errors import FitError
from creepkit.inverse.growth import detect_creep, distinct_loads
from creepkit.inverse.scales import LOGARITHMIC_OUTPUTS
from creepkit.inverse.together import CompositePredictor, predictor_for
from creepkit.records import History, Predictor


@dataclass(frozen=True)
class Alloy:
    """An alloy and all its tests, which are identified together."""

    name: str
    tests: tuple[History, ...]


def group_by_alloy(histories: Sequence[History]) -> tuple[Alloy, ...]:
    """The alloys in the order of their first tests; a test that names no alloy is one by itself."""
    tests_by_alloy: dict[str, list[History]] = {}
    for history in histories:
        tests_by_alloy.setdefault(history.alloy or history.name, []).append(history)
    return tuple(Alloy(name, tuple(tests)) for name, tests in tests_by_alloy.items())


def check_tests(alloy: Alloy, predictor: Predictor) -> None:
    """FitError, in one sentence, for tests that do not belong together, lack an output, or show no creep."""
    _check_specimens(alloy, predictor)
    creep_outputs = [(test, _creep_output(test, predictor)) for test in alloy.tests]
    for test, output in creep_outputs:
        if output not in test.outputs or not np.isfinite(test.outputs[output][test.used]).any():
            raise FitError(
                f"alloy '{alloy.name}': test '{test.name}' has no {output}, without which creep cannot be told; it has "
                f"{', '.join(test.outputs) or 'no output'}"
            )
    _check_creep(alloy, creep_outputs)


def limitations(alloy: Alloy, predictor: Predictor) -> tuple[str, ...]:
    """What the tests of an alloy leave open, whatever is identified from them."""
    notes, tests = [], alloy.tests
    if len(tests) == 1:
        notes.append("one test: how dimples or bars of this alloy differ cannot be known from it")
    if len(distinct_loads(tests)) == 1:
        notes.append("one level of load: strain and time hardening are nearly the same law then")
    if len({round(float(v)) for t in tests for v in t.temperature_program().values}) == 1:
        notes.append("one temperature: the activation energy cannot be known")
    specimens = sorted({t.specimen for t in tests})
    if len(specimens) > 1:
        notes.append(f"tests of several specimens ({', '.join(specimens)}) are identified together")
    for name in getattr(predictor_for(predictor, tests[0]), "outputs", ())[1:]:
        lacking = [t.name for t in tests if name not in t.outputs]
        if lacking:
            notes.append(f"no {name} in {len(lacking)} of {len(tests)} tests: the stress exponent is known the less")
    return tuple(notes)


def _check_specimens(alloy: Alloy, predictor: Predictor) -> None:
    """One predictor serves one specimen; several need one each."""
    specimens = sorted({test.specimen for test in alloy.tests})
    if isinstance(predictor, CompositePredictor):
        unpredicted = [kind for kind in specimens if kind not in predictor.predictors]
        remedy = f"using= names predictors for {', '.join(predictor.predictors)}; add it" if unpredicted else ""
    else:
        specimen_name = getattr(getattr(predictor, "specimen", predictor), "name", specimens[0])
        unpredicted = [kind for kind in specimens if kind != specimen_name]
        remedy = f"using= predicts {specimen_name}; give using= a predictor for each, or screen them apart"
    if unpredicted:
        problem = "its tests are of different specimens" if len(specimens) > 1 else "its tests are of another specimen"
        raise FitError(f"alloy '{alloy.name}': {problem} ({', '.join(specimens)}) and {remedy}")


def _check_creep(alloy: Alloy, creep_outputs: Sequence[tuple[History, str]]) -> None:
    detections = [(output, detect_creep(test, output)) for test, output in creep_outputs if output not in LOGARITHMIC_OUTPUTS]
    if not detections or len(detections) < len(alloy.tests) or any(g.shows_creep for _, g in detections):
        return
    output, largest = max(detections, key=lambda pair: pair[1].increase)
    raise FitError(
        f"alloy '{alloy.name}': elastic only, there is no creep to identify: its {output} grows by {largest.increase:.2g} "
        f"while the load is held, within its noise of {largest.noise:.2g}; test it longer, hotter or at a higher load"
    )


def _creep_output(test: History, predictor: Predictor) -> str:
    """The output that grows with creep."""
    outputs = getattr(predictor_for(predictor, test), "outputs", ())
    return str(outputs[0]) if outputs else next(iter(test.outputs), "output")
