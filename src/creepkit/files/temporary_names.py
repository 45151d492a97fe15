"""Names of files while they are written, and the removal of those whose process was killed.

A name says which process writes the file: `.NAME.PLACE-PID-RANDOM.part`, where PLACE stands for the machine and the
process table that PID is from. The first writing of a process into a folder removes what dead processes of the same
place have left there, whatever they were writing.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import stat
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

PART = ".part"

_PATTERN = re.compile(r"\..+\.([0-9a-f]{8})-([0-9]{1,10})-[0-9a-f]{8}\.part", re.DOTALL)


OLD = 86_400.0
"""s after which a file is taken for left where processes cannot be asked for."""


_tidied: set[str] = set()


def temporary_name(path: Path) -> Path:
    """A new name beside `path`, once the folder is free of what killed processes have left."""
    folder = os.path.abspath(path.parent)
    if folder not in _tidied:
        _tidied.add(folder)
        remove_leftovers(path.parent)
    return path.with_name(f"{temporary_beginning(path)}{_place()}-{os.getpid()}-{secrets.token_hex(4)}{PART}")


def temporary_beginning(path: Path) -> str:
    """What all temporary names of a file begin with."""
    name = path.name
    if len(os.fsencode(name)) > 200:  # of 255 bytes that a file system allows
        name = hashlib.sha256(os.fsencode(name)).hexdigest()[:32]
    return f".{name}."


def is_temporary(path: Path, of: Path | None = None) -> bool:
    """Whether a regular file has such a name, whatever process made it. of : the file that it was of."""
    found = _PATTERN.fullmatch(path.name)
    if not found or (of is not None and path.name[: found.start(1)] != temporary_beginning(of)):
        return False
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files whose process is dead."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            found = _PATTERN.fullmatch(entry.name)
            if found and found[1] == _place() and _is_left(entry, int(found[2])):
                with suppress(OSError):
                    os.unlink(entry.path)


@cache
def _place() -> str:
    """Of this machine and its process table, which containers have of their own."""
    table = 0
    with suppress(OSError):
        table = os.stat("/proc/self/ns/pid").st_ino
    return hashlib.sha256(f"{platform.node()} {table}".encode("utf-8", "replace")).hexdigest()[:8]


def _is_left(entry: os.DirEntry[str], process: int) -> bool:
    try:
        state = entry.stat(follow_symlinks=False)
        if not stat.S_ISREG(state.st_mode):
            return False
        if os.name == "nt":  # where signal 0 would not ask for a process, but end it
            return time.time() - state.st_mtime > OLD
        if state.st_uid != os.geteuid():
            return False
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return True
    except OSError:
        return False
    return False
