"""Laws, specimens, plugins and example data, by name or file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit import registry
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, nearest

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import Material, Specimen
    from creepkit.registry import Plugin


EXAMPLE_DATA = Path(__file__).parents[1] / "example_data"


@checked
def law(name: str) -> CreepLaw:
    """Return the law called `name`: one of `available("laws")`, or a sum of them as in "norton+strain-hardening"."""
    return registry.default_registry().law(name)


@checked
def specimen(name: str) -> Specimen:
    """Return the specimen called `name`: one of `available("specimens")`."""
    return registry.default_registry().specimen(name)


@checked
def material(name: str) -> Material:
    """Return the published creep law called `name`: one of `available("materials")`, as `creepkit-materials` has them.

    >>> ck.export(ck.material("chromium"), "abaqus", to="creep.f")  # doctest: +SKIP
    """
    return registry.default_registry().one(registry.kinds.MATERIALS, name)


@checked
def available(kind: str) -> dict[str, Any]:
    """Return all that is registered of a kind, {name: value}.

    kind : "laws", "specimens", "readers", "cameras", "instruments", "exporters", "materials" or "temperature-forms".
    """
    return {name: entry.value for name, entry in registry.default_registry().all(registry.kinds.kind(kind)).items()}


@checked
def load_plugin(path: str | Path) -> Plugin:
    """Load a plugin from a `.py` file; what it offers is available by name from then on.

    The file is run as a program: load only what you trust.
    """
    return registry.default_registry().load_file(path)


@checked
def example_data(name: str) -> Path:
    """Return the folder of example data that come with creepkit, such as "planted creep curves".

    name : of the data in words; case, spaces and hyphens do not matter. Measured data say in the heads of their files
        where they come from and under which licence; planted data have their true values in `truth.json`.
    """
    folders = {_plain_name(path.name): path for path in EXAMPLE_DATA.iterdir() if path.is_dir()}
    if _plain_name(name) not in folders:
        known = sorted(path.name.replace("_", " ") for path in folders.values())
        raise HistoryError(f"there are no example data '{name}'; {nearest(name, known)}")
    return folders[_plain_name(name)]


def _plain_name(name: str) -> str:
    return "".join(character for character in name.lower() if character.isalnum())
