"""What plugins contribute: the kinds, and the validation of what the hooks of a plugin return."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from inspect import isgeneratorfunction
from types import ModuleType
from typing import TYPE_CHECKING, Any

from creepkit import hookspecs
from creepkit.errors import (
    CreepkitError,
    ExportError,
    HistoryError,
    LawError,
    PluginError,
    SolveError,
    nearest,
    quoted,
    raised_text,
)
from creepkit.registry.plugin_sources import Provenance

if TYPE_CHECKING:
    import pluggy

HOOKS = tuple(name for name in vars(hookspecs) if name.startswith("creepkit_"))


COMMANDS_HOOK = "creepkit_commands"


def group_of(hook: str) -> str:
    """The group of entry points of a hook: creepkit.laws of creepkit_laws."""
    return hook.replace("_", ".", 1)


@dataclass(frozen=True)
class ContributionKind:
    """One kind of contribution: its name, the hook that returns it, the error when a name is unknown, and its record.

    module : of the record that each object must be; imported when there is one to check.
    """

    label: str
    hook: str
    error: type[CreepkitError]
    module: str
    record: str

    @property
    def group(self) -> str:
        """The group of its entry points."""
        return group_of(self.hook)

    def named(self, returned: Any) -> dict[str, Any]:
        """{name: object} of what a hook returned; PluginError when it is not what the hook promises."""
        if not isinstance(returned, Sequence) or isinstance(returned, str):
            raise PluginError(
                f"must return a list of {self.record} records, found {_type_text(returned)}{_remedy(returned)}"
            )
        required: Any = getattr(import_module(self.module), self.record) if returned else object
        result: dict[str, Any] = {}
        for one in returned:
            problem = f"must return a list of {self.record} records, found {_type_text(one)} in it"
            if isinstance(one, type):
                raise PluginError(f"{problem}; return an instance, {one.__name__}()")
            if not isinstance(one, required):
                raise PluginError(f"{problem}{_missing_members(one, required)}")
            name: Any = getattr(one, "name")  # noqa: B009  of a type that is known at run time
            if not (isinstance(name, str) and name.strip()):
                raise PluginError(f"returned a {self.label} whose name is {name!r}; give it a short name in words")
            if name in result:
                raise PluginError(f"offers the {self.label} '{name}' twice; rename one")
            if self.label == "specimen" and (wrong := _specimen_problem(one)):
                raise PluginError(f"returned the specimen '{name}', which {wrong}")
            result[name] = one
        return result


class TemperatureFormKind(ContributionKind):
    """Temperature forms, which are functions and so come with their names."""

    def named(self, returned: Any) -> dict[str, Any]:
        """{name: function of T_ref}."""
        if not isinstance(returned, Mapping):
            raise PluginError(f"must return {{name: function of T_ref}}, found {_type_text(returned)}")
        for name, form in returned.items():
            if not callable(form):
                raise PluginError(f"must return {{name: function of T_ref}}, found {_type_text(form)} for '{name}'")
        return dict(returned)


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


def check_hooks(provenance: Provenance, module: ModuleType) -> None:
    """PluginError for a module with no hook, or with one that could never be called."""
    hooks = [name for name in vars(module) if name.startswith("creepkit_") and callable(getattr(module, name))]
    if not hooks:
        raise PluginError(f"{provenance} offers nothing; mark one of its functions @hookimpl ({', '.join(HOOKS)})")
    for name in hooks:
        function = getattr(module, name)
        place = hook_location(function)
        if not hasattr(function, f"{hookspecs.PROJECT}_impl"):
            raise PluginError(f"{provenance} has a function '{name}' without @hookimpl; add the decorator{place}")
        if name not in HOOKS:
            raise PluginError(f"{provenance} has an unknown hook '{name}': {nearest(name, HOOKS)}{place}")
        if isgeneratorfunction(function):
            raise PluginError(f"{provenance}: {name} is a generator; return a list in the place of yield{place}")


def contributions_of(kind: ContributionKind, provenance: Provenance, implementation: pluggy.HookImpl) -> dict[str, Any]:
    """Return {name: object} that one plugin's hook offers."""
    returned, place = call_hook(provenance, implementation), hook_location(implementation.function)
    try:
        return kind.named(returned)
    except PluginError as error:
        raise PluginError(f"{provenance}: {kind.hook} {error}{place}") from None
    except Exception as error:  # of a property of the plugin's record
        raise PluginError(
            f"{provenance}: {kind.hook} returned a record that cannot be asked its name: {raised_text(error)}{place}"
        ) from error


def call_hook(provenance: Provenance, implementation: pluggy.HookImpl, **keywords: Any) -> Any:
    """Call one plugin's hook; PluginError when it raises."""
    arguments = [keywords[name] for name in implementation.argnames]
    try:
        return implementation.function(*arguments)
    except (Exception, SystemExit) as error:
        name = implementation.function.__name__
        raise PluginError(f"{provenance}: {name} raised {raised_text(error)}") from error


def hook_location(function: Any) -> str:
    """Where a function of a plugin is written, as the end of a sentence; "" where that is not known."""
    code = getattr(function, "__code__", None)
    return f" ({code.co_filename}, line {code.co_firstlineno})" if code is not None else ""


def _specimen_problem(specimen: Any) -> str:
    """What is wrong with the record of a specimen, as the end of a sentence; "" where files and options can use it."""
    try:
        outputs, loads, lengths = map(tuple, (specimen.outputs, specimen.loads, specimen.dimensions))
        outputs += tuple(specimen.optional_outputs) if outputs else ()
        known = (*(str(name) for name in outputs), *(one.name for one in loads), *(one.name for one in lengths))
    except Exception as error:
        return (
            f"has a record that cannot be read: {raised_text(error)}; outputs are names, loads ck.Load, lengths fields"
        )
    if not outputs or not all(isinstance(name, str) for name in outputs):
        return f"has outputs {quoted(repr(outputs), 60)}; give at least one name, or ck.Output"
    if both := {str(o) for o in outputs} & {load.name for load in loads}:
        return f"has an output and a load called '{both.pop()}', which a file could not tell apart; rename one"
    for name in known:
        if name in _RESERVED_NAMES or name.endswith("_sd"):
            return f"calls something '{name}', which means something else in files or options; rename it"
    return ""


_RESERVED = """time used temperature modulus poisson jump_time end_time rupture ended label geometry offset rate control
ramp specimen name alloy operator set to help points every picture end_h modulus_gpa temperature_c level draws target
tolerance json plot"""


_RESERVED_NAMES = frozenset(_RESERVED.split())
"""Columns and keys of files, options of commands and kinds of nuisance parameters that every specimen has."""


def _missing_members(contribution: object, required: type) -> str:
    """What an object lacks of an interface, as the end of a sentence."""
    members = sorted(getattr(required, "__protocol_attrs__", ())) or [
        name for one in required.__mro__ for name in vars(one) if getattr(one, "_is_protocol", False) and name[0] != "_"
    ]
    missing = [name for name in members if not hasattr(contribution, name)]
    return f"; it has no {', '.join(missing)}" if missing else f"; derive its class from ck.{required.__name__}"


def _remedy(returned: Any) -> str:
    """What to do about something that is no list, as the end of a sentence."""
    if returned is None:
        return "; add a return statement"
    if isinstance(returned, Iterator):
        return "; return list(...) of it"
    return "; put it into a list" if hasattr(returned, "name") else ""


def _type_text(thing: Any) -> str:
    """Name something unexpected: a class by its own name, else by its type."""
    return f"the class {thing.__name__}" if isinstance(thing, type) else quoted(f"{type(thing).__name__} {thing!r}", 80)
