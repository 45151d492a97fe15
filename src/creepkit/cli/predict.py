"""`creepkit predict`: what tests will show by an identified law, or by the laws of a ranking, with bands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.command_options import Levels, OutputPath
from creepkit.cli.planned_test import described_test, loads_and_lengths
from creepkit.cli.shared import Json, Tests, read_results, show
from creepkit.errors import FitError
from creepkit.forecasts.planned_tests import ForecastOptions, PlannedTestOptions
from creepkit.options import Option
from creepkit.reports.terminal import ProgressBar

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking


def command(
    fit: Annotated[Path, typer.Argument(metavar="FIT.json", help="A saved identification, or a ranking.json.")],
    tests: Tests = None,
    *,
    test: Annotated[dict[str, Any], PlannedTestOptions],
    load: Annotated[dict[str, Levels] | None, Option(help="By name; --load stress=80 is --stress 80.")] = None,
    piece: Annotated[dict[str, Any], loads_and_lengths()],
    label: Annotated[dict[str, str] | None, Option(help="Of the planned test.", example="heat=X7")] = None,
    how: Annotated[dict[str, Any], ForecastOptions],
    target: Annotated[
        dict[str, tuple[float, ...]] | None,
        Option(help="Values the times to which are asked for.", example="strain=0.01,0.05"),
    ] = None,
    tolerance: Annotated[
        dict[str, float] | None,
        Option(help="Standard deviation of what is not exactly known.", example="thickness=0.01"),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture of the curves with their bands."), OutputPath("picture")
    ] = None,
    as_json: Json = False,
) -> None:
    """Measured tests are files; a planned one is described by options, as for simulate.

    Each has its curve, a band, times to a strain or deflection and to rupture; measured ones are compared with theirs.
    """
    import creepkit as ck

    source = read_results(fit)
    histories = ck.read_histories(tests) if tests else []
    if test.get("end") is not None:
        planned = described_test(test, piece, load)
        temperature = planned.temperature if planned.temperature is not None else _temperature_of(source)
        histories.append(planned.history(temperature).replace(labels=label or {}))
    elif described := {**test, **piece, **(load or {}), **(label or {})}:
        name = next(iter(described)).replace("_", "-")
        raise FitError(f"--{name} describes a planned test, which needs an end: give --end-h, such as 100")
    if not histories:
        raise FitError("there is no test to forecast: name files, or describe a test, such as --stress 80 --end-h 100")
    with ProgressBar() as progress:
        forecast = ck.forecast(
            source, histories, targets=target, tolerances=tolerance or {}, progress=progress.tick, **how
        )  # fmt: skip
    show(forecast, as_json=as_json, plot=plot)


def _temperature_of(source: Identification | Ranking) -> float:
    """K, that of the fitted tests, which must have had one alone."""
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
    from creepkit.records.units import celsius_text

    low, high = (source if isinstance(source, Identification) else source.best).ranges["temperature"]
    if high - low > ISOTHERMAL_RANGE:
        raise FitError(f"the fitted tests were made at {celsius_text(low, high)}: give --temperature-c")
    return float(0.5 * (low + high))
