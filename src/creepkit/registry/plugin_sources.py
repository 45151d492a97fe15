"""Where plugins come from (entry points and files), and the validation of what they contribute.

Importing a plugin runs the code of somebody else, so whatever it raises becomes one sentence with its location.
"""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import os
import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from inspect import isgeneratorfunction, signature
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import pluggy

from creepkit import hookspecs
from creepkit.errors import (
    POWER_REMEDY,
    CreepkitError,
    ExportError,
    HistoryError,
    LawError,
    PluginError,
    SolveError,
    nearest,
    quoted,
)
from creepkit.registry.contribution_texts import missing_members, remedy, type_text

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
    results = [
        (Provenance(_distribution_text(entry), entry.name), entry) for entry in entry_points(group=ENTRY_POINT_GROUP)
    ]
    return sorted(results, key=lambda pair: (not pair[0].origin.startswith("creepkit "), pair[0]))


def plugin_files_in_environment() -> list[Path]:
    """Return the files that the environment variable CREEPKIT_PLUGINS lists, separated as in PATH."""
    return [Path(text) for text in os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep) if text.strip()]


def check_files_in_environment() -> None:
    """PluginError, in one sentence, where the environment variable names what is no plugin file or does not exist."""
    for path in plugin_files_in_environment():
        advice = f"separate several files with '{os.pathsep}'" if "," in str(path) else "correct or unset it"
        if not is_plugin_file_name(path):
            raise PluginError(f"{ENVIRONMENT_VARIABLE} names {path}, which is {_NO_PLUGIN_FILE}; {advice}")
        if not path.is_file():
            raise PluginError(f"{ENVIRONMENT_VARIABLE} names the plugin file {path}, which does not exist; {advice}")


_NO_PLUGIN_FILE = "not executed, for only files whose names end in .py are"


def is_plugin_file_name(path: str | Path) -> bool:
    """Whether a path names a file of Python code: no other is ever executed."""
    return Path(path).suffix == ".py"


def provenance_of_file(path: Path) -> Provenance:
    """Return the provenance of a plugin file."""
    return Provenance(os.path.realpath(path), path.stem)


def mentions_commands(source: EntryPoint | Path) -> bool:
    """Whether the text of a plugin's module or file has the name of the hook for commands; nothing is imported.

    So `creepkit --help` imports no plugin but those that add commands. False where the source cannot be found.
    """
    path = source if isinstance(source, Path) else _module_file(source.module)
    try:
        return path is not None and COMMANDS_HOOK.encode() in path.read_bytes()
    except OSError:
        return False


def _module_file(name: str) -> Path | None:
    """The file of a module, found as an import would find it, without importing the packages that it is in."""
    places: Sequence[str] | None = None
    spec = None
    for k in range(name.count(".") + 1):
        full_name = ".".join(name.split(".")[: k + 1])
        finders = (finder.find_spec for finder in sys.meta_path if hasattr(finder, "find_spec"))
        try:
            spec = next((found for find in finders if (found := find(full_name, places)) is not None), None)
        except Exception:  # of a finder of somebody else: then the module is not known to add commands
            return None
        if spec is None:
            return None
        places = spec.submodule_search_locations
    return Path(spec.origin) if spec is not None and spec.has_location and spec.origin else None


def import_entry(provenance: Provenance, entry: EntryPoint) -> object:
    """Import an installed plugin; PluginError when it raises."""
    try:
        return entry.load()
    except (Exception, SystemExit) as error:
        raise PluginError(f"{provenance} cannot be imported: {error_text(error)}") from error


def import_file(provenance: Provenance, path: Path) -> ModuleType:
    """Import a plugin file under a module name of its own; PluginError when it is no .py, is missing or raises."""
    if not is_plugin_file_name(path):
        raise PluginError(f"plugin file {path} is {_NO_PLUGIN_FILE}; name a Python file with hooks in it")
    if not path.is_file():
        raise PluginError(f"plugin file {path} does not exist; name a Python file with hooks in it")
    digest = hashlib.sha256(provenance.origin.encode()).hexdigest()[:8]
    name = f"creepkit_plugin_{path.stem}_{digest}"
    spec = importlib.util.spec_from_file_location(
        name, provenance.origin, loader=_UncachedSourceLoader(name, provenance.origin)
    )
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
        of_power = isinstance(error, TypeError) and ("for ^:" in description or "'Xor'" in description)
        description = f"{type(error).__name__}: {description}{f'; {POWER_REMEDY}' if of_power else ''}"
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


