"""`creepkit predict`: what tests will show by an identified law, or by the laws of a ranking, with bands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.described_test import further_options
from creepkit.cli.generated_options import parsed_number
from creepkit.cli.options import parse_numbers
from creepkit.cli.planned_test import (
    ControlOption,
    GeometryOption,
    ModulusOption,
    PressureOption,
    RampOption,
    StrainOption,
    StressOption,
    TestOptions,
    parse_temperature,
    planned_test,
)
from creepkit.reports.terminal import ProgressBar, print_json, tell, tell_written

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage
    from creepkit.records import Program


def command(
    ctx: typer.Context,
    fit: Annotated[Path, typer.Argument(metavar="FIT.json", help="A saved identification, or a ranking.json.")],
    tests: Annotated[
        list[str] | None, typer.Argument(metavar="[TESTS]...", help="Measured files, folders or patterns.")
    ] = None,
    level: Annotated[float, typer.Option(help="Probability of bands and intervals."), limits.PROBABILITY] = 0.95,
    target: Annotated[
        list[str] | None,
        typer.Option(metavar="OUTPUT=VALUE,...", help="Values the times to which are asked for; strain=0.01."),
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND=SD", help="Standard deviation of what is not exactly known, as thickness=0.01."),
    ] = None,
    specimen: Annotated[str | None, typer.Option(help="Of a planned test; see 'creepkit specimens'.")] = None,
    stress: StressOption = None,
    strain: StrainOption = None,
    pressure: PressureOption = None,
    temperature_c: Annotated[
        list[str] | None,
        typer.Option(metavar="[S:]C", help="Temperature, C; by default that of the fitted tests, if they had one."),
    ] = None,
    end_h: Annotated[float | None, typer.Option(help="End of a planned test, h."), limits.HOURS] = None,
    modulus_gpa: ModulusOption = None,
    geometry: GeometryOption = None,
    control: ControlOption = None,
    ramp: RampOption = None,
    label: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Label of a planned test, such as heat=X7.")
    ] = None,
    draws: Annotated[
        int | None, typer.Option(help="Of the law and of all else; more make bands smoother."), limits.BAND_DRAWS
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture of the curves with their bands."), OutputPath("picture")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the forecast as JSON.")] = False,
) -> None:
    """Forecast tests by an identified law.

    Measured tests are files; a planned one is described by options, as for simulate. Each has its curve, a band, times
    to a strain or deflection and to rupture; measured ones are compared with theirs.
    """
    import creepkit as ck
    from creepkit.errors import FitError
    from creepkit.inverse.ranking_document import read_fit_or_ranking
    from creepkit.reports.forecast import forecast_to_json

    source = read_fit_or_ranking(fit)
    histories = ck.read_histories(tests) if tests else []
    described = {
        "stress": stress,
        "strain": strain,
        "pressure": pressure,
        "modulus_gpa": modulus_gpa,
        "geometry": geometry,
        "control": control,
        "ramp": ramp,
    }
    others = {"specimen": specimen, "temperature_c": temperature_c, "label": label, **further_options(ctx)}
    given = [name for name, value in {**described, **others}.items() if value not in (None, [])]
    if end_h is not None:
        temperature = _temperature(source, temperature_c)
        options = TestOptions(end_h, specimen, **described, context=ctx)  # type: ignore[arg-type]
        planned = planned_test(options, temperature)
        histories.append(planned.replace(labels=dict(_label(text) for text in label or ())))
    elif given:
        option = f"--{given[0].replace('_', '-')}"
        raise FitError(f"{option} describes a planned test, which needs an end: give --end-h, such as 100")
    if not histories:
        raise FitError("there is no test to forecast: name files, or describe a test, such as --stress 80 --end-h 100")
    with ProgressBar() as progress:
        forecast = ck.forecast(
            source,
            histories,
            level=level,
            targets=_targets(target),
            tolerances=parse_numbers(tolerance or (), "--tolerance", "thickness=0.01"),
            draws=draws,
            progress=progress.tick,
        )
    if plot is not None:
        forecast.plot(plot)
        tell_written(plot, err=True)
    if as_json:
        print_json(forecast_to_json(forecast))
    else:
        tell(forecast)


def _temperature(source: Identification | ModelAverage, texts: list[str] | None) -> float | Program:
    """K, as given; else that of the fitted tests, which must have had one alone."""
    from creepkit.errors import FitError
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
    from creepkit.records.units import celsius_text

    if texts:
        return parse_temperature(texts)
    low, high = (source if isinstance(source, Identification) else source.fits[0]).ranges["temperature"]
    if high - low > ISOTHERMAL_RANGE:
        raise FitError(f"the fitted tests were made at {celsius_text(low, high)}: give --temperature-c")
    return float(0.5 * (low + high))


def _targets(texts: list[str] | None) -> dict[str, list[float]] | None:
    """{output: values} of texts such as strain=0.01,0.05; None where nothing is asked for."""
    from creepkit.errors import FitError

    if not texts:
        return None
    targets: dict[str, list[float]] = {}
    for text in texts:
        name, _, values = text.partition("=")
        try:
            targets.setdefault(name.strip(), []).extend(parsed_number(value) for value in values.split(","))
        except ValueError:
            raise FitError(f"--target {text}: write OUTPUT=NUMBER, such as strain=0.01,0.05") from None
    return targets


def _label(text: str) -> tuple[str, str]:
    from creepkit.errors import FitError

    name, separator, value = (part.strip() for part in text.partition("="))
    if not (name and separator and value):
        raise FitError(f"--label {text}: write NAME=VALUE, such as heat=X7")
    return name, value
