"""A worker process, `python -m creepkit.dataset.worker`: is told its work, then numbers of parts, until all is done.

What it is told is pickled by the process that started it, as multiprocessing does; nobody else can tell it anything.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import struct
import sys
from dataclasses import asdict
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.dataset.workers import Work


def main() -> None:
    """Answer each number with what became of its shard, a line of JSON."""
    signal.signal(signal.SIGTERM, _end)
    told, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever else is printed belongs on stderr
    sys.path[:] = _part(told)
    work = _part(told).on_one_thread()
    _say(answers, {"ready": True})
    for line in told:
        _say(answers, asdict(attempt(work, int(line))))


def _end(*_: object) -> None:
    """End as after an error: a sample that is given up on request has not killed its process."""
    raise SystemExit(0)


def _part(told: IO[bytes]) -> Any:
    (size,) = struct.unpack("!Q", told.read(8))
    return pickle.loads(told.read(size))


def _say(answers: IO[bytes], what: dict[str, Any]) -> None:
    try:
        answers.write(json.dumps(what).encode() + b"\n")
    except BrokenPipeError:
        raise SystemExit(0) from None  # who asked is gone; the shard is done all the same


def attempt(work: Work, number: int) -> Any:
    """Run a part; an error is an answer too, whatever a design or a criterion of somebody raises."""
    from creepkit.dataset.shards import Answer
    from creepkit.dataset.simulating import words
    from creepkit.errors import CreepkitError

    try:
        return work.run(number)
    except CreepkitError as error:
        return Answer(number, "error", text=words(error))
    except Exception as error:
        return Answer(number, "error", text=f"{work.part} {number} cannot be simulated: {words(error)}")


if __name__ == "__main__":
    main()
