"""Fingerprints of what decides an identification: the data of histories, and what a predictor is made of."""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import fields
from typing import Any

import numpy as np

from creepkit.errors import DatasetError
from creepkit.files.json_documents import canonical_json
from creepkit.records import History, Predictor, Program
from creepkit.registry.specimen_documents import specimen_to_json

METADATA_FIELDS = ("source", "labels")
"""Fields of a history that no identification uses."""


def predictor_fingerprint(predictor: Predictor) -> str:
    """SHA-256, shortened, of what decides the predictions of a predictor; the number of threads does not."""
    return hashlib.sha256(_serialised_predictor(predictor.single_threaded())).hexdigest()[:16]


def _serialised_predictor(predictor: Predictor) -> bytes:
    untyped: Any = predictor
    if predictor.parts:
        return b"".join(name.encode() + _serialised_predictor(one) for name, one in sorted(predictor.parts.items()))
    if predictor.is_surrogate:
        weights = b"".join(array.tobytes() for array in untyped.weights.values())
        return canonical_json(untyped.file_header) + weights
    try:
        return canonical_json(specimen_to_json(untyped))
    except (DatasetError, AttributeError):  # a mesh of its own, or no record at all
        return pickle.dumps(predictor)


def history_text(history: History) -> str:
    """All data of a history that an identification uses, for hashing."""
    values = {f.name: getattr(history, f.name) for f in fields(history) if f.name not in METADATA_FIELDS}
    program = history.loading.program()
    loading = (type(history.loading).__name__, _plain_value(program), getattr(history.loading, "control", ""))
    return repr([(name, _plain_value(value)) for name, value in {**values, "loading": loading}.items()])


def _plain_value(value: Any) -> Any:
    """A value whose repr is complete."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Program):
        return value.times.tolist(), value.values.tolist()
    if hasattr(value, "items"):
        return sorted((name, _plain_value(item)) for name, item in value.items())
    return value


def short_hash(data: bytes) -> str:
    """SHA-256, shortened."""
    return hashlib.sha256(data).hexdigest()[:24]
