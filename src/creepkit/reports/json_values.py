"""Fields of records as JSON-able data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def finite(value: Any) -> Any:
    """A value with null for numbers that are infinite or not known, at any depth; arrays and tuples as lists."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {name: finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def fields_to_json(record: object, names: str) -> dict[str, Any]:
    """{name: value} of the fields of these names."""
    return {name: finite(getattr(record, name)) for name in names.split()}
