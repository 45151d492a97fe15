"""`creepkit design`: the next tests, by what they are expected to tell for each hour of machine time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import Json, Seed, read_results, show
from creepkit.experiments.design_task import GoalOptions
from creepkit.experiments.rig import Rig, changed_rigs, rigs_of
from creepkit.reports.terminal import ProgressBar, tell


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
    from creepkit.inverse.selection import Ranking

    histories = ck.read_histories(tests)
    found = [read_results(path, histories) for path in fits]
    identified: list[Any] = []
    for one in found:
        identified += [ranked.fit for ranked in one.laws] if isinstance(one, Ranking) else [one]
    source: Any = found[0] if len(found) == 1 else identified
    predictor = identified[0].predictor
    assert predictor is not None
    asked = GoalOptions().changed(goal)
    with ProgressBar() as progress:
        result = ck.design(
            source, rig=changed_rigs(rigs_of(identified[0].histories, predictor), rig), goal=asked.quantity,
            budget=asked.budget, seed=seed, progress=progress.tick,
        )  # fmt: skip
    show(result, as_json=as_json, plot=plot if result.tests else None)
    if plot is not None and not result.tests:
        tell(f"there is no test to draw: {plot} is not written", err=True)
