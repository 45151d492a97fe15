"""Where plugins come from: entry points of installed distributions, and files of Python.

There is one group of entry points for each hook, `creepkit.laws` for creepkit_laws. The name of an entry point is that
of one object which the hook of its module returns, so that this module alone is imported when the object is asked for:

    [project.entry-points."creepkit.laws"]
    norton-bailey = "my_package.laws"
    dorn = "my_package.laws"

A module with several objects has an entry point for each. An entry point of another name is an alias, where its module
has one object of the kind; where it has more, they are found when all of the kind are asked for.

Importing a plugin runs the code of somebody else, so whatever it raises becomes one sentence with its location.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import CodeType, ModuleType

import creepkit
from creepkit.errors import PluginError, raised_text

GROUP_PREFIX = "creepkit."


ENVIRONMENT_VARIABLE = "CREEPKIT_PLUGINS"


@dataclass(frozen=True, order=True)
class Provenance:
    """Who brought a plugin: its name, and the distribution with version or the file it came from."""

    origin: str
    name: str

    def __str__(self) -> str:
        return f"plugin '{self.name}' ({self.origin})"


@dataclass(frozen=True)
class InstalledModule:
    """A module of an installed distribution, with the entry points that name it.

    place : the module's name.
    """

    place: str
    entries: tuple[EntryPoint, ...]
    is_file = False

    @property
    def is_own(self) -> bool:
        """Whether it is one of creepkit's own."""
        return self.place.startswith("creepkit.")

    @cached_property
    def provenance(self) -> Provenance:
        """Distribution with version, and the name of the first entry point; metadata are read when asked."""
        entry = self.entries[0]
        if self.is_own:
            return Provenance(f"creepkit {creepkit.__version__}", entry.name)
        origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "unknown distribution"
        return Provenance(origin, entry.name)

    def offers(self, group: str, keys: Iterable[str] | None = None) -> bool:
        """Whether an entry point is in this group, and has one of these names, see `name_key`."""
        names = {name_key(entry.name) for entry in self.entries if entry.group == group}
        return bool(names if keys is None else names.intersection(keys))

    def load(self) -> ModuleType:
        """Import the module; PluginError when it raises."""
        try:
            return import_module(self.place)
        except (Exception, SystemExit) as error:
            raise PluginError(f"{self.provenance} cannot be imported: {raised_text(error)}") from error


@dataclass(frozen=True)
class PluginFile:
    """A file of Python that the user named; it may offer anything."""

    path: Path
    is_file = True
    is_own = False

    @cached_property
    def place(self) -> str:
        """The file, however it was named."""
        return os.path.realpath(self.path)

    @property
    def problem(self) -> str:
        """Why it cannot be run, as a part of a sentence; "" where it can."""
        if not is_plugin_file_name(self.path):
            return "is not executed, for only files whose names end in .py are"
        return "" if self.path.is_file() else "does not exist"

    @property
    def provenance(self) -> Provenance:
        """The file, and its name without ending."""
        return Provenance(self.place, self.path.stem)

    def offers(self, group: str, keys: Iterable[str] | None = None) -> bool:
        """True: what is in a file is not known before it is run."""
        return True

    def load(self) -> ModuleType:
        """Run the file as a module of its own name; PluginError when it is no .py, is missing or raises."""
        if self.problem:
            raise PluginError(f"plugin file {self.path} {self.problem}; name a Python file with hooks in it")
        import hashlib  # which takes longer to import than a law to be made

        name = f"creepkit_plugin_{self.path.stem}_{hashlib.sha256(self.place.encode()).hexdigest()[:8]}"
        loader = _UncachedSourceLoader(name, self.place)
        spec = importlib.machinery.ModuleSpec(name, loader, origin=self.place)
        spec.has_location = True
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        try:
            loader.exec_module(module)
        except (Exception, SystemExit) as error:
            del sys.modules[name]
            raise PluginError(f"{self.provenance} cannot be imported: {raised_text(error)}") from error
        return module


Source = InstalledModule | PluginFile


def installed_modules() -> list[InstalledModule]:
    """The modules of plugins that are installed, creepkit's own first; none is imported."""
    found: dict[str, dict[EntryPoint, None]] = {}
    installed = entry_points()
    for group in installed.groups:
        if group.startswith(GROUP_PREFIX):
            for entry in installed.select(group=group):
                found.setdefault(entry.module, {})[entry] = None
    modules = [InstalledModule(module, tuple(entries)) for module, entries in found.items()]
    return sorted(modules, key=lambda one: (not one.is_own, one.place))


def plugin_files_in_environment() -> list[PluginFile]:
    """The files that the environment variable CREEPKIT_PLUGINS lists, separated as in PATH."""
    listed = os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep)
    return [PluginFile(Path(text)) for text in listed if text.strip()]


def check_files_in_environment() -> None:
    """PluginError, in one sentence, where the environment variable names what is no plugin file or does not exist."""
    for one in plugin_files_in_environment():
        advice = f"separate several files with '{os.pathsep}'" if "," in str(one.path) else "correct or unset it"
        if one.problem:
            raise PluginError(f"{ENVIRONMENT_VARIABLE} names the file {one.path}, which {one.problem}; {advice}")


def is_plugin_file_name(path: str | Path) -> bool:
    """Whether a path names a file of Python code: no other is ever executed."""
    return Path(path).suffix == ".py"


def name_key(name: str) -> str:
    """A name as it is compared: 'Strain_Hardening' and 'strain hardening' are 'strain-hardening'."""
    return "-".join(name.casefold().replace("_", " ").replace("-", " ").split())


class _UncachedSourceLoader(importlib.machinery.SourceFileLoader):
    """Compiles the source each time: no bytecode beside the user's file, and never a stale one while it is edited."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)
