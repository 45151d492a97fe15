"""Data sets as HDF5 files, readable without creepkit.

Layout 1. Attributes of the file: `format` is "creepkit-dataset" and `layout` 1; `units` says "MPa, mm, s, K" of
everything that follows (forces are in N, moments in N mm, angles in rad); lists of strings `outputs`,
`parameter_names`, `condition_names`, `reason_names` and `reason_texts`; JSON texts `law` (creepkit.language.law_codec),
`specimen` (its name and fields), `design` (what decided the draws) and `provenance` (versions, seed, when,
fingerprint).

Arrays, the first axis being the sample, in the order of the Sobol sequence, rejected and failed samples included:

    parameters   (n, P)                float64  the law's parameters in the author's values; 0 = switched off
    conditions   (n, C)                float64  what the test was: modulus (MPa), levels of the load, end_time (s) ...
    values       (n, frames, outputs)  float32  NaN after the end, and where nothing was simulated
    hold_outputs (n, 4, outputs)       float32  at the ends of first ramp, first hold, second ramp and test
    status       (n,)                  int8     0 complete, 1 burst, 2 not converged, 3 outside the domain, -1 not run
    end_times    (n,)                  float64  s, where the simulation ended
    reasons      (n,)                  int8     0 accepted, k rejected for reason_names[k], -1 failed
    index        (n,)                  int64    row of the Sobol sequence

and time_grid (frames,) float64, in s, or, where its attribute `relative` is true, in shares of the sample's end_time.
The group `failures` has `rows` (k,) int64 and `texts` (k,): which samples failed, and why.

    with h5py.File("combined.h5") as f:
        good = f["reasons"][:] == 0
        first_output = f["values"][good][:, :, 0]  # the one of f.attrs["outputs"][0]
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Bools
from creepkit.checked_arguments import checked
from creepkit.dataset.dataset import COLUMNS, NOT_SIMULATED, Dataset, empty_columns
from creepkit.errors import DatasetError, LawError, printable, quoted, quoted_value
from creepkit.files.hdf5_files import open_hdf5, write_hdf5
from creepkit.files.json_documents import compact_json, parse_json
from creepkit.files.reading import FileKind
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.records import Status
from creepkit.registry.specimen_documents import specimen_from_json, specimen_to_json
from creepkit.sampling.conditions import TimeGrid

DATASET_FILE = FileKind("a data set", DatasetError, "give a data set that creepkit generated", maximum_bytes=2**50)


WRITE_ADVICE = "choose another folder and start again, nothing done is lost"


FORMAT = "creepkit-dataset"


LAYOUT_VERSION = 1


FILE_UNITS = "MPa, mm, s, K"


NAME_LISTS = ("outputs", "parameter_names", "condition_names", "reason_names", "reason_texts")


def _damaged(source: str, problem: str) -> DatasetError:
    return DatasetError(f"{source}: {problem}; the file is damaged")


def check_format(file: h5py.File, source: str) -> None:
    """DatasetError when the file is not one of ours, or of another layout or unit."""
    format_name, layout, units = (file.attrs.get(name) for name in ("format", "layout", "units"))
    if not isinstance(format_name, str) or format_name != FORMAT:
        raise DatasetError(
            f"{source}: an HDF5 file, but no data set of creepkit (its format is {quoted_value(format_name)})"
        )
    if not isinstance(layout, int | np.integer) or layout != LAYOUT_VERSION:
        newer = isinstance(layout, int | np.integer) and layout > LAYOUT_VERSION
        advice = "upgrade creepkit" if newer else "generate it again"
        raise DatasetError(
            f"{source}: its layout is {quoted(layout)}, this creepkit reads layout {LAYOUT_VERSION}; {advice}"
        )
    if not isinstance(units, str) or units != FILE_UNITS:
        raise DatasetError(f"{source}: its units are {quoted_value(units)}; allowed are '{FILE_UNITS}'")


def check_columns(file: h5py.File, header: Dataset, source: str) -> None:
    """DatasetError when an array has not as many samples as the others, or does not fit the words of the file."""
    samples = len(file["index"])
    for name, column in COLUMNS.items():
        array, shape = file[name], (samples, *getattr(header, name).shape[1:])
        if array.shape != shape or array.dtype.kind != np.dtype(column.file_type).kind:
            raise _damaged(source, f"the array '{name}' is {array.dtype} {array.shape}, which does not fit the others")


def check_values(columns: dict[str, Any], header: Dataset, source: str) -> None:
    """DatasetError when what was drawn is no value of the law, a code is none, or an accepted sample has no history."""
    with np.errstate(invalid="ignore"):
        theta = header.law.to_internal(dict(zip(header.parameter_names, columns["parameters"].T, strict=True)))
    accepted = columns["reasons"] == 0
    drawn = np.isfinite(columns["parameters"]).all(1) & np.isfinite(columns["conditions"]).all(1)
    has_history = np.isfinite(columns["values"][..., 0]).any(axis=1) & np.isfinite(columns["end_times"])
    for what, sound in (
        ("parameters or conditions are no numbers of its law", drawn & ~np.isnan(theta).any(axis=1)),
        ("status is none", np.isin(columns["status"], [NOT_SIMULATED, *map(int, Status)])),
        ("reason is none", (columns["reasons"] >= -1) & (columns["reasons"] < len(header.reason_names))),
        ("history is missing, though it was accepted", ~accepted | has_history),
    ):
        if not sound.all():
            raise _damaged(source, f"sample {np.flatnonzero(~sound)[0]}: its {what}")


COMPRESSION = {"compression": "gzip", "compression_opts": 4, "shuffle": True, "fletcher32": True}
"""With a checksum of each chunk, which is compared when it is read."""


# ---- writing -------------------------------------------------------------------------------------------------------


@checked
def write_dataset(data: Dataset, path: str | Path) -> Path:
    """Write a data set, whole or not at all; DatasetError for a file that creepkit did not write."""
    path = Path(path)
    with write_hdf5(path, DatasetError, WRITE_ADVICE) as file:
        write_header(file, data)
        append_samples(file, data)
    return path


def write_header(file: h5py.File, data: Dataset) -> None:
    """Write everything but the samples, with space for these."""
    file.attrs.update({"format": FORMAT, "layout": LAYOUT_VERSION, "units": FILE_UNITS})
    for name in NAME_LISTS:
        file.attrs[name] = [*map(str, getattr(data, name))]  # outputs are more than texts
    documents = {
        "law": law_to_json(data.law),
        "specimen": specimen_to_json(data.specimen),
        "design": data.design_document,
        "provenance": data.provenance,
    }
    for name, document in documents.items():
        file.attrs[name] = compact_json(document, sort_keys=True)
    file["time_grid"] = data.grid.values
    file["time_grid"].attrs["relative"] = bool(data.grid.relative)
    for name, column in COLUMNS.items():
        shape = getattr(data, name).shape[1:]
        # the last axis apart: neighbours in a chunk are then neighbours in time, which compress better
        chunks = (column.chunk, *(max(size, 1) for size in shape[:-1]), *(1 for _ in shape[-1:]))
        file.create_dataset(name, (0, *shape), column.file_type, maxshape=(None, *shape), chunks=chunks, **COMPRESSION)
    failures = file.create_group("failures")
    failures.create_dataset("rows", (0,), np.int64, maxshape=(None,), chunks=(1024,))
    failures.create_dataset("texts", (0,), h5py.string_dtype(), maxshape=(None,), chunks=(1024,))


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


@checked
def read_dataset(path: str | Path, *, accepted_only: bool = False) -> Dataset:
    """Read a data set that write_dataset or generate wrote; DatasetError, in one sentence, when the file is another.

    accepted_only : leave rejected and failed samples in the file, which saves memory.
    """
    with open_hdf5(Path(path), DATASET_FILE) as file:
        return read_samples(file, read_header(file, str(path)), accepted_only)


def read_header(file: h5py.File, source: str) -> Dataset:
    """The data set of a file with no samples in it yet."""
    check_format(file, source)
    name_lists: dict[str, Any] = {name: tuple(map(str, file.attrs[name])) for name in NAME_LISTS}
    documents: dict[str, Any] = {}
    for name in ("law", "specimen", "design", "provenance"):
        documents[name] = parse_json(file.attrs[name], f"{source}: its {name}", DATASET_FILE)
        if not isinstance(documents[name], dict):
            raise _damaged(source, f"the attribute '{name}' is no record")
    if not name_lists["outputs"] or len(name_lists["reason_names"]) != len(name_lists["reason_texts"]):
        raise _damaged(source, "names no output, or not a text for each reason")
    times = file["time_grid"]
    try:
        law, grid = law_from_json(documents["law"], source), TimeGrid(times[:], bool(times.attrs["relative"]))
    except (LawError, DatasetError) as error:
        raise DatasetError(str(error) if source in str(error) else f"{source}: {error}") from None
    if tuple(law.names) != (names := name_lists["parameter_names"]):
        raise _damaged(source, f"its parameters are {', '.join(names)}, those of its law {', '.join(law.names)}")
    header = Dataset(
        law=law,
        specimen=specimen_from_json(documents["specimen"], source),
        design_document=documents["design"],
        grid=grid,
        provenance=documents["provenance"],
        **name_lists,
        **empty_columns(name_lists, len(times)),
    )
    check_columns(file, header, source)
    return header


def read_samples(file: h5py.File, header: Dataset, accepted_only: bool = False) -> Dataset:
    """The header with the samples of a file, in blocks, to save memory."""
    reasons = file["reasons"][:]
    selected = reasons == 0 if accepted_only else np.ones(len(reasons), dtype=bool)
    columns: dict[str, Any] = {name: _read_rows(file[name], selected, COLUMNS[name].memory_type) for name in COLUMNS}
    new_row = {int(row): k for k, row in enumerate(np.flatnonzero(selected))}
    rows, texts = file["failures/rows"][:], file["failures/texts"].asstr()[:]
    if rows.shape != texts.shape or not np.isin(rows, np.arange(len(reasons))).all():
        raise _damaged(file.filename, "its failures are not of samples, each with one text")
    pairs = zip(rows.tolist(), texts.tolist(), strict=True)
    failures = {new_row[row]: printable(text) for row, text in pairs if row in new_row}
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
