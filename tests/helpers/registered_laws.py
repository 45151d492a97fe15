"""Every law that is installed, with numbers for the conditions of the material that it asks for."""

from creepkit.language import CreepLaw
from creepkit.registry import default_registry
from creepkit.testing.sample_points import with_numbers


def registered_laws() -> dict[str, CreepLaw]:
    """{name: law}, by name."""
    return {name: with_numbers(entry.value) for name, entry in sorted(default_registry().laws().items())}


def laws_of_scalars() -> dict[str, CreepLaw]:
    """The same of which all specimens and the page of sliders take: without a back stress."""
    return {name: law for name, law in registered_laws().items() if not law.back_stresses}
