"""Specimens to JSON and back: the fields of a frozen record, put into the registered specimen of that name."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

from creepkit.errors import SAID, CreepkitError, DatasetError, quoted, restated
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.limits import ANY_NUMBER
from creepkit.registry.arguments import specimen_by_name

if TYPE_CHECKING:
    from creepkit.records import Specimen


COMPUTATION_FIELDS = ("threads",)
"""Fields that say how, not what, is computed."""


CODEC = RecordCodec(omitted={object: COMPUTATION_FIELDS}, default_range=ANY_NUMBER)


def specimen_to_json(specimen: Specimen) -> dict[str, Any]:
    """The specimen as JSON-able data: its name and the fields that decide what it predicts."""
    record: Any = specimen
    if not is_dataclass(record):
        raise DatasetError(
            f"specimen '{specimen.name}' is no dataclass, so that a data set cannot say which one it was made with"
        )
    with restated(RecordError, DatasetError, f"{SAID}; allowed are numbers, words and records of them"):
        _refuse_arrays(record, specimen.name)
        return {"name": specimen.name, "fields": CODEC.to_json(record, specimen.name)}


def _refuse_arrays(record: Any, place: str) -> None:
    """RecordError for records that hold arrays, such as meshes."""
    for f in (f for f in fields(record) if f.init):
        value = getattr(record, f.name)
        if not is_dataclass(value):
            continue
        if any(hasattr(getattr(value, inner.name), "shape") for inner in fields(value) if inner.init):
            raise RecordError(f"{place}.{f.name} is a {type(value).__name__}, which a data set cannot hold")
        _refuse_arrays(value, f"{place}.{f.name}")


def specimen_from_json(document: Any, source: str) -> Specimen:
    """The specimen that specimen_to_json wrote; DatasetError, naming `source`, when that cannot be."""
    if not (isinstance(document, dict) and isinstance(document.get("name"), str) and "fields" in document):
        raise DatasetError(f"{source}: does not say its specimen; it is damaged or was not written by creepkit")
    name = document["name"]
    try:
        return CODEC.updated(specimen_by_name(name), document["fields"])
    except CreepkitError as error:
        raise DatasetError(f"{source}: its specimen '{quoted(name)}' cannot be rebuilt here: {error}") from None
