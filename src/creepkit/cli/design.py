"""`creepkit design`: the next tests, by what they are expected to tell for each hour of machine time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.generated_options import parsed_number
from creepkit.reports.terminal import ProgressBar, print_json, tell, tell_written

if TYPE_CHECKING:
    from creepkit.experiments.design_task import Goal
    from creepkit.experiments.rig import Rig


def command(
    fits: Annotated[
        list[Path],
        typer.Argument(metavar="FIT.json...", help="A ranking.json, or saved identifications of the same tests."),
    ],
    tests: Annotated[
        list[str], typer.Option("--tests", metavar="TESTS", help="Their measured files, folders or patterns.")
    ],
    goal: Annotated[
        str | None,
        typer.Option(
            metavar="GOAL",
            help="law, parameters, or rate:STRESS, rate:STRESS:TEMPERATURE, exponent:STRESS (MPa, K); by default the "
            "law where the tests allow more than one.",
        ),
    ] = None,
    budget: Annotated[
        float | None, typer.Option(metavar="HOURS", help="Oven hours for one run or several."), limits.HOURS
    ] = None,
    levels: Annotated[
        str | None, typer.Option(metavar="LOW:HIGH", help="What the rig can load: MPa, or a strain; 4:14.")
    ] = None,
    longest: Annotated[
        float | None, typer.Option(metavar="HOURS", help="The rig's longest test."), limits.HOURS
    ] = None,
    specimen: Annotated[
        str | None, typer.Option(metavar="NAME", help="Whose rig is described, where tests are of several specimens.")
    ] = None,
    temperature_c: Annotated[
        list[float] | None,
        typer.Option(metavar="C", help="At which tests can be made; may be given several times."),
        limits.CELSIUS,
    ] = None,
    dimension: Annotated[
        list[str] | None,
        typer.Option(metavar="LENGTH=MM,...", help="Test pieces that can be made: apex_thickness=0.44,0.5,0.58."),
    ] = None,
    tests_per_run: Annotated[
        int | None,
        typer.Option(metavar="COUNT", help="Test pieces that the oven takes at once."),
        limits.TESTS_IN_A_RUN,
    ] = None,
    setup_hours: Annotated[
        float | None, typer.Option(metavar="HOURS", help="Of the oven for each run, beside its test."), limits.RAMP
    ] = None,
    frame_interval: Annotated[
        float | None, typer.Option(metavar="S", help="Seconds between frames."), limits.SECONDS
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the draws."), limits.SEED] = 0,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a map of what tests tell, .png, .svg or .pdf."),
        OutputPath("picture"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Say which test to make next.

    What is not said of the rig is a little more than what it did. Ctrl-C ends the work with the best so far.
    """
    import creepkit as ck
    from creepkit.experiments.rig import rigs_of
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.ranking_document import read_fit_or_ranking
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage
    from creepkit.reports.design import design_to_json, print_design

    histories = ck.read_histories(tests)
    found = [read_fit_or_ranking(path) for path in fits]
    laws = [fit for one in found for fit in ((one,) if isinstance(one, Identification) else one.fits)]
    identified = [fit.with_histories(histories) for fit in laws]
    source: Identification | list[Identification] | ModelAverage = identified
    if len(found) == 1 and not isinstance(found[0], Identification):
        source = ModelAverage(tuple(identified), found[0].weights)
    elif len(identified) == 1:
        source = identified[0]
    changes = rig_changes(
        levels=levels, longest=longest, temperature_c=temperature_c, dimension=dimension, tests_per_run=tests_per_run,
        setup_hours=setup_hours, frame_interval=frame_interval,
    )  # fmt: skip
    predictor = identified[0].predictor
    assert predictor is not None
    rigs = changed_rigs(list(rigs_of(identified[0].histories, predictor)), specimen, changes)
    with ProgressBar() as progress:
        result = ck.design(source, rig=rigs, goal=parse_goal(goal), budget=budget, seed=seed, progress=progress.tick)
    if as_json:
        print_json(design_to_json(result))
    else:
        print_design(result)
    if plot is not None and result.tests:
        result.plot(plot)
        tell_written(plot, err=as_json)
    elif plot is not None:
        tell(f"there is no test to draw: {plot} is not written", err=True)


def parse_goal(text: str | None) -> Goal | None:
    """The goal, from law, parameters, rate:60, rate:60:1073 or exponent:60."""
    from creepkit.errors import FitError
    from creepkit.inverse.uncertainty.quantities import exponent_at, rate_at

    if text is None or text == "parameters":
        return "parameters" if text else None
    if text == "law":
        return "law"
    kind, *numbers = text.split(":")
    try:
        values = [parsed_number(number) for number in numbers]
    except ValueError:
        values = []
    quantities = {"rate": rate_at, "exponent": exponent_at}
    if kind not in quantities or not 1 <= len(values) <= 2 or min(values) <= 0:
        raise FitError(
            f"--goal {text} is not known; write law, parameters, rate:60, rate:60:1073 (MPa, K) or exponent:60"
        )
    return quantities[kind](*values)


def changed_rigs(rigs: list[Rig], specimen: str | None, changes: dict[str, Any]) -> list[Rig]:
    """The rigs with what was said of one of them."""
    from creepkit.errors import FitError

    names = [rig.specimen for rig in rigs]
    if specimen is not None and specimen not in names:
        raise FitError(f"--specimen {specimen}: the tests are of {' and '.join(names)}")
    if changes and len(rigs) > 1 and specimen is None:
        raise FitError(f"the tests are of {' and '.join(names)}: say by --specimen whose rig is described")
    return [rig.replace(**changes) if rig.specimen == (specimen or names[0]) else rig for rig in rigs]


def rig_changes(
    *,
    levels: str | None,
    longest: float | None,
    temperature_c: Sequence[float] | None,
    dimension: Sequence[str] | None,
    tests_per_run: int | None,
    setup_hours: float | None,
    frame_interval: float | None,
) -> dict[str, Any]:
    """Fields of a rig that were said."""
    from creepkit.records import ZERO_CELSIUS

    given: dict[str, Any] = {
        "levels": None if levels is None else tuple(_numbers(levels, ":", "--levels", "4:14", count=2)),
        "longest_hours": longest,
        "temperatures": tuple(celsius + ZERO_CELSIUS for celsius in temperature_c) if temperature_c else None,
        "tests_per_run": tests_per_run,
        "setup_hours": setup_hours,
        "frame_interval": frame_interval,
    }
    if dimension:
        parts = [text.partition("=") for text in dimension]
        given["dimensions"] = {
            name.strip(): tuple(_numbers(values, ",", f"--dimension {name.strip()}", "0.44,0.5,0.58 after ="))
            for name, _, values in parts
        }
    return {name: value for name, value in given.items() if value is not None}


def _numbers(text: str, separator: str, option: str, example: str, count: int | None = None) -> list[float]:
    from creepkit.errors import FitError

    try:
        values = [parsed_number(part) for part in text.split(separator)]
    except ValueError:
        values = []
    if not values or (count is not None and len(values) != count):
        raise FitError(f"{option} {text} is not known; write {option} {example}")
    return values
