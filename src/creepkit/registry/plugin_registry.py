"""The registry: all that plugins contribute (laws, specimens, readers, camera formats ...), with its provenance.

It is asked for one kind and one name, and imports the module that an entry point of this name states; a list of a kind
imports those of the kind. Built-in and other plugins come through the same groups of entry points; files come from
CREEPKIT_PLUGINS and `load_file`. A plugin that cannot be used is kept with the reason and the others stand; only
`load_file`, which was asked for that very plugin, raises.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import pluggy

from creepkit import hookspecs
from creepkit.errors import LawError, PluginError, nearest, raised_text
from creepkit.registry import kinds, plugin_sources
from creepkit.registry.kinds import PluginKind, group_of
from creepkit.registry.plugin_sources import PluginFile, Provenance, Source, name_key

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw
    from creepkit.records import Predictor, Specimen


MORE_LAWS = 'plugins bring more: pip install "creepkit[plugins]"'
"""The end of the sentence about a law, or a material, that is not installed."""


_T = TypeVar("_T")


@dataclass(frozen=True)
class Registered(Generic[_T]):
    """Something a plugin offers, and the plugin it came from."""

    value: _T
    provenance: Provenance


@dataclass(frozen=True)
class Plugin:
    """One plugin: where it came from, and what it offers or why it cannot be used.

    contributions : {kind: {name: object}}, by the labels of registry.kinds.
    problem : one sentence when the plugin is broken, else empty.
    """

    source: Source
    contributions: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    problem: str = ""

    @property
    def provenance(self) -> Provenance:
        """Where it came from."""
        return self.source.provenance


class Registry:
    """A plugin manager that records where everything came from; it imports what is installed when that is asked for."""

    def __init__(self) -> None:
        self._manager = pluggy.PluginManager(hookspecs.PROJECT)
        self._manager.add_hookspecs(hookspecs)
        self._plugins: dict[str, Plugin] = {}
        self._being_loaded: set[str] = set()
        self._loading = threading.RLock()
        self._given: dict[str, Specimen] = {}
        self._found: dict[tuple[str, str | None], Any] = {}  # what was asked for, until another plugin is registered

    # ---- what there is ---------------------------------------------------------------------------------------------

    def plugins(self) -> tuple[Plugin, ...]:
        """Every plugin, the broken ones included: those installed, then the files."""
        self._load(self._sources)
        return self._loaded()

    def conflicts(self, *of: PluginKind[Any]) -> tuple[str, ...]:
        """One sentence for each name of these kinds, or of any, that two plugins offer."""
        for kind in of or kinds.KINDS:
            self._load(self._offering(kind))
        return tuple(text for kind in of or kinds.KINDS for text in _merged(kind, self._loaded())[1].values())

    def replaced(self, plugin: Plugin) -> tuple[str, ...]:
        """One sentence for each name that a plugin file offers in the place of an installed plugin."""
        return tuple(
            f"the {kind} '{name}' is that of {plugin.provenance}, in place of {other.provenance}"
            for kind, offered in plugin.contributions.items()
            for name in offered
            for other in self.plugins()
            if name in other.contributions.get(kind, {}) and _replaces(plugin, other)
        )

    def all(self, kind: PluginKind[_T]) -> dict[str, Registered[_T]]:
        """{name: what is registered of a kind}."""
        if (kind.label, None) not in self._found:
            self._load(self._offering(kind))
            self._found[kind.label, None] = _merged(kind, self._loaded())[0]
        return dict(self._found[kind.label, None])

    def values(self, kind: PluginKind[_T]) -> list[_T]:
        """All that is registered of a kind."""
        return [entry.value for entry in self.all(kind).values()]

    def one(self, kind: PluginKind[_T], name: str) -> _T:
        """What is registered under a name, whatever its capitals and hyphens, or under an alias of it.

        The error of its kind, with the nearest name or those that serve this word, where there is none.
        """
        if (kind.label, name) not in self._found:
            self._found[kind.label, name] = self._looked_up(kind, name)
        result: _T = self._found[kind.label, name]
        return result

    def laws(self) -> dict[str, Registered[CreepLaw]]:
        """{name: registered law}."""
        return self.all(kinds.LAWS)

    def specimens(self) -> dict[str, Registered[Specimen]]:
        """{name: registered specimen}."""
        return self.all(kinds.SPECIMENS)

    def known_specimens(self) -> dict[str, Specimen]:
        """{name: specimen} of those registered, and after them of those given to public functions."""
        registered = {name: entry.value for name, entry in self.specimens().items()}
        return registered | {name: one for name, one in self._given.items() if name not in registered}

    def remember(self, predictor: Predictor) -> None:
        """Keep the specimen of a predictor that was given to a public function: files and texts have its name alone."""
        if predictor.specimen.name:
            self._given[predictor.specimen.name] = predictor.specimen

    def law(self, name: str) -> CreepLaw:
        """The law of a name, a sum as "norton+strain-hardening", or "hyperbolic-sine*primary"; LawError without one.

        With forms of temperature about a reference in K: "threshold-stress[s_0:linear(840)]*arrhenius(840)".
        """
        if "+" in name and name not in self.laws():
            first, *others = (self.law(part.strip()) for part in name.split("+"))
            return sum(others, start=first)
        if name.endswith("*primary"):
            return self.law(name.removesuffix("*primary")).with_primary()
        if factor := re.fullmatch(r"(.+)\*arrhenius\((\d+\.?\d*)\)", name):
            return self.law(factor[1]).times(self.one(kinds.TEMPERATURE_FORMS, "arrhenius")(T_ref=float(factor[2])))
        if form := re.fullmatch(r"(.+)\[(\w+):([\w-]+)\((\d+\.?\d*)\)\]", name):
            made = self.one(kinds.TEMPERATURE_FORMS, form[3])(T_ref=float(form[4]))
            return self.law(form[1]).with_temperature(**{form[2]: made})
        return self.one(kinds.LAWS, name)

    def specimen(self, name: str) -> Specimen:
        """The specimen of a name; SolveError with the nearest name when there is none."""
        return self.one(kinds.SPECIMENS, name)

    def distributions_of(self, law: CreepLaw) -> str:
        """Return the distributions, with versions, of the laws that a law's name says it was made of.

        'creepkit-damage 0.1.0' of 'kachanov-rabotnov*arrhenius'; empty when no plugin has them.
        """
        return ", ".join(sorted({one.origin for one in self.plugins_of(law)}))

    def plugins_of(self, law: CreepLaw) -> tuple[Provenance, ...]:
        """Where the laws come from that a law's name says it was made of."""
        parts = {law.name, *re.split(r"[^a-z0-9-]+", law.name)}
        self._load(self._offering(kinds.LAWS, parts))
        known, _ = _merged(kinds.LAWS, self._loaded())
        return tuple(dict.fromkeys(one.provenance for name, one in known.items() if name in parts))

    def broken_hint(self) -> str:
        """How many plugins could not be loaded, as the end of a sentence; "" where all were."""
        broken = sum(bool(plugin.problem) for plugin in self._loaded())
        return f"; {broken} plugin(s) could not be loaded, see 'creepkit list plugins'" if broken else ""

    def _looked_up(self, kind: PluginKind[Any], name: str) -> Any:
        """As one(), loading the plugins that may have it: first those that name it by an entry point."""
        named = self._offering(kind, {name})
        for sources in (named, self._offering(kind)):
            self._load(sources)
            known, clashes = _merged(kind, self._loaded())
            by_key = {name_key(one): one for one in (*clashes, *known)}
            found = name if name in known or name in clashes else by_key.get(name_key(name), "")
            if found in clashes:
                raise PluginError(clashes[found])
            if found:
                return known[found].value
        for source in named:
            offered = {} if source.is_file else self._plugins[source.place].contributions.get(kind.label, {})
            if len(offered) == 1 and set(offered) <= set(known):
                return known[next(iter(offered))].value
        serving = sorted(one for one in known if name_key(name) in getattr(known[one].value, "serves", ()))
        if len(serving) == 1:
            return known[serving[0]].value
        if serving:
            raise kind.error(
                f"there is no {kind.label} '{name}'; choose one of those that serve it: {', '.join(serving)}"
            )
        bare = kind in (kinds.LAWS, kinds.MATERIALS) and all(one.is_own for one in self._sources)
        more = f"; {MORE_LAWS}" if bare else ""
        near = nearest(name, known)
        if kind is kinds.LAWS and not near.startswith("did you mean"):
            more += "; that of a file: creepkit --plugin FILE.py before the command, or ck.load_plugin"
        raise kind.error(f"there is no {kind.label} '{name}': {near}{more}{self.broken_hint()}")

    def _offering(self, kind: PluginKind[Any], names: Iterable[str] | None = None) -> list[Source]:
        """The sources that may have something of a kind, or of one of these names: by entry points, and all files."""
        keys = None if names is None else {name_key(name) for name in names}
        return [source for source in self._sources if source.offers(group_of(kind.hook), keys)]

    # ---- where it comes from ---------------------------------------------------------------------------------------

    @cached_property
    def _sources(self) -> tuple[Source, ...]:
        return (*plugin_sources.installed_modules(), *plugin_sources.plugin_files_in_environment())

    def _loaded(self) -> tuple[Plugin, ...]:
        """The plugins that have been imported: creepkit's own, others that are installed, then files as they came."""

        def place(plugin: Plugin) -> tuple[bool, bool, str]:
            source = plugin.source
            return source.is_file, not source.is_own, "" if source.is_file else source.place

        return tuple(sorted(self._plugins.values(), key=place))

    def load_file(self, path: str | Path) -> Plugin:
        """Load one plugin file; PluginError, and nothing registered, when it cannot be used."""
        source = PluginFile(Path(path))
        with self._loading:
            known = self._plugins.get(source.place)
            if known is None or known.problem:
                self._plugins[source.place] = self._registered(source)
            return self._plugins[source.place]

    def _load(self, sources: Iterable[Source]) -> None:
        """Import these plugins, each once; of one that cannot be used the reason is kept.

        Other threads wait until all are there; a plugin that asks for laws while it is imported gets those so far.
        """
        with self._loading:
            for source in sources:
                if source.place in self._being_loaded or source.place in self._plugins:
                    continue
                self._being_loaded.add(source.place)
                try:
                    self._plugins[source.place] = self._registered(source)
                except PluginError as error:
                    self._plugins[source.place] = Plugin(source, problem=str(error))
                finally:
                    self._being_loaded.discard(source.place)

    def _registered(self, source: Source) -> Plugin:
        """Import a plugin and enter it whole or not at all: its hooks must exist and return what they promise."""
        self._found.clear()
        module, provenance = source.load(), source.provenance
        _check_hooks(provenance, module)
        if self._manager.has_plugin(source.place):  # as it was before the file was mended
            self._manager.unregister(name=source.place)
        try:
            self._manager.register(module, source.place)
            hooks = {caller.name for caller in self._manager.get_hookcallers(module) or ()}
            for group in sorted(group_of(hook) for hook in hooks):
                if not source.offers(group):
                    raise PluginError(
                        f"{provenance} has the hook {group.replace('.', '_')}, but no entry point in the group "
                        f"'{group}' names its module; add one"
                    )
            offered = {kind.label: self._offered(kind, source) for kind in kinds.KINDS if kind.hook in hooks}
        except pluggy.PluginValidationError as error:
            description = " ".join(str(error).split())
            raise PluginError(f"{provenance} does not fit the hooks of creepkit: {description}") from error
        except PluginError:
            self._manager.unregister(module)
            raise
        return Plugin(source, offered)

    def _offered(self, kind: PluginKind[_T], source: Source) -> dict[str, _T]:
        """{name: object} of a kind that one plugin offers; PluginError when that is not what the hook promises."""
        returned = self._called(source, kind.hook)
        try:
            return kind.named(returned)
        except Exception as error:
            place = _location(getattr(self._manager.get_plugin(source.place), kind.hook))
            if isinstance(error, PluginError):
                raise PluginError(f"{source.provenance}: {kind.hook} {error}{place}") from None
            problem = f"returned a record that cannot be asked its name: {raised_text(error)}"
            raise PluginError(f"{source.provenance}: {kind.hook} {problem}{place}") from error

    def _called(self, source: Source, hook: str, **arguments: Any) -> Any:
        """What a hook of one plugin returns; PluginError when it raises."""
        others = self._manager.get_plugins() - {self._manager.get_plugin(source.place)}
        try:
            results = self._manager.subset_hook_caller(hook, others)(**arguments)
        except (Exception, SystemExit) as error:
            raise PluginError(f"{source.provenance}: {hook} raised {raised_text(error)}") from error
        return results[0] if results else None


