"""The registry: what plugins offer, with its provenance."""

from creepkit.registry.catalogue import Plugin, Registered, Registry, default
from creepkit.registry.sources import Provenance

__all__ = ["Plugin", "Provenance", "Registered", "Registry", "default"]
