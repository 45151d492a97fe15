"""Data sets as HDF5 files, which any HDF5 reader opens without creepkit.

Layout 1. Attributes of the file: `format` is "creepkit-dataset" and `layout` 1; `units` says "MPa, mm, s, K" of
everything that follows; lists of words `outputs`, `parameter_names`, `condition_names`, `reason_names`, `reason_texts`;
JSON texts `law` (creepkit.language.tree), `specimen` (its name and fields), `design` (what decided the draws) and
`provenance` (versions, seed, when, fingerprint).

Arrays, the first axis being the sample, in the order of the Sobol sequence, rejected and failed samples included:

    parameters   (n, P)                float64  the law's parameters in the author's values; 0 = switched off
    conditions   (n, C)                float64  what the test was: modulus, P1, P2 (MPa), Tj (s) ...
    values       (n, frames, outputs)  float32  NaN after the end, and where nothing was simulated; 12 binary digits
                                                of rejected samples
    marks        (n, 4, outputs)       float32  at the ends of first ramp, first hold, second ramp and test
    status       (n,)                  int8     0 complete, 1 burst, 2 not converged, 3 outside the domain, -1 not run
    end_times    (n,)                  float64  s, where the simulation ended
    reasons      (n,)                  int8     0 accepted, k rejected for reason_names[k], -1 failed
    index        (n,)                  int64    row of the Sobol sequence

and time_grid (frames,) float64, in s, or, where its attribute `relative` is true, in shares of the sample's end_time.
The group `failures` has `rows` (k,) int64 and `texts` (k,): which samples failed, and why.

    with h5py.File("combined.h5") as f:
        good = f["reasons"][:] == 0
        amplitude = f["values"][good][:, :, list(f.attrs["outputs"]).index("amplitude")]
"""

from __future__ import annotations

import errno
import json
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Bools
from creepkit.dataset.columns import COLUMNS, HOLD_TIMES, empty_columns
from creepkit.dataset.dataset import Dataset
from creepkit.dataset.layout import (
    FORMAT,
    LAYOUT_VERSION,
    FILE_UNITS,
    NAME_LISTS,
    check_values,
    check_shapes,
    check_attributes,
    check_format,
)
from creepkit.dataset.quiet_file import FaultTolerantFile
from creepkit.dataset.specimen_document import specimen_to_json, specimen_from_json
from creepkit.dataset.time_grid import MOST_FRAMES, TimeGrid
from creepkit.errors import DatasetError, LawError
from creepkit.language import CreepLaw
from creepkit.language.tree import law_from_json, law_to_json

COMPRESSION = {"compression": "gzip", "compression_opts": 4, "shuffle": True}

# ---- writing -------------------------------------------------------------------------------------------------------


def write_dataset(data: Dataset, path: str | Path) -> Path:
    """Write a data set; the file is whole or absent, and one that is there is replaced."""
    path = Path(path)
    with replace_on_success(path) as temporary, create_hdf5(temporary) as file:
        write_header(file, data)
        append_samples(file, data)
    return path


@contextmanager
def replace_on_success(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place at the end; removed when writing fails, which is said."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be written: {_error_cause(error)}") from None
    finally:
        if temporary.exists():
            temporary.unlink()


def remove_temporary_files(path: Path) -> None:
    """Remove what processes that died while they wrote `path` have left; nobody must be writing it now."""
    for temporary in path.parent.glob(f".{path.name}.*.part"):
        temporary.unlink(missing_ok=True)


@contextmanager
def create_hdf5(path: Path) -> Iterator[h5py.File]:
    """A new file, of a version in which attributes may be long; OSError when there is no room for it."""
    with FaultTolerantFile(path, "w+") as raw:
        try:
            with h5py.File(raw, "w", libver=("v110", "v110")) as file:
                yield file
        finally:
            raw.raise_failure()  # in the place of what HDF5 says when it reads what was dropped


def _error_cause(error: OSError) -> str:
    message = os.strerror(error.errno) if error.errno else " ".join(str(error).split())
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return f"{message}; {'make room' if full else 'choose another folder'} and start again, nothing done is lost"


def write_header(file: h5py.File, data: Dataset) -> None:
    """Write everything but the samples, with room for these."""
    file.attrs.update({"format": FORMAT, "layout": LAYOUT_VERSION, "units": FILE_UNITS})
    text = h5py.string_dtype()
    for name in NAME_LISTS:
        file.attrs.create(name, np.array(getattr(data, name), dtype=object), dtype=text)
    documents = {
        "law": law_to_json(data.law),
        "specimen": specimen_to_json(data.specimen),
        "design": data.design_document,
        "provenance": data.provenance,
    }
    for name, document in documents.items():
        file.attrs[name] = json.dumps(document, sort_keys=True)
    grid = file.create_dataset("time_grid", data=data.grid.values, dtype=np.float64)
    grid.attrs["relative"] = bool(data.grid.relative)
    sizes = {**{name: len(getattr(data, name)) for name in NAME_LISTS}, "marks": HOLD_TIMES, "frames": grid.size}
    for name, column in COLUMNS.items():
        shape = tuple(sizes[axis] for axis in column.axes)
        # the last axis apart: neighbours in a chunk are then neighbours in time, which compress better
        chunks = (column.chunk, *(max(size, 1) for size in shape[:-1]), *(1 for _ in shape[-1:]))
        file.create_dataset(name, (0, *shape), column.file_type, maxshape=(None, *shape), chunks=chunks, **COMPRESSION)
    failures = file.create_group("failures")
    failures.create_dataset("rows", (0,), np.int64, maxshape=(None,), chunks=(1024,))
    failures.create_dataset("texts", (0,), text, maxshape=(None,), chunks=(1024,))


