"""`creepkit report`: saved results as one page that a colleague can read, or as a page of sliders."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import creepkit as ck
from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import is_law_name, law_source
from creepkit.errors import FitError, ReportError
from creepkit.options import Option
from creepkit.reports.terminal import ProgressBar, tell_written

if TYPE_CHECKING:
    from creepkit.app.contents import PageSource
    from creepkit.records import History


def command(
    results: Annotated[
        list[str],
        typer.Argument(
            metavar="RESULT.json...",
            help="Identifications, rankings, rupture assessments; with --app one, a law, or tests.",
        ),
    ],
    *,
    tests: Annotated[
        list[str] | None,
        typer.Option("--tests", metavar="TESTS", help="Their measured files, folders or patterns, for the curves."),
    ] = None,
    to: Annotated[Path | None, typer.Option(help="File for the page; report.html, or page.html."), OutputPath()] = None,
    title: Annotated[str, Option(help="Of the page.")] = "",
    app: Annotated[bool, Option(help="A page on which the law's parameters are moved by sliders.")] = False,
    specimen: Annotated[str | None, Option(help="Of a page of sliders: which is shown first.")] = None,
) -> None:
    """One file, complete without scripts: findings, curves, tests, laws tried, data, files to download, methods.

    It prints, and opens anywhere. Identifications of the same tests are ranked. With --app, curves are computed in the
    browser while sliders move, and measured tests are laid over; of tests alone the three laws that suit them are
    fitted first.
    """
    histories = list(ck.read_histories(tests)) if tests else []
    if app:
        source = _page_source(results, histories)
        path = ck.interactive_page(source, to or Path("page.html"), tests=histories, specimen=specimen, title=title)
        if sys.stdout.isatty():
            webbrowser.open(path.resolve().as_uri())
    else:
        if specimen is not None:
            raise ReportError("--specimen belongs to a page of sliders: give --app as well")
        law = next((name for name in results if is_law_name(name)), None)
        if law is not None:
            raise ReportError(f"{law} is a law: give --app for a page of its sliders, or name results of identify")
        found = map(ck.load, results)
        path = ck.report(
            [one.with_histories(histories) if hasattr(one, "with_histories") and histories else one for one in found],
            to or Path("report.html"),
            title=title,
        )
    tell_written(path, err=True)


MOST_FITTED = 3
"""Laws that are fitted to tests for a page of sliders."""


def _page_source(names: list[str], histories: list[History]) -> PageSource:
    """A law by its name, fitted to tests where there are some; what a file holds; or the best laws of measured tests.

    histories : given by --tests; measured files in the place of results are added to them.
    """
    named = [name for name in names if name.endswith(".json") or is_law_name(name)]
    if named and len(names) > 1:
        raise FitError(f"{len(names)} laws or results are named; name one, and tests by --tests")
    if not named:
        histories += ck.read_histories(names)
    elif not histories or names[0].endswith(".json"):
        return law_source(names[0])
    return fitted_laws(named, histories)


def fitted_laws(names: list[str], histories: list[History]) -> PageSource:
    """Laws by name, or those that suit tests, fitted to these."""
    from creepkit.inverse.candidate_laws import LawChanges
    from creepkit.inverse.candidates import candidates

    laws = [ck.law(name) for name in names] or candidates(histories)[:MOST_FITTED]
    laws = LawChanges().applied(laws, histories)
    with ProgressBar() as progress:
        if len(laws) == 1:
            return ck.identify(laws[0], histories, progress=progress.tick)
        return ck.select(laws, histories, sums=False, progress=progress.tick)
