"""A program that goes through HDF5 files for another process: the HDF5 library may never return from a damaged one.

Started by `hdf5_trial`. It says "ready" and reads requests from standard input, a line of JSON each: [path, seconds of
CPU, most objects]. It writes a line with "done" when it has come to the end of that file, whatever it met there: what
is wrong with a file is for those to say who read it. A file that HDF5 does not come to the end of ends this process,
and so does a crash.

Only what HDF5 follows of its own accord is followed: groups, attributes, texts, and the places of the pieces that an
array is stored in; not links to other files, nor the numbers of arrays.
"""

from __future__ import annotations

import faulthandler
import json
import signal
import sys
from contextlib import suppress

import h5py

WALL_SECONDS = 300
"""In which a file has to be gone through where there is no clock of CPU time, and where a disk does not answer."""


def walk(path: str, most: int) -> None:
    """Go through a file, to so many objects at most."""
    with h5py.File(path, "r") as file:
        groups, visited = [file], 0
        while groups and visited <= most:
            group = groups.pop()
            _walk_attributes(group)
            for name in group:
                visited += 1
                if visited > most:
                    break
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    continue
                item = group[name]
                if isinstance(item, h5py.Group):
                    groups.append(item)
                elif isinstance(item, h5py.Dataset):
                    _walk_array(item, most)


def _walk_attributes(item: h5py.Group | h5py.Dataset) -> None:
    for name in item.attrs:
        with suppress(Exception):
            item.attrs[name]


def _walk_array(array: h5py.Dataset, most: int) -> None:
    _walk_attributes(array)
    with suppress(Exception):
        if array.is_virtual or array.external:
            return
        if array.dtype.hasobject:
            for place in range(min(len(array), most)):
                array[place]
        elif array.chunks:
            array.id.get_num_chunks()


def main() -> None:
    """Answer requests until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    print("ready", flush=True)
    for line in sys.stdin:
        path, seconds, most = json.loads(line)
        faulthandler.dump_traceback_later(WALL_SECONDS, exit=True)
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_PROF, seconds)  # SIGPROF ends a process that does not handle it
        with suppress(Exception):
            walk(path, most)
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        faulthandler.cancel_dump_traceback_later()
        print("done", flush=True)


if __name__ == "__main__":
    main()
