"""The kinds of things that plugins offer, and the checks on what their hooks are and return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import pluggy

from creepkit import hookspecs
from creepkit.errors import CreepkitError, ExportError, HistoryError, LawError, PluginError, SolveError, nearest
from creepkit.registry.sources import Provenance, blame

PREFIX = "creepkit_"
COMMANDS = "creepkit_commands"


@dataclass(frozen=True)
class Kind:
    """One kind of thing: its word, the hook that offers it, the error when a name is unknown, and its record.

    home : module of the record that each thing must be; imported when there is a thing to check, for it is not light.
    """

    word: str
    hook: str
    error: type[CreepkitError]
    home: str
    record: str

    def named(self, returned: Any) -> list[tuple[str, Any]]:
        """Return [(name, thing)] of what a hook returned; PluginError when it is not what the hook promises."""
        if not isinstance(returned, Sequence) or isinstance(returned, str):
            raise PluginError(f"must return a list of {self.record} records, found {_told(returned)}")
        required = getattr(import_module(self.home), self.record) if returned else object
        for thing in returned:
            if isinstance(thing, type) or not isinstance(thing, required):
                raise PluginError(f"must return a list of {self.record} records, found {_told(thing)} in it")
        return [(thing.name, thing) for thing in returned]


class FormKind(Kind):
    """Temperature forms, which are functions and so come with their names."""

    def named(self, returned: Any) -> list[tuple[str, Any]]:
        """Return [(name, function of T_ref)]."""
        if not isinstance(returned, Mapping):
            raise PluginError(f"must return {{name: function of T_ref}}, found {_told(returned)}")
        for name, form in returned.items():
            if not callable(form):
                raise PluginError(f"must return {{name: function of T_ref}}, found {_told(form)} for '{name}'")
        return list(returned.items())


LAW = Kind("law", "creepkit_laws", LawError, "creepkit.language", "CreepLaw")
SPECIMEN = Kind("specimen", "creepkit_specimens", SolveError, "creepkit.records", "Specimen")
READER = Kind("reader", "creepkit_readers", HistoryError, "creepkit.records", "Reader")
EXPORTER = Kind("exporter", "creepkit_exporters", ExportError, "creepkit.records", "Exporter")
FORM = FormKind("temperature form", "creepkit_temperature_forms", LawError, "", "function")
KINDS = (LAW, SPECIMEN, READER, EXPORTER, FORM)


def implementations(
    manager: pluggy.PluginManager, plugin: object, provenance: Provenance
) -> dict[str, pluggy.HookImpl]:
    """Return {hook: implementation} of one registered plugin; PluginError when a hook of it could never be called.

    This is pluggy's check_pending for one plugin; it names the nearest hook and sees forgotten decorators as well.
    """
    known = [name for name in vars(hookspecs) if name.startswith(PREFIX)]
    callers = manager.get_hookcallers(plugin) or []
    for caller in callers:
        if not caller.has_spec():
            raise PluginError(f"{provenance} has an unknown hook '{caller.name}': {nearest(caller.name, known)}")
    found = {c.name: impl for c in callers for impl in c.get_hookimpls() if impl.plugin is plugin}
    marked = {impl.function.__name__ for impl in found.values()}
    for name in vars(plugin):
        if name.startswith(PREFIX) and callable(getattr(plugin, name)) and name not in marked:
            raise PluginError(f"{provenance} has a function '{name}' without @hookimpl; add the decorator")
    if not found:
        raise PluginError(f"{provenance} offers nothing; mark one of its functions @hookimpl ({', '.join(known)})")
    return found


def offered(kind: Kind, implementation: pluggy.HookImpl) -> dict[str, Any]:
    """Return {name: thing} that one plugin's hook offers."""
    returned = called(implementation)
    try:
        pairs = kind.named(returned)
    except PluginError as error:
        raise PluginError(f"{implementation.plugin_name}: {kind.hook} {error}") from None
    for name, _ in pairs:
        if [other for other, _ in pairs].count(name) > 1:
            raise PluginError(f"{implementation.plugin_name} offers the {kind.word} '{name}' twice; rename one")
    return dict(pairs)


def called(implementation: pluggy.HookImpl, **given: Any) -> Any:
    """Call one plugin's hook; PluginError when it raises."""
    arguments = [given[name] for name in implementation.argnames]
    try:
        return implementation.function(*arguments)
    except Exception as error:
        name = implementation.function.__name__
        raise PluginError(f"{implementation.plugin_name}: {name} raised {blame(error)}") from error


def _told(thing: Any) -> str:
    """Name something unexpected: a class by its own name, else by its type."""
    return f"the class {thing.__name__}" if isinstance(thing, type) else f"{type(thing).__name__} {thing!r}"[:80]
