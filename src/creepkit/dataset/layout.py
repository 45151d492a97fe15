"""The layout of a data set's file (see store), and the checks that a file has it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from creepkit.dataset.columns import COLUMNS
from creepkit.errors import DatasetError

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

FORMAT = "creepkit-dataset"
LAYOUT_VERSION = 1
FILE_UNITS = "MPa, mm, s, K"
NAME_LISTS = ("outputs", "parameter_names", "condition_names", "reason_names", "reason_texts")
LARGEST_COMPRESSION = 1032
"""Bytes that one of gzip's may stand for, at most."""


def check_format(file: h5py.File, source: str) -> None:
    """DatasetError when the file is not one of ours, or of another layout or unit."""
    format_name = file.attrs.get("format")
    if format_name != FORMAT:
        raise DatasetError(f"{source}: an HDF5 file, but no data set of creepkit (its format is {format_name!r})")
    layout = file.attrs.get("layout")
    if layout != LAYOUT_VERSION:
        newer = isinstance(layout, int | np.integer) and layout > LAYOUT_VERSION
        advice = "upgrade creepkit" if newer else "generate it again"
        raise DatasetError(f"{source}: its layout is {layout}, this creepkit reads layout {LAYOUT_VERSION}; {advice}")
    if file.attrs.get("units") != FILE_UNITS:
        raise DatasetError(f"{source}: its units are {file.attrs.get('units')!r}; allowed are '{FILE_UNITS}'")
    for name in (*NAME_LISTS, "law", "specimen", "design", "provenance"):
        if name not in file.attrs:
            raise DatasetError(f"{source}: the attribute '{name}' is missing; the file is damaged")


def check_shapes(file: h5py.File, expected: dict[str, Any], source: str) -> None:
    """DatasetError when an array is missing, or does not fit the words of the file."""
    for name, empty in expected.items():
        array = file.get(name)
        if not isinstance(array, h5py.Dataset):
            raise DatasetError(f"{source}: the array '{name}' is missing; the file is damaged")
        kind = np.dtype(COLUMNS[name].file_type).kind
        if array.shape != (len(file["index"]), *empty.shape[1:]) or array.dtype.kind != kind:
            description = f"{array.dtype} {array.shape}"
            raise DatasetError(f"{source}: the array '{name}' is {description}, which does not fit the others")
        if array.nbytes > LARGEST_COMPRESSION * array.id.get_storage_size():
            raise DatasetError(f"{source}: the array '{name}' says to be {array.shape}, and is not all there")


def check_attributes(attributes: dict[str, Any], source: str) -> None:
    """DatasetError when the words of a file do not fit each other; told : attributes by name, documents parsed."""
    for name in ("design", "provenance"):
        if not isinstance(attributes[name], dict):
            raise DatasetError(f"{source}: the attribute '{name}' is no record; the file is damaged")
    if not attributes["outputs"] or len(attributes["reason_names"]) != len(attributes["reason_texts"]):
        raise DatasetError(f"{source}: names no output, or not a text for each reason; the file is damaged")


def check_values(columns: dict[str, Any], header: Dataset, source: str) -> None:
    """DatasetError when what was drawn is not finite, a reason is none, or an accepted sample has no history."""
    for name in ("parameters", "conditions"):
        invalid = np.argwhere(~np.isfinite(columns[name]))
        if invalid.size:
            column_name = getattr(header, COLUMNS[name].axes[0])[invalid[0, 1]]
            raise DatasetError(f"{source}: {name} of sample {invalid[0, 0]} ({column_name}) are not finite; the file is damaged")
    invalid_reasons = np.flatnonzero((columns["reasons"] < -1) | (columns["reasons"] >= len(header.reason_names)))
    if invalid_reasons.size:
        raise DatasetError(
            f"{source}: the reason of sample {invalid_reasons[0]} is {columns['reasons'][invalid_reasons[0]]}; allowed are -1 to "
            f"{len(header.reason_names) - 1}; the file is damaged"
        )
    accepted = columns["reasons"] == 0
    has_history = np.isfinite(columns["values"][accepted, :, 0]).any(axis=1) & np.isfinite(columns["end_times"][accepted])
    if not has_history.all():
        row = np.flatnonzero(accepted)[~has_history][0]
        raise DatasetError(f"{source}: sample {row} was accepted and has no history; the file is damaged")
