"""Checks of a specimen's own record: its name, loads, lengths and reference stress."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.records import (
    Dimension,
    Load,
    Program,
    RecordedLoading,
    Status,
    dimensions_of,
    loads_of,
    predict_with,
    typical_history,
)
from creepkit.registry import default_registry
from creepkit.testing.predictor_checks import SAME, PredictorCase, largest_difference, must_refuse, nuisance_value
from creepkit.testing.reports import ConformanceCheck

NAME_OF_RECORD = re.compile(r"[a-z0-9]+([-_][a-z0-9]+)*")


UNKNOWN_LOAD, UNKNOWN_LENGTH = "no_such_load", "no_such_length"


def check_record_name(subject: Any, kind: str) -> Iterator[ConformanceCheck]:
    """Name and title are texts of the stated pattern, and no other plugin has the name."""
    name, title = subject.name, subject.title
    if not (isinstance(name, str) and NAME_OF_RECORD.fullmatch(name)):
        detail = f"{name!r} is not in small letters and digits joined by hyphens, such as four-point; rename it"
        yield ConformanceCheck("name", False, detail)
        return
    if not (isinstance(title, str) and title.strip() and title.isprintable()):
        yield ConformanceCheck("title", False, f"{title!r} is not one line of text; say what it is")
        return
    for plugin in default_registry().plugins():
        other = plugin.contributions.get(kind, {}).get(name)
        if other is not None and not _same_class(type(other), type(subject)):
            detail = f"'{name}' is taken, by {plugin.provenance}; give the {kind} another name"
            yield ConformanceCheck("name", False, detail)
            return
    yield ConformanceCheck("name and title", True, f"{name}: {title}")


def _same_class(first: type, second: type) -> bool:
    """Whether two classes are one, or one of them is the other loaded from the same file as a plugin."""
    files = [getattr(sys.modules.get(one.__module__), "__file__", None) for one in (first, second)]
    same_file = None not in files and os.path.realpath(str(files[0])) == os.path.realpath(str(files[1]))
    return first is second or (first.__qualname__ == second.__qualname__ and same_file)


def check_loads(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Every load that is declared works, and another is refused."""
    loads: tuple[Any, ...] = loads_of(case.predictor)
    if not loads:
        yield ConformanceCheck("loads", False, "none is declared; state loads = (ck.Load('force', 'force'),)")
        return
    for load in loads:
        if not isinstance(load, Load):
            yield ConformanceCheck("loads", False, f"{load!r} is no load; write ck.Load('force', 'force')")
            return
        plan = typical_history(case.predictor, load.name, frames=8)
        found = predict_with(case.predictor, case.law, case.theta, [plan])
        status = Status(int(found.status[0, 0]))
        passed = status is Status.COMPLETE and bool(np.isfinite(found.of(0)).all())
        detail = f"{load.quantity} in {load.unit or 'no unit'}" if passed else (
            f"a typical test ends early, {status.text}{f': {found.reason}' if found.reason else ''}; state the range "
            f"of this load, conditions = {{'{load.name}': (low, high)}}"
        )  # fmt: skip
        yield ConformanceCheck(f"load {load.name}", passed, detail)
    other = case.histories[0].replace(loading=RecordedLoading(Program.constant(1.0), UNKNOWN_LOAD))
    yield must_refuse(
        "an undeclared load is refused",
        lambda: _predicted_or_refused(case, other),
        f"a test under '{UNKNOWN_LOAD}' is simulated; call creepkit.records.check_load() in predict()",
    )


def check_dimensions(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """Each length is followed when a test states it, as it is when it is a nuisance parameter."""
    history = case.histories[0]
    plain = case.predict(histories=[history]).values
    lengths: tuple[Any, ...] = dimensions_of(case.predictor)
    kinds = getattr(case.predictor, "nuisances", ())
    for length in lengths:
        if not isinstance(length, Dimension):
            yield ConformanceCheck("lengths", False, f"{length!r} is none; write ck.dimension(50.0) for a field")
            return
        name = f"length {length.name}"
        as_nuisance = next((kind for kind in length.names if kind in kinds), None)
        if as_nuisance is None:
            yield ConformanceCheck(name, False, f"it is no nuisance parameter; add '{length.name}' to nuisances")
            continue
        if not length.of_piece:
            yield ConformanceCheck(name, True, "of the observation; no test states it as geometry")
            continue
        value, _ = nuisance_value(case, length.name)
        stated = history.replace(geometry={**history.geometry, length.name: value})
        found = case.predict(histories=[stated]).values
        if largest_difference(plain, found) == 0.0:
            detail = (
                f"a test that states {value:g} mm is simulated as one of {length.default:g} mm; follow its geometry"
            )
            yield ConformanceCheck(name, False, detail)
            continue
        other = case.predict(histories=[history], nuisances={as_nuisance: np.array([[value]])}).values
        gap = largest_difference(found, other)
        detail = f"{gap:.1e}" + ("" if gap <= SAME else "; geometry and nuisance parameter of one length differ")
        yield ConformanceCheck(f"{name} stated and as a nuisance", gap <= SAME, detail)
    if lengths:
        foreign = history.replace(geometry={UNKNOWN_LENGTH: 1.0})
        yield must_refuse(
            "an unknown length is refused",
            lambda: _predicted_or_refused(case, foreign),
            f"a test that states '{UNKNOWN_LENGTH}' is simulated; call creepkit.records.check_geometry() in predict()",
        )


def _predicted_or_refused(case: PredictorCase, history: Any) -> None:
    """Predict; a candidate that did not converge for a stated reason is a refusal as well."""
    found = case.predict(histories=[history])
    if found.reason and (found.status == int(Status.NOT_CONVERGED)).all():
        raise CreepkitError(found.reason)


def check_reference_stress(case: PredictorCase) -> Iterator[ConformanceCheck]:
    """The stress that stands for a test is positive, MPa."""
    if not hasattr(case.predictor, "reference_stress"):
        if {load.name for load in loads_of(case.predictor)} == {"stress"}:
            yield ConformanceCheck("reference stress", True, "the load itself, MPa")
            return
        detail = "reference_stress(history) is missing; return the von Mises stress, MPa, that stands for a test"
        yield ConformanceCheck("reference stress", False, detail)
        return
    stress = np.atleast_1d(np.asarray(case.predictor.reference_stress(case.histories[0]), float))
    passed = stress.size > 0 and bool((np.isfinite(stress) & (stress > 0)).all())
    shown = ", ".join(f"{value:.4g}" for value in stress[:3])
    detail = f"{shown} MPa" + ("" if passed else "; return finite stresses above zero")
    yield ConformanceCheck("reference stress", passed, detail)
