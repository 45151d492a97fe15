"""Two data sets as one: what must agree, and what may differ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.dataset.columns import COLUMNS
from creepkit.dataset.specimen_document import specimen_to_json
from creepkit.errors import DatasetError

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


def join(one: Dataset, other: Dataset) -> Dataset:
    """The samples of both, one after the other; designs and seeds may differ, what was simulated may not."""
    _check_compatible(one, other)
    _check_no_shared_rows(one, other)
    columns: dict[str, Any] = {name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in COLUMNS}
    failures = {**one.failures, **{len(one) + row: text for row, text in other.failures.items()}}
    same = one.design_document == other.design_document
    design = one.design_document if same else {"joined": [*_joined_documents(one.design_document), *_joined_documents(other.design_document)]}
    provenance = {"joined": [*_joined_documents(one.provenance), *_joined_documents(other.provenance)]}
    return replace(one, **columns, failures=failures, design_document=design, provenance=provenance)


def _joined_documents(document: Any) -> list[Any]:
    joined = document.get("joined")
    return list(joined) if isinstance(joined, list) else [dict(document)]


def _check_compatible(one: Dataset, other: Dataset) -> None:
    """DatasetError that names the first thing in which two data sets differ."""
    if one.law.fingerprint != other.law.fingerprint:
        raise DatasetError(
            f"data sets of the laws '{one.law.name}' and '{other.law.name}' cannot be joined: their equations differ"
        )
    specimens = specimen_to_json(one.specimen), specimen_to_json(other.specimen)
    if specimens[0] != specimens[1]:
        raise DatasetError(
            f"data sets of different specimens cannot be joined: {first_difference(*specimens, 'specimen')}"
        )
    for name in ("parameter_names", "condition_names", "outputs", "reason_names"):
        if getattr(one, name) != getattr(other, name):
            raise DatasetError(
                f"data sets with different {name.replace('_', ' ')} cannot be joined: "
                f"{', '.join(getattr(one, name))} and {', '.join(getattr(other, name))}"
            )
    if one.grid != other.grid:
        raise DatasetError("data sets with different time grids cannot be joined; generate them with the same grid")


def _check_no_shared_rows(one: Dataset, other: Dataset) -> None:
    """The same row of the same sequence must not count twice."""
    if one.design_document != other.design_document or one.provenance.get("seed") != other.provenance.get("seed"):
        return
    shared = np.intersect1d(one.index, other.index)
    if shared.size:
        raise DatasetError(
            f"both data sets hold {shared.size} samples of the same design and seed (Sobol row {shared[0]} is one), "
            "which would count twice; generate one of them with another seed"
        )


def first_difference(one: Any, other: Any, name: str) -> str:
    """Where two documents first differ: 'specimen.tolerance is 0.01 and 0.02'; '' when they do not.

    place : what both are called; "" when only what is within has a name.
    """
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            path = f"{name}.{key}" if name else key
            if key not in one or key not in other:
                return f"{path} is only in one of them"
            if difference := first_difference(one[key], other[key], path):
                return difference
        return ""
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = (first_difference(a, b, f"{name}[{k}]") for k, (a, b) in enumerate(zip(one, other, strict=True)))
        return next((found for found in pairs if found), "")
    return "" if one == other else f"{name} is {_shortened(one)} and {_shortened(other)}"


def _shortened(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
