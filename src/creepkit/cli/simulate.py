"""`creepkit simulate`: what a test would show of a law with given values, as a history CSV and a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.command_options import Levels, OutputPath
from creepkit.cli.planned_test import described_test, loads_and_lengths
from creepkit.cli.shared import Law, Values, law_source, merged_values
from creepkit.errors import SolveError
from creepkit.forecasts.planned_tests import PlannedTestOptions
from creepkit.limits import SECONDS, SIMULATED_FRAMES
from creepkit.options import Option
from creepkit.reports.terminal import put, tell, tell_written

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.records import Specimen

DEFAULT_FRAMES = 200
"""Of a specimen that does not say how long a frame takes."""


def command(
    law: Law,
    *,
    value: Values = None,
    test: Annotated[dict[str, Any], PlannedTestOptions],
    load: Annotated[dict[str, Levels] | None, Option(help="By name; --load stress=80 is --stress 80.")] = None,
    piece: Annotated[dict[str, Any], loads_and_lengths()],
    points: Annotated[
        int | None, Option(help="Number of frames; 200 of most specimens.", limits=SIMULATED_FRAMES)
    ] = None,
    every: Annotated[float | None, Option(help="Or s from frame to frame; 150 of a bulge.", limits=SECONDS)] = None,
    to: Annotated[Path | None, typer.Option(help="CSV file to write; by default it is printed."), OutputPath()] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Picture of the section at the end, coloured by stress."), OutputPath("picture")
    ] = None,
) -> None:
    """Loads and lengths of a specimen are options of their names, such as --stress 80 or --outer-radius 12."""
    import creepkit as ck
    from creepkit.language.symbols import temperature
    from creepkit.readers.history_csv import history_text, write_history

    source = law_source(law)
    valued = ck.law_with_values(source, merged_values(source, value))
    planned = described_test(test, piece, load)
    if planned.options.end is None:
        raise SolveError("a test needs its end: give --end-h, such as 100")
    if planned.temperature is None and valued.law.uses(temperature):
        raise SolveError(f"law '{valued.law.name}' depends on temperature: give --temperature-c")
    held = planned.temperature if isinstance(planned.temperature, float) else None
    for _, level in planned.loads.get("stress", [(0.0, None)]):
        if caution := valued.caution(temperature=held, stress=level):
            tell(caution, err=True)
    if picture is not None and not planned.specimen.draws_section:
        raise SolveError(f"--picture: specimen '{planned.specimen.name}' has no section to draw; leave it out")
    specimen: Any = planned.specimen
    run = ck.simulate(
        valued.law,
        specimen.replace(**planned.lengths) if planned.lengths else specimen,
        valued.values,
        loading=planned.loading,
        times=_frame_times(planned.options.end, points, every, specimen),
        temperature=planned.temperature,
        elastic=planned.elastic,
        name=valued.law.name if to is None else to.stem,
    )
    run = replace(run, geometry={**run.geometry, **planned.lengths})
    if run.reason:
        tell(f"the test ended at {run.end_time / 3600:.4g} h: {run.reason}; the history ends there", err=True)
    if picture is not None:
        run.section(path=picture)  # type: ignore[attr-defined]
        tell_written(picture, err=True)
    if to is None:
        put(history_text(run))
    else:
        write_history(run, to)
        tell_written(to, f": {run.times.size} frames to {run.times[-1] / 3600:.4g} h")


def _frame_times(end: float, points: int | None, every: float | None, specimen: Specimen) -> Floats:
    """The frames, s, the last one at the end."""
    import numpy as np

    if points is not None and every is not None:
        raise SolveError("--points and --every both say when frames are taken; give one of them")
    if points is None and every is None:
        every = specimen.frame_interval
    if every is None:
        return np.linspace(0.0, end, points or DEFAULT_FRAMES)
    if not end / SIMULATED_FRAMES.high <= every <= end:
        raise SolveError(
            f"--every {every:g} s is not a step of a test of {end:g} s (1 to {SIMULATED_FRAMES.high} frames)"
        )
    return np.append(np.arange(0.0, end * (1 - 1e-9), every), end)
