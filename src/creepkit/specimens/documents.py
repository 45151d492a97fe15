"""Specimens to JSON and back: the fields of a frozen record, put into the registered specimen of that name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from creepkit.errors import CreepkitError, DatasetError

if TYPE_CHECKING:
    from creepkit.records import Specimen


COMPUTATION_FIELDS = ("threads",)
"""Fields that say how, not what, is computed."""


def specimen_to_json(specimen: Specimen) -> dict[str, Any]:
    """The specimen as JSON-able data: its name and the fields that decide what it predicts."""
    record: Any = specimen
    if not is_dataclass(record):
        raise DatasetError(
            f"specimen '{specimen.name}' is no dataclass, so that a data set cannot say which one it was made with"
        )
    return {"name": specimen.name, "fields": _to_json(record, specimen.name)}


def _to_json(record: Any, path: str) -> Any:
    if record is None or isinstance(record, bool | int | float | str):
        return record
    if isinstance(record, tuple | list):
        return [_to_json(item, path) for item in record]
    if is_dataclass(record) and not isinstance(record, type) and _has_no_arrays(record):
        field_names = [f.name for f in fields(record) if f.init and f.name not in COMPUTATION_FIELDS]
        return {name: _to_json(getattr(record, name), f"{path}.{name}") for name in field_names}
    raise DatasetError(
        f"{path} is a {type(record).__name__}, which a data set cannot hold; allowed are numbers, words and records "
        "of them"
    )


def _has_no_arrays(record: Any) -> bool:
    """Whether a record is rebuilt from its fields by putting them into the registered specimen's own."""
    return all(not hasattr(getattr(record, f.name), "shape") for f in fields(record) if f.init)


def specimen_from_json(document: Any, source: str, registered: Callable[[str], Specimen]) -> Specimen:
    """The specimen that specimen_to_json wrote; DatasetError, naming `source`, when that cannot be.

    registered : gives the registered specimen of a name.
    """
    if not (isinstance(document, dict) and isinstance(document.get("name"), str) and "fields" in document):
        raise DatasetError(f"{source}: does not say its specimen; it is damaged or was not written by creepkit")
    try:
        specimen: Specimen = _with_fields(registered(document["name"]), document["fields"])
    except (CreepkitError, TypeError, AttributeError) as error:
        raise DatasetError(f"{source}: its specimen '{document['name']}' cannot be rebuilt here: {error}") from None
    return specimen


def _with_fields(template: Any, values: Any) -> Any:
    changes = {}
    for name, value in values.items():
        current = getattr(template, name)
        if isinstance(value, dict):
            changes[name] = _with_fields(current, value)
        else:
            changes[name] = _to_tuples(value)
    return replace(template, **changes)


def _to_tuples(value: Any) -> Any:
    return tuple(_to_tuples(item) for item in value) if isinstance(value, list) else value
