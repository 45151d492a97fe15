"""Frames in arrays of MATLAB (versions 5 and 7.3).

Names and shapes are read first; of a frame its own columns alone are unpacked. Real arrays of numbers count; objects,
cells, functions and text in such a file are passed over.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.cameras.text_files import FRAME_FILE
from creepkit.errors import CreepkitError, HistoryError
from creepkit.files.reading import read_bytes

MATLAB_5, MATLAB_7, HDF5 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n\x1a\n"


_NO_NUMBERS = ("char", "cell", "struct", "object", "opaque", "function", "sparse", "unknown")
"""Classes of MATLAB's arrays, as scipy.io.whosmat calls them, that are no real numbers."""


@dataclass(frozen=True)
class ArrayTable:
    """Columns of one frame that are arrays in a file.

    shapes : {name: shape}. load : of some names, the arrays (...,) of these shapes; others are not read.
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
        shapes = {tuple(size for size in self.shapes[name] if size != 1) for name in chosen}
        if len(shapes) > 1:
            listed = ", ".join(f"{name} has {' x '.join(map(str, self.shapes[name]))}" for name in chosen)
            raise HistoryError(f"{self.path}: its arrays differ in their number of points ({listed}); is it damaged?")
        arrays = self.load(chosen)
        return np.stack([np.asarray(arrays[name], dtype=float).ravel() for name in chosen], axis=1)

    def first_row(self) -> ArrayTable:
        """The table itself, of which no part is cheaper to read."""
        return self

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
    from scipy.io import loadmat, whosmat

    content = read_bytes(path, FRAME_FILE)
    with _damage_reported(path):
        arrays = whosmat(io.BytesIO(content))
    shapes = {name: shape for name, shape, kind in arrays if kind not in _NO_NUMBERS and math.prod(shape) > 0}

    def load(names: Sequence[str]) -> Mapping[str, Floats]:
        with _damage_reported(path):
            found = loadmat(io.BytesIO(content), variable_names=names)
            if complex_ones := [name for name in names if np.iscomplexobj(found[name])]:
                raise HistoryError(f"{path}: '{complex_ones[0]}' holds complex numbers; a length is a real one")
            return {name: found[name] for name in names}

    return ArrayTable(path, shapes, load)


@contextmanager
def _damage_reported(path: Path) -> Iterator[None]:
    try:
        yield
    except CreepkitError:
        raise
    except Exception as error:  # SciPy raises errors of many kinds of a damaged file
        words = " ".join(str(error).split())
        raise HistoryError(f"{path}: cannot be read as arrays of MATLAB, it seems damaged ({words})") from None


def _hdf5_table(path: Path) -> ArrayTable:
    """Of a file of version 7.3, which is HDF5."""
    import h5py

    from creepkit.files.hdf5_files import open_hdf5

    def load(names: Sequence[str]) -> Mapping[str, Floats]:
        with open_hdf5(path, FRAME_FILE) as file:
            return {name: file[name][()].T for name in names}

    with open_hdf5(path, FRAME_FILE) as file:
        numeric = {n: one for n, one in file.items() if isinstance(one, h5py.Dataset) and one.dtype.kind in "fiu"}
        return ArrayTable(path, {name: one.shape[::-1] for name, one in numeric.items() if one.size}, load)
