"""Workers that run the tasks of a job: processes of this machine with one thread each, or a dask cluster.

A worker process receives task numbers on standard input and writes results to standard output.
"""

from __future__ import annotations

import json
import pickle
import queue
import re
import signal
import socket
import subprocess
import threading
import time
from collections import Counter
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from types import TracebackType
from typing import IO, Any, Protocol

from creepkit import limits
from creepkit.arrays import usable_cores
from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError, DatasetError, quoted
from creepkit.jobs.worker_process import Job, ShardedJob, TaskResult, run_task
from creepkit.jobs.worker_start import setup_message, start_worker
from creepkit.options import Options, option

SHARD_ROWS = 256
"""Samples of a shard: some seconds of work, so that little is lost when a process dies."""


ADDRESS = re.compile(r"inproc://.+|[a-z]+://.+:[0-9]+/?")


CONNECT_TIMEOUT = 30
"""s, in which a scheduler answers."""


WORKERLESS_TIMEOUT = 600
"""s, within which a queue of jobs starts a worker."""


LEAST_QUEUED = 8
"""Shards handed over while a cluster has few workers or none: an adaptive one grows with its queue."""


DEAD_WORKER_ERRORS = ("KilledWorker", "FutureCancelledError", "CancelledError")
"""Errors that dask gives a task whose workers died."""


