"""Workers that run the tasks of a job: processes of this machine with one thread each, or a dask cluster.

All are used as executors of concurrent.futures are: submit(number) returns a future of the task's result.
"""

from __future__ import annotations

import json
import logging
import pickle
import re
import signal
import subprocess
import threading
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeAlias

from creepkit import limits
from creepkit.arrays import usable_cores
from creepkit.checked_arguments import checked
from creepkit.errors import DatasetError, quoted, restated
from creepkit.jobs.worker_process import Job, TaskResult, run_task, send, setup_message, start_worker
from creepkit.options import Options, option

SHARD_ROWS = 256
"""Samples of a shard: some seconds of work, so that little is lost when a process dies."""


ADDRESS = re.compile(r"inproc://.+|[a-z]+://.+:[0-9]+/?")


CONNECT_TIMEOUT = 30
"""s, in which a scheduler answers."""


LEAST_QUEUED = 8
"""Shards handed over while a cluster has few workers or none: an adaptive one grows with its queue."""


MOST_DEATHS = 3
"""Processes that a task may cost before it is given up."""


TERMINATION_TIMEOUT = 5
"""s, in which a worker that is asked to end does so."""


_log = logging.getLogger("creepkit.jobs")


@checked
@dataclass(frozen=True)
class ParallelExecution(Options, title="settings of an execution"):
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

    def start(self, job: Job) -> AbstractContextManager[Workers]:
        """The workers, which run in the context that is returned."""
        if self.cluster is not None:
            return cluster_workers(job, self.cluster, self.workers)
        return ProcessWorkers(job, self.workers or usable_cores())


class ProcessWorkers:
    """Worker processes of this machine, each driven by a thread of its own; a context.

    A job that no other process can read, of a class of the main script or a notebook, is done by this one.
    """

    def __init__(self, job: Job, processes: int) -> None:
        self._job, self._message = job, b""
        with suppress(pickle.PicklingError, AttributeError, TypeError):
            pickled = pickle.dumps(job)
            self._message = b"" if b"__main__" in pickled else setup_message() + pickled
        self.size = processes if self._message else 1
        self._threads = ThreadPoolExecutor(self.size)
        self._own = threading.local()
        self._processes: list[subprocess.Popen[bytes]] = []
        self._ending = False

    def submit(self, number: int) -> Future[TaskResult]:
        """Have a task done by the next worker that is free."""
        if not self._message:
            return self._threads.submit(run_task, self._job.on_one_thread(), number)
        return self._threads.submit(self._run, number)

    def _run(self, number: int) -> TaskResult:
        """The result of a task, which is given out again where its worker dies."""
        cause = ""
        for _ in range(MOST_DEATHS):
            process = getattr(self._own, "process", None) or self._start()
            send(process, b"%d\n" % number)
            if line := process.stdout.readline():
                return TaskResult(**json.loads(line))
            cause, self._own.process = _death(process), None
            if self._ending:
                break
            _log.warning("a worker process died (%s); its %s %d is done again", cause, self._job.task_name, number)
        text = f"its worker process died {MOST_DEATHS} times, the last time by {cause}; is there memory enough?"
        return TaskResult(number, "error", text=f"{self._job.task_name} {number}: {text}")

    def _start(self) -> Any:
        process = start_worker(self._message)
        self._processes.append(process)
        assert process.stdout is not None
        if not process.stdout.readline():
            raise DatasetError(f"a worker process ended as it started ({_death(process)}); its own message is above")
        self._own.process = process
        return process

    def __enter__(self) -> ProcessWorkers:
        return self

    def __exit__(self, *exception: object) -> None:
        self._ending = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for process in self._processes:
            process.terminate()
        for process in self._processes:
            try:
                process.wait(TERMINATION_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
        self._threads.shutdown()
        for process in self._processes:
            process.communicate()


def _death(process: subprocess.Popen[bytes]) -> str:
    code = process.wait()
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


@dataclass(frozen=True)
class ClusterWorkers:
    """The workers of a dask scheduler, at most `threads` of their threads at once (None: all)."""

    job: Job
    client: Any
    executor: Any
    threads: int | None = None

    @property
    def size(self) -> int:
        """Two shards for each thread, so that none waits for us."""
        return self.threads or max(LEAST_QUEUED, 2 * sum(self.client.nthreads().values()))

    def submit(self, number: int) -> Future[TaskResult]:
        """Hand a shard to the scheduler."""
        result: Future[TaskResult] = self.executor.submit(run_task, self.job, number)
        return result


@contextmanager
def cluster_workers(job: Job, address: str, threads: int | None = None) -> Iterator[ClusterWorkers]:
    """The workers of the dask scheduler at an address; DatasetError where none answers, or dask is not installed."""
    with restated(ImportError, DatasetError, "--cluster needs dask; install it with: pip install 'creepkit[cluster]'"):
        from distributed import Client
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)  # type: ignore[no-untyped-call]
    except Exception as error:  # whatever dask makes of what another kind of server says
        text = " ".join(f"{type(error).__name__}: {error}".split())
        raise DatasetError(
            f"no dask scheduler answers at {address}: {text}; check the address, and that the scheduler runs"
        ) from None
    with closing(client):
        executor = client.get_executor(pure=False)  # type: ignore[no-untyped-call]
        yield ClusterWorkers(job.on_one_thread(), client, executor, threads)


Workers: TypeAlias = ProcessWorkers | ClusterWorkers
