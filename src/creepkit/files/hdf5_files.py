"""HDF5 files: written whole or not at all with write errors reported once, and read without following external links.

HDF5 tries to write again whenever one of its objects is closed, and h5py prints a traceback for each failure. The first
error is kept, later writes are discarded, and the error is raised when HDF5 is done.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from creepkit.errors import CreepkitError, quoted
from creepkit.files.hdf5_trial import try_hdf5
from creepkit.files.hdf5_walk import promises_too_much
from creepkit.files.limits import how_to_raise, raised
from creepkit.files.private_copies import unchanging
from creepkit.files.reading import FileKind
from creepkit.files.writing import ADVICE, replace_on_success

MAXIMUM_OBJECTS = 20_000
"""Groups and arrays in a file that is read; a data set has some twenty."""


MAXIMUM_CHUNK_BYTES = 64_000_000
"""Of a piece in which an array is stored; a compressed one is unpacked whole, however little of it is wanted."""


FILTERS = frozenset({h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32, h5py.h5z.FILTER_LZF})
"""By which pieces may be stored; others read beyond their memory where a file lies about sizes."""


FAILURES = (OSError, RuntimeError, LookupError, ValueError, TypeError, NotImplementedError, RecursionError)
"""What h5py and whoever reads by it raise of a damaged file."""


class FaultTolerantFile(io.FileIO):
    """A new file that keeps its first failure to write, for `raise_failure` to raise."""

    failure: OSError | None = None

    def write(self, data: Any, /) -> int:
        """Write all of it, or keep the failure."""
        remaining = memoryview(data).cast("B")
        size = len(remaining)
        while remaining:
            written = self._attempt(super().write, remaining)
            if not written:
                break
            remaining = remaining[written:]
        return size

    def truncate(self, size: int | None = None, /) -> int:
        """Change the size, or keep the failure."""
        self._attempt(super().truncate, size)
        return self.tell() if size is None else size

    def raise_failure(self) -> None:
        """Raise the failure that was kept."""
        if self.failure is not None:
            raise self.failure

    def _attempt(self, operation: Callable[[Any], int | None], argument: Any) -> int | None:
        """What the operation returns; None once one has failed."""
        if self.failure is None:
            try:
                return operation(argument)
            except OSError as error:
                self.failure = error
        return None


@contextmanager
def write_hdf5(
    path: Path, error: type[CreepkitError], advice: str = ADVICE, *, force: bool = False, internal: bool = False
) -> Iterator[h5py.File]:
    """A new file, open for writing, that takes the place of `path` when all of it is written.

    advice : what to do when it cannot be written. force, internal : as of replace_on_success().
    """
    with (
        replace_on_success(path, error, advice, force=force, internal=internal) as unfinished,
        _create_hdf5(unfinished.descriptor) as file,
    ):
        yield file


@contextmanager
def _create_hdf5(descriptor: int) -> Iterator[h5py.File]:
    """An empty file, of a version in which attributes may be long; OSError when there is no space for it."""
    with FaultTolerantFile(descriptor, "w+", closefd=False) as raw:
        try:
            with h5py.File(raw, "w", libver=("v110", "v110")) as file:
                yield file
        finally:
            raw.raise_failure()  # in the place of what HDF5 says when it reads what was dropped


@contextmanager
def open_hdf5(path: Path, kind: FileKind, *, bounded: bool = True) -> Iterator[h5py.File]:
    """A file open for reading; the error of `kind` when there is none, it is no HDF5, damaged, or points elsewhere.

    bounded : whether an array that says to be larger than its bytes can be is refused; False where the caller looks at
        the sizes of the arrays that it reads, and leaves others alone.
    """
    with unchanging(path, kind) as stored:
        if not h5py.is_hdf5(stored.path):
            raise kind.error(f"{path}: not an HDF5 file; {kind.advice}")
        try_hdf5(path, stored, kind, raised(MAXIMUM_OBJECTS))
        try:
            with h5py.File(stored.path, "r") as file:
                _check_links(file, path, kind, bounded)
                yield file
        except MemoryError:
            raise kind.error(f"{path}: holds more than there is memory for") from None
        except FAILURES as error:
            text = " ".join(str(error).replace(str(stored.path), str(path)).split())
            raise kind.error(f"{path}: cannot be read, it seems damaged: {quoted(text, 300)}") from None


def write_names(group: h5py.Group, name: str, words: tuple[str, ...]) -> None:
    """Write an attribute that is a list of texts."""
    group.attrs.create(name, np.array(words, dtype=object), dtype=h5py.string_dtype())


def _check_links(file: h5py.File, path: Path, kind: FileKind, bounded: bool) -> None:
    """Raise the error of `kind` for a file that would have HDF5 open other files, or that has no end."""
    groups: list[h5py.Group] = [file]
    visited, most = 0, raised(MAXIMUM_OBJECTS)
    while groups:
        group = groups.pop()
        for name in group:
            visited += 1
            if visited > most:  # hard links may also lead back to where they came from
                raise kind.error(
                    f"{path}: more than {most} objects, or links in a circle; {kind.advice}, or "
                    f"{how_to_raise(2 * most, most)}"
                )
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise kind.error(
                    f"{path}: '{quoted(name)}' is a link to elsewhere, which is not followed; {kind.advice}"
                )
            item = group[name]
            if isinstance(item, h5py.Group):
                groups.append(item)
            elif isinstance(item, h5py.Dataset):
                _check_place(item, path, kind)
                _check_pieces(item, path, kind)
                if bounded:
                    _check_size(item, path, kind)


def _check_place(array: h5py.Dataset, path: Path, kind: FileKind) -> None:
    """Raise the error of `kind` for an array that lies in other files."""
    if array.external or array.is_virtual:
        raise kind.error(
            f"{path}: the array '{quoted(array.name)}' lies in other files, which are not opened; {kind.advice}"
        )


def _check_pieces(array: h5py.Dataset, path: Path, kind: FileKind) -> None:
    """Raise the error of `kind` for an array in pieces that are large, or stored in a way that few files are."""
    if not array.chunks:
        return
    found, most = math.prod(array.chunks) * array.dtype.itemsize, raised(MAXIMUM_CHUNK_BYTES)
    if found > most:
        raise kind.error(
            f"{path}: the array '{quoted(array.name)}' is stored in pieces of {found} bytes, more than {most}; "
            f"{kind.advice}, or {how_to_raise(found, most)}"
        )
    properties = array.id.get_create_plist()
    filters = [properties.get_filter(k)[0] for k in range(properties.get_nfilters())]
    if not set(filters) <= FILTERS or len(set(filters)) < len(filters):
        raise kind.error(
            f"{path}: the array '{quoted(array.name)}' is stored by the HDF5 filters {filters}; read are "
            f"gzip, lzf, shuffle and checksums, once each; {kind.advice}"
        )


def _check_size(array: h5py.Dataset, path: Path, kind: FileKind) -> None:
    """Raise the error of `kind` for an array that says to be larger than its bytes can be."""
    if promises_too_much(array):
        raise kind.error(
            f"{path}: the array '{quoted(array.name)}' says to have {array.nbytes} bytes, and holds "
            f"{array.id.get_storage_size()}; {kind.advice}"
        )
