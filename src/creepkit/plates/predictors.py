"""Predictors as worker processes need them: on one thread, and with a fingerprint."""

from __future__ import annotations

import hashlib
import json
import pickle
from dataclasses import replace
from typing import Any

from creepkit.dataset.specimen_document import specimen_to_json
from creepkit.errors import DatasetError
from creepkit.inverse.together import CompositePredictor
from creepkit.records import Predictor


def single_threaded(predictor: Predictor) -> Predictor:
    """The same predictor, which starts no threads."""
    untyped: Any = predictor
    if isinstance(untyped, CompositePredictor):
        return CompositePredictor({name: single_threaded(p) for name, p in untyped.predictors.items()})
    if _is_surrogate(untyped):
        metadata = replace(untyped.told, specimen=single_threaded(untyped.told.specimen))
        return untyped.recipe.surrogate(untyped.module, metadata)  # type: ignore[no-any-return]
    if getattr(untyped, "threads", 1) == 1:
        return predictor
    return untyped.replace(threads=1)  # type: ignore[no-any-return]


def underlying_specimen(predictor: Predictor) -> Predictor:
    """What a surrogate or a stand-in says that it stands for; anything else is taken for the specimen itself."""
    untyped: Any = predictor
    if isinstance(untyped, CompositePredictor):
        return CompositePredictor({name: underlying_specimen(p) for name, p in untyped.predictors.items()})
    return getattr(untyped, "specimen", predictor)


def predictor_fingerprint(predictor: Predictor) -> str:
    """The same for predictors that predict the same, as far as their records tell, on however many threads."""
    return hashlib.sha256(_serialised_predictor(single_threaded(predictor))).hexdigest()[:16]


def _serialised_predictor(predictor: Predictor) -> bytes:
    untyped: Any = predictor
    if isinstance(untyped, CompositePredictor):
        return b"".join(name.encode() + _serialised_predictor(p) for name, p in sorted(untyped.predictors.items()))
    if _is_surrogate(untyped):
        weights = b"".join(tensor.detach().numpy().tobytes() for tensor in untyped.module.state_dict().values())
        return json.dumps(untyped.header, sort_keys=True).encode() + weights
    try:
        return json.dumps(specimen_to_json(untyped), sort_keys=True).encode()
    except (DatasetError, AttributeError):  # a mesh of its own, or no record at all
        return pickle.dumps(predictor)


def _is_surrogate(predictor: Any) -> bool:
    """Whether it is a surrogate.Surrogate; asking by class would load torch for everybody."""
    return all(hasattr(predictor, name) for name in ("recipe", "module", "told"))
