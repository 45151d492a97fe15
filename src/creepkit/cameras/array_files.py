"""Frames in binary files: arrays of MATLAB (versions 5 and 7.3), and packed rows without a head.

Only numeric arrays are read; objects, cells, functions and text in such a file are passed over. The layout of version 5
is that of MathWorks, MAT-File Format (2024); no more is unpacked than the arrays' own sizes say.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.cameras.text_files import FRAME_FILE
from creepkit.errors import HistoryError
from creepkit.files.reading import read_bytes

LARGEST_ARRAY = 20_000_000
"""Numbers in one array of a frame."""


MATLAB_5, HDF5 = b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n\x1a\n"


MATLAB_7 = b"MATLAB 7.3 MAT-file"


_MATRIX, _COMPRESSED = 14, 15


_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""{data type of an element: NumPy's}."""


_NUMERIC_CLASSES = range(6, 16)


@dataclass(frozen=True)
class ArrayTable:
    """Columns of one frame that are arrays in a file.

    arrays : {name: (points,)}.
    """

    path: Path
    arrays: Mapping[str, Floats]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the arrays."""
        return tuple(self.arrays)

    def numbers(self, positions: Sequence[int]) -> Floats:
        """(points, positions) the numbers of some arrays; HistoryError where they differ in size."""
        chosen = [self.names[k] for k in positions]
        sizes = {name: self.arrays[name].size for name in chosen}
        if len(set(sizes.values())) > 1:
            listed = ", ".join(f"{name} has {size}" for name, size in sizes.items())
            raise HistoryError(f"{self.path}: its arrays differ in their number of points ({listed}); is it damaged?")
        return np.stack([self.arrays[name] for name in chosen], axis=1)

    def location(self, row: int) -> str:
        """Where a point stands."""
        return f"{self.path}, point {row + 1}"


def is_matlab(content: bytes) -> bool:
    """Whether the beginning of a file is that of a MATLAB file of arrays."""
    return content.startswith((MATLAB_5, MATLAB_7, HDF5))


def matlab_table(path: Path) -> ArrayTable:
    """The numeric arrays of a MATLAB file."""
    if not read_bytes(path, FRAME_FILE, first=len(MATLAB_5)).startswith(MATLAB_5):
        return _hdf5_table(path)
    content = read_bytes(path, FRAME_FILE)
    try:
        arrays = {array.name: array.numbers for array in _arrays(content)}
    except (struct.error, zlib.error, ValueError, IndexError, OverflowError) as error:
        words = " ".join(str(error).split())
        raise HistoryError(f"{path}: cannot be read as arrays of MATLAB, it seems damaged ({words})") from None
    except MemoryError:
        raise HistoryError(f"{path}: holds more than there is memory for; is it damaged?") from None
    return ArrayTable(path, arrays)


def _hdf5_table(path: Path) -> ArrayTable:
    """Of a file of version 7.3, which is HDF5."""
    import h5py

    from creepkit.files.hdf5_files import open_hdf5

    with open_hdf5(path, FRAME_FILE) as file:
        arrays = {
            name: np.asarray(item[()], dtype=float).ravel()
            for name, item in file.items()
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and 0 < item.size <= LARGEST_ARRAY
        }
    return ArrayTable(path, arrays)


class _Array(NamedTuple):
    name: str
    numbers: Floats


class _Element(NamedTuple):
    kind: int
    data: bytes


def _arrays(content: bytes) -> Iterator[_Array]:
    """The real numeric arrays of more than one number in a file of version 5."""
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        raise ValueError("its mark of the order of bytes is missing")
    for element in _elements(content[128:], order):
        data = element.data
        if element.kind == _COMPRESSED:
            data = _unpacked(data, order)
        elif element.kind != _MATRIX:
            continue
        if (array := _array_of(data, order)) is not None:
            yield array


def _elements(data: bytes, order: str) -> Iterator[_Element]:
    """The elements that lie one behind the other in some bytes."""
    position = 0
    while position + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, position)
        small = kind >> 16
        if small:
            if small > 4:
                raise ValueError("an element is larger than its place")
            yield _Element(kind & 0xFFFF, data[position + 4 : position + 4 + small])
            position += 8
            continue
        start, end = position + 8, position + 8 + size
        if end > len(data):
            raise ValueError("it ends amid an element")
        yield _Element(kind, data[start:end])
        position = end if kind == _COMPRESSED else end + -size % 8


def _unpacked(data: bytes, order: str) -> bytes:
    """The inside of the one matrix that a compressed element holds, no longer than its head says; b"" for others."""
    stream = zlib.decompressobj()
    head = stream.decompress(data, 8)
    kind, size = struct.unpack(f"{order}II", head)
    if kind != _MATRIX or size > 8 * LARGEST_ARRAY + 4096:
        return b""
    inside = stream.decompress(stream.unconsumed_tail, size) if size else b""
    if len(inside) < size:
        raise ValueError("a compressed array is cut off")
    return inside


def _array_of(data: bytes, order: str) -> _Array | None:
    """The array in the inside of a matrix; None for what is no real array of numbers."""
    parts = _elements(data, order)
    flags, shape, name = next(parts, None), next(parts, None), next(parts, None)
    if flags is None or shape is None or name is None or flags.kind != 6 or len(flags.data) < 4:
        return None
    (word,) = struct.unpack_from(f"{order}I", flags.data)
    if word & 0xFF not in _NUMERIC_CLASSES or word & 0x0800 or shape.kind != 5:
        return None
    count = 1
    for size in struct.unpack(f"{order}{len(shape.data) // 4}i", shape.data[: len(shape.data) // 4 * 4]):
        count *= size
    if not 0 < count <= LARGEST_ARRAY:
        return None
    values = next(parts, None)
    if values is None or values.kind not in _TYPES:
        raise ValueError("an array has no numbers")
    numbers = np.frombuffer(values.data, dtype=np.dtype(order + _TYPES[values.kind]))
    label = name.data.decode("ascii", errors="replace").rstrip("\0")
    if numbers.size != count:
        raise ValueError(f"the array {label:.40} has {numbers.size} numbers in the place of {count}")
    return _Array(label, numbers.astype(float))


def row_table(path: Path, layout: Sequence[tuple[str, str]]) -> ArrayTable:
    """The columns of a file of packed rows without a head."""
    row = np.dtype([(name, "u1" if kind == "?" else kind) for name, kind in layout])
    content = read_bytes(path, FRAME_FILE)
    if not content or len(content) % row.itemsize:
        raise HistoryError(
            f"{path}: {len(content)} bytes are no whole number of rows of {row.itemsize} bytes; is it cut off, or of "
            "another version?"
        )
    rows = np.frombuffer(content, dtype=row)
    for name, kind in layout:
        if kind == "?" and (rows[name] > 1).any():
            k = int(np.argmax(rows[name] > 1))
            raise HistoryError(
                f"{path}, point {k + 1}: '{name}' is {rows[name][k]}, where 0 or 1 must be; it is of another layout"
            )
    return ArrayTable(path, {name: rows[name].astype(float) for name, _ in layout})
