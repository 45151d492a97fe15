"""Shards simulated by a dask cluster; the folder of the shards must be one that all its workers see."""

from __future__ import annotations

import re
import time
from contextlib import suppress
from types import TracebackType
from typing import Any

from creepkit.dataset.shards import TaskResult, Campaign
from creepkit.dataset.worker import run_task
from creepkit.errors import DatasetError

ADDRESS = re.compile(r"inproc://.+|[a-z]+://.+:[0-9]+/?")
CONNECT_TIMEOUT = 30
"""s, in which a scheduler answers."""
LEAST_QUEUED = 8
"""Shards handed over while a cluster has few workers or none: an adaptive one grows by what waits."""
DEAD_WORKER_ERRORS = ("KilledWorker", "FutureCancelledError", "CancelledError")
"""What dask says of a task whose workers died."""


class ClusterWorkers:
    """The workers of a dask scheduler, at most `size` of their threads at once (None: all); a context."""

    def __init__(self, job: Campaign, address: str, thread_limit: int | None = None) -> None:
        self._job = job.on_one_thread()
        self._address = address
        self._size = thread_limit
        self._client: Any = None
        self._futures: dict[Any, int] = {}

    def __enter__(self) -> ClusterWorkers:
        try:
            from distributed import Client
        except ImportError:
            raise DatasetError("--cluster needs dask; install it with: pip install 'creepkit[cluster]'") from None
        if not ADDRESS.fullmatch(self._address):  # a client of such an address takes a minute to go
            raise DatasetError(f"'{self._address}' is no address of a dask scheduler; write tcp://host:port")
        try:
            self._client = Client(  # type: ignore[no-untyped-call]
                self._address, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, ValueError) as error:
            raise DatasetError(f"no dask scheduler answers at {self._address}: {_one_line(error)}") from None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.cancel(list(self._futures))
        self._client.close()

    @property
    def free_slots(self) -> int:
        """How many more shards can be handed over: two for each thread, so that none waits for us."""
        size = self._size or max(LEAST_QUEUED, 2 * sum(self._client.nthreads().values()))
        return max(size - len(self._futures), 0)

    def submit(self, number: int) -> None:
        """Hand a shard to the scheduler."""
        self._futures[self._client.submit(run_task, self._job, number, pure=False)] = number

    def results(self, timeout: float) -> list[TaskResult]:
        """Wait for answers, at most so many s."""
        from distributed import wait

        if not self._futures:
            time.sleep(timeout)
            return []
        with suppress(TimeoutError), self._client.as_current():
            wait(list(self._futures), timeout, "FIRST_COMPLETED")  # type: ignore[no-untyped-call]
        finished = [future for future in self._futures if future.done()]
        return [self._result(future, self._futures.pop(future)) for future in finished]

    def _result(self, future: Any, number: int) -> TaskResult:
        """What a task returned; a worker that died in it often enough is an answer too."""
        error = future.exception()
        if error is None:
            result: TaskResult = future.result()
            return self._checked(result)
        if type(error).__name__ in DEAD_WORKER_ERRORS:
            return TaskResult(number, "died", text=type(error).__name__)
        return TaskResult(number, "error", text=f"a dask worker could not run its shard: {_one_line(error)}")

    def _checked(self, result: TaskResult) -> TaskResult:
        """The answer, unless what was done there cannot be seen here."""
        if result.status == "done" and not self._job.path(result.number).exists():
            text = f"a dask worker wrote {self._job.path(result.number)}, which is not there on this machine"
            return TaskResult(result.number, "error", text=f"{text}; name a file in a folder that all machines share")
        return result


def _one_line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
