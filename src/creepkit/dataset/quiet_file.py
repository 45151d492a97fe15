"""A file for HDF5 to write to that runs out of room quietly.

HDF5 tries to write what is left each time that one of its objects is closed, and h5py prints a traceback for each of
these failures, over the one sentence that says what has happened. So the first failure is kept, what follows is taken
and dropped, and the failure is raised when HDF5 is done.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

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
