"""HDF5 files whose write errors are reported once.

HDF5 tries to write again whenever one of its objects is closed, and h5py prints a traceback for each failure. The first error is kept, later writes are discarded, and the error is raised when HDF5 is done.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py

if TYPE_CHECKING:
    from collections.abc import Callable


class FaultTolerantFile(io.FileIO):
    """A new file that keeps its first failure to write, for `check` to raise."""

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
        """What the act returns; None once one has failed."""
        if self.failure is None:
            try:
                return operation(argument)
            except OSError as error:
                self.failure = error
        return None


@contextmanager
def create_hdf5(path: Path) -> Iterator[h5py.File]:
    """A new file, of a version in which attributes may be long; OSError when there is no room for it."""
    with FaultTolerantFile(path, "w+") as raw:
        try:
            with h5py.File(raw, "w", libver=("v110", "v110")) as file:
                yield file
        finally:
            raw.raise_failure()  # in the place of what HDF5 says when it reads what was dropped
