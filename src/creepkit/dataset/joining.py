"""Two data sets as one: what must agree, and what may differ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.dataset.columns import COLUMNS
from creepkit.dataset.specimen_document import specimen_document
from creepkit.errors import DatasetError

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


def joined(one: Dataset, other: Dataset) -> Dataset:
    """The samples of both, one after the other; designs and seeds may differ, what was simulated may not."""
    _refuse_strangers(one, other)
    _refuse_twins(one, other)
    both: dict[str, Any] = {name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in COLUMNS}
    failures = {**one.failures, **{len(one) + row: text for row, text in other.failures.items()}}
    same = one.design_document == other.design_document
    design = one.design_document if same else {"joined": [*_parts(one.design_document), *_parts(other.design_document)]}
    provenance = {"joined": [*_parts(one.provenance), *_parts(other.provenance)]}
    return replace(one, **both, failures=failures, design_document=design, provenance=provenance)


def _parts(document: Any) -> list[Any]:
    found = document.get("joined")
    return list(found) if isinstance(found, list) else [dict(document)]


def _refuse_strangers(one: Dataset, other: Dataset) -> None:
    """DatasetError that names the first thing in which two data sets differ."""
    if one.law.fingerprint != other.law.fingerprint:
        raise DatasetError(
            f"data sets of the laws '{one.law.name}' and '{other.law.name}' cannot be joined: their equations differ"
        )
    specimens = specimen_document(one.specimen), specimen_document(other.specimen)
    if specimens[0] != specimens[1]:
        raise DatasetError(
            f"data sets of different specimens cannot be joined: {first_difference(*specimens, 'specimen')}"
        )
    for what in ("parameter_names", "condition_names", "outputs", "reason_names"):
        if getattr(one, what) != getattr(other, what):
            raise DatasetError(
                f"data sets with different {what.replace('_', ' ')} cannot be joined: "
                f"{', '.join(getattr(one, what))} and {', '.join(getattr(other, what))}"
            )
    if one.grid != other.grid:
        raise DatasetError("data sets with different time grids cannot be joined; generate them with the same grid")


def _refuse_twins(one: Dataset, other: Dataset) -> None:
    """The same row of the same sequence must not count twice."""
    if one.design_document != other.design_document or one.provenance.get("seed") != other.provenance.get("seed"):
        return
    shared = np.intersect1d(one.index, other.index)
    if shared.size:
        raise DatasetError(
            f"both data sets hold {shared.size} samples of the same design and seed (Sobol row {shared[0]} is one), "
            "which would count twice; generate one of them with another seed"
        )


def first_difference(one: Any, other: Any, place: str) -> str:
    """Where two documents first differ: 'specimen.tolerance is 0.01 and 0.02'; '' when they do not.

    place : what both are called; "" when only what is within has a name.
    """
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            name = f"{place}.{key}" if place else key
            if key not in one or key not in other:
                return f"{name} is only in one of them"
            if found := first_difference(one[key], other[key], name):
                return found
        return ""
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = (first_difference(a, b, f"{place}[{k}]") for k, (a, b) in enumerate(zip(one, other, strict=True)))
        return next((found for found in pairs if found), "")
    return "" if one == other else f"{place} is {_short(one)} and {_short(other)}"


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
