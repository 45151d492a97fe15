"""The registry: what plugins offer, with its provenance."""

from creepkit.registry.catalogue import Plugin, Registered, Registry, default_registry
from creepkit.registry.sources import Provenance

__all__ = ["Plugin", "Provenance", "Registered", "Registry", "default_registry"]
