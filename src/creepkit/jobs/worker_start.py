"""How a worker process is started, and what that process can import.

A worker is a new interpreter, because a fork would copy locks of libraries such as torch. Its `sys.path` is the one
that Python itself makes without the working folder and the folder of a script, so that nothing beside the data is
importable. Modules that the starting process has imported from elsewhere, such as the one beside a user's script that
has the class of a job, are found by their very names and files, after everything that is installed.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import os
import pickle
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import IO, Any

from creepkit.files.cache_folders import cache_environment
from creepkit.import_path import (
    environment_without_working_folder,
    leave_settings_of_working_folder_out,
    options_of_another_interpreter,
)
from creepkit.registry.plugin_registry import load_plugin_file, loaded_plugin_files

THREADED_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
"""Libraries that start threads of their own: two threads on one busy core are many times slower than one."""


ONE_THREAD = dict.fromkeys((f"{library}_NUM_THREADS" for library in THREADED_LIBRARIES), "1")


WORKER_MODULE = "creepkit.jobs.worker_process"


def start_worker() -> subprocess.Popen[bytes]:
    """A worker process, in a session of its own: Ctrl-C is for the process that started it, which then ends it."""
    return subprocess.Popen(
        [sys.executable, *options_of_another_interpreter(), "-m", WORKER_MODULE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        bufsize=0,
        env={**environment_without_working_folder(), **cache_environment(), **ONE_THREAD},
        start_new_session=True,
    )


# ---- what a worker is sent -----------------------------------------------------------------------------------------


def setup_message(job: Any) -> bytes:
    """What a worker reads first: modules, plugin files and the job, each pickled, behind its length."""
    parts = (_imported_modules(sys.modules), loaded_plugin_files(), job)
    return b"".join(struct.pack("!Q", len(part)) + part for part in map(pickle.dumps, parts))


def receive_job(stream: IO[bytes]) -> Any:
    """The job of a setup message, once the modules and plugins are known that it may have classes of."""
    leave_settings_of_working_folder_out()
    sys.meta_path.append(_ImportedModules(_read_pickled(stream)))
    for plugin_file in _read_pickled(stream):
        load_plugin_file(plugin_file)
    return _read_pickled(stream)


def _read_pickled(stream: IO[bytes]) -> Any:
    (size,) = struct.unpack("!Q", stream.read(8))
    return pickle.loads(stream.read(size))


@dataclass(frozen=True)
class _ModuleFile:
    """Where a module was imported from. file : None of a package without one. folders : of a package, else None."""

    file: str | None
    folders: tuple[str, ...] | None


def _imported_modules(modules: Mapping[str, ModuleType]) -> dict[str, _ModuleFile]:
    """The modules and packages that this process has imported from outside its installation, {name: where}."""
    installation = tuple({f"{os.path.realpath(prefix)}{os.sep}" for prefix in (sys.prefix, sys.base_prefix)})
    results = {}
    for name, module in list(modules.items()):
        spec = getattr(module, "__spec__", None)
        if "." in name or name == "__main__" or not isinstance(spec, importlib.machinery.ModuleSpec):
            continue
        file = spec.origin if spec.has_location else None
        folders = None if spec.submodule_search_locations is None else tuple(spec.submodule_search_locations)
        places = [place for place in (file, *(folders or ())) if place and os.path.isabs(place)]
        if places and not any(os.path.realpath(place).startswith(installation) for place in places):
            results[name] = _ModuleFile(file, folders)
    return results


class _ImportedModules(importlib.abc.MetaPathFinder):
    """Finds the modules of another process by their names; asked last, so that it replaces nothing installed."""

    def __init__(self, files: Mapping[str, _ModuleFile]) -> None:
        self._files = files

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Where a module is; None of one that the other process has not imported."""
        place = self._files.get(fullname)
        if place is None:
            return None
        if place.file is not None:
            folders = None if place.folders is None else list(place.folders)
            return importlib.util.spec_from_file_location(fullname, place.file, submodule_search_locations=folders)
        spec = importlib.machinery.ModuleSpec(fullname, None, is_package=True)
        spec.submodule_search_locations = list(place.folders or ())
        return spec
