"""Arguments of public functions: laws, predictors and histories, given themselves or by the name of a plugin's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from creepkit.errors import FitError
from creepkit.records import History, Predictor, Specimen
from creepkit.registry.plugin_registry import default_registry


def specimen_by_name(name: str) -> Specimen:
    """The registered specimen of a name, or one that was given in this process; SolveError where there is none."""
    registry = default_registry()
    return registry.known_specimens().get(name) or registry.specimen(name)


def resolve_predictor(predictor: Predictor | str) -> Predictor:
    """The predictor itself, or the specimen of that name."""
    if isinstance(predictor, str):
        return specimen_by_name(predictor)
    default_registry().remember(predictor)
    return predictor


def resolve_predictors(
    predictors: Predictor | str | Mapping[str, Predictor | str] | None, histories: Sequence[History]
) -> Predictor | dict[str, Predictor]:
    """One predictor, or {specimen: predictor}; None stands for the specimens that the histories name."""
    if predictors is None:
        names = sorted({h.specimen for h in histories})
        if not names:
            raise FitError("there are no histories to identify a law from")
        specimens = {name: specimen_by_name(name) for name in names}
        return specimens[names[0]] if len(names) == 1 else dict(specimens)
    if isinstance(predictors, Mapping):
        return {name: resolve_predictor(predictor) for name, predictor in predictors.items()}
    return resolve_predictor(predictors)
