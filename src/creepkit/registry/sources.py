"""Where plugins come from: entry points of installed distributions, and single files.

Importing a plugin runs the code of somebody else, so whatever it raises becomes one sentence that says where.
"""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import os
import sys
import traceback
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import CodeType, ModuleType

from creepkit.errors import CreepkitError, PluginError

ENTRY_POINT_GROUP = "creepkit"
ENVIRONMENT_VARIABLE = "CREEPKIT_PLUGINS"


@dataclass(frozen=True, order=True)
class Provenance:
    """Who brought a plugin: its name, and the distribution with version or the file it came from."""

    origin: str
    name: str

    def __str__(self) -> str:
        return f"plugin '{self.name}' ({self.origin})"


def installed_entry_points() -> list[tuple[Provenance, EntryPoint]]:
    """Return the entry points of group `creepkit`: creepkit's own first, then by distribution and name."""
    results = [(Provenance(_distribution_text(entry), entry.name), entry) for entry in entry_points(group=ENTRY_POINT_GROUP)]
    return sorted(results, key=lambda pair: (not pair[0].origin.startswith("creepkit "), pair[0]))


def plugin_files_in_environment() -> list[Path]:
    """Return the files that the environment variable CREEPKIT_PLUGINS lists, separated as in PATH."""
    return [Path(text) for text in os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep) if text.strip()]


def provenance_of_file(path: Path) -> Provenance:
    """Return the provenance of a plugin file."""
    return Provenance(str(path.resolve()), path.stem)


def import_entry(provenance: Provenance, entry: EntryPoint) -> object:
    """Import an installed plugin; PluginError when it raises."""
    try:
        return entry.load()
    except (Exception, SystemExit) as error:
        raise PluginError(f"{provenance} cannot be imported: {error_text(error)}") from error


def import_file(provenance: Provenance, path: Path) -> ModuleType:
    """Import a plugin file under a module name of its own; PluginError when it is missing or raises."""
    if not path.is_file():
        raise PluginError(f"plugin file {path} does not exist; name a Python file with hooks in it")
    digest = hashlib.sha256(provenance.origin.encode()).hexdigest()[:8]
    name = f"creepkit_plugin_{path.stem}_{digest}"
    spec = importlib.util.spec_from_file_location(name, provenance.origin, loader=_UncachedSourceLoader(name, provenance.origin))
    if spec is None or spec.loader is None:
        raise PluginError(f"plugin file {path} cannot be imported; name a Python file with hooks in it")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise PluginError(f"{provenance} cannot be imported: {error_text(error)}") from error
    return module


def error_text(error: BaseException) -> str:
    """Return one sentence for what a plugin raised, with the plugin's file and line where they are known."""
    if isinstance(error, SyntaxError):
        return f"{type(error).__name__}: {error.msg} ({error.filename}, line {error.lineno})"
    description = " ".join(str(error).split()) or "no message"
    if not isinstance(error, CreepkitError):
        description = f"{type(error).__name__}: {description}"
    location = _source_location(error)
    return f"{description} ({location})" if location else description


class _UncachedSourceLoader(importlib.machinery.SourceFileLoader):
    """Compiles the source each time: no bytecode beside the user's file, and never a stale one while it is edited."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


def _distribution_text(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "unknown distribution"


def _source_location(error: BaseException) -> str:
    """Say where the plugin's own file appears deepest in the traceback, below the frames of registry and importlib."""
    internal_paths = (os.path.dirname(__file__), os.path.dirname(importlib.__file__), "<frozen importlib")
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith(internal_paths)]
    if not frames:
        return ""
    last = [frame for frame in frames if frame.filename == frames[0].filename][-1]
    return f"{last.filename}, line {last.lineno}"