@cache
def default_registry() -> Registry:
    """The registry of the public functions; it imports what is asked for when it is asked for."""
    return Registry()


default_registry()  # made with the module, while there is one thread


def resolve_law(law: CreepLaw | str) -> CreepLaw:
    """The law itself, or the one of that name; "norton+strain-hardening" names the sum of two."""
    if isinstance(law, str):
        return default_registry().law(law)
    if not hasattr(law, "terms"):
        raise LawError(f"a creep law or its name is needed, found {type(law).__name__}")
    return law


def loaded_plugin_files() -> list[str]:
    """The plugin files that the registry of the public functions has loaded without a problem."""
    return [p.provenance.origin for p in default_registry()._loaded() if p.source.is_file and not p.problem]


def load_plugin_file(path: str) -> None:
    """Load a plugin file in a worker process; one that is gone is missed where something of it is needed."""
    with suppress(PluginError):
        default_registry().load_file(path)


def _check_hooks(provenance: Provenance, module: ModuleType) -> None:
    """PluginError for a module with no hook, or with one that pluggy would pass over."""
    known = [name for name in vars(hookspecs) if name.startswith("creepkit_")]
    hooks = [name for name in vars(module) if name.startswith("creepkit_") and callable(getattr(module, name))]
    if not hooks:
        raise PluginError(f"{provenance} offers nothing; mark one of its functions @hookimpl ({', '.join(known)})")
    for name in hooks:
        function = getattr(module, name)
        if not hasattr(function, f"{hookspecs.PROJECT}_impl"):
            problem = f"has a function '{name}' without @hookimpl; add the decorator"
            raise PluginError(f"{provenance} {problem}{_location(function)}")
        if name not in known:
            raise PluginError(f"{provenance} has an unknown hook '{name}': {nearest(name, known)}{_location(function)}")


