"""`creepkit check`: does what a plugin offers keep the promises that every law, specimen, reader and exporter makes?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.reports.terminal import tell

if TYPE_CHECKING:
    from creepkit.testing import ConformanceReport


def command(
    targets: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE.py|NAME...",
            help="Plugin files, or names of laws, specimens, readers, camera formats or exporters.",
        ),
    ],
) -> None:
    """Check that laws, specimens, readers, exporters are fit."""
    reports = [report for target in targets for report in _reports_of(target)]
    for report in reports:
        tell(report)
    failed = [report for report in reports if not report.passed]
    if failed:
        kinds = sorted({report.kind for report in reports})
        what = f"{kinds[0]}s" if len(kinds) == 1 else "checked"
        tell(f"creepkit: {len(failed)} of {len(reports)} {what} failed the check", err=True)
        raise typer.Exit(1)


def _reports_of(target: str) -> list[ConformanceReport]:
    """The reports of what is registered under a name, or else of a plugin file, whose name ends in .py.

    No other file is executed: one that happens to have the name of a law is not asked for.
    """
    from creepkit import registry
    from creepkit.errors import CreepkitError, PluginError
    from creepkit.registry.plugin_sources import is_plugin_file_name
    from creepkit.testing import check_named, check_plugin

    try:
        return check_named(target)
    except CreepkitError as error:
        if is_plugin_file_name(target):
            return check_plugin(registry.default_registry().load_file(target))
        if Path(target).is_file():
            raise PluginError(
                f"{error}; the file {target} is not executed, for only names that end in .py are those of files"
            ) from None
        raise
