"""`creepkit simulate`: what a test would show of a law with given values, as a history CSV and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.law_sources import law_source, merged_values
from creepkit.cli.planned_test import (
    ControlOption,
    GeometryOption,
    ModulusOption,
    PressureOption,
    RampOption,
    StrainOption,
    StressOption,
    TestOptions,
    described_test,
    parse_temperature,
)
from creepkit.reports.terminal import put, tell, tell_written

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.language import CreepLaw
    from creepkit.records import History, Program, Specimen


DEFAULT_FRAMES = 200
"""Of a specimen that does not say how long a frame takes."""


def command(
    ctx: typer.Context,
    law: Annotated[
        str, typer.Argument(metavar="LAW|RESULT.json", help="A law's name, an exported JSON, or an identification.")
    ],
    end_h: Annotated[float, typer.Option(help="End of the test, h."), limits.HOURS],
    value: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value, given or changed.")
    ] = None,
    specimen: Annotated[
        str | None,
        typer.Option(help="bulge, point, relaxation, uniaxial or a plugin's; by default one that takes the load."),
    ] = None,
    stress: StressOption = None,
    strain: StrainOption = None,
    pressure: PressureOption = None,
    temperature_c: Annotated[
        list[str] | None, typer.Option(metavar="[S:]C", help="Temperature, C; 20 unless the law depends on it.")
    ] = None,
    modulus_gpa: ModulusOption = None,
    geometry: GeometryOption = None,
    control: ControlOption = None,
    ramp: RampOption = None,
    points: Annotated[
        int | None, typer.Option(help="Number of frames; 200 of most specimens."), limits.SIMULATED_FRAMES
    ] = None,
    every: Annotated[
        float | None, typer.Option(help="Or s from frame to frame; 150 of a bulge."), limits.SECONDS
    ] = None,
    to: Annotated[Path | None, typer.Option(help="CSV file to write; by default it is printed."), OutputPath()] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Picture of the section at the end, coloured by stress."), OutputPath("picture")
    ] = None,
) -> None:
    """Simulate a test of a bar, a dimple or another specimen.

    Loads and lengths of a specimen are options of their names, such as --force or --outer-radius; 'creepkit specimens
    NAME' lists them.
    """
    import creepkit as ck
    from creepkit.errors import SolveError
    from creepkit.language import Elastic

    source = law_source(law)
    valued = ck.law_with_values(source, merged_values(source, value))
    chosen = valued.law
    test = described_test(
        TestOptions(end_h, specimen, stress, strain, pressure, modulus_gpa, geometry, control, ramp, ctx)
    )
    times = _frame_times(3600.0 * end_h, points, every, test.specimen)
    if picture is not None and not hasattr(test.specimen, "draws_section"):
        raise SolveError(f"--picture: specimen '{test.specimen.name}' has no section to draw; leave it out")
    run = ck.simulate(
        chosen,
        test.specimen.replace(**test.lengths) if test.lengths else test.specimen,  # type: ignore[attr-defined]
        valued.values,
        loading=test.loading,
        times=times,
        temperature=_temperature_of(chosen, temperature_c),
        elastic=None if modulus_gpa is None else Elastic(1e3 * modulus_gpa),
        name=chosen.name if to is None else to.stem,
    )
    run = replace(run, geometry={**run.geometry, **test.lengths})
    if run.reason:
        tell(f"the test ended at {run.end_time / 3600:.4g} h: {run.reason}; the history ends there", err=True)
    if picture is not None:
        run.section(path=picture)  # type: ignore[attr-defined]
        tell_written(picture, err=True)
    _write_history(run, to)


def _temperature_of(law: CreepLaw, texts: Sequence[str] | None) -> float | Program | None:
    """K; None where nothing was said and the law does not ask."""
    from creepkit.errors import SolveError
    from creepkit.language.symbols import temperature

    if texts:
        return parse_temperature(texts)
    if law.uses(temperature):
        raise SolveError(f"law '{law.name}' depends on temperature: give --temperature-c")
    return None


def _write_history(run: History, to: Path | None) -> None:
    from creepkit.readers.history_csv import history_text, write_history

    if to is None:
        put(history_text(run))
    else:
        write_history(run, to)
        tell_written(to, f": {run.times.size} frames to {run.times[-1] / 3600:.4g} h")


def _frame_times(end: float, points: int | None, every: float | None, specimen: Specimen) -> Floats:
    """The frames, s, the last one at the end."""
    import numpy as np

    from creepkit.errors import SolveError

    if points is not None and every is not None:
        raise SolveError("--points and --every both say when frames are taken; give one of them")
    if points is None and every is None:
        every = getattr(specimen, "frame_interval", None)
    if every is None:
        return np.linspace(0.0, end, points or DEFAULT_FRAMES)
    if not end / limits.SIMULATED_FRAMES.high <= every <= end:
        raise SolveError(
            f"--every {every:g} s is not a step of a test of {end:g} s (allowed are 1 to "
            f"{limits.SIMULATED_FRAMES.high} frames)"
        )
    frame_times = np.arange(0.0, end * (1 - 1e-9), every)
    return np.append(frame_times, end)