def _location(function: Any) -> str:
    """Where a function of a plugin is written, as the end of a sentence; "" where that is not known."""
    code = getattr(function, "__code__", None)
    return f" ({code.co_filename}, line {code.co_firstlineno})" if code is not None else ""


def _replaces(plugin: Plugin, other: Plugin) -> bool:
    """Whether a file that the user names stands in for an installed plugin, which is not creepkit's own."""
    return plugin.source.is_file and not other.source.is_file and not other.source.is_own


def _merged(kind: PluginKind[Any], plugins: Iterable[Plugin]) -> tuple[dict[str, Registered[Any]], dict[str, str]]:
    """Return {name: registered} over plugins, and {name: a sentence} for each that two offer, which is left out."""
    offers: dict[str, list[Plugin]] = {}
    for plugin in plugins:
        for name in plugin.contributions.get(kind.label, {}):
            others = offers.setdefault(name, [])
            others[:] = [other for other in others if not _replaces(plugin, other)]
            others.append(plugin)
    clashes = {
        name: f"the {kind.label} '{name}' is offered twice, by {found[0].provenance} and by {found[1].provenance}; "
        "rename one or uninstall it"
        for name, found in offers.items()
        if len(found) > 1
    }
    known = {
        name: Registered(found[0].contributions[kind.label][name], found[0].provenance)
        for name, found in offers.items()
        if name not in clashes
    }
    return known, clashes
