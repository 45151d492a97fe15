"""A file while it is written: under a temporary name, and only by way of the descriptor that made it.

In a folder that others may write to, the temporary name can be given to another file or to a link at any moment. So
the file is made new and never opened by its name again: content, permissions and hash go through the descriptor, and
a name that has become another's is neither written through nor taken for the result.
"""

from __future__ import annotations

import hashlib
import io
import os
import stat
import time
from contextlib import suppress
from pathlib import Path

from creepkit.files.temporary_names import temporary_name

WAITS = (0.02, 0.1, 0.4)
"""s between attempts to give a file the name of one that another program holds."""


_FLAGS = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


class ReplacedError(OSError):
    """The name of an unfinished file has become that of another."""

    def __init__(self) -> None:
        super().__init__("another program removed the file that was being written, or put another in its place")


def is_own(status: os.stat_result) -> bool:
    """Whether a file is a regular one of our user; of any where a system does not tell users by numbers."""
    if hasattr(os, "geteuid") and status.st_uid != os.geteuid():
        return False
    return stat.S_ISREG(status.st_mode)


class UnfinishedFile:
    """A new file beside `path` under a temporary name, open for writing and reading until it is closed.

    OSError where it cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.name = temporary_name(path)
        self.descriptor = os.open(self.name, _FLAGS, 0o666)
        self._status = os.fstat(self.descriptor)
        self._is_open = True

    def stream(self) -> io.BufferedRandom:
        """The file for writing and reading from its beginning; the end of the stream leaves the file open."""
        os.lseek(self.descriptor, 0, os.SEEK_SET)
        return os.fdopen(self.descriptor, "w+b", closefd=False)

    def write_bytes(self, content: bytes) -> None:
        """Make this the content."""
        with self.stream() as stream:
            stream.truncate()
            stream.write(content)

    def flush(self) -> None:
        """Have the content on the disk: a name that is there before it may be of an empty file after a failure."""
        os.fsync(self.descriptor)

    def allow(self, mode: int) -> None:
        """Give it permissions; nothing where the system has none for open files."""
        with suppress(OSError, AttributeError):
            os.fchmod(self.descriptor, mode)

    def summary(self) -> tuple[str, int]:
        """SHA-256 and bytes of the content."""
        with self.stream() as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest(), stream.tell()

    def move_to(self, path: Path) -> None:
        """Give it its name, in the place of the file that has it; ReplacedError where that failed for another program.

        Windows refuses that as long as anybody has the file open which has the name, as scanners do, or this one.
        """
        self._check()
        if os.name == "nt":
            self._close()
        for wait in (*WAITS, 0.0):
            try:
                os.replace(self.name, path)
                break
            except PermissionError:
                if not wait:
                    raise
                time.sleep(wait)
        self._check_result(path)

    def link_to(self, path: Path) -> None:
        """Give it a name that no file has; FileExistsError where one has it."""
        self._check()
        try:
            os.link(self.name, path)
        except FileExistsError:
            raise
        except OSError:  # a file system without links
            self.move_to(path)

    def end(self) -> None:
        """Close it, and remove its temporary name where it is there still."""
        self._close()
        with suppress(OSError):  # the folder may be no folder
            self.name.unlink(missing_ok=True)

    def _check(self) -> None:
        """ReplacedError where its temporary name became that of another file."""
        try:
            found = os.lstat(self.name)
        except FileNotFoundError:
            raise ReplacedError from None
        if os.name != "nt" and not os.path.samestat(found, self._status):  # Windows counts files in several ways
            raise ReplacedError

    def _check_result(self, path: Path) -> None:
        """ReplacedError where its name went to another between _check() and the end, and that is nobody's we know."""
        with suppress(FileNotFoundError):
            found = os.lstat(path)
            own = os.path.samestat(found, self._status) or is_own(found)  # of another process that was faster
            if os.name != "nt" and not own:
                raise ReplacedError

    def _close(self) -> None:
        if self._is_open:
            self._is_open = False
            os.close(self.descriptor)
