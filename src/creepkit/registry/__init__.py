"""The registry: what plugins offer, with its provenance."""

from creepkit.registry import kinds
from creepkit.registry.plugin_registry import Plugin, Registered, Registry, default_registry, resolve_law
from creepkit.registry.plugin_sources import Provenance

__all__ = ["Plugin", "Provenance", "Registered", "Registry", "default_registry", "kinds", "resolve_law"]
