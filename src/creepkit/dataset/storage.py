"""Data sets as HDF5 files, readable without creepkit.

Layout 1. Attributes of the file: `format` is "creepkit-dataset" and `layout` 1; `units` says "MPa, mm, s, K" of
everything that follows (forces are in N, moments in N mm, angles in rad); lists of strings `outputs`,
`parameter_names`, `condition_names`, `reason_names` and `reason_texts`; JSON texts `law` (creepkit.language.law_codec),
`specimen` (its name and fields), `design` (what decided the draws) and `provenance` (versions, seed, when,
fingerprint).

Arrays, the first axis being the sample, in the order of the Sobol sequence, rejected and failed samples included:

    parameters   (n, P)                float64  the law's parameters in the author's values; 0 = switched off
    conditions   (n, C)                float64  what the test was: modulus (MPa), levels of the load, end_time (s) ...
    values       (n, frames, outputs)  float32  NaN after the end, and where nothing was simulated; 12 binary digits
                                                of rejected samples
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
from creepkit.dataset.dataset import COLUMNS, HOLD_TIMES, NOT_SIMULATED, Dataset, empty_columns
from creepkit.errors import DatasetError, LawError, printable, quoted, quoted_value
from creepkit.files.hdf5_files import open_hdf5, write_hdf5, write_names
from creepkit.files.json_documents import compact_json, parse_json
from creepkit.files.reading import FileKind
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.records import Status
from creepkit.registry.arguments import specimen_by_name
from creepkit.registry.specimen_documents import specimen_from_json, specimen_to_json
from creepkit.sampling.conditions import MOST_FRAMES, TimeGrid

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


def stored_array(file: h5py.File, name: str, kinds: str, source: str) -> h5py.Dataset:
    """An array of one axis or more; DatasetError when there is none, or its numbers are of another kind of NumPy."""
    array = file.get(name)
    if not isinstance(array, h5py.Dataset) or not array.shape or array.dtype.kind not in kinds:
        raise _damaged(source, f"the array '{name}' is missing, or is none of its kind")
    return array


def stored_names(file: h5py.File, name: str, source: str) -> tuple[str, ...]:
    """An attribute that is a list of texts; DatasetError when it is something else."""
    value = file.attrs.get(name)
    if not (isinstance(value, np.ndarray) and value.ndim == 1 and all(isinstance(word, str) for word in value)):
        raise _damaged(source, f"the attribute '{name}' is missing, or no list of texts")
    return tuple(str(word) for word in value)


def check_shapes(file: h5py.File, expected: dict[str, Any], source: str) -> None:
    """DatasetError when an array is missing, or does not fit the words of the file."""
    samples = stored_array(file, "index", "i", source).shape[0]
    for name, empty in expected.items():
        array = stored_array(file, name, np.dtype(COLUMNS[name].file_type).kind, source)
        if array.shape != (samples, *empty.shape[1:]):
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
        write_names(file, name, getattr(data, name))
    documents = {
        "law": law_to_json(data.law),
        "specimen": specimen_to_json(data.specimen),
        "design": data.design_document,
        "provenance": data.provenance,
    }
    for name, document in documents.items():
        file.attrs[name] = compact_json(document, sort_keys=True)
    grid = file.create_dataset("time_grid", data=data.grid.values, dtype=np.float64)
    grid.attrs["relative"] = bool(data.grid.relative)
    sizes = {**{name: len(getattr(data, name)) for name in NAME_LISTS}, "holds": HOLD_TIMES, "frames": grid.size}
    for name, column in COLUMNS.items():
        shape = tuple(sizes[axis] for axis in column.axes)
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
    name_lists: dict[str, Any] = {name: stored_names(file, name, source) for name in NAME_LISTS}
    documents: dict[str, Any] = {}
    for name in ("law", "specimen", "design", "provenance"):
        text = file.attrs.get(name)
        documents[name] = parse_json(text, f"{source}: its {name}", DATASET_FILE) if isinstance(text, str) else None
        if not isinstance(documents[name], dict):
            raise _damaged(source, f"the attribute '{name}' is missing, or no record")
    if not name_lists["outputs"] or len(name_lists["reason_names"]) != len(name_lists["reason_texts"]):
        raise _damaged(source, "names no output, or not a text for each reason")
    times = stored_array(file, "time_grid", "f", source)
    lengths = {name: len(values) for name, values in name_lists.items()}
    columns = empty_columns({**lengths, "holds": HOLD_TIMES, "frames": len(times)})
    check_shapes(file, columns, source)
    return Dataset(
        law=_read_law(documents["law"], name_lists["parameter_names"], source),
        specimen=specimen_from_json(documents["specimen"], source, specimen_by_name),
        design_document=documents["design"],
        grid=_read_grid(times, source),
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
        raise _damaged(source, f"its parameters are {', '.join(names)}, those of its law {', '.join(law.names)}")
    return law


def _read_grid(array: h5py.Dataset, source: str) -> TimeGrid:
    relative = array.attrs.get("relative")
    if array.size > MOST_FRAMES or array.ndim != 1 or not isinstance(relative, bool | np.bool_):
        found = f"{array.dtype} {array.shape}, relative {quoted_value(relative)}"
        raise _damaged(source, f"its time grid is {found}")
    try:
        return TimeGrid(array[:], bool(relative))
    except DatasetError as error:
        raise DatasetError(f"{source}: {error}") from None


def read_samples(file: h5py.File, header: Dataset, accepted_only: bool = False) -> Dataset:
    """The header with the samples of a file, in blocks, to save memory."""
    reasons = file["reasons"][:]
    selected = reasons == 0 if accepted_only else np.ones(len(reasons), dtype=bool)
    columns: dict[str, Any] = {name: _read_rows(file[name], selected, COLUMNS[name].memory_type) for name in COLUMNS}
    rows = stored_array(file, "failures/rows", "i", file.filename)
    texts = stored_array(file, "failures/texts", "O", file.filename)
    if rows.shape != texts.shape or rows.ndim != 1 or not np.isin(rows[:], np.arange(len(reasons))).all():
        raise _damaged(file.filename, "its failures are not of samples, each with one text")
    new_row = {int(row): k for k, row in enumerate(np.flatnonzero(selected))}
    pairs = zip(rows[:].tolist(), texts.asstr()[:].tolist(), strict=True)
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
