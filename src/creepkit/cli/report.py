"""`creepkit report`: saved results as one page of HTML that a colleague can read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.cli.declared_options import OutputPath
from creepkit.reports.terminal import tell_written

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage
    from creepkit.records import History
    from creepkit.rupture_assessment.assessment import RuptureAssessment


def command(
    results: Annotated[
        list[Path], typer.Argument(metavar="RESULT.json...", help="Identifications, rankings, or rupture assessments.")
    ],
    tests: Annotated[
        list[str] | None,
        typer.Option("--tests", metavar="TESTS", help="Their measured files, folders or patterns, for the curves."),
    ] = None,
    to: Annotated[Path, typer.Option(help="File for the page."), OutputPath()] = Path("report.html"),
    title: Annotated[str, typer.Option(help="Of the page.")] = "",
) -> None:
    """Write results as a page to read, HTML.

    One file, complete without scripts: findings, curves, tests, laws tried, data, files to download, methods,
    provenance. It prints, and opens anywhere. Identifications of the same tests are ranked.
    """
    import creepkit as ck

    histories = ck.read_histories(tests) if tests else []
    written = ck.report([_read(path, histories) for path in results], to, title=title)
    tell_written(written, err=True)


def _read(path: Path, histories: list[History]) -> Identification | ModelAverage | RuptureAssessment:
    """What a file holds, with the tests that it was made from where they are given."""
    import creepkit as ck
    from creepkit.errors import ReportError
    from creepkit.files.json_documents import read_json
    from creepkit.files.reading import FileKind
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.ranking_document import read_fit_or_ranking
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage
    from creepkit.rupture_assessment.assessment_document import ASSESSMENT

    advice = "give an identification, a ranking.json or a rupture assessment that creepkit wrote"
    data = read_json(path, FileKind("a result", ReportError, advice))
    if isinstance(data, dict) and data.get("format") == ASSESSMENT.name:
        return ck.load_rupture_assessment(path)
    found = read_fit_or_ranking(path)
    if not histories:
        return found
    if isinstance(found, Identification):
        return found.with_histories(histories)
    return ModelAverage(tuple(fit.with_histories(histories) for fit in found.fits), found.weights)
