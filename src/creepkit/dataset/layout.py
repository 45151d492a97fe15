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
        if not isinstance(file.get(name), h5py.Dataset):
            raise DatasetError(f"{source}: the array '{name}' is missing; the file is damaged")
        if file[name].shape != (len(file["index"]), *empty.shape[1:]) or file[name].dtype.kind not in "fi":
            found = f"{file[name].dtype} {file[name].shape}"
            raise DatasetError(f"{source}: the array '{name}' is {found}, which does not fit the others")


def check_numbers(own: dict[str, Any], header: Dataset, source: str) -> None:
    """DatasetError when what was drawn is not finite, or a reason is none."""
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
