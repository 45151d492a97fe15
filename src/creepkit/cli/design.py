"""`creepkit design`: the next tests, by what they are expected to tell for each hour of machine time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import Json, Seed
from creepkit.experiments.design_task import GoalOptions
from creepkit.experiments.rig import Rig, changed_rigs, rigs_of
from creepkit.reports.terminal import ProgressBar, print_json, tell, tell_written

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage


def command(
    fits: Annotated[
        list[Path],
        typer.Argument(metavar="FIT.json...", help="A ranking.json, or saved identifications of the same tests."),
    ],
    tests: Annotated[
        list[str], typer.Option("--tests", metavar="TESTS", help="Their measured files, folders or patterns.")
    ],
    *,
    goal: Annotated[dict[str, Any], GoalOptions],
    rig: Annotated[dict[str, Any], Rig],
    seed: Seed = 0,
    plot: Annotated[
        Path | None, typer.Option(help="Map of what tests tell, .png, .svg or .pdf."), OutputPath("picture")
    ] = None,
    as_json: Json = False,
) -> None:
    """What is not said of the rig is a little more than what it did. Ctrl-C ends the work with the best so far."""
    import creepkit as ck
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.ranking_document import read_fit_or_ranking
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage
    from creepkit.reports.design import design_to_json

    histories = ck.read_histories(tests)
    found = [read_fit_or_ranking(path) for path in fits]
    laws = [fit for one in found for fit in ((one,) if isinstance(one, Identification) else one.fits)]
    identified = [fit.with_histories(histories) for fit in laws]
    source: Identification | list[Identification] | ModelAverage = identified
    if len(found) == 1 and not isinstance(found[0], Identification):
        source = ModelAverage(tuple(identified), found[0].weights)
    elif len(identified) == 1:
        source = identified[0]
    predictor = identified[0].predictor
    assert predictor is not None
    asked = GoalOptions().changed(goal)
    with ProgressBar() as progress:
        result = ck.design(
            source, rig=changed_rigs(rigs_of(identified[0].histories, predictor), rig), goal=asked.quantity,
            budget=asked.budget, seed=seed, progress=progress.tick,
        )  # fmt: skip
    if as_json:
        print_json(design_to_json(result))
    else:
        tell(result)
    if plot is not None and result.tests:
        result.plot(plot)
        tell_written(plot, err=as_json)
    elif plot is not None:
        tell(f"there is no test to draw: {plot} is not written", err=True)
