"""`creepkit rupture`: rupture tests by time-temperature methods, strengths with bounds, and post-assessment checks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from creepkit.cli.command_options import OutputPath, parsed_number
from creepkit.cli.shared import Files, Json, Only, selected, show
from creepkit.errors import FitError, restated
from creepkit.options import Option
from creepkit.records import ZERO_CELSIUS
from creepkit.rupture_assessment.assessment import RuptureQuestion, RuptureSettings


def command(
    tables: Files,
    *,
    question: Annotated[dict[str, Any], RuptureQuestion],
    settings: Annotated[dict[str, Any], RuptureSettings],
    tensile: Annotated[
        dict[str, float] | None, Option(help="Tensile strengths by temperature.", metavar="C=MPA", example="850=420")
    ] = None,
    only: Only = None,
    to: Annotated[
        Path | None,
        typer.Option(help="File for the assessment, JSON; or the time to rupture, .c, .f90 or .csv."),
        OutputPath(),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture of isotherms and the master curve."), OutputPath("picture")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run-outs count as tests that last longer, heats and laboratories as random effects.

    Strengths have bounds of the mean, of a new heat and of one test of it; what lies beyond three times the longest
    test is flagged.
    """
    import creepkit as ck

    with restated(ValueError, FitError, f"--tensile {' '.join(tensile or ())}: write C=MPA, such as 850=420"):
        strengths = {parsed_number(celsius) + ZERO_CELSIUS: value for celsius, value in (tensile or {}).items()}
    assessment = ck.rupture(
        selected(ck.read_histories(tables), only),
        tensile_strength=strengths or None,
        settings=RuptureSettings().changed(settings),
        **question,
    )
    written = [] if to is None else [assessment.save(to)]
    show(assessment, as_json=as_json, plot=plot, written=written)
