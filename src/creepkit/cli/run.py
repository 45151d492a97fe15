"""`creepkit run`: a study file, or the study that a report carries, carried out; what was made before is kept."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS
from creepkit.reports.terminal import ProgressBar, print_json, print_table, tell

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.studies.result import StudyResult

MOST_FIGURES = 10
"""Forecasts and strengths that are printed; all of them stand in the report."""


REPORT_SUFFIXES = (".html", ".htm")


def command(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml|REPORT.html", help="A study file, or a study's report.")],
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STAGE",
            help="extraction, record, quality, rupture, identification, temperature, forecast, design, export or "
            "report, with what it needs; may be given several times.",
        ),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="For results, exports and report; by default beside it."),
        OutputPath("folder"),
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Make everything again.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print how each stage ended as JSON.")] = False,
) -> None:
    """Only what changed runs again. Interrupted, it goes on where it was when it is started again. A report is written
    back to its study and data in a folder, which then runs.
    """
    from creepkit.errors import StudyError
    from creepkit.studies.study import Study, study_of_report

    if study.suffix.lower() in REPORT_SUFFIXES:
        folder = to if to is not None else study.parent / f"{study.stem}_study"
        loaded, target = study_of_report(study, folder), folder
    else:
        loaded, target = Study.load(study), to if to is not None else study.parent
    with ProgressBar() as progress:
        result = loaded.run(to=target, only=only or None, again=again, progress=progress.tick)
    if as_json:
        print_json(result)
    else:
        print_result(result)
    if result.failures:
        first = result.failures[0]
        others = f" ({len(result.failures) - 1} more)" if len(result.failures) > 1 else ""
        raise StudyError(f"{study}: {first.stage} failed: {first.sentence}{others}")


def print_result(result: StudyResult) -> None:
    """How each stage ended, what was found, and where the report is."""
    from creepkit.reports.answer import answer_text, asked_figures, rupture_figures, table_of_groups
    from creepkit.reports.blocks import Paragraph, as_text, plural

    tell(result.title)
    told = [(one.name, one.state, one.sentence) for one in result.stages if one.state != "made" or one.sentence]
    if told:
        print_table("", ("stage", "state", ""), told)
    for exclusion in result.exclusions:
        frames = f", {plural(len(exclusion.frames), 'frame')}" if exclusion.frames else ""
        tell(f"left out: {exclusion.test}{frames}: {exclusion.reason}")
    of = {name: f"{group}: " if len(result.rankings) > 1 else "" for name, group in result.forecast_groups.items()}
    lines = [f"{of[name]}{one.line}" for name, found in result.forecasts.items() for one in asked_figures(found)]
    lines += [one.line for assessment in result.rupture.values() for one in rupture_figures(assessment)]
    if lines:
        tell(as_text([*map(Paragraph, lines[:MOST_FIGURES])]))
    rankings = result.rankings
    name = "ranking.json" if len(rankings) == 1 else f"{next(iter(rankings), '')}_ranking.json"
    path = None if result.folder is None else result.folder / name
    for ranking in [*rankings.values()][: len(rankings) == 1]:
        design = next(iter(result.designs.values()), None)
        tell(answer_text(ranking.best, ranking, result.report or f"creepkit report {path}", design=design))
    if len(rankings) > 1:
        tell(as_text([table_of_groups({name: (one.best, one.decisive) for name, one in rankings.items()})]))
    if result.report is not None:
        tell(f"report: {result.report}")
    if rankings and path is not None:
        tell(f"laws: {path}\nforecast: creepkit predict {path} {_test_as_options(next(iter(rankings.values())).best)}")


def _test_as_options(fit: Identification) -> str:
    """A test like those that a law was identified from, as options of `creepkit predict`; TESTS where not of bars."""
    from creepkit.reports.advice import are_bars

    if not are_bars(fit):
        return "TESTS"
    point, end = fit.tested_point, fit.ranges["time"][1] / SECONDS_PER_HOUR
    temperature = f" --temperature-c {point.temperature - ZERO_CELSIUS:.0f}"
    return f"--stress {point.stress:.3g}{temperature} --end-h {float(f'{end:.3g}'):g}"
