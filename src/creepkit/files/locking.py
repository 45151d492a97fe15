"""A lock on an open file, which the operating system releases when its process ends, by whatever means it has.

Unix systems lock a file as a whole, without hindering readers. Windows locks bytes and keeps others from reading them,
so that one byte far beyond the end is locked there, and the content stays readable.
"""

from __future__ import annotations

import errno
import importlib
import os
from typing import Any


def _module_if_any(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


fcntl = _module_if_any("fcntl")
"""Of Unix systems."""


msvcrt = _module_if_any("msvcrt")
"""Of Windows."""


UNSUPPORTED_LOCK_ERRORS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL)
"""Errors of file systems without locks."""


LOCKED_BYTE = 1 << 30
"""Place of the byte that is locked on Windows."""


HELD_ELSEWHERE = (errno.EACCES, errno.EDEADLK, errno.EAGAIN)
"""Errors of Windows for a byte that another process has locked."""


def lock_file(file: int) -> bool:
    """Lock an open file (its descriptor) for this process; False where another has it.

    True where locks are not to be had, on a file system or a system without them. OSError for any other failure.
    """
    try:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        elif msvcrt is not None:
            return _lock_byte(file)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in UNSUPPORTED_LOCK_ERRORS:
            raise
    return True


def _lock_byte(file: int) -> bool:
    before = os.lseek(file, 0, os.SEEK_CUR)
    os.lseek(file, LOCKED_BYTE, os.SEEK_SET)
    try:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        if error.errno in HELD_ELSEWHERE:
            return False
        raise
    finally:
        os.lseek(file, before, os.SEEK_SET)
    return True
