"""What predicted the tests of an identification, as a file names it, and back; fingerprints of what decides one.

A registered specimen is stored with the fields that decide what it predicts, and its reduced-order model likewise. A
trained surrogate is stored by a fingerprint of its header and weights, anything else by name alone; neither is found
again.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from creepkit.errors import DatasetError, FitError, quoted
from creepkit.files.json_documents import as_read_back, canonical_json
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.records import History, Predictor, Program
from creepkit.registry import default_registry
from creepkit.registry.specimen_documents import specimen_from_json, specimen_to_json


@dataclass(frozen=True)
class PredictorDocument:
    """One predictor: fields are those of a specimen that is registered under the name, or of the specimen whose
    reduced-order model it is; fingerprint, of a surrogate.
    """

    kind: Literal["specimen", "reduced-order model", "surrogate", "other"]
    name: str
    fields: Any = None
    fingerprint: str = ""


OF_SPECIMENS = ("specimen", "reduced-order model")
"""Kinds of documents that name a registered specimen."""


SINGLE = ""
"""The key of a predictor of all tests, in the place of the specimen's name."""


def predictor_documents(predictor: Predictor | None) -> dict[str, PredictorDocument]:
    """{specimen: document} of a composite predictor; of any other one document under SINGLE, of none nothing."""
    if predictor is None:
        return {}
    return {specimen: _document_of(one) for specimen, one in (predictor.parts or {SINGLE: predictor}).items()}


def predictor_from_documents(documents: Mapping[str, PredictorDocument]) -> Predictor | None:
    """The predictor, or None where a part of it is not to be had here; FitError for documents that say nonsense."""
    predictors = {specimen: _predictor_of(document) for specimen, document in documents.items()}
    present = {specimen: one for specimen, one in predictors.items() if one is not None}
    if not predictors or len(present) < len(predictors):
        return None
    return present[SINGLE] if [*present] == [SINGLE] else CompositePredictor(present)


def missing_predictor(documents: Mapping[str, PredictorDocument]) -> str:
    """Why an identification from a file has no predictor, and what to do, in one sentence."""
    for document in documents.values():
        if document.kind in OF_SPECIMENS and document.name not in default_registry().specimens():
            return (
                f"this identification was made with specimen '{quoted(document.name)}', which is not known here: "
                "install "
                "the plugin that has it, or give using="
            )
        if document.kind == "surrogate":
            return (
                f"this identification was made with the surrogate '{quoted(document.name, 80)}' of a file: give "
                "using=ck.surrogate(that file)"
            )
        if document.kind == "other":
            return (
                f"this identification was made with '{quoted(document.name)}', which a file cannot hold: give "
                "using=, the "
                "predictor itself or a specimen"
            )
    return "this identification was loaded from a file: give using=, the specimen it was made with"


def registered_specimens(predictor: Predictor | None) -> dict[str, Predictor]:
    """{name: specimen} of those parts of a predictor that are registered specimens, with whatever settings."""
    parts = () if predictor is None else (predictor.parts or {SINGLE: predictor}).values()
    described = [(one, _document_of(one)) for one in parts]
    return {document.name: one for one, document in described if document.kind == "specimen"}


# ---- one predictor -------------------------------------------------------------------------------------------------


def _document_of(predictor: Predictor) -> PredictorDocument:
    name = predictor.label
    if predictor.is_surrogate:
        return PredictorDocument("surrogate", name, fingerprint=predictor_fingerprint(predictor))
    underlying = predictor.specimen
    if underlying is not predictor and underlying.reduced_order_model() == predictor:
        document = _document_of(underlying)
        if document.kind == "specimen":
            return replace(document, kind="reduced-order model")
    registered = default_registry().specimens().get(name)
    specimen: Any = predictor
    if registered is not None and type(registered.value) is type(specimen):
        try:
            return PredictorDocument("specimen", name, as_read_back(specimen_to_json(specimen)["fields"]))
        except DatasetError:  # it holds arrays, such as a mesh
            pass
    return PredictorDocument("other", name)


def _predictor_of(document: PredictorDocument) -> Predictor | None:
    if document.kind in OF_SPECIMENS and document.name in default_registry().specimens():
        fields = {"name": document.name, "fields": document.fields}
        try:
            specimen = specimen_from_json(fields, "predictor_documents")
        except DatasetError as error:
            raise FitError(str(error)) from None
        return specimen if document.kind == "specimen" else specimen.reduced_order_model()
    return None


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
