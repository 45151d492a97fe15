"""Nouns by name, and what a verb makes of what it is given: a law or its name, a specimen or its name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit import registry
from creepkit.errors import FitError, LawError, SolveError
from creepkit.records import History, Predictor, Specimen

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


def law(name: str) -> CreepLaw:
    """Return the law called `name`: one of `laws()`."""
    return registry.default_registry().law(name)


def laws() -> dict[str, CreepLaw]:
    """Return every law that is known: {name: law}."""
    return {name: entry.value for name, entry in registry.default_registry().laws().items()}


def specimen(name: str) -> Specimen:
    """Return the specimen called `name`: one of `specimens()`."""
    return registry.default_registry().specimen(name)


def specimens() -> dict[str, Specimen]:
    """Return every specimen that is known: {name: specimen}."""
    return {name: entry.value for name, entry in registry.default_registry().specimens().items()}


# ---- what is given -------------------------------------------------------------------------------------------------


def resolve_law(law_or_name: CreepLaw | str) -> CreepLaw:
    """The law itself, or the one of that name."""
    if isinstance(law_or_name, str):
        return law(law_or_name)
    if not hasattr(law_or_name, "terms"):
        raise LawError(f"a creep law or its name is needed, found {type(law_or_name).__name__}")
    return law_or_name


def resolve_predictor(predictor_or_name: Predictor | str) -> Predictor:
    """The predictor itself, or the specimen of that name."""
    if isinstance(predictor_or_name, str):
        return specimen(predictor_or_name)
    if not hasattr(predictor_or_name, "predict"):
        raise SolveError(f"a specimen, its name or another predictor is needed, found {type(predictor_or_name).__name__}")
    return predictor_or_name


def check_histories(values: Sequence[History]) -> list[History]:
    """The histories as a list; FitError for what is none."""
    if isinstance(values, (str, Path, History)):
        raise FitError("histories must be a list of them: read_histories(path) returns one, [history] makes one")
    histories = list(values)
    wrong_types = [type(h).__name__ for h in histories if not isinstance(h, History)]
    if wrong_types:
        raise FitError(f"histories must be a list of them, found {wrong_types[0]} in it; use read_histories(path)")
    return histories


def resolve_predictors(predictors: Predictor | str | Mapping[str, Predictor | str]) -> Predictor | dict[str, Predictor]:
    """One predictor, or one for each specimen."""
    if isinstance(predictors, Mapping):
        return {name: resolve_predictor(predictor) for name, predictor in predictors.items()}
    return resolve_predictor(predictors)


def specimens_of_histories(histories: Sequence[History]) -> Predictor | dict[str, Predictor]:
    """The specimen that the histories name, or all of them by name."""
    names = sorted({h.specimen for h in histories})
    if not names:
        raise FitError("there are no histories to identify a law from")
    return specimen(names[0]) if len(names) == 1 else {name: specimen(name) for name in names}
