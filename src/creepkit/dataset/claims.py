"""Claims on shards: who is at work on one, and on which sample, so that nobody does it twice and no death is forgotten.

A claim is a lock that the system takes back when its process dies, however it dies: a stale one cannot be. Its file
says which sample is being simulated; what stands there when the lock is free again died with its process. Where a file
system knows no locks, a shard may be done twice, with the same result, and counts once.
"""

from __future__ import annotations

import errno
import fcntl
import os
from collections import Counter
from pathlib import Path
from types import TracebackType

UNSUPPORTED_LOCK_ERRORS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL)
"""What file systems without locks answer."""

MOST_DIGITS = 19
"""Of the number of a sample; what has more is none."""


class ShardLock:
    """The claim on a shard; a context, `held` in it when nobody else has it.

    deaths : {sample: how often its process died in it}.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = -1
        self._recorded_deaths = b""
        self.held = False
        self.deaths: Counter[int] = Counter()

    def __enter__(self) -> ShardLock:
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
        self.held = _locked(self._file)
        if self.held:
            lines = os.pread(self._file, 1 << 20, 0).split()
            self.deaths = Counter(int(line) for line in lines if line.isdigit() and len(line) < MOST_DIGITS)
            self._recorded_deaths = b"".join(b"%d\n" % row for row in self.deaths.elements())
        return self

    def record_start(self, sample: int) -> None:
        """Note that a sample is being simulated now."""
        os.ftruncate(self._file, len(self._recorded_deaths))
        os.pwrite(self._file, b"%d\n" % sample, len(self._recorded_deaths))

    def remove(self) -> None:
        """Take the file away: the shard is done."""
        self._path.unlink(missing_ok=True)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.held:  # what ends here, be it by an error, has not died
            os.ftruncate(self._file, len(self._recorded_deaths))
        os.close(self._file)


def _locked(file: int) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in UNSUPPORTED_LOCK_ERRORS:
            raise
    return True
