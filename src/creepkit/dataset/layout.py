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
LAYOUT = 1
UNITS = "MPa, mm, s, K"
WORDS = ("outputs", "parameter_names", "condition_names", "reason_names", "reason_texts")
DENSEST = 1032
"""Bytes that one of gzip's may stand for, at most."""


def refuse_strangers(file: h5py.File, source: str) -> None:
    """DatasetError when the file is not one of ours, or of another layout or unit."""
    told = file.attrs.get("format")
    if told != FORMAT:
        raise DatasetError(f"{source}: an HDF5 file, but no data set of creepkit (its format is {told!r})")
    layout = file.attrs.get("layout")
    if layout != LAYOUT:
        newer = isinstance(layout, int | np.integer) and layout > LAYOUT
        todo = "upgrade creepkit" if newer else "generate it again"
        raise DatasetError(f"{source}: its layout is {layout}, this creepkit reads layout {LAYOUT}; {todo}")
    if file.attrs.get("units") != UNITS:
        raise DatasetError(f"{source}: its units are {file.attrs.get('units')!r}; allowed are '{UNITS}'")
    for name in (*WORDS, "law", "specimen", "design", "provenance"):
        if name not in file.attrs:
            raise DatasetError(f"{source}: the attribute '{name}' is missing; the file is damaged")


def check_shapes(file: h5py.File, expected: dict[str, Any], source: str) -> None:
    """DatasetError when an array is missing, or does not fit the words of the file."""
    for name, empty in expected.items():
        own = file.get(name)
        if not isinstance(own, h5py.Dataset):
            raise DatasetError(f"{source}: the array '{name}' is missing; the file is damaged")
        kind = np.dtype(COLUMNS[name].stored).kind
        if own.shape != (len(file["index"]), *empty.shape[1:]) or own.dtype.kind != kind:
            found = f"{own.dtype} {own.shape}"
            raise DatasetError(f"{source}: the array '{name}' is {found}, which does not fit the others")
        if own.nbytes > DENSEST * own.id.get_storage_size():
            raise DatasetError(f"{source}: the array '{name}' says to be {own.shape}, and is not all there")


def check_words(told: dict[str, Any], source: str) -> None:
    """DatasetError when the words of a file do not fit each other; told : attributes by name, documents parsed."""
    for name in ("design", "provenance"):
        if not isinstance(told[name], dict):
            raise DatasetError(f"{source}: the attribute '{name}' is no record; the file is damaged")
    if not told["outputs"] or len(told["reason_names"]) != len(told["reason_texts"]):
        raise DatasetError(f"{source}: names no output, or not a text for each reason; the file is damaged")


def check_numbers(own: dict[str, Any], header: Dataset, source: str) -> None:
    """DatasetError when what was drawn is not finite, a reason is none, or an accepted sample has no history."""
    for name in ("parameters", "conditions"):
        odd = np.argwhere(~np.isfinite(own[name]))
        if odd.size:
            word = getattr(header, COLUMNS[name].axes[0])[odd[0, 1]]
            raise DatasetError(f"{source}: {name} of sample {odd[0, 0]} ({word}) are not finite; the file is damaged")
    strange = np.flatnonzero((own["reasons"] < -1) | (own["reasons"] >= len(header.reason_names)))
    if strange.size:
        raise DatasetError(
            f"{source}: the reason of sample {strange[0]} is {own['reasons'][strange[0]]}; allowed are -1 to "
            f"{len(header.reason_names) - 1}; the file is damaged"
        )
    good = own["reasons"] == 0
    seen = np.isfinite(own["values"][good, :, 0]).any(axis=1) & np.isfinite(own["end_times"][good])
    if not seen.all():
        row = np.flatnonzero(good)[~seen][0]
        raise DatasetError(f"{source}: sample {row} was accepted and has no history; the file is damaged")
