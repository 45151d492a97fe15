"""The registry: all that plugins contribute (laws, specimens, readers, camera formats ...), with its provenance.

Built-in and other plugins come through the same entry-point group; files come from CREEPKIT_PLUGINS and `load_file`.
All are imported when first asked for. A plugin that cannot be used is kept with the reason and the others stand;
only `load_file`, which was asked for that very plugin, raises.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import pluggy

from creepkit import hookspecs
from creepkit.errors import PluginError, nearest
from creepkit.registry import plugin_sources
from creepkit.registry.plugin_sources import ContributionKind, Provenance

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    import typer

    from creepkit.language.law import CreepLaw
    from creepkit.records import CameraFormat, Exporter, InstrumentFormat, Reader, Specimen


LAWS_BY_PACKAGE = {
    "creepkit-classic": (
        "blackburn",
        "coble",
        "dorn",
        "double-power",
        "garofalo",
        "graham-walles",
        "mpc-omega",
        "nabarro-herring",
        "norton-bailey-rate",
        "norton-bailey-strain",
        "norton-bailey-time",
        "theta-projection",
        "threshold-stress",
    ),
    "creepkit-damage": ("kachanov-rabotnov", "liu-murakami", "sinh-damage"),
    "creepkit-logarithmic": ("logarithmic",),
}
"""{package: its laws}, the packages under plugins/."""


def package_with_law(law: str) -> str:
    """The package that has a law of this name; empty when none is known to."""
    return next((package for package, laws in LAWS_BY_PACKAGE.items() if law in laws), "")


_T = TypeVar("_T")


@dataclass(frozen=True)
class Registered(Generic[_T]):
    """Something a plugin offers, and the plugin it came from."""

    value: _T
    provenance: Provenance


@dataclass(frozen=True)
class Plugin:
    """One plugin: where it came from, and what it offers or why it cannot be used.

    contributions : {kind: {name: object}} with the kinds "law", "specimen", "reader", "camera format",
        "instrument format", "exporter",
        "temperature form".
    commands : whether it adds commands to the command line.
    problem : one sentence when the plugin is broken, else empty.
    """

    provenance: Provenance
    contributions: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    commands: bool = False
    problem: str = ""


class Registry:
    """A plugin manager that records where everything came from; it loads what is installed when first used."""

    def __init__(self) -> None:
        self._manager = pluggy.PluginManager(hookspecs.PROJECT)
        self._manager.add_hookspecs(hookspecs)
        self._plugins: dict[Provenance, Plugin] = {}
        self._loaded = False
        self._loading_begun = False
        self._loading = threading.RLock()
        self._being_loaded: set[Provenance] = set()

    # ---- what there is ---------------------------------------------------------------------------------------------

    def plugins(self) -> tuple[Plugin, ...]:
        """Return every plugin, the broken ones included, in the order of loading."""
        self._load_all()
        return tuple(self._plugins.values())

    def conflicts(self) -> tuple[str, ...]:
        """Return one sentence for each name that two plugins offer."""
        return tuple(
            conflict
            for kind in plugin_sources.CONTRIBUTION_KINDS
            for conflict in _merged_contributions(kind, self.plugins())[1].values()
        )

    def replaced(self, plugin: Plugin) -> tuple[str, ...]:
        """One sentence for each name that a plugin file offers in the place of an installed plugin."""
        return tuple(
            f"the {kind} '{name}' is that of {plugin.provenance}, in place of {other.provenance}"
            for kind, offered in plugin.contributions.items()
            for name in offered
            for other in self.plugins()
            if name in other.contributions.get(kind, {}) and _replaces(plugin.provenance, other.provenance)
        )

    def laws(self) -> dict[str, Registered[CreepLaw]]:
        """Return {name: registered law}."""
        return self._all(plugin_sources.LAW)

    def specimens(self) -> dict[str, Registered[Specimen]]:
        """Return {name: registered specimen}."""
        return self._all(plugin_sources.SPECIMEN)

    def readers(self) -> dict[str, Registered[Reader]]:
        """Return {name: registered reader}."""
        return self._all(plugin_sources.READER)

    def cameras(self) -> dict[str, Registered[CameraFormat]]:
        """Return {name: registered camera format}."""
        return self._all(plugin_sources.CAMERA_FORMAT)

    def exporters(self) -> dict[str, Registered[Exporter]]:
        """Return {name: registered exporter}."""
        return self._all(plugin_sources.EXPORTER)

    def instruments(self) -> dict[str, Registered[InstrumentFormat]]:
        """Return {name: registered instrument format}."""
        return self._all(plugin_sources.INSTRUMENT)

    def temperature_forms(self) -> dict[str, Registered[Callable[..., Any]]]:
        """Return {name: registered function of T_ref that gives a form or a factor}."""
        return self._all(plugin_sources.TEMPERATURE_FORM)

    def law(self, name: str) -> CreepLaw:
        """Return the law called `name`; LawError with the nearest name when there is none."""
        law: CreepLaw = self._one(plugin_sources.LAW, name)
        return law

    def distributions_of(self, law: CreepLaw) -> str:
        """Return the distributions, with versions, of the laws that a law's name says it was made of.

        'creepkit-damage 0.1.0' of 'kachanov-rabotnov*arrhenius'; empty when no plugin has them.
        """
        parts = set(re.split(r"[^a-z0-9-]+", law.name))
        return ", ".join(sorted({one.provenance.origin for name, one in self.laws().items() if name in parts}))

    def specimen(self, name: str) -> Specimen:
        """Return the specimen called `name`; SolveError with the nearest name when there is none."""
        specimen: Specimen = self._one(plugin_sources.SPECIMEN, name)
        return specimen

    def reader(self, name: str) -> Reader:
        """Return the reader called `name`; HistoryError with the nearest name when there is none."""
        reader: Reader = self._one(plugin_sources.READER, name)
        return reader

    def camera(self, name: str) -> CameraFormat:
        """Return the camera format called `name`; HistoryError with the nearest name when there is none."""
        camera: CameraFormat = self._one(plugin_sources.CAMERA_FORMAT, name)
        return camera

    def exporter(self, name: str) -> Exporter:
        """Return the exporter called `name`; ExportError with the nearest name when there is none."""
        exporter: Exporter = self._one(plugin_sources.EXPORTER, name)
        return exporter

    def temperature_form(self, name: str) -> Callable[..., Any]:
        """Return the function of T_ref called `name`; LawError with the nearest name when there is none."""
        form: Callable[..., Any] = self._one(plugin_sources.TEMPERATURE_FORM, name)
        return form

    def _all(self, kind: ContributionKind) -> dict[str, Registered[Any]]:
        return _merged_contributions(kind, self.plugins())[0]

    def _one(self, kind: ContributionKind, name: str) -> Any:
        known, clashes = _merged_contributions(kind, self.plugins())
        if name in known:
            return known[name].value
        if name in clashes:
            raise PluginError(clashes[name])
        package = package_with_law(name) if kind is plugin_sources.LAW else ""
        hint = self.broken_hint()
        if package:
            raise kind.error(f"there is no law '{name}'; package {package} has it: pip install {package}{hint}")
        raise kind.error(f"there is no {kind.label} '{name}': {nearest(name, known)}{hint}")

    def broken_hint(self) -> str:
        """How many plugins could not be loaded, as the end of a sentence; "" where all were."""
        broken = sum(bool(plugin.problem) for plugin in self.plugins())
        return f"; {broken} plugin(s) could not be loaded, see 'creepkit plugins'" if broken else ""

    # ---- where it comes from ---------------------------------------------------------------------------------------

    def load_file(self, path: str | Path) -> Plugin:
        """Load one plugin file; PluginError, and nothing registered, when it cannot be used."""
        path = Path(path)
        provenance = plugin_sources.provenance_of_file(path)
        with self._loading:
            known = self._plugins.get(provenance)
            if known is None or known.problem:
                module = plugin_sources.import_file(provenance, path)
                self._plugins[provenance] = self._register_plugin(provenance, module)
            return self._plugins[provenance]

    def command_lines(self, *, listed_only: bool = False) -> list[tuple[Plugin, typer.Typer]]:
        """Return [(plugin, a command line with its commands)]; that of a plugin that is broken is empty.

        listed_only : load those plugins alone whose text has the name of the hook, as `creepkit --help` does; else all.
        """
        import typer

        if listed_only:
            with self._loading:
                considered = self._load_sources(plugin_sources.mentions_commands)
        else:
            considered = [plugin.provenance for plugin in self.plugins()]
        results = []
        for provenance in considered:
            app = typer.Typer()
            if self._add_commands(provenance, app):
                results.append((self._plugins[provenance], app))
            elif self._plugins[provenance].problem:
                results.append((self._plugins[provenance], typer.Typer()))
        return results

    def _add_commands(self, provenance: Provenance, app: typer.Typer) -> bool:
        """Let one plugin add its commands, if it has any; it is broken from then on when it raises."""
        plugin = self._plugins[provenance]
        for implementation in self._manager.hook.creepkit_commands.get_hookimpls():
            if implementation.plugin_name != str(provenance):
                continue
            try:
                plugin_sources.call_hook(implementation, app=app)
                return True
            except PluginError as error:
                self._plugins[provenance] = replace(plugin, problem=str(error))
        return False

    def _load_all(self) -> None:
        """Load what is installed and what the environment names, once.

        Other threads wait until all is there; a plugin that asks for laws while it is loaded gets those so far.
        """
        if self._loaded:
            return
        with self._loading:
            if not self._loading_begun:
                self._loading_begun = True
                self._load_sources()
                self._loaded = True

    def _load_sources(self, wanted: Callable[[EntryPoint | Path], bool] = lambda source: True) -> list[Provenance]:
        """Load the wanted ones of the installed plugins and of the files that the environment names.

        Returns their provenances, and those of files that were loaded by name.
        """
        loaded = [provenance for provenance in self._plugins if Path(provenance.origin).is_absolute()]
        for provenance, entry in plugin_sources.installed_entry_points():
            if wanted(entry):
                self._add_plugin(provenance, partial(plugin_sources.import_entry, provenance, entry))
                loaded.append(provenance)
        for path in plugin_sources.plugin_files_in_environment():
            provenance = plugin_sources.provenance_of_file(path)
            if wanted(path):
                self._add_plugin(provenance, partial(plugin_sources.import_file, provenance, path))
                loaded.append(provenance)
        return list(dict.fromkeys(loaded))

    def _add_plugin(self, provenance: Provenance, imported: Callable[[], object]) -> None:
        """Enter a plugin, or else the reason why it cannot be used; not one that is being loaded, and asks for laws."""
        if provenance in self._plugins or provenance in self._being_loaded:
            return
        self._being_loaded.add(provenance)
        try:
            self._plugins[provenance] = self._register_plugin(provenance, imported())
        except PluginError as error:
            self._plugins[provenance] = Plugin(provenance, problem=str(error))
        finally:
            self._being_loaded.discard(provenance)

    def _register_plugin(self, provenance: Provenance, module: object) -> Plugin:
        """Enter a plugin whole or not at all: its hooks must exist and return what they promise."""
        if other_name := self._manager.get_name(module):
            raise PluginError(f"{provenance} is the same module as {other_name}; drop one of the two entry points")
        try:
            self._register_module(provenance, module)
            hooks = plugin_sources.hook_implementations(self._manager, module, provenance)
            contributions = {
                k.label: plugin_sources.contributions_of(k, hooks[k.hook])
                for k in plugin_sources.CONTRIBUTION_KINDS
                if k.hook in hooks
            }
        except PluginError:
            if self._manager.is_registered(module):
                self._manager.unregister(module)
            raise
        return Plugin(provenance, contributions, commands=plugin_sources.COMMANDS_HOOK in hooks)

    def _register_module(self, provenance: Provenance, module: object) -> None:
        plugin_sources.check_signatures(provenance, module)
        try:
            self._manager.register(module, str(provenance))
        except pluggy.PluginValidationError as error:
            description = " ".join(str(error).split())
            raise PluginError(f"{provenance} does not fit the hooks of creepkit: {description}") from error


@cache
def default_registry() -> Registry:
    """The registry of the public functions; it loads what is installed and the environment names when first asked."""
    return Registry()


default_registry()  # made with the module, while there is one thread


def loaded_plugin_files() -> list[str]:
    """The plugin files that the registry of the public functions has loaded without a problem."""
    plugins = list(default_registry()._plugins.values())
    return [p.provenance.origin for p in plugins if p.provenance.origin.endswith(".py") and not p.problem]


def load_plugin_file(path: str) -> None:
    """Load a plugin file in a worker process; one that is gone is missed where something of it is needed."""
    with suppress(PluginError):
        default_registry().load_file(path)


def _replaces(file: Provenance, installed: Provenance) -> bool:
    """Whether a file that the user names stands in for an installed plugin, which is not creepkit's own."""
    is_file = Path(file.origin).is_absolute()
    return is_file and not Path(installed.origin).is_absolute() and not installed.origin.startswith("creepkit ")


def _merged_contributions(
    kind: ContributionKind, plugins: Iterable[Plugin]
) -> tuple[dict[str, Registered[Any]], dict[str, str]]:
    """Return {name: registered} over plugins, and {name: a sentence} for each that two offer, which is left out."""
    results: dict[str, Registered[Any]] = {}
    conflicts: dict[str, str] = {}
    for plugin in plugins:
        for name, value in plugin.contributions.get(kind.label, {}).items():
            if name in results and _replaces(plugin.provenance, results[name].provenance):
                results[name] = Registered(value, plugin.provenance)
            elif name in results and not _replaces(results[name].provenance, plugin.provenance):
                providers = f"{results[name].provenance} and by {plugin.provenance}"
                conflicts[name] = (
                    f"the {kind.label} '{name}' is offered twice, by {providers}; rename one or uninstall it"
                )
            elif name not in results:
                results[name] = Registered(value, plugin.provenance)
    return {name: one for name, one in results.items() if name not in conflicts}, conflicts
