"""The worker process, `python -m creepkit.jobs.worker_process`.

It receives a job, then numbers of tasks, and reports results.

The job is pickled by the process that started the worker, as multiprocessing does.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, Protocol

from creepkit.errors import CreepkitError
from creepkit.jobs.worker_start import receive_job


@dataclass(frozen=True)
class TaskResult:
    """Outcome of a task.

    number : of the task. status : "done"; "taken", by another process; "died", its own process did; "error", as `text`
        says. accepted : how many samples it left that count.
    """

    number: int
    status: str
    accepted: int = 0
    text: str = ""


class Job(Protocol):
    """Numbered tasks that worker processes do; it is pickled and sent to them."""

    @property
    def task_name(self) -> str:
        """Name of a task in messages, such as "shard"."""
        ...

    def on_one_thread(self) -> Job:
        """The same job, to be done on one thread."""
        ...

    def run(self, number: int) -> TaskResult:
        """Do one task and leave its outcome in a file."""
        ...


class ShardedJob(Job, Protocol):
    """A job whose tasks are shards of `rows` samples, each a file in `folder`."""

    def on_one_thread(self) -> ShardedJob:
        """The same job, to be done on one thread."""
        ...

    @property
    def folder(self) -> Path:
        """Where the files of the shards lie."""
        ...

    @property
    def rows(self) -> int:
        """Samples of a shard."""
        ...

    def path(self, number: int) -> Path:
        """The file of a shard."""
        ...

    def lock_path(self, number: int) -> Path:
        """The file that is locked while a shard is simulated."""
        ...

    def count_death(self, number: int) -> None:
        """Count the death of a worker at the sample that it simulated; where this process goes on."""
        ...

    def accepted_count(self, number: int) -> int | None:
        """How many samples of a shard were accepted; None when it has to be simulated."""
        ...


def run_task(job: Job, number: int) -> TaskResult:
    """Run one task; an error is a result too, whatever a design or a criterion of a plugin raises."""
    try:
        return job.run(number)
    except CreepkitError as error:
        return TaskResult(number, "error", text=error_text(error))
    except Exception as error:
        return TaskResult(number, "error", text=f"{job.task_name} {number} cannot be simulated: {error_text(error)}")


def error_text(error: Exception) -> str:
    """One line on what happened; errors that are not ours are named."""
    text = " ".join(str(error).split())
    if isinstance(error, CreepkitError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def main() -> None:
    """Do the task of each number read from standard input, and write its result, a line of JSON."""
    signal.signal(signal.SIGTERM, _terminate)
    stdin, stdout = sys.stdin.buffer, os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever else is printed belongs on stderr
    job = receive_job(stdin).on_one_thread()
    _write_result(stdout, {"ready": True})
    for line in stdin:
        _write_result(stdout, asdict(run_task(job, int(line))))


def _terminate(*_: object) -> None:
    """End as after an error: a sample that is given up on request has not killed its process."""
    raise SystemExit(0)


def _write_result(stream: IO[bytes], document: dict[str, Any]) -> None:
    try:
        stream.write(json.dumps(document).encode() + b"\n")
    except BrokenPipeError:
        raise SystemExit(0) from None  # the process that asked has ended; the task is done all the same


if __name__ == "__main__":
    main()
