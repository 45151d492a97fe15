"""The kinds of things that plugins offer, and the checks on what their hooks are and return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import pluggy

from creepkit import hookspecs
from creepkit.errors import CreepkitError, ExportError, HistoryError, LawError, PluginError, SolveError, nearest
from creepkit.registry.sources import Provenance, error_text

HOOK_PREFIX = "creepkit_"
COMMANDS_HOOK = "creepkit_commands"


@dataclass(frozen=True)
class ContributionKind:
    """One kind of thing: its word, the hook that offers it, the error when a name is unknown, and its record.

    home : module of the record that each thing must be; imported when there is a thing to check, for it is not light.
    """

    label: str
    hook: str
    error: type[CreepkitError]
    record_module: str
    record_name: str

    def named_contributions(self, returned: Any) -> list[tuple[str, Any]]:
        """Return [(name, thing)] of what a hook returned; PluginError when it is not what the hook promises."""
        if not isinstance(returned, Sequence) or isinstance(returned, str):
            raise PluginError(f"must return a list of {self.record_name} records, found {_type_text(returned)}")
        required = getattr(import_module(self.record_module), self.record_name) if returned else object
        for contribution in returned:
            if isinstance(contribution, type) or not isinstance(contribution, required):
                raise PluginError(f"must return a list of {self.record_name} records, found {_type_text(contribution)} in it")
        return [(thing.name, thing) for thing in returned]


class TemperatureFormKind(ContributionKind):
    """Temperature forms, which are functions and so come with their names."""

    def named_contributions(self, returned: Any) -> list[tuple[str, Any]]:
        """Return [(name, function of T_ref)]."""
        if not isinstance(returned, Mapping):
            raise PluginError(f"must return {{name: function of T_ref}}, found {_type_text(returned)}")
        for name, form in returned.items():
            if not callable(form):
                raise PluginError(f"must return {{name: function of T_ref}}, found {_type_text(form)} for '{name}'")
        return list(returned.items())


LAW = ContributionKind("law", "creepkit_laws", LawError, "creepkit.language", "CreepLaw")
SPECIMEN = ContributionKind("specimen", "creepkit_specimens", SolveError, "creepkit.records", "Specimen")
READER = ContributionKind("reader", "creepkit_readers", HistoryError, "creepkit.records", "Reader")
EXPORTER = ContributionKind("exporter", "creepkit_exporters", ExportError, "creepkit.records", "Exporter")
TEMPERATURE_FORM = TemperatureFormKind("temperature form", "creepkit_temperature_forms", LawError, "", "function")
CONTRIBUTION_KINDS = (LAW, SPECIMEN, READER, EXPORTER, TEMPERATURE_FORM)


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
            raise PluginError(f"{provenance} has an unknown hook '{caller.name}': {nearest(caller.name, known)}")
    results = {c.name: impl for c in callers for impl in c.get_hookimpls() if impl.plugin is plugin}
    marked = {impl.function.__name__ for impl in results.values()}
    for name in vars(plugin):
        if name.startswith(HOOK_PREFIX) and callable(getattr(plugin, name)) and name not in marked:
            raise PluginError(f"{provenance} has a function '{name}' without @hookimpl; add the decorator")
    if not results:
        raise PluginError(f"{provenance} offers nothing; mark one of its functions @hookimpl ({', '.join(known)})")
    return results


def contributions_of(kind: ContributionKind, implementation: pluggy.HookImpl) -> dict[str, Any]:
    """Return {name: thing} that one plugin's hook offers."""
    returned = call_hook(implementation)
    try:
        contributions = kind.named_contributions(returned)
    except PluginError as error:
        raise PluginError(f"{implementation.plugin_name}: {kind.hook} {error}") from None
    for name, _ in contributions:
        if [other for other, _ in contributions].count(name) > 1:
            raise PluginError(f"{implementation.plugin_name} offers the {kind.label} '{name}' twice; rename one")
    return dict(contributions)


def call_hook(implementation: pluggy.HookImpl, **keywords: Any) -> Any:
    """Call one plugin's hook; PluginError when it raises."""
    arguments = [keywords[name] for name in implementation.argnames]
    try:
        return implementation.function(*arguments)
    except Exception as error:
        name = implementation.function.__name__
        raise PluginError(f"{implementation.plugin_name}: {name} raised {error_text(error)}") from error


def _type_text(thing: Any) -> str:
    """Name something unexpected: a class by its own name, else by its type."""
    return f"the class {thing.__name__}" if isinstance(thing, type) else f"{type(thing).__name__} {thing!r}"[:80]
