"""Frames in binary files: arrays of MATLAB (versions 5 and 7.3), and packed rows without a head.

Only numeric arrays are read; objects, cells, functions and text in such a file are passed over. The layout of version 5
is that of MathWorks, MAT-File Format (2024). Names and shapes are read first; of a frame its own columns alone are
unpacked, and no more than their sizes say.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.cameras.text_files import FRAME_FILE
from creepkit.errors import HistoryError, quoted
from creepkit.files.limits import how_to_raise, raised
from creepkit.files.reading import read_bytes

LARGEST_FRAME = 20_000_000
"""Numbers of a frame in all its columns."""


MOST_ELEMENTS = 10_000
"""Arrays and other elements in one file."""


_HEAD_BYTES = 4096
"""In which kind, shape and name of an array stand."""


MATLAB_5, HDF5 = b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n\x1a\n"


MATLAB_7 = b"MATLAB 7.3 MAT-file"


_MATRIX, _COMPRESSED = 14, 15


_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""{data type of an element: NumPy's}."""


_NUMERIC_CLASSES = range(6, 16)


@dataclass(frozen=True)
class ArrayTable:
    """Columns of one frame that are arrays in a file.

    shapes : {name: shape}. load : the arrays of some names, each (points,); only what is asked for is read.
    """

    path: Path
    shapes: Mapping[str, tuple[int, ...]]
    load: Callable[[Sequence[str]], Mapping[str, Floats]]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the arrays."""
        return tuple(self.shapes)

    def numbers(self, positions: Sequence[int]) -> Floats:
        """(points, positions) the numbers of some arrays; HistoryError where they differ in shape."""
        chosen = [self.names[k] for k in positions]
        shapes = {name: tuple(size for size in self.shapes[name] if size != 1) for name in chosen}
        if len(set(shapes.values())) > 1:
            listed = ", ".join(f"{name} has {' x '.join(map(str, self.shapes[name]))}" for name in chosen)
            raise HistoryError(f"{self.path}: its arrays differ in their number of points ({listed}); is it damaged?")
        count = sum(math.prod(self.shapes[name]) for name in chosen)
        if count > (most := raised(LARGEST_FRAME)):
            raise HistoryError(
                f"{self.path}: a frame of {count} numbers, of at most {most}; is it damaged? "
                f"{how_to_raise(count, most)}"
            )
        arrays = self.load(chosen)
        return np.stack([arrays[name] for name in chosen], axis=1)

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
    content = memoryview(read_bytes(path, FRAME_FILE))
    stored: dict[str, _Stored] = {}
    with _damage_reported(path):
        for array in _stored_arrays(content):
            if array.name in stored:
                raise HistoryError(f"{path}: two of its arrays are called '{quoted(array.name)}'; keep one of them")
            stored[array.name] = array

    def load(names: Sequence[str]) -> dict[str, Floats]:
        with _damage_reported(path):
            return {name: stored[name].numbers() for name in names}

    return ArrayTable(path, {name: array.shape for name, array in stored.items()}, load)


@contextmanager
def _damage_reported(path: Path) -> Iterator[None]:
    try:
        yield
    except (struct.error, zlib.error, ValueError, IndexError, OverflowError) as error:
        words = " ".join(str(error).split())
        raise HistoryError(f"{path}: cannot be read as arrays of MATLAB, it seems damaged ({words})") from None
    except MemoryError:
        raise HistoryError(f"{path}: holds more than there is memory for; is it damaged?") from None


def _hdf5_table(path: Path) -> ArrayTable:
    """Of a file of version 7.3, which is HDF5."""
    import h5py

    from creepkit.files.hdf5_files import open_hdf5

    def load(names: Sequence[str]) -> dict[str, Floats]:
        with open_hdf5(path, FRAME_FILE) as file:
            return {name: np.asarray(file[name][()], dtype=float).T.ravel() for name in names}

    with open_hdf5(path, FRAME_FILE) as file:
        shapes = {
            name: item.shape[::-1]
            for name, item in file.items()
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and 0 < item.size <= raised(LARGEST_FRAME)
        }
    return ArrayTable(path, shapes, load)


class _Element(NamedTuple):
    kind: int
    data: memoryview


class _Stored(NamedTuple):
    """An array in a file of version 5. data : its element; unpacked only when its numbers are asked for."""

    name: str
    shape: tuple[int, ...]
    data: memoryview
    is_compressed: bool
    order: str

    def numbers(self) -> Floats:
        """(points,)."""
        count = math.prod(self.shape)
        data = _unpacked(self.data, self.order, 8 * count + _HEAD_BYTES) if self.is_compressed else self.data
        values = next(islice(_elements(data, self.order), 3, None), None)
        if values is None or values.kind not in _TYPES:
            raise ValueError("an array has no numbers")
        numbers = np.frombuffer(values.data, dtype=np.dtype(self.order + _TYPES[values.kind]))
        if numbers.size != count:
            raise ValueError(f"the array {quoted(self.name)} has {numbers.size} numbers in the place of {count}")
        return numbers.astype(float).reshape(self.shape, order="F").ravel()


def _stored_arrays(content: memoryview) -> Iterator[_Stored]:
    """The real numeric arrays in a file of version 5, of which no more than their heads is unpacked."""
    order = {b"IM": "<", b"MI": ">"}.get(bytes(content[126:128]))
    if order is None:
        raise ValueError("its mark of the order of bytes is missing")
    for number, element in enumerate(_elements(content[128:], order)):
        if number == MOST_ELEMENTS:
            raise ValueError(f"more than {MOST_ELEMENTS} elements")
        is_compressed = element.kind == _COMPRESSED
        if not is_compressed and element.kind != _MATRIX:
            continue
        head = _unpacked(element.data, order, _HEAD_BYTES, whole=False) if is_compressed else element.data
        described = _described(head[:_HEAD_BYTES], order)
        if described is not None:
            yield _Stored(*described, element.data, is_compressed, order)


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
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


def _unpacked(data: memoryview, order: str, most: int, whole: bool = True) -> memoryview:
    """The inside of the one matrix that a compressed element holds, at most so many bytes; nothing of others.

    whole : whether less than its head says is an error.
    """
    stream = zlib.decompressobj()
    head = stream.decompress(data, 8)
    kind, size = struct.unpack(f"{order}II", head)
    if kind != _MATRIX:
        return memoryview(b"")
    if whole and size > most:
        raise ValueError("a compressed array is larger than its shape says")
    inside = stream.decompress(stream.unconsumed_tail, min(size, most)) if size else b""
    if whole and len(inside) < size:
        raise ValueError("a compressed array is cut off")
    return memoryview(inside)


def _described(head: memoryview, order: str) -> tuple[str, tuple[int, ...]] | None:
    """Name and shape of the array whose matrix begins so; None for what is no real array of numbers."""
    parts = _elements(head, order)
    try:
        flags, shape, name = next(parts, None), next(parts, None), next(parts, None)
    except ValueError:  # they are longer than those of any frame
        return None
    if flags is None or shape is None or name is None or flags.kind != 6 or len(flags.data) < 4:
        return None
    (word,) = struct.unpack_from(f"{order}I", flags.data)
    if word & 0xFF not in _NUMERIC_CLASSES or word & 0x0800 or shape.kind != 5:
        return None
    sizes = struct.unpack(f"{order}{len(shape.data) // 4}i", shape.data[: len(shape.data) // 4 * 4])
    if not 0 < len(sizes) <= 32 or min(sizes) < 1 or math.prod(sizes) > raised(LARGEST_FRAME):
        return None
    return bytes(name.data).decode("ascii", errors="replace").rstrip("\0"), sizes


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
    shapes = {name: rows.shape for name, _ in layout}
    return ArrayTable(path, shapes, lambda names: {name: rows[name].astype(float) for name in names})
