"""`creepkit simulate`: what a test would show of a law with given values, as a history CSV and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.language import CreepLaw
    from creepkit.records import History, Loading, Program, Specimen

BULGE, UNIAXIAL = "bulge", "uniaxial"
RAMP = 5.0
"""s, in which each pressure is reached."""
FRAMES, EVERY = 200, 150.0
"""Frames of a bar; s between those of a dimple, as its cameras take them."""


def command(
    law: Annotated[str, typer.Argument(metavar="LAW", help="Name of a law.")],
    value: Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value.")],
    end_h: Annotated[float, typer.Option(help="End of the test, h.")],
    specimen: Annotated[str, typer.Option(help="uniaxial or bulge.")] = UNIAXIAL,
    stress: Annotated[
        list[str] | None, typer.Option(metavar="[S:]MPA", help="Of a bar, from S seconds on; several are steps.")
    ] = None,
    pressure: Annotated[
        list[str] | None, typer.Option(metavar="[S:]MPA", help="On a dimple, from S seconds on, after a ramp of 5 s.")
    ] = None,
    temperature_c: Annotated[
        list[str] | None, typer.Option(metavar="[S:]C", help="Temperature, C; 20 unless the law depends on it.")
    ] = None,
    modulus_gpa: Annotated[float | None, typer.Option(help="Young's modulus, GPa; a dimple needs it.")] = None,
    geometry: Annotated[
        list[str] | None, typer.Option(metavar="NAME=MM", help="A length of the dimple, such as apex_thickness=0.48.")
    ] = None,
    control: Annotated[str | None, typer.Option(help="Of a bar: load (held in each step) or stress (true).")] = None,
    points: Annotated[int | None, typer.Option(min=2, help="Number of frames; 200 of a bar.")] = None,
    every: Annotated[float | None, typer.Option(help="Or s from frame to frame; 150 of a dimple.")] = None,
    to: Annotated[Path | None, typer.Option(help="CSV file to write; by default it is printed.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Picture of the dimple's section at the end, coloured by stress.")
    ] = None,
) -> None:
    """Simulate a creep test of a bar or of a dimple."""
    from creepkit import study
    from creepkit.errors import SolveError
    from creepkit.language import Elastic

    for_bulge: dict[str, object] = {"--pressure": pressure, "--geometry": geometry, "--picture": picture}
    for_bars: dict[str, object] = {"--stress": stress, "--control": control}
    if specimen not in (BULGE, UNIAXIAL):
        raise SolveError(f"--specimen {specimen} is not known; allowed are {UNIAXIAL} and {BULGE}")
    _refuse(specimen, for_bars if specimen == BULGE else for_bulge)
    chosen = study.law(law)
    if not 0 < end_h < 1e9:
        raise SolveError(f"--end-h {end_h:g} is not a time above zero (and below 1e9 h)")
    times = _times(3600.0 * end_h, points, every, specimen)
    if specimen == BULGE:
        loading, body = _by_pressure(pressure, times[-1]), _dimple(geometry)
        if modulus_gpa is None:
            raise SolveError("a dimple needs a modulus: give --modulus-gpa, such as 150")
    else:
        loading, body = _by_stress(stress, control), study.specimen(UNIAXIAL)
    run = study.simulate(
        chosen,
        body,
        _numbers(value, "--set", "n=5.2"),
        loading=loading,
        times=times,
        temperature=_temperature(chosen, temperature_c),
        elastic=None if modulus_gpa is None else Elastic(1e3 * modulus_gpa),
        name=chosen.name,
    )
    if run.reason:
        typer.echo(f"the test ended at {run.end_time / 3600:.4g} h: {run.reason}; the history ends there", err=True)
    if picture is not None:
        run.section(path=picture)  # type: ignore[attr-defined]
        typer.echo(f"wrote {picture}", err=True)
    _write(run, to)


def _temperature(law: CreepLaw, texts: Sequence[str] | None) -> float | Program | None:
    """K; None where nothing was said and the law does not ask."""
    from creepkit.errors import SolveError
    from creepkit.language.symbols import temperature
    from creepkit.records import ZERO_CELSIUS, Program

    if not texts:
        if law.uses(temperature):
            raise SolveError(f"law '{law.name}' depends on temperature: give --temperature-c")
        return None
    steps = [(start, celsius + ZERO_CELSIUS) for start, celsius in _steps(texts, "--temperature-c")]
    return steps[0][1] if len(steps) == 1 and steps[0][0] == 0.0 else Program.steps(steps)


def _refuse(specimen: str, options: dict[str, object]) -> None:
    """Options of the other specimen would go unheard."""
    from creepkit.errors import SolveError

    other = UNIAXIAL if specimen == BULGE else BULGE
    for option, given in options.items():
        if given not in (None, []):
            raise SolveError(
                f"{option} belongs to --specimen {other}, found --specimen {specimen}; leave one of them out"
            )


def _write(run: History, to: Path | None) -> None:
    from creepkit.readers.writing import history_text, write_history

    if to is None:
        typer.echo(history_text(run), nl=False)
    else:
        write_history(run, to)
        typer.echo(f"wrote {to}: {run.times.size} frames to {run.times[-1] / 3600:.4g} h")


def _times(end: float, points: int | None, every: float | None, specimen: str) -> Floats:
    """The frames, s, the last one at the end."""
    import numpy as np

    from creepkit.errors import SolveError

    if points is not None and every is not None:
        raise SolveError("--points and --every both say when frames are taken; give one of them")
    if points is None and every is None and specimen == BULGE:
        every = EVERY
    if every is None:
        return np.linspace(0.0, end, points or FRAMES)
    if not end / 1e6 <= every <= end:
        raise SolveError(f"--every {every:g} s is not a step of a test of {end:g} s (allowed are 1 to 1000000 frames)")
    inner = np.arange(0.0, end * (1 - 1e-9), every)
    return np.append(inner, end)


def _by_stress(texts: Sequence[str] | None, control: str | None) -> Loading:
    from creepkit.errors import SolveError
    from creepkit.records import StressSteps

    if not texts:
        raise SolveError("a bar needs a stress: give --stress, such as 100, or --specimen bulge with --pressure")
    if control not in (None, "load", "stress"):
        raise SolveError(f"--control {control} is not known; allowed are load and stress")
    return StressSteps(tuple(_steps(texts, "--stress")), "stress" if control == "stress" else "load")


def _by_pressure(texts: Sequence[str] | None, end: float) -> Loading:
    """One or two pressures as a PressureJump, more as the program that they are."""
    import numpy as np

    from creepkit.errors import SolveError
    from creepkit.records import PressureJump, Program, RecordedLoading

    if not texts:
        raise SolveError("a dimple needs a pressure: give --pressure, such as 8, or 7200:10 for a later step")
    starts, pressures = np.array(_steps(texts, "--pressure")).T
    if starts[0] != 0.0 or (np.diff(starts) < RAMP).any() or pressures.min() < 0.0:
        raise SolveError(
            f"--pressure {' '.join(texts)}: the first pressure starts at 0 s, none is negative, and each comes "
            f"{RAMP:g} s or more after the one before, for the ramp takes that long"
        )
    if len(texts) <= 2 and pressures.min() > 0.0 and (len(texts) == 1 or starts[1] > RAMP):
        change = starts[1] if len(texts) == 2 else max(end, 2 * RAMP)
        return PressureJump(float(pressures[0]), float(pressures[-1]), float(change), RAMP)
    times = np.stack([starts, starts + RAMP], axis=1).ravel()
    values = np.repeat(np.append(0.0, pressures), 2)[1:-1]
    return RecordedLoading(Program(times, values), "pressure")


def _dimple(texts: Sequence[str] | None) -> Specimen:
    from creepkit import study
    from creepkit.errors import SolveError, nearest
    from creepkit.specimens.dimple import DimpleGeometry

    lengths = _numbers(texts or (), "--geometry", "apex_thickness=0.48")
    for name in lengths:
        if name not in DimpleGeometry.lengths:
            raise SolveError(f"--geometry: no length is called '{name}'; {nearest(name, DimpleGeometry.lengths)}")
    body = study.specimen(BULGE)
    return body.replace(**lengths) if lengths else body  # type: ignore[attr-defined]


def _numbers(texts: Sequence[str], option: str, example: str) -> dict[str, float]:
    from creepkit.errors import SolveError

    values: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        name = name.strip()
        if name in values:
            raise SolveError(f"{option} {text}: {name} is given twice; keep one of them")
        try:
            values[name] = float(number)
        except ValueError:
            raise SolveError(f"{option} {text}: write NAME=NUMBER, such as {example}") from None
    return values


def _steps(texts: Sequence[str], option: str) -> list[tuple[float, float]]:
    from creepkit.errors import SolveError

    steps = []
    for text in texts:
        start, _, value = text.rpartition(":")
        try:
            steps.append((float(start or 0.0), float(value)))
        except ValueError:
            raise SolveError(f"{option} {text}: write a number, or SECONDS:NUMBER for a later step") from None
    return steps
