"""`creepkit check`: does a law keep the promises that every law makes?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


def command(
    targets: Annotated[list[str], typer.Argument(metavar="FILE|NAME...", help="Plugin files, or names of laws.")],
) -> None:
    """Check that laws keep what every law promises."""
    from creepkit.testing import check_law

    laws = [law for target in targets for law in _laws_of(target)]
    failure_count = 0
    for law in laws:
        report = check_law(law)
        typer.echo(str(report))
        failure_count += not report.passed
    if failure_count:
        typer.echo(f"creepkit: {failure_count} of {len(laws)} laws failed the check", err=True)
        raise typer.Exit(1)


def _laws_of(target: str) -> list[CreepLaw]:
    """Return the laws of a plugin file, or the one law of that name."""
    from creepkit import registry
    from creepkit.errors import PluginError

    if not (target.endswith(".py") or Path(target).is_file()):
        return [registry.default_registry().law(target)]
    plugin = registry.default_registry().load_file(target)
    laws = list(plugin.contributions.get("law", {}).values())
    if not laws:
        raise PluginError(f"{plugin.provenance} offers no law; return one from creepkit_laws")
    return laws
