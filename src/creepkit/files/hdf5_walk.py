"""A program that reads HDF5 files for another process: the HDF5 library may never return from a damaged one, or crash.

Started by `hdf5_trial`. It says "ready" and reads requests from standard input, a line of JSON each: [path, seconds of
CPU, most objects]. It answers with a line: what is wrong with the file, or nothing. A file that HDF5 does not come to
the end of ends this process, and so does a crash; one that takes much memory is refused.

Read are attributes, texts and the numbers of all arrays, piece by piece. Links to other files are not followed.
"""

from __future__ import annotations

import faulthandler
import json
import math
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from typing import Any

import h5py

WALL_SECONDS = 600
"""In which a file has to be read where there is no clock of CPU time, and where a disk does not answer."""


MEMORY_BYTES = 500_000_000
"""That may be taken beside what this process begins with."""


PIECE_BYTES = 16_000_000
"""Of an array that is read at once."""


LARGEST_COMPRESSION = 1032
"""Bytes that one of gzip's may stand for, at most; what lies outside chunks is not compressed at all."""


ALWAYS_ALLOWED_BYTES = 1_000_000
"""Of an array whose values are nowhere, as those of a file that was only begun."""


UNREADABLE = (TypeError, NotImplementedError)
"""What h5py raises of types that NumPy does not have; who needs them says so."""


def promises_too_much(array: h5py.Dataset) -> bool:
    """Whether an array says to be larger than its bytes can be."""
    stored = array.id.get_storage_size()
    allowed = stored * LARGEST_COMPRESSION if array.chunks else stored
    return bool(array.nbytes > max(allowed, ALWAYS_ALLOWED_BYTES))


def problem_with(path: str, most: int) -> str:
    """What is wrong with a file, in the words of the HDF5 library; "" where it can be read."""
    try:
        with h5py.File(path, "r") as file:
            _read(file, most, max(os.path.getsize(path), 1))
    except MemoryError:
        return "it takes too much memory"
    except Exception as error:
        return " ".join(str(error).split())[:300] or type(error).__name__
    return ""


def _read(file: h5py.File, most: int, size: int) -> None:
    """Read what a file holds, of so many objects at most; size : of the file, bytes."""
    groups, known = [file], {_place(file)}
    while groups:
        group = groups.pop()
        _read_attributes(group)
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                continue
            with suppress(*UNREADABLE):
                item = group[name]
                if _place(item) in known:
                    continue
                known.add(_place(item))
                if len(known) > most:
                    return
                if isinstance(item, h5py.Group):
                    groups.append(item)
                elif isinstance(item, h5py.Dataset):
                    _read_array(item, size)


def _place(item: h5py.Group | h5py.Dataset | h5py.Datatype) -> Any:
    """Where an object begins in its file: links may lead to one by several ways."""
    return h5py.h5o.get_info(item.id).addr


def _read_attributes(item: h5py.Group | h5py.Dataset) -> None:
    for k in range(h5py.h5a.get_num_attrs(item.id)):
        name = h5py.h5a.open(item.id, index=k).get_name()
        with suppress(*UNREADABLE):
            item.attrs[name]


def _read_array(array: h5py.Dataset, size: int) -> None:
    _read_attributes(array)
    if array.is_virtual or array.external or array.shape is None or not array.size or promises_too_much(array):
        return
    for piece in _pieces(array, size):
        array[piece]


def _pieces(array: h5py.Dataset, size: int) -> Iterator[Any]:
    """What to read at once; size : of the file, which every text may refer to the whole of."""
    if not array.shape:
        return iter([()])
    if array.chunks and not array.dtype.hasobject:
        return iter(array.iter_chunks())
    row = math.prod(array.shape[1:]) * (size if array.dtype.hasobject else array.dtype.itemsize)
    step = max(PIECE_BYTES // max(row, 1), 1)
    return (slice(start, start + step) for start in range(0, array.shape[0], step))


def limit_memory() -> None:
    """Allow little more than what this process has, where the system can."""
    with suppress(Exception):
        resource = import_module("resource")  # not on Windows
        with open("/proc/self/statm", encoding="ascii") as file:
            used = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, resource.getrlimit(resource.RLIMIT_AS)[1]))


def main() -> None:
    """Answer requests until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    limit_memory()
    print("ready", flush=True)
    for line in sys.stdin:
        path, seconds, most = json.loads(line)
        faulthandler.dump_traceback_later(WALL_SECONDS, exit=True)
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_PROF, seconds)  # SIGPROF ends a process that does not handle it
        answer = problem_with(path, most)
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
