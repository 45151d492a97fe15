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
    return registry.default().law(name)


def laws() -> dict[str, CreepLaw]:
    """Return every law that is known: {name: law}."""
    return {name: found.value for name, found in registry.default().laws().items()}


def specimen(name: str) -> Specimen:
    """Return the specimen called `name`: one of `specimens()`."""
    return registry.default().specimen(name)


def specimens() -> dict[str, Specimen]:
    """Return every specimen that is known: {name: specimen}."""
    return {name: found.value for name, found in registry.default().specimens().items()}


# ---- what is given -------------------------------------------------------------------------------------------------


def law_given(given: CreepLaw | str) -> CreepLaw:
    """The law itself, or the one of that name."""
    if isinstance(given, str):
        return law(given)
    if not hasattr(given, "terms"):
        raise LawError(f"a creep law or its name is needed, found {type(given).__name__}")
    return given


def predictor_given(given: Predictor | str) -> Predictor:
    """The predictor itself, or the specimen of that name."""
    if isinstance(given, str):
        return specimen(given)
    if not hasattr(given, "predict"):
        raise SolveError(f"a specimen, its name or another predictor is needed, found {type(given).__name__}")
    return given


def histories_given(given: Sequence[History]) -> list[History]:
    """The histories as a list; FitError for what is none."""
    if isinstance(given, (str, Path, History)):
        raise FitError("histories must be a list of them: read_histories(path) returns one, [history] makes one")
    histories = list(given)
    strangers = [type(h).__name__ for h in histories if not isinstance(h, History)]
    if strangers:
        raise FitError(f"histories must be a list of them, found {strangers[0]} in it; use read_histories(path)")
    return histories


def predictors_given(given: Predictor | str | Mapping[str, Predictor | str]) -> Predictor | dict[str, Predictor]:
    """One predictor, or one for each specimen."""
    if isinstance(given, Mapping):
        return {name: predictor_given(one) for name, one in given.items()}
    return predictor_given(given)


def specimens_of(histories: Sequence[History]) -> Predictor | dict[str, Predictor]:
    """The specimen that the histories name, or all of them by name."""
    names = sorted({h.specimen for h in histories})
    if not names:
        raise FitError("there are no histories to identify a law from")
    return specimen(names[0]) if len(names) == 1 else {name: specimen(name) for name in names}
