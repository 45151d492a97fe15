"""The worker process, `python -m creepkit.jobs.worker_process`: how it is started, and what it does.

A worker is a new interpreter, because a fork would copy locks of libraries such as torch, and multiprocessing would
import the user's script. It receives a job, pickled by the process that started it, then numbers of tasks, a line each,
and answers each with a line of JSON.

Its `sys.path` is the one that Python itself makes without the working folder and the folder of a script, so that
nothing beside the data is importable. Modules that the starting process has imported from elsewhere, such as the one
beside a user's script that has the class of a job, are found by their very names and files.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import ModuleType
from typing import Protocol

from creepkit.errors import CreepkitError
from creepkit.registry.plugin_registry import load_plugin_file, loaded_plugin_files

THREADED_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
"""Libraries that start threads of their own: two threads on one busy core are many times slower than one."""


@dataclass(frozen=True)
class TaskResult:
    """Outcome of a task.

    number : of the task. status : "done", or "error", as `text` says. accepted : how many samples it left that count.
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


# ---- the process that starts workers -------------------------------------------------------------------------------


def start_worker(message: bytes) -> subprocess.Popen[bytes]:
    """A worker process, in a session of its own: Ctrl-C is for the process that started it, which then ends it.

    message : setup_message() and the pickled job.
    """
    path = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if os.path.isabs(entry)]
    one_thread = dict.fromkeys((f"{library}_NUM_THREADS" for library in THREADED_LIBRARIES), "1")
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "creepkit.jobs.worker_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path), **one_thread},
        start_new_session=True,
    )
    send(process, message)
    return process


def setup_message() -> bytes:
    """What a worker reads before its pickled job: modules and plugin files."""
    return pickle.dumps(_imported_modules(sys.modules)) + pickle.dumps(loaded_plugin_files())


def send(process: subprocess.Popen[bytes], data: bytes) -> None:
    """Write to a worker; that it has died is found where its answer is read."""
    assert process.stdin is not None
    try:
        process.stdin.write(data)
        process.stdin.flush()
    except BrokenPipeError:
        pass


def _imported_modules(modules: Mapping[str, ModuleType]) -> dict[str, tuple[str | None, list[str] | None]]:
    """{name: its file, the folders of a package} of modules that were imported from outside of the installation."""
    installation = tuple({f"{os.path.realpath(prefix)}{os.sep}" for prefix in (sys.prefix, sys.base_prefix)})
    found = {}
    for name, module in list(modules.items()):
        if "." in name or name == "__main__":  # some of torch's make up a __path__ that is none
            continue
        file, folders = getattr(module, "__file__", None), list(getattr(module, "__path__", ()))
        places = [os.path.realpath(place) for place in (file, *folders) if place]
        if places and not places[0].startswith(installation):
            found[name] = (file and os.path.abspath(file), folders or None)
    return found


# ---- the worker ----------------------------------------------------------------------------------------------------


class _ImportedModules(importlib.abc.MetaPathFinder):
    """Finds the modules of another process by their names; asked last, so that it replaces nothing installed."""

    def __init__(self, files: Mapping[str, tuple[str | None, list[str] | None]]) -> None:
        self._files = files

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Where a module is; None of one that the other process has not imported."""
        if fullname not in self._files:
            return None
        file, folders = self._files[fullname]
        if file is not None:
            return importlib.util.spec_from_file_location(fullname, file, submodule_search_locations=folders)
        spec = importlib.machinery.ModuleSpec(fullname, None, is_package=True)  # of a package without a file
        spec.submodule_search_locations = folders
        return spec


def main() -> None:
    """Do the task of each number read from standard input, and write its result, a line of JSON."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    stdin, stdout = sys.stdin.buffer, os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    os.dup2(2, 1)  # whatever else is printed belongs on stderr
    sys.meta_path.append(_ImportedModules(pickle.load(stdin)))
    for plugin_file in pickle.load(stdin):
        load_plugin_file(plugin_file)
    job = pickle.load(stdin).on_one_thread()
    try:
        stdout.write("ready\n")
        for line in stdin:
            stdout.write(f"{json.dumps(asdict(run_task(job, int(line))))}\n")
    except BrokenPipeError:  # the process that asked has ended; the task is done all the same
        os._exit(0)


if __name__ == "__main__":
    main()
