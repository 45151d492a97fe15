"""Workers that run the tasks of a job: processes of this machine with one thread each, or a dask cluster.

A worker process receives task numbers on standard input and writes results to standard output. It is started as a new interpreter, because a fork would copy locks of numba and torch.
"""

from __future__ import annotations

import json
import os
import pickle
import re
import selectors
import signal
import struct
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import IO, Any, Protocol

from creepkit.errors import DatasetError
from creepkit.jobs.worker import Job, ShardedJob, TaskResult, run_task

ADDRESS = re.compile(r"inproc://.+|[a-z]+://.+:[0-9]+/?")


CONNECT_TIMEOUT = 30
"""s, in which a scheduler answers."""


LEAST_QUEUED = 8
"""Shards handed over while a cluster has few workers or none: an adaptive one grows by what waits."""


DEAD_WORKER_ERRORS = ("KilledWorker", "FutureCancelledError", "CancelledError")
"""What dask says of a task whose workers died."""


class ClusterWorkers:
    """The workers of a dask scheduler, at most `size` of their threads at once (None: all); a context."""

    def __init__(self, job: ShardedJob, address: str, thread_limit: int | None = None) -> None:
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


THREADED_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
"""Those that start threads of their own: two on one busy core are many times slower than one."""


ONE_THREAD = dict.fromkeys((f"{library}_NUM_THREADS" for library in THREADED_LIBRARIES), "1")


TERMINATION_TIMEOUT = 5
"""s, in which a worker that is asked to end does so."""


class Workers(Protocol):
    """Whoever does parts of some work."""

    @property
    def free_slots(self) -> int:
        """How many more parts can be worked on at once."""
        ...

    def submit(self, number: int) -> None:
        """Have a part done."""
        ...

    def results(self, timeout: float) -> list[TaskResult]:
        """Wait for answers, at most so many s."""
        ...


@dataclass
class WorkerProcess:
    """A worker process. shard : the part it is at, None when it is idle. ready : whether it has started."""

    popen: subprocess.Popen[bytes]
    task: int | None = None
    ready: bool = False
    buffer: bytes = b""


class ProcessWorkers:
    """Worker processes of this machine; a context."""

    def __init__(self, job: Job, process_count: int) -> None:
        paths = pickle.dumps(sys.path)
        self._setup_message = b"".join(struct.pack("!Q", len(part)) + part for part in (paths, pickle.dumps(job)))
        self._size = process_count
        self._processes: list[WorkerProcess] = []
        self._selector = selectors.DefaultSelector()

    @property
    def free_slots(self) -> int:
        """How many more parts can be worked on at once."""
        return self._size - sum(process.task is not None for process in self._processes)

    def submit(self, number: int) -> None:
        """Give a part to an idle worker, or to a new one."""
        idle = [process for process in self._processes if process.task is None]
        process = idle[0] if idle else self._start()
        process.task = number
        _send(process.popen, b"%d\n" % number)

    def results(self, timeout: float) -> list[TaskResult]:
        """Wait for answers, at most so many s."""
        return [result for key, _ in self._selector.select(timeout) for result in self._read_results(key.data)]

    def __enter__(self) -> ProcessWorkers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._processes:
            process.popen.terminate()
        for process in list(self._processes):
            self._close(process)

    def _start(self) -> WorkerProcess:
        """A new process, in a session of its own: Ctrl-C is for us alone, who then end it."""
        popen = subprocess.Popen(
            [sys.executable, "-m", "creepkit.jobs.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env={**os.environ, **ONE_THREAD},
            start_new_session=True,
        )
        process = WorkerProcess(popen)
        self._processes.append(process)
        self._selector.register(_pipe(popen.stdout), selectors.EVENT_READ, process)
        _send(popen, self._setup_message)
        return process

    def _read_results(self, process: WorkerProcess) -> list[TaskResult]:
        """What a process says: that it is ready, what became of its part, or, by silence, that it is dead."""
        data = _pipe(process.popen.stdout).read(1 << 16)
        if not data:
            return self._after_death(process)
        *lines, process.buffer = (process.buffer + data).split(b"\n")
        messages = [json.loads(line) for line in lines]
        results = [TaskResult(**message) for message in messages if "number" in message]
        process.ready = True
        process.task = None if results else process.task
        return results

    def _after_death(self, process: WorkerProcess) -> list[TaskResult]:
        code = self._close(process)
        cause = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        if code > 0 and not process.ready:
            raise DatasetError(f"a worker process ended as it started ({cause}); what it said is above")
        return [] if process.task is None else [TaskResult(process.task, "died", text=cause)]

    def _close(self, process: WorkerProcess) -> int:
        self._processes.remove(process)
        self._selector.unregister(_pipe(process.popen.stdout))
        for pipe in (process.popen.stdin, process.popen.stdout):
            _pipe(pipe).close()
        try:
            return process.popen.wait(TERMINATION_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.popen.kill()
            return process.popen.wait()


def _send(popen: subprocess.Popen[bytes], data: bytes) -> None:
    """Write to a worker; that it has died is heard where its answers are."""
    with suppress(BrokenPipeError):
        _pipe(popen.stdin).write(data)


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    assert pipe is not None
    return pipe
