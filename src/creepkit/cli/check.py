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
    example: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Example file or folder for a reader; may be given several times."),
    ] = None,
) -> None:
    """Each promise that is not kept is a sentence that says what to change."""
    reports = [report for target in targets for report in _reports_of(target)]
    if example:
        reports = _with_examples(reports, example)
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
        if Path(target).is_dir():
            raise PluginError(f"{target} is a folder; {_file_in(Path(target))}") from None
        if Path(target).is_file():
            raise PluginError(
                f"{error}; the file {target} is not executed, for only names that end in .py are those of files"
            ) from None
        raise


def _with_examples(reports: list[ConformanceReport], examples: list[Path]) -> list[ConformanceReport]:
    """The reports, of each reader one for each of its example files."""
    from creepkit.errors import PluginError
    from creepkit.testing import check_reader

    if not any(report.kind == "reader" for report in reports):
        raise PluginError("--example is for readers, and none is checked; leave it out")
    return [
        one
        for report in reports
        for one in ([check_reader(report.subject, path) for path in examples] if report.kind == "reader" else [report])
    ]


def _file_in(folder: Path) -> str:
    """What to write in the place of a folder, in words."""
    found = [path for path in sorted(folder.glob("*.py")) if path.name not in ("conftest.py", "setup.py")]
    if not found:
        return "name the file of the plugin in it, which ends in .py"
    return f"name the file in it: creepkit check {' '.join(str(path) for path in found[:3])}"
