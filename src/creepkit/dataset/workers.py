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

from creepkit.dataset.shards import Answer
from creepkit.errors import DatasetError

LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
"""Those that start threads of their own: two on one busy core are many times slower than one."""
ONE_THREAD = dict.fromkeys((f"{library}_NUM_THREADS" for library in LIBRARIES), "1")
LAST_WORDS = 5
"""s, in which a worker that is asked to end does so."""


class Work(Protocol):
    """What worker processes are sent, pickled, to do parts of."""

    @property
    def part(self) -> str:
        """What a part is called, such as "shard"."""
        ...

    def on_one_thread(self) -> Work:
        """The same work, to be done on one thread."""
        ...

    def run(self, number: int) -> Answer:
        """Do one part and leave what came of it in a file."""
        ...


class Workers(Protocol):
    """Whoever does parts of some work."""

    @property
    def free(self) -> int:
        """How many more parts can be worked on at once."""
        ...

    def submit(self, number: int) -> None:
        """Have a part done."""
        ...

    def answers(self, timeout: float) -> list[Answer]:
        """Wait for answers, at most so many s."""
        ...


@dataclass
class Process:
    """A worker process. shard : the part it is at, None when it is idle. ready : whether it has started."""

    popen: subprocess.Popen[bytes]
    shard: int | None = None
    ready: bool = False
    heard: bytes = b""


class ProcessWorkers:
    """Worker processes of this machine; a context."""

    def __init__(self, work: Work, size: int) -> None:
        paths = pickle.dumps(sys.path)
        self._greeting = b"".join(struct.pack("!Q", len(part)) + part for part in (paths, pickle.dumps(work)))
        self._size = size
        self._processes: list[Process] = []
        self._selector = selectors.DefaultSelector()

    @property
    def free(self) -> int:
        """How many more parts can be worked on at once."""
        return self._size - sum(process.shard is not None for process in self._processes)

    def submit(self, number: int) -> None:
        """Give a part to an idle worker, or to a new one."""
        idle = [process for process in self._processes if process.shard is None]
        process = idle[0] if idle else self._started()
        process.shard = number
        _tell(process.popen, b"%d\n" % number)

    def answers(self, timeout: float) -> list[Answer]:
        """Wait for answers, at most so many s."""
        return [answer for key, _ in self._selector.select(timeout) for answer in self._heard(key.data)]

    def __enter__(self) -> ProcessWorkers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._processes:
            process.popen.terminate()
        for process in list(self._processes):
            self._forget(process)

    def _started(self) -> Process:
        """A new process, in a session of its own: Ctrl-C is for us alone, who then end it."""
        popen = subprocess.Popen(
            [sys.executable, "-m", "creepkit.dataset.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env={**os.environ, **ONE_THREAD},
            start_new_session=True,
        )
        process = Process(popen)
        self._processes.append(process)
        self._selector.register(_pipe(popen.stdout), selectors.EVENT_READ, process)
        _tell(popen, self._greeting)
        return process

    def _heard(self, process: Process) -> list[Answer]:
        """What a process says: that it is ready, what became of its part, or, by silence, that it is dead."""
        read = _pipe(process.popen.stdout).read(1 << 16)
        if not read:
            return self._died(process)
        *lines, process.heard = (process.heard + read).split(b"\n")
        told = [json.loads(line) for line in lines]
        answers = [Answer(**one) for one in told if "number" in one]
        process.ready = True
        process.shard = None if answers else process.shard
        return answers

    def _died(self, process: Process) -> list[Answer]:
        code = self._forget(process)
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        if code > 0 and not process.ready:
            raise DatasetError(f"a worker process ended as it started ({how}); what it said is above")
        return [] if process.shard is None else [Answer(process.shard, "died", text=how)]

    def _forget(self, process: Process) -> int:
        self._processes.remove(process)
        self._selector.unregister(_pipe(process.popen.stdout))
        for pipe in (process.popen.stdin, process.popen.stdout):
            _pipe(pipe).close()
        try:
            return process.popen.wait(LAST_WORDS)
        except subprocess.TimeoutExpired:
            process.popen.kill()
            return process.popen.wait()


def _tell(popen: subprocess.Popen[bytes], what: bytes) -> None:
    """Write to a worker; that it has died is heard where its answers are."""
    with suppress(BrokenPipeError):
        _pipe(popen.stdin).write(what)


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    assert pipe is not None
    return pipe
