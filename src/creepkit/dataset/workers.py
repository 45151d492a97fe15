"""Who does the parts of some work, such as the shards of a campaign: processes of this machine, one thread each.

A worker is an interpreter of its own that is told numbers of parts on its standard input and answers on its standard
output. It inherits nothing of the caller: neither threads nor locks, which a fork would copy in whatever state they
are (numba and torch have some), nor its script, which multiprocessing's other ways run again, so that a study would
need an `if __name__ == "__main__"`. When one dies, only its own part is concerned.
"""

from __future__ import annotations

import json
import os
import pickle
import selectors
import signal
import struct
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import IO, Protocol

from creepkit.dataset.shards import TaskResult
from creepkit.errors import DatasetError

THREADED_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
"""Those that start threads of their own: two on one busy core are many times slower than one."""
ONE_THREAD = dict.fromkeys((f"{library}_NUM_THREADS" for library in THREADED_LIBRARIES), "1")
TERMINATION_TIMEOUT = 5
"""s, in which a worker that is asked to end does so."""


class Job(Protocol):
    """What worker processes are sent, pickled, to do parts of."""

    @property
    def task_name(self) -> str:
        """What a part is called, such as "shard"."""
        ...

    def on_one_thread(self) -> Job:
        """The same work, to be done on one thread."""
        ...

    def run(self, number: int) -> TaskResult:
        """Do one part and leave what came of it in a file."""
        ...


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
            [sys.executable, "-m", "creepkit.dataset.worker"],
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
