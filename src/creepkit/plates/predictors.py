"""Predictors as worker processes need them: on one thread, and with a fingerprint."""

from __future__ import annotations

import hashlib
import json
import pickle
from dataclasses import replace
from typing import Any

from creepkit.dataset.specimen_document import specimen_document
from creepkit.errors import DatasetError
from creepkit.inverse.together import Together
from creepkit.records import Predictor


def on_one_thread(predictor: Predictor) -> Predictor:
    """The same predictor, which starts no threads."""
    one: Any = predictor
    if isinstance(one, Together):
        return Together({name: on_one_thread(p) for name, p in one.predictors.items()})
    if _is_surrogate(one):
        told = replace(one.told, specimen=on_one_thread(one.told.specimen))
        return one.recipe.surrogate(one.module, told)  # type: ignore[no-any-return]
    if getattr(one, "threads", 1) == 1:
        return predictor
    return one.replace(threads=1)  # type: ignore[no-any-return]


def specimen_behind(predictor: Predictor) -> Predictor:
    """What a surrogate or a stand-in says that it stands for; anything else is taken for the specimen itself."""
    one: Any = predictor
    if isinstance(one, Together):
        return Together({name: specimen_behind(p) for name, p in one.predictors.items()})
    return getattr(one, "specimen", predictor)


def fingerprint_of(predictor: Predictor) -> str:
    """The same for predictors that predict the same, as far as their records tell, on however many threads."""
    return hashlib.sha256(_described(on_one_thread(predictor))).hexdigest()[:16]


def _described(predictor: Predictor) -> bytes:
    one: Any = predictor
    if isinstance(one, Together):
        return b"".join(name.encode() + _described(p) for name, p in sorted(one.predictors.items()))
    if _is_surrogate(one):
        weights = b"".join(tensor.detach().numpy().tobytes() for tensor in one.module.state_dict().values())
        return json.dumps(one.header, sort_keys=True).encode() + weights
    try:
        return json.dumps(specimen_document(one), sort_keys=True).encode()
    except (DatasetError, AttributeError):  # a mesh of its own, or no record at all
        return pickle.dumps(predictor)


def _is_surrogate(one: Any) -> bool:
    """Whether it is a surrogate.Surrogate; asking by class would load torch for everybody."""
    return all(hasattr(one, name) for name in ("recipe", "module", "told"))
