"""HDF5 files: written whole or not at all, and read without following external links.

They are made in memory: HDF5 would try to write again whenever one of its objects is closed on a disk that is full, and
h5py print a traceback for each failure.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from creepkit.errors import CreepkitError, quoted
from creepkit.files.reading import MAXIMUM_UNPACKED_BYTES, FileKind, check_readable
from creepkit.files.writing import ADVICE, replace_on_success

LARGEST_COMPRESSION = 100
"""Bytes of all arrays a byte of the file, beyond MAXIMUM_UNPACKED_BYTES; arrays of numbers have 1 to 30."""


FAILURES = (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError)
"""What h5py and whoever reads by it raise of a damaged file."""


@contextmanager
def write_hdf5(
    path: Path, error: type[CreepkitError], advice: str = ADVICE, *, force: bool = False, internal: bool = False
) -> Iterator[h5py.File]:
    """A new file, open for writing, that takes the place of `path` when all of it is written.

    advice : what to do when it cannot be written. force, internal : as of replace_on_success().
    """
    content = io.BytesIO()
    with replace_on_success(path, error, advice, force=force, internal=internal) as temporary:
        with h5py.File(content, "w", libver=("v110", "v110")) as file:  # in which attributes may be long
            yield file
        temporary.write_bytes(content.getbuffer())


@contextmanager
def open_hdf5(path: Path, kind: FileKind) -> Iterator[h5py.File]:
    """A file open for reading; the error of `kind` when there is none, it is no HDF5, damaged, or points elsewhere."""
    check_readable(path, kind)
    if not h5py.is_hdf5(path):
        raise kind.error(f"{path}: not an HDF5 file; {kind.advice}")
    try:
        with h5py.File(path, "r") as file:
            _check(file, path, kind)
            yield file
    except MemoryError:
        raise kind.error(f"{path}: holds more than there is memory for") from None
    except FAILURES as error:
        text = " ".join(str(error).split())
        raise kind.error(f"{path}: cannot be read, it seems damaged: {quoted(text, 300)}") from None


def _check(file: h5py.File, path: Path, kind: FileKind) -> None:
    """Raise the error of `kind` for a file that would have HDF5 open other files, or that unpacks to too much."""
    groups, known, size = [file], {h5py.h5o.get_info(file.id).addr}, 0
    most = max(MAXIMUM_UNPACKED_BYTES, LARGEST_COMPRESSION * path.stat().st_size)
    while groups:
        group = groups.pop()
        for name in group:
            item = group[name] if isinstance(group.get(name, getlink=True), h5py.HardLink) else None
            is_array = isinstance(item, h5py.Dataset)
            if item is None or (is_array and (item.external or item.is_virtual)):
                raise kind.error(
                    f"{path}: '{quoted(name)}' is a link to elsewhere, which is not followed; {kind.advice}"
                )
            size += item.nbytes if is_array else 0
            if size > most:
                raise kind.error(f"{path}: its arrays have more than {most / 1e6:g} MB unpacked; {kind.advice}")
            if isinstance(item, h5py.Group) and (place := h5py.h5o.get_info(item.id).addr) not in known:
                known.add(place)  # links may lead back to where they came from
                groups.append(item)
