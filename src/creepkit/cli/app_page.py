"""`creepkit app`: an interactive page of a law, an identification or a ranking, as one file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.cli.declared_options import OutputPath
from creepkit.cli.options import is_file_name, is_law_name
from creepkit.reports.terminal import tell_written

if TYPE_CHECKING:
    from creepkit.app.contents import PageSource
    from creepkit.records import History


def command(
    sources: Annotated[
        list[str] | None,
        typer.Argument(metavar="[LAW|FIT.json|TESTS]...", help="A law, an identification or a ranking, and tests."),
    ] = None,
    specimen: Annotated[str | None, typer.Option(help="Which is shown first; by default that of the tests.")] = None,
    to: Annotated[Path, typer.Option(help="The page, one file of HTML."), OutputPath()] = Path("page.html"),
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Whether to open it, from a terminal.")
    ] = True,
) -> None:
    """Explore a law by sliders in a browser page.

    Measured tests are laid over. The page is one file that computes by itself.
    """
    import sys
    import webbrowser

    from creepkit.api.pages import write_page
    from creepkit.app.contents import page_contents

    source, tests = _resolved(sources or [])
    path = write_page(page_contents(source, tests, specimen=specimen), to)
    tell_written(path)
    if browser and sys.stdout.isatty():
        webbrowser.open(path.resolve().as_uri())


def _resolved(words: list[str]) -> tuple[PageSource, list[History]]:
    """The source of the page, and the measured tests; a word that is no file is a law."""
    import creepkit as ck
    from creepkit.cli.law_sources import read_law_file
    from creepkit.errors import FitError
    from creepkit.inverse.ranking_document import RANKING, read_ranking

    sources: list[PageSource] = []
    tests: list[str] = []
    for word in words:
        if is_law_name(word) or not (Path(word).exists() or is_file_name(word) or any(c in word for c in "*?[\\")):
            sources.append(ck.law(word))
        elif Path(word).suffix.lower() == ".json" and _format(Path(word)) is not None:
            sources.append(read_ranking(word) if _format(Path(word)) == RANKING.name else read_law_file(Path(word)))
        else:
            tests.append(word)
    if len(sources) > 1:
        raise FitError(f"{len(sources)} laws or results are named; name one, and tests beside it")
    return sources[0] if sources else DEFAULT_LAW, _tests(tests)


DEFAULT_LAW = "norton"
"""Where only tests are named, or nothing."""


def _format(path: Path) -> str | None:
    """The format of a law, an identification or a ranking in JSON; None for a file of tests."""
    from creepkit.exporters.law_files import VALUED_LAW
    from creepkit.files.json_documents import read_json
    from creepkit.inverse.identification_document import IDENTIFICATION
    from creepkit.inverse.ranking_document import RANKING

    data = read_json(path, VALUED_LAW.kind)
    name = data.get("format") if isinstance(data, dict) else None
    return name if name in (VALUED_LAW.name, IDENTIFICATION.name, RANKING.name) else None


def _tests(words: list[str]) -> list[History]:
    """The measured tests; FitError for a JSON file that holds neither tests nor what a page is made of."""
    import creepkit as ck
    from creepkit.errors import CreepkitError, FitError

    for word in words:
        if Path(word).suffix.lower() == ".json" and Path(word).is_file():
            try:
                ck.read_histories([word])
            except CreepkitError:
                raise FitError(
                    f"{word} is no identification, ranking or law that creepkit wrote, and no test; give a file that "
                    "'creepkit identify' or 'creepkit export' wrote, or study.results/identified/ranking.json"
                ) from None
    return list(ck.read_histories(words)) if words else []