def append_samples(file: h5py.File, data: Dataset) -> None:
    """Write the samples of a data set behind those that are there."""
    before = len(file["index"])
    for name in COLUMNS:
        _extend(file[name], getattr(data, name))
    if data.failures:
        _extend(file["failures/rows"], np.array([before + row for row in data.failures], dtype=np.int64))
        _extend(file["failures/texts"], np.array(list(data.failures.values()), dtype=object))


def _extend(dataset: h5py.Dataset, values: Any) -> None:
    before = len(dataset)
    dataset.resize(before + len(values), axis=0)
    dataset[before:] = values


# ---- reading -------------------------------------------------------------------------------------------------------


def read_dataset(path: str | Path, *, accepted_only: bool = False) -> Dataset:
    """Read a data set that `write` or a campaign wrote; DatasetError, in one sentence, when the file is another.

    accepted_only : leave rejected and failed samples in the file, which spares their memory.
    """
    with open_hdf5(Path(path)) as file:
        return read_samples(file, read_header(file, str(path)), accepted_only)


@contextmanager
def open_hdf5(path: Path) -> Iterator[h5py.File]:
    """The file open for reading; DatasetError when there is none, when it is no HDF5, or when it is damaged."""
    try:
        with h5py.File(path, "r") as file:
            yield file
    except FileNotFoundError:
        raise DatasetError(f"{path}: there is no such file") from None
    except MemoryError:
        raise DatasetError(f"{path}: holds more than there is memory for") from None
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        if path.is_dir():
            raise DatasetError(f"{path}: is a folder; give a data set that creepkit generated") from None
        if path.is_file() and not h5py.is_hdf5(path):
            raise DatasetError(f"{path}: not an HDF5 file; give a data set that creepkit generated") from None
        raise DatasetError(f"{path}: cannot be read, it seems damaged: {' '.join(str(error).split())}") from None


def read_header(file: h5py.File, source: str) -> Dataset:
    """The data set of a file with no samples in it yet."""
    check_format(file, source)
    name_lists: dict[str, Any] = {name: tuple(str(word) for word in file.attrs[name]) for name in NAME_LISTS}
    documents = {name: json.loads(file.attrs[name]) for name in ("law", "specimen", "design", "provenance")}
    check_attributes({**name_lists, **documents}, source)
    sizes = {**{name: len(values) for name, values in name_lists.items()}, "marks": HOLD_TIMES, "frames": len(file["time_grid"])}
    columns = empty_columns(sizes)
    check_shapes(file, columns, source)
    return Dataset(
        law=_read_law(documents["law"], name_lists["parameter_names"], source),
        specimen=specimen_from_json(documents["specimen"], source),
        design_document=documents["design"],
        grid=_read_grid(file["time_grid"], source),
        provenance=documents["provenance"],
        **name_lists,
        **columns,
    )


def _read_law(document: Any, names: tuple[str, ...], source: str) -> CreepLaw:
    try:
        law = law_from_json(document, source)
    except LawError as error:
        raise DatasetError(str(error)) from None
    if tuple(law.names) != names:
        found = f"its parameters are {', '.join(names)}, those of its law {', '.join(law.names)}"
        raise DatasetError(f"{source}: {found}; the file is damaged")
    return law


def _read_grid(array: h5py.Dataset, source: str) -> TimeGrid:
    if array.size > MOST_FRAMES or array.dtype.kind != "f":
        raise DatasetError(f"{source}: its time grid is {array.dtype} {array.shape}; the file is damaged")
    try:
        return TimeGrid(array[:], bool(array.attrs["relative"]))
    except DatasetError as error:
        raise DatasetError(f"{source}: {error}") from None


def read_samples(file: h5py.File, header: Dataset, accepted_only: bool = False) -> Dataset:
    """The header with the samples of a file, in blocks that spare memory."""
    reasons = file["reasons"][:]
    selected = reasons == 0 if accepted_only else np.ones(len(reasons), dtype=bool)
    columns: dict[str, Any] = {name: _read_rows(file[name], selected, COLUMNS[name].memory_type) for name in COLUMNS}
    new_row = {int(row): k for k, row in enumerate(np.flatnonzero(selected))}
    rows, texts = file["failures/rows"][:], file["failures/texts"].asstr()[:]
    failures = {new_row[row]: str(text) for row, text in zip(rows.tolist(), texts, strict=True) if row in new_row}
    check_values(columns, header, file.filename)
    return replace(header, **columns, failures=failures)


def _read_rows(dataset: h5py.Dataset, selected: Bools, dtype: type, block: int = 4096) -> NDArray[Any]:
    """The wanted rows; reading by mask is slow in HDF5, and the whole may be many times larger."""
    rows = np.empty((int(selected.sum()), *dataset.shape[1:]), dtype)
    filled = 0
    for start in range(0, len(selected), block):
        mask = selected[start : start + block]
        if mask.any():
            chunk = dataset[start : start + block][mask]
            rows[filled : filled + len(chunk)] = chunk
            filled += len(chunk)
    return rows