class ClusterWorkers:
    """The workers of a dask scheduler, at most `size` of their threads at once (None: all); a context."""

    def __init__(self, job: ShardedJob, address: str, thread_limit: int | None = None) -> None:
        self._job = job.on_one_thread()
        self._address = address
        self._size = thread_limit
        self._client: Any = None
        self._futures: dict[Any, int] = {}
        self._last_worker = time.monotonic()

    def __enter__(self) -> ClusterWorkers:
        try:
            from distributed import Client
        except ImportError:
            raise DatasetError("--cluster needs dask; install it with: pip install 'creepkit[cluster]'") from None

        class OwnClient(Client):
            """A client that is closed by us: one that could not connect would be closed for a minute, and fail."""

            def __del__(self) -> None:
                """Nothing."""

        self._check_reachable()
        try:
            self._client = OwnClient(  # type: ignore[no-untyped-call]
                self._address, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except Exception as error:  # whatever dask makes of what another kind of server says
            raise self._silent(error) from None
        return self

    def _check_reachable(self) -> None:
        """DatasetError where nothing answers: a client of dask takes minutes for that, and fails in several ways."""
        scheme, _, rest = self._address.partition("://")
        host, _, port = rest.rstrip("/").rpartition(":")
        if scheme == "inproc":
            return
        try:
            socket.create_connection((host.strip("[]"), int(port)), CONNECT_TIMEOUT).close()
        except (OSError, ValueError, OverflowError) as error:
            raise self._silent(error) from None

    def _silent(self, error: Exception) -> DatasetError:
        return DatasetError(
            f"no dask scheduler answers at {self._address}: {_one_line(error)}; check the "
            "address, and that the scheduler runs"
        )

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
        """Wait for results, at most `timeout` s."""
        from distributed import wait

        self._check_workers()
        if not self._futures:
            time.sleep(timeout)
            return []
        with suppress(TimeoutError), self._client.as_current():
            wait(list(self._futures), timeout, "FIRST_COMPLETED")  # type: ignore[no-untyped-call]
        finished = [future for future in self._futures if future.done()]
        return [self._result(future, self._futures.pop(future)) for future in finished]

    def _check_workers(self) -> None:
        """DatasetError where the scheduler is gone, or has had no worker for WORKERLESS_TIMEOUT."""
        if self._client.status not in ("running", "connecting"):
            raise DatasetError(
                f"the dask scheduler at {self._address} is gone; start it again, and the same call goes on from here"
            )
        if self._client.status == "running" and self._client.nthreads():
            self._last_worker = time.monotonic()
        elif time.monotonic() - self._last_worker > WORKERLESS_TIMEOUT:
            raise DatasetError(
                f"the dask scheduler at {self._address} has had no worker for {WORKERLESS_TIMEOUT} s; start workers "
                "that reach it, and the same call goes on from here"
            )

    def _result(self, future: Any, number: int) -> TaskResult:
        """The result of a task; that its workers died is a result too."""
        error = future.exception()
        if error is None:
            result: TaskResult = future.result()
            return self._checked(result)
        if type(error).__name__ in DEAD_WORKER_ERRORS:
            return TaskResult(number, "died", text=type(error).__name__)
        return TaskResult(number, "error", text=f"a dask worker could not run its shard: {_one_line(error)}")

    def _checked(self, result: TaskResult) -> TaskResult:
        """The result, unless its file cannot be seen from this machine."""
        if result.status == "done" and not self._job.path(result.number).exists():
            text = f"a dask worker wrote {self._job.path(result.number)}, which is not there on this machine"
            return TaskResult(result.number, "error", text=f"{text}; name a file in a folder that all machines share")
        return result


def _one_line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


TERMINATION_TIMEOUT = 5
"""s, in which a worker that is asked to end does so."""


class Workers(Protocol):
    """Processes or threads that run the tasks of a job."""

    @property
    def free_slots(self) -> int:
        """How many more tasks can be submitted now."""
        ...

    def submit(self, number: int) -> None:
        """Have a task done."""
        ...

    def results(self, timeout: float) -> list[TaskResult]:
        """Wait for results, at most `timeout` s."""
        ...


@checked
@dataclass(frozen=True)
class ParallelExecution(Options, title="settings of an execution", error=DatasetError):
    """How the shards of a data set are divided among processes and machines.

    workers : processes of this machine, by default one for each core; of a cluster, its threads that are used at once.
    cluster : address of a dask scheduler, tcp://host:port, whose workers simulate instead of processes of this machine.
    part : (k, n) simulates every n-th shard only, from the k-th on, for an array of jobs; a call without it merges.
    shard_rows : samples of a shard, which is the unit of work that is kept; by default those of the shards that are
        there already, else 256, or as many as are wanted where these are fewer.
    """

    workers: int | None = option(None, "Processes; one for each core by default.", limits.WORKERS)
    cluster: str | None = option(None, "A dask scheduler, tcp://host:port.", metavar="URL")
    part: tuple[int, int] | None = option(None, "Every N-th shard alone, from the K-th on.", example="3/16")
    shard_rows: int | None = None

    def __post_init__(self) -> None:
        """DatasetError for what is no address; a client of such a one takes a minute to go."""
        if self.cluster is not None and not ADDRESS.fullmatch(self.cluster):
            raise DatasetError(f"'{quoted(self.cluster)}' is no address of a dask scheduler; write tcp://host:port")

    def start(self, job: ShardedJob) -> AbstractContextManager[Workers]:
        """The workers, which run in the context that is returned."""
        if self.cluster is not None:
            return ClusterWorkers(job, self.cluster, self.workers)
        if not can_be_sent(job):
            process_count(self.workers)  # which refuses what is no number of them
            return nullcontext(ThisProcess(job))
        return ProcessWorkers(job, process_count(self.workers))


def can_be_sent(job: Job) -> bool:
    """Whether another process can read a job: not one of a class of the main script or a notebook, or of a function."""
    try:
        return b"__main__" not in pickle.dumps(job)
    except (pickle.PicklingError, AttributeError, TypeError):
        return False


class ThisProcess:
    """The tasks of a job one after another in this very process, where no other can read the job."""

    def __init__(self, job: ShardedJob) -> None:
        self._job, self._submitted = job.on_one_thread(), list[int]()

    @property
    def free_slots(self) -> int:
        """One at a time."""
        return 1 - len(self._submitted)

    def submit(self, number: int) -> None:
        """Have a task done when results are asked for."""
        self._submitted.append(number)

    def results(self, timeout: float) -> list[TaskResult]:
        """The result of the task that was submitted, however long it takes."""
        numbers, self._submitted = self._submitted, []
        return [run_task(self._job, number) for number in numbers]


def process_count(workers: int | None, error: type[CreepkitError] = DatasetError) -> int:
    """How many processes are meant: `workers`, or one for each core; `error` for what is no number of them."""
    if workers is not None:
        limits.check_number("workers", workers, limits.WORKERS, error)
    return workers or usable_cores()


class WorkerDeaths:
    """Deaths of worker processes by task: a task is given out again until it has cost `limit` processes."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._counts: Counter[int] = Counter()

    def may_retry(self, result: TaskResult) -> bool:
        """Count the death that a result reports; whether its task is to be given out again."""
        self._counts[result.number] += 1
        return self._counts[result.number] < self._limit

    def description(self, result: TaskResult) -> str:
        """One sentence on a task that is given up."""
        times = self._counts[result.number]
        return f"its worker process died {times} times, the last time by {result.text}; is there memory enough?"


@dataclass(eq=False)
class WorkerProcess:
    """A worker process. task : the one it does, None when it is idle. ready : whether it has started.

    reader : the thread that reads its output.
    """

    popen: subprocess.Popen[bytes]
    task: int | None = None
    ready: bool = False
    buffer: bytes = b""
    reader: threading.Thread | None = None


class ProcessWorkers:
    """Worker processes of this machine; a context."""

    def __init__(self, job: Job, processes: int) -> None:
        self._setup_message = setup_message(job)
        self._size = processes
        self._processes: list[WorkerProcess] = []
        self._outputs: queue.SimpleQueue[tuple[WorkerProcess, bytes]] = queue.SimpleQueue()

    @property
    def free_slots(self) -> int:
        """How many more tasks can be submitted now."""
        return self._size - sum(process.task is not None for process in self._processes)

    def submit(self, number: int) -> None:
        """Give a task to an idle worker, or to a new one."""
        idle = [process for process in self._processes if process.task is None]
        process = idle[0] if idle else self._start()
        process.task = number
        _send(process.popen, b"%d\n" % number)

    def results(self, timeout: float) -> list[TaskResult]:
        """Wait for results, at most `timeout` s."""
        outputs = []
        with suppress(queue.Empty):
            outputs.append(self._outputs.get(timeout=timeout))
            while True:
                outputs.append(self._outputs.get_nowait())
        return [result for process, data in outputs for result in self._read_results(process, data)]

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
        popen = start_worker()
        process = WorkerProcess(popen)
        self._processes.append(process)
        process.reader = threading.Thread(target=self._forward_output, args=(process,), daemon=True)
        process.reader.start()
        _send(popen, self._setup_message)
        return process

    def _forward_output(self, process: WorkerProcess) -> None:
        """Pass on what a process writes; a thread does so, for Windows cannot wait for several pipes at once."""
        with suppress(OSError, ValueError):
            while data := _pipe(process.popen.stdout).read(1 << 16):
                self._outputs.put((process, data))
        self._outputs.put((process, b""))

    def _read_results(self, process: WorkerProcess, data: bytes) -> list[TaskResult]:
        """Results that a process reports; the end of its output means that it died."""
        if process not in self._processes:
            return []
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
            raise DatasetError(f"a worker process ended as it started ({cause}); its own message is above")
        return [] if process.task is None else [TaskResult(process.task, "died", text=cause)]

    def _close(self, process: WorkerProcess) -> int:
        self._processes.remove(process)
        with suppress(OSError):  # a task that it was given and never read
            _pipe(process.popen.stdin).close()
        try:
            code = process.popen.wait(TERMINATION_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.popen.kill()
            code = process.popen.wait()
        if process.reader is not None:
            process.reader.join(TERMINATION_TIMEOUT)
            if not process.reader.is_alive():  # else a process that the worker started has the pipe still
                _pipe(process.popen.stdout).close()
        return code


def _send(popen: subprocess.Popen[bytes], data: bytes) -> None:
    """Write to a worker; that it has died is found where its results are read."""
    with suppress(BrokenPipeError):
        _pipe(popen.stdin).write(data)


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    assert pipe is not None
    return pipe
