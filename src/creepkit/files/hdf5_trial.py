"""HDF5 files are tried in another process first: damaged ones can keep the HDF5 library for ever, or make it crash.

While the library is in such a loop, no line of Python runs in its process, not even at Ctrl-C. The process that tries
is started with the first file and kept (see `hdf5_walk`).
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

from creepkit.errors import quoted
from creepkit.files.limits import how_to_raise, raised
from creepkit.files.private_copies import UnchangingFile
from creepkit.files.reading import FileKind
from creepkit.import_path import environment_without_working_folder, options_of_another_interpreter

CPU_SECONDS = 4
"""In which HDF5 has to come to the end of a small file; 20,000 objects take one."""


BYTES_PER_SECOND = 10_000_000
"""Of a larger file, that are read in one second of CPU time at least."""


MOST_REMEMBERED = 100_000
"""Files that are not tried twice while they stay as they are."""


_PROGRAM = Path(__file__).with_name("hdf5_walk.py")


def try_hdf5(path: Path, stored: UnchangingFile, kind: FileKind, most: int) -> None:
    """Raise the error of `kind` for a file that the HDF5 library cannot read, never ends with, or crashes at.

    path : of the file as it is called. stored : of which the content is read. most : objects that are looked at. Where
    no other process can be started, nothing is tried.
    """
    state = stored.path.stat()
    times = (state.st_mtime_ns, state.st_ctime_ns)
    key = (stored.digest or (os.path.abspath(path), state.st_size, *times, state.st_ino, state.st_dev), most)
    seconds = raised(CPU_SECONDS + state.st_size // BYTES_PER_SECOND)
    with _trial.lock:
        if key in _trial.read:
            return
        problem = _trial.problem_with(stored.path, seconds, most)
        if problem == "" and len(_trial.read) < MOST_REMEMBERED:
            _trial.read.add(key)
    if problem is None:
        raise kind.error(
            f"{path}: the HDF5 library does not come to the end of this file in {seconds} s of CPU time, or crashes at "
            f"it; it seems damaged; {kind.advice}, or {how_to_raise(4 * seconds, seconds)}"
        )
    if problem:
        raise kind.error(
            f"{path}: cannot be read, it seems damaged: {quoted(problem.replace(str(stored.path), str(path)), 300)}"
        )


class _Trial:
    """The process that tries files, once there is one. read : what identifies files that were read to their ends."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.read = set[tuple[object, ...]]()
        self._process: subprocess.Popen[str] | None = None
        self._owner = 0

    def problem_with(self, path: Path, seconds: int, most: int) -> str | None:
        """What HDF5 says is wrong with a file, "" for nothing, or where no process can be started; None of an end."""
        process = self._running()
        if process is None:
            return ""
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            print(json.dumps([os.path.abspath(path), seconds, most]), file=process.stdin, flush=True)
            if line := process.stdout.readline():
                return str(json.loads(line))
        except OSError:  # it has ended
            pass
        self.close()
        return None

    def close(self) -> None:
        """Let the process end, if it has not."""
        if self._process is not None and self._owner == os.getpid():
            _end(self._process)
        self._process = None

    def _running(self) -> subprocess.Popen[str] | None:
        if self._process is not None and (self._owner != os.getpid() or self._process.poll() is not None):
            self.close()  # this process is a fork of the one that started it, or someone else has ended it
        if self._process is None and sys.executable:
            try:
                process = subprocess.Popen(
                    [sys.executable, *options_of_another_interpreter(), str(_PROGRAM)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    text=True,
                    cwd=_PROGRAM.parent,
                    env=environment_without_working_folder(),
                )
            except OSError:
                return None
            assert process.stdout is not None
            if not process.stdout.readline():  # it cannot import what it needs, for lack of memory for example
                _end(process)
                return None
            self._process, self._owner = process, os.getpid()
        return self._process


def _end(process: subprocess.Popen[str]) -> None:
    """Close a process's streams, which ends it."""
    for stream in (process.stdin, process.stdout):
        with suppress(OSError):
            if stream is not None:
                stream.close()
    process.wait()


_trial = _Trial()
atexit.register(_trial.close)


def _renew_lock() -> None:
    """In a fork: of the thread that held the lock there is none here."""
    _trial.lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_lock)
