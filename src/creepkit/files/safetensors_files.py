"""Safetensors files with one JSON header, written whole or not at all; nothing in them is evaluated.

A file is read from one descriptor, its header first: what is no file of ours, or promises other arrays than it holds,
takes no memory. It is not mapped into memory, for a process ends that reads a mapped file while another shortens it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save

from creepkit.files.json_documents import DocumentFormat, check_heading, compact_json, parse_json
from creepkit.files.reading import FileKind, open_binary
from creepkit.files.writing import write_bytes

HEADER_KEY = "creepkit"
"""Under which the header stands in the file's metadata."""


LENGTH_BYTES = 8
"""In front of the header, which say how long it is."""


MAXIMUM_HEADER_BYTES = 50_000_000


MOST_DIMENSIONS = 32


TYPES = {
    "BOOL": "?", "U8": "u1", "I8": "i1", "U16": "<u2", "I16": "<i2", "U32": "<u4", "I32": "<i4", "U64": "<u8",
    "I64": "<i8", "F16": "<f2", "F32": "<f4", "F64": "<f8",
}  # fmt: skip
"""{a type of numbers of the format: what NumPy calls it}; there are others, which NumPy lacks."""


def write_safetensors(
    path: str | Path,
    arrays: Mapping[str, NDArray[Any]],
    header: Mapping[str, Any],
    document: DocumentFormat,
    *,
    internal: bool = False,
) -> Path:
    """Write arrays (...,) by name and a JSON-able header below the heading of its format.

    internal : in a folder that creepkit keeps for itself, or under a name that only creepkit uses.
    """
    text = compact_json({**document.heading, **header})
    contiguous = {name: np.array(array, order="C", copy=True) for name, array in arrays.items()}
    content = save(contiguous, metadata={HEADER_KEY: text})
    return write_bytes(content, Path(path), document.kind.error, internal=internal)


def read_safetensors(path: str | Path, document: DocumentFormat) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """The arrays, {name: (...,)}, and the header without its heading; the error of its kind for other files."""
    path, kind = Path(path), document.kind
    with open_binary(path, kind) as stream:
        try:
            entries, begin = _entries(stream, path, kind)
            text = _of_type(dict, entries.pop("__metadata__", {})).get(HEADER_KEY)
            if text is None:
                raise kind.error(f"{path}: written by another program (there is no creepkit header); {kind.advice}")
            header = check_heading(parse_json(_of_type(str, text), f"{path}: its header", kind), str(path), document)
            places = _places(entries, os.fstat(stream.fileno()).st_size - begin)
            return {name: _array(stream, begin, *place) for name, place in places.items()}, header
        except _DamagedError:
            raise kind.error(f"{path}: damaged, or not a safetensors file; {kind.advice}") from None
        except MemoryError:
            raise kind.error(f"{path}: holds more than there is memory for") from None


class _DamagedError(Exception):
    """The file is not what its format says."""


Kind = TypeVar("Kind")


def _of_type(kind: type[Kind], value: Any) -> Kind:
    if type(value) is not kind:
        raise _DamagedError
    return value


def _entries(stream: BinaryIO, path: Path, kind: FileKind) -> tuple[dict[str, Any], int]:
    """What a file says of its arrays, {name: their type, shape and place}, and where their bytes begin."""
    length = int.from_bytes(stream.read(LENGTH_BYTES), "little")
    if not 0 < length <= MAXIMUM_HEADER_BYTES:
        raise _DamagedError
    content = stream.read(length)
    if len(content) < length or not content.startswith(b"{"):
        raise _DamagedError
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise _DamagedError from None
    return _of_type(dict, parse_json(text, f"{path}: its header", kind)), LENGTH_BYTES + length


def _places(entries: Mapping[str, Any], size: int) -> dict[str, tuple[np.dtype[Any], tuple[int, ...], int]]:
    """{name: type, shape, first byte} of arrays that lie one behind another and make up `size` bytes together."""
    places, ranges = {}, []
    for name, entry in entries.items():
        if _of_type(dict, entry).keys() != {"dtype", "shape", "data_offsets"}:
            raise _DamagedError
        numpy_name, offsets = TYPES.get(_of_type(str, entry["dtype"])), _counts(entry["data_offsets"])
        shape = tuple(_counts(entry["shape"]))
        if numpy_name is None or len(offsets) != 2 or len(shape) > MOST_DIMENSIONS:
            raise _DamagedError
        dtype, (first, end) = np.dtype(numpy_name), offsets
        if end - first != math.prod(shape) * dtype.itemsize:
            raise _DamagedError
        places[name] = (dtype, shape, first)
        ranges.append((first, end))
    end = 0
    for first, following in sorted(ranges):
        if first != end:
            raise _DamagedError
        end = following
    if end != size:
        raise _DamagedError
    return places


def _counts(values: Any) -> list[int]:
    if any(_of_type(int, one) < 0 for one in _of_type(list, values)):
        raise _DamagedError
    return list(values)


def _array(stream: BinaryIO, begin: int, dtype: np.dtype[Any], shape: tuple[int, ...], first: int) -> NDArray[Any]:
    """An array (shape) whose bytes stand at `begin` + `first`."""
    try:
        array = np.empty(shape, dtype)
    except ValueError:  # of no numbers, and of more in one direction than there can be
        raise _DamagedError from None
    if array.size:
        stream.seek(begin + first)
        if stream.readinto(array.reshape(-1).view(np.uint8).data) != array.nbytes:  # type: ignore[attr-defined]
            raise _DamagedError
    return array
