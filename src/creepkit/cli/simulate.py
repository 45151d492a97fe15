"""`creepkit simulate`: the creep curve of a law with given values, as a history CSV."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from creepkit.records import Program


def command(
    law: Annotated[str, typer.Argument(metavar="LAW", help="Name of a law.")],
    value: Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value.")],
    stress: Annotated[list[str], typer.Option(help="MPa, or 'SECONDS:MPa' for a step; may be given several times.")],
    end_h: Annotated[float, typer.Option(help="End of the test, h.")],
    temperature_c: Annotated[list[str], typer.Option(help="C, or 'SECONDS:C' for a step.")] = ["20"],  # noqa: B006
    points: Annotated[int, typer.Option(min=2, help="Number of frames.")] = 200,
    control: Annotated[str, typer.Option(help="load (constant load in each step) or stress (true stress).")] = "load",
    to: Annotated[Path | None, typer.Option(help="CSV file to write; by default the curve is printed.")] = None,
) -> None:
    """Simulate a uniaxial creep test."""
    import numpy as np

    from creepkit import study
    from creepkit.errors import SolveError
    from creepkit.readers.writing import history_text, write_history
    from creepkit.records import ZERO_CELSIUS, Program, StressSteps

    chosen = study.law(law)
    if control not in ("load", "stress"):
        raise SolveError(f"--control {control} is not known; allowed are load and stress")
    if not 0 < end_h < 1e9:
        raise SolveError(f"--end-h {end_h:g} is not a time above zero (and below 1e9 h)")
    steps = _steps(stress, "--stress")
    warmth: Program = Program.steps([(t, c + ZERO_CELSIUS) for t, c in _steps(temperature_c, "--temperature-c")])
    history = study.simulate(
        chosen, study.specimen("uniaxial"), _values(value),
        loading=StressSteps(tuple(steps), "load" if control == "load" else "stress"),
        times=np.linspace(0, 3600 * end_h, points), temperature=warmth, name=chosen.name,
    )  # fmt: skip
    if "burst_s" in history.labels:
        typer.echo(f"the bar burst at {float(history.labels['burst_s']) / 3600:.4g} h; the curve ends there", err=True)
    if to is None:
        typer.echo(history_text(history), nl=False)
    else:
        write_history(history, to)
        typer.echo(f"wrote {to}: {history.times.size} frames to {history.times[-1] / 3600:.4g} h")


def _values(texts: list[str]) -> dict[str, float]:
    from creepkit.errors import SolveError

    values = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            values[name.strip()] = float(number)
        except ValueError:
            raise SolveError(f"--set {text}: write NAME=NUMBER, such as n=5.2") from None
    return values


def _steps(texts: list[str], option: str) -> list[tuple[float, float]]:
    from creepkit.errors import SolveError

    steps = []
    for text in texts:
        start, _, value = text.rpartition(":")
        try:
            steps.append((float(start or 0.0), float(value)))
        except ValueError:
            raise SolveError(f"{option} {text}: write a number, or SECONDS:NUMBER for a later step") from None
    return steps