HOOK_PREFIX = "creepkit_"


COMMANDS_HOOK = "creepkit_commands"


@dataclass(frozen=True)
class ContributionKind:
    """One kind of contribution: its name, the hook that returns it, the error when a name is unknown, and its record.

    record_module : module of the record that each object must be; imported when there is one to check.
    """

    label: str
    hook: str
    error: type[CreepkitError]
    record_module: str
    record_name: str

    def named_contributions(self, returned: Any) -> list[tuple[str, Any]]:
        """Return [(name, object)] of what a hook returned; PluginError when it is not what the hook promises."""
        if not isinstance(returned, Sequence) or isinstance(returned, str):
            raise PluginError(
                f"must return a list of {self.record_name} records, found {type_text(returned)}{remedy(returned)}"
            )
        required: Any = getattr(import_module(self.record_module), self.record_name) if returned else object
        contribution: Any
        for contribution in returned:
            if isinstance(contribution, type):
                raise PluginError(
                    f"must return a list of {self.record_name} records, found {type_text(contribution)} in it; "
                    f"return an instance, {contribution.__name__}()"
                )
            if not isinstance(contribution, required):
                missing = missing_members(contribution, required)
                raise PluginError(
                    f"must return a list of {self.record_name} records, found {type_text(contribution)} in it{missing}"
                )
            if not (isinstance(contribution.name, str) and contribution.name.strip()):
                raise PluginError(
                    f"returned a {self.label} whose name is {contribution.name!r}; give it a short name in words"
                )
        return [(thing.name, thing) for thing in returned]


class TemperatureFormKind(ContributionKind):
    """Temperature forms, which are functions and so come with their names."""

    def named_contributions(self, returned: Any) -> list[tuple[str, Any]]:
        """Return [(name, function of T_ref)]."""
        if not isinstance(returned, Mapping):
            raise PluginError(f"must return {{name: function of T_ref}}, found {type_text(returned)}")
        for name, form in returned.items():
            if not callable(form):
                raise PluginError(f"must return {{name: function of T_ref}}, found {type_text(form)} for '{name}'")
        return list(returned.items())


LAW = ContributionKind("law", "creepkit_laws", LawError, "creepkit.language", "CreepLaw")


SPECIMEN = ContributionKind("specimen", "creepkit_specimens", SolveError, "creepkit.records", "Specimen")


READER = ContributionKind("reader", "creepkit_readers", HistoryError, "creepkit.records", "Reader")


CAMERA_FORMAT = ContributionKind("camera format", "creepkit_cameras", HistoryError, "creepkit.records", "CameraFormat")


EXPORTER = ContributionKind("exporter", "creepkit_exporters", ExportError, "creepkit.records", "Exporter")


INSTRUMENT = ContributionKind(
    "instrument format", "creepkit_instruments", HistoryError, "creepkit.records", "InstrumentFormat"
)


TEMPERATURE_FORM = TemperatureFormKind("temperature form", "creepkit_temperature_forms", LawError, "", "function")


CONTRIBUTION_KINDS = (LAW, SPECIMEN, READER, CAMERA_FORMAT, INSTRUMENT, EXPORTER, TEMPERATURE_FORM)


def check_signatures(provenance: Provenance, plugin: object) -> None:
    """PluginError for a hook that takes other parameters than creepkit gives it."""
    for name, function in vars(plugin).items():
        specified = getattr(hookspecs, name, None)
        if not (name.startswith(HOOK_PREFIX) and isinstance(function, FunctionType) and callable(specified)):
            continue
        allowed = list(signature(specified).parameters)
        found = list(signature(function).parameters.values())
        unknown = [p.name for p in found if p.name not in allowed]
        if unknown:
            wanted = f"({', '.join(allowed)})" if allowed else "no parameters"
            raise PluginError(
                f"{provenance} does not fit the hooks of creepkit: {name} has the parameter '{unknown[0]}', "
                f"creepkit calls it with {wanted}"
                f"{hook_location(function)}"
            )
        if isgeneratorfunction(function):
            raise PluginError(
                f"{provenance}: {name} is a generator; return a list in the place of yield{hook_location(function)}"
            )


