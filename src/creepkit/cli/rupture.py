"""`creepkit rupture`: rupture tests by time-temperature methods, strengths with bounds, and post-assessment checks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.generated_options import parsed_integer, parsed_number
from creepkit.cli.identification_options import OnlyOption, select_by_label
from creepkit.reports.terminal import print_json, tell, tell_written

HOURS_BY_SUFFIX = {"h": 1.0, "d": 24.0, "s": 1.0 / 3600.0, "": 1.0}


def command(
    tables: Annotated[
        list[str], typer.Argument(metavar="TABLE...", help="Tables of rupture tests, test files, folders or patterns.")
    ],
    only: OnlyOption = None,
    method: Annotated[
        list[str] | None,
        typer.Option(help="larson-miller, orr-sherby-dorn, manson-haferd, wilshire, monkman-grant or isothermal."),
    ] = None,
    times: Annotated[
        str, typer.Option(metavar="TIME,...", help="Times at which strengths are stated, such as 1e3h,1e5h.")
    ] = "1e3h,1e4h,1e5h",
    temperature: Annotated[
        str | None,
        typer.Option("--temperature-c", "--temperature", metavar="C,...", help="Temperatures of strengths, C."),
    ] = None,
    tensile: Annotated[
        str | None, typer.Option(metavar="C:MPA,...", help="Tensile strengths by temperature, as 850:420,900:310.")
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(metavar="METHOD.CONSTANT=VALUE", help="A constant that is given, as larson-miller.C=20."),
    ] = None,
    degrees: Annotated[str, typer.Option(help="Degrees of polynomials of log stress that are tried.")] = "1,2,3",
    distribution: Annotated[str, typer.Option(help="Of rupture times: lognormal or weibull.")] = "lognormal",
    criterion: Annotated[str, typer.Option(help="Of the ranking: bic or aicc.")] = "bic",
    level: Annotated[float, typer.Option(help="Probability of intervals and bounds."), limits.PROBABILITY] = 0.95,
    to: Annotated[Path | None, typer.Option(help="File for the assessment, JSON."), OutputPath()] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture of isotherms and the master curve."), OutputPath("picture")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the assessment as JSON.")] = False,
) -> None:
    """Assess rupture tests by parametric methods.

    Run-outs count as tests that last longer, heats and laboratories as random effects. Strengths have bounds of the
    mean, of a new heat and of one test of it; what lies beyond three times the longest test is flagged.
    """
    import creepkit as ck
    from creepkit.reports.rupture import rupture_to_json

    settings = ck.RuptureSettings(
        degrees=tuple(_degree(text) for text in degrees.split(",")),
        distribution=distribution,  # type: ignore[arg-type]
        criterion=criterion,  # type: ignore[arg-type]
        fixed=_fixed(fix or ()),
        level=level,
    )
    assessment = ck.rupture(
        select_by_label(ck.read_histories(tables), only),
        method,
        hours=[_hours(text) for text in times.split(",")],
        temperatures=None if temperature is None else [_kelvin(text) for text in temperature.split(",")],
        tensile_strength=None if tensile is None else dict(_tensile(text) for text in tensile.split(",")),
        settings=settings,
    )
    written = []
    if to is not None:
        written.append(assessment.save(to))
    if plot is not None:
        assessment.plot(plot)
        written.append(plot)
    for path in written:
        tell_written(path, err=True)
    if as_json:
        print_json(rupture_to_json(assessment))
    else:
        tell(assessment)


def _hours(text: str) -> float:
    from creepkit.errors import FitError

    word = text.strip()
    suffix = word[-1:] if word[-1:].isalpha() else ""
    try:
        return parsed_number(word.removesuffix(suffix)) * HOURS_BY_SUFFIX[suffix]
    except (KeyError, ValueError):
        raise FitError(f"--times {text}: write numbers with h, d or s, such as 1e3h,1e5h") from None


def _number(text: str, option: str, example: str) -> float:
    from creepkit.errors import FitError

    try:
        return parsed_number(text)
    except ValueError:
        raise FitError(f"{option} {text.strip()}: write {example}") from None


def _kelvin(text: str) -> float:
    from creepkit.records import ZERO_CELSIUS

    return _number(text.strip().removesuffix("C"), "--temperature-c", "degrees Celsius, such as 850,900") + ZERO_CELSIUS


def _tensile(text: str) -> tuple[float, float]:
    temperature, _, strength = text.partition(":")
    example = "C:MPA, such as 850:420,900:310"
    return _kelvin(temperature), _number(strength, f"--tensile {text.strip()}", example)


def _degree(text: str) -> int:
    from creepkit.errors import FitError

    try:
        return parsed_integer(text)
    except ValueError:
        raise FitError(f"--degrees {text.strip()}: write whole numbers, such as 1,2,3") from None


def _fixed(texts: list[str] | tuple[str, ...]) -> dict[str, dict[str, float]]:
    from creepkit.errors import FitError

    fixed: dict[str, dict[str, float]] = {}
    for text in texts:
        constant, _, value = text.partition("=")
        method, dot, name = constant.strip().rpartition(".")
        if not dot:
            raise FitError(f"--fix {text}: write METHOD.CONSTANT=VALUE, such as larson-miller.C=20")
        fixed.setdefault(method, {})[name] = _number(value, f"--fix {text}", "a number, such as larson-miller.C=20")
    return fixed
