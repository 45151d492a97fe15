"""The tests of each alloy, and what is wrong with them before any identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.errors import FitError
from creepkit.inverse.growth import growth, levels
from creepkit.inverse.scales import LOGARITHMIC
from creepkit.inverse.together import Together, predictor_of
from creepkit.records import History, Predictor


@dataclass(frozen=True)
class Alloy:
    """An alloy and all its tests, which are identified together."""

    name: str
    tests: tuple[History, ...]


def alloys_of(histories: Sequence[History]) -> tuple[Alloy, ...]:
    """The alloys in the order of their first tests; a test that names no alloy is one by itself."""
    found: dict[str, list[History]] = {}
    for history in histories:
        found.setdefault(history.alloy or history.name, []).append(history)
    return tuple(Alloy(name, tuple(tests)) for name, tests in found.items())


def check(alloy: Alloy, using: Predictor) -> None:
    """FitError, in one sentence, for tests that do not belong together, lack an output, or show no creep."""
    _check_specimens(alloy, using)
    leading = [(test, _leading(test, using)) for test in alloy.tests]
    for test, output in leading:
        if output not in test.outputs or not np.isfinite(test.outputs[output][test.used]).any():
            raise FitError(
                f"alloy '{alloy.name}': test '{test.name}' has no {output}, without which creep cannot be told; it has "
                f"{', '.join(test.outputs) or 'no output'}"
            )
    _check_creep(alloy, leading)


def remarks(alloy: Alloy, using: Predictor) -> tuple[str, ...]:
    """What the tests of an alloy leave open, whatever is identified from them."""
    found, tests = [], alloy.tests
    if len(tests) == 1:
        found.append("one test: how dimples or bars of this alloy differ cannot be known from it")
    if len(levels(tests)) == 1:
        found.append("one level of load: strain and time hardening are nearly the same law then")
    if len({round(float(v)) for t in tests for v in t.temperature_program().values}) == 1:
        found.append("one temperature: the activation energy cannot be known")
    kinds = sorted({t.specimen for t in tests})
    if len(kinds) > 1:
        found.append(f"tests of several specimens ({', '.join(kinds)}) are identified together")
    for name in getattr(predictor_of(using, tests[0]), "outputs", ())[1:]:
        without = [t.name for t in tests if name not in t.outputs]
        if without:
            found.append(f"no {name} in {len(without)} of {len(tests)} tests: the stress exponent is known the less")
    return tuple(found)


def _check_specimens(alloy: Alloy, using: Predictor) -> None:
    """One predictor serves one specimen; several need one each."""
    kinds = sorted({test.specimen for test in alloy.tests})
    if isinstance(using, Together):
        missing = [kind for kind in kinds if kind not in using.predictors]
        advice = f"using= names predictors for {', '.join(using.predictors)}; add it" if missing else ""
    else:
        own = getattr(getattr(using, "specimen", using), "name", kinds[0])
        missing = [kind for kind in kinds if kind != own]
        advice = f"using= predicts {own}; give using= a predictor for each, or screen them apart"
    if missing:
        mixed = "its tests are of different specimens" if len(kinds) > 1 else "its tests are of another specimen"
        raise FitError(f"alloy '{alloy.name}': {mixed} ({', '.join(kinds)}) and {advice}")


def _check_creep(alloy: Alloy, leading: Sequence[tuple[History, str]]) -> None:
    seen = [(output, growth(test, output)) for test, output in leading if output not in LOGARITHMIC]
    if not seen or len(seen) < len(alloy.tests) or any(g.visible for _, g in seen):
        return
    output, most = max(seen, key=lambda pair: pair[1].value)
    raise FitError(
        f"alloy '{alloy.name}': elastic only, there is no creep to identify: its {output} grows by {most.value:.2g} "
        f"while the load is held, within its noise of {most.noise:.2g}; test it longer, hotter or at a higher load"
    )


def _leading(test: History, using: Predictor) -> str:
    """The output that grows with creep."""
    outputs = getattr(predictor_of(using, test), "outputs", ())
    return str(outputs[0]) if outputs else next(iter(test.outputs), "output")