def hook_implementations(
    manager: pluggy.PluginManager, plugin: object, provenance: Provenance
) -> dict[str, pluggy.HookImpl]:
    """Return {hook: implementation} of one registered plugin; PluginError when a hook of it could never be called.

    This is pluggy's check_pending for one plugin; it names the nearest hook and sees forgotten decorators as well.
    """
    known = [name for name in vars(hookspecs) if name.startswith(HOOK_PREFIX)]
    callers = manager.get_hookcallers(plugin) or []
    for caller in callers:
        if not caller.has_spec():
            (unknown,) = [impl.function for impl in caller.get_hookimpls() if impl.plugin is plugin][:1]
            raise PluginError(
                f"{provenance} has an unknown hook '{caller.name}': {nearest(caller.name, known)}"
                f"{hook_location(unknown)}"
            )
    results = {c.name: impl for c in callers for impl in c.get_hookimpls() if impl.plugin is plugin}
    marked = {impl.function.__name__ for impl in results.values()}
    for name in vars(plugin):
        if name.startswith(HOOK_PREFIX) and callable(getattr(plugin, name)) and name not in marked:
            raise PluginError(
                f"{provenance} has a function '{name}' without @hookimpl; add the decorator"
                f"{hook_location(getattr(plugin, name))}"
            )
    if not results:
        raise PluginError(f"{provenance} offers nothing; mark one of its functions @hookimpl ({', '.join(known)})")
    return results


def contributions_of(kind: ContributionKind, implementation: pluggy.HookImpl) -> dict[str, Any]:
    """Return {name: object} that one plugin's hook offers."""
    returned, place = call_hook(implementation), hook_location(implementation.function)
    try:
        contributions = kind.named_contributions(returned)
    except PluginError as error:
        raise PluginError(f"{implementation.plugin_name}: {kind.hook} {error}{place}") from None
    except Exception as error:  # of a property of the plugin's record
        raise PluginError(
            f"{implementation.plugin_name}: {kind.hook} returned a record that cannot be asked its name: "
            f"{error_text(error)}{place}"
        ) from error
    for name, contribution in contributions:
        if kind.label == "specimen" and (problem := record_problem(contribution)):
            raise PluginError(f"{implementation.plugin_name}: specimen '{name}' {problem}{place}")
        if [other for other, _ in contributions].count(name) > 1:
            raise PluginError(f"{implementation.plugin_name} offers the {kind.label} '{name}' twice; rename one{place}")
    return dict(contributions)


def record_problem(specimen: Any) -> str:
    """What is wrong with the record of a specimen, as the end of a sentence; "" where files and options can use it."""
    try:
        outputs, loads, lengths = (tuple(getattr(specimen, name, ())) for name in ("outputs", "loads", "dimensions"))
        outputs += tuple(getattr(specimen, "optional_outputs", ())) if outputs else ()
        known = (*(str(name) for name in outputs), *(one.name for one in loads), *(one.name for one in lengths))
    except Exception as error:
        return (
            f"has a record that cannot be read: {error_text(error)}; outputs are names, loads ck.Load, lengths fields"
        )
    if not outputs or not all(isinstance(name, str) for name in outputs):
        return f"has outputs {quoted(repr(outputs), 60)}; give at least one name, or ck.Output"
    if both := {str(o) for o in outputs} & {load.name for load in loads}:
        return f"has an output and a load called '{both.pop()}', which a file could not tell apart; rename one"
    for name in known:
        if name in RESERVED_NAMES or name.endswith("_sd"):
            return f"calls something '{name}', which means something else in files or options; rename it"
    return ""


_RESERVED = """time used temperature modulus poisson jump_time end_time rupture ended label geometry offset rate control
ramp specimen name alloy operator set to help points every picture end_h modulus_gpa temperature_c level draws target
tolerance json plot"""


RESERVED_NAMES = frozenset(_RESERVED.split())
"""Columns and keys of files, options of commands and kinds of nuisance parameters that every specimen has."""


def call_hook(implementation: pluggy.HookImpl, **keywords: Any) -> Any:
    """Call one plugin's hook; PluginError when it raises."""
    arguments = [keywords[name] for name in implementation.argnames]
    try:
        return implementation.function(*arguments)
    except (Exception, SystemExit) as error:
        name = implementation.function.__name__
        raise PluginError(f"{implementation.plugin_name}: {name} raised {error_text(error)}") from error


def hook_location(function: Any) -> str:
    """Where a function of a plugin is written, as the end of a sentence; "" where that is not known."""
    code = getattr(function, "__code__", None)
    return f" ({code.co_filename}, line {code.co_firstlineno})" if code is not None else ""
