"""`creepkit identify`: from a folder of creep curves to a ranking of laws with intervals, and its files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.identification_options import (
    BoundOption,
    FixOption,
    OnlyOption,
    SurrogateOption,
    change_laws,
    select_by_label,
    surrogate_named,
)
from creepkit.cli.identified_folder import identifying_alone, write_ranking
from creepkit.cli.options import penalty_named, search_named
from creepkit.inverse.settings import IdentificationSettings
from creepkit.reports.ranking import print_ranking, ranking_to_json
from creepkit.reports.terminal import ProgressBar, print_json, tell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw
    from creepkit.records import History


def command(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Measured files, folders or patterns.")],
    law: Annotated[
        list[str],
        typer.Option(
            "--law", metavar="NAME", help="A law to fit, or a sum, norton+strain-hardening; may be given several times."
        ),
    ],
    settings: Annotated[dict[str, Any], IdentificationSettings],
    to: Annotated[
        Path,
        typer.Option(help="Folder for results; made if needed."),
        OutputPath("folder", ("ranking.json", "ranking.png")),
    ] = Path("identified"),
    reader: Annotated[str | None, typer.Option(help="Reader to use; by default the one that accepts the file.")] = None,
    temperature: Annotated[
        str, typer.Option(help="auto: an Arrhenius factor when the tests span several temperatures; or none.")
    ] = "auto",
    only: OnlyOption = None,
    fix: FixOption = None,
    bound: BoundOption = None,
    surrogate: SurrogateOption = None,
    up_to: Annotated[
        float | None, typer.Option(help="Use frames up to this strain only, such as 0.05."), limits.STRAIN
    ] = None,
    search: Annotated[str, typer.Option(help="How to begin: multi-start, swarm or cma-es.")] = "multi-start",
    penalty: Annotated[
        str | None, typer.Option(metavar="NAME", help="Reduce a sum of terms: l2, group-l2, sqrt or subsets.")
    ] = None,
    sums: Annotated[
        bool | None, typer.Option("--sums/--no-sums", help="Whether sums of two laws are tried as well.")
    ] = None,
    further: Annotated[
        bool, typer.Option("--further-tests", help="Say which tests would distinguish the remaining laws.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Fit laws to creep curves and rank them.

    Every law is fitted to all curves at once. Several are compared by their likelihood, as by select() in Python,
    unless --weights, --search, --penalty or --loss ask for something else; one is identified as by identify(). JSON
    and plots of each, LaTeX and Python of the best, go to a folder.
    """
    import creepkit as ck
    from creepkit.errors import FitError

    if temperature not in ("auto", "none"):
        raise FitError(f"--temperature {temperature} is not known; allowed are auto and none")
    candidate_laws = [ck.law(name) for name in dict.fromkeys(law)]
    histories = select_by_label(ck.read_histories(files, reader), only)
    if up_to is not None:
        histories = _truncate_at_strain(histories, up_to)
    _tell_assumptions(histories)
    _warn_of_duplicates(histories)
    if temperature == "auto":
        candidate_laws = [ck.with_arrhenius(candidate_law, histories) for candidate_law in candidate_laws]
    candidate_laws = change_laws(candidate_laws, fix, bound)
    options: dict[str, Any] = {"using": surrogate_named(surrogate), **settings}
    weights, loss = settings.get("weights"), settings.get("loss")
    by_likelihood = weights in (None, "likelihood") and loss in (None, "linear") and search == "multi-start"
    by_likelihood = by_likelihood and penalty is None
    if sums is not None and not by_likelihood:
        raise FitError("--sums compares laws by their likelihood: leave out --weights, --search, --penalty and --loss")
    with identifying_alone(to, candidate_laws):
        if by_likelihood and (len(candidate_laws) > 1 or sums is not None):
            ranking = select_laws(candidate_laws, histories, **({} if sums is None else {"sums": sums}), **options)
        else:
            ranking = rank_laws(
                candidate_laws, histories, search=search_named(search), penalty=penalty_named(penalty), **options
            )
        written = write_ranking(ranking, to)
    if as_json:
        print_json(ranking_to_json(ranking, written))
    else:
        print_ranking(ranking, written, len(histories))
    if further:
        tell(ranking.further_tests(), err=as_json)


def _truncate_at_strain(histories: list[History], limit: float) -> list[History]:
    """Frames up to a strain; a curve that has fewer than two of them is left out, and said."""
    from creepkit.errors import FitError
    from creepkit.inverse.history_checks import truncated_at_strain

    retained = truncated_at_strain(histories, limit)
    names = {history.name for history in retained}
    for history in histories:
        if history.name not in names:
            tell(f"left out: {history.name} has no two frames below a strain of {limit:g}", err=True)
    if not retained:
        raise FitError(f"no test has two frames below a strain of {limit:g}; raise --up-to")
    return retained


def _tell_assumptions(histories: list[History]) -> None:
    """What readers assumed of the tests, for a fit rests on it."""
    from creepkit.reports.histories import assumptions_text

    for line in assumptions_text(histories).splitlines():
        tell(f"note: {line}", err=True)


def _warn_of_duplicates(histories: list[History]) -> None:
    """Tests that end alike; those with the same readings are left out, and a note of the identification says so."""
    from creepkit.quality import without_copies
    from creepkit.quality.comparison import duplicate_tests

    for first, second in duplicate_tests(without_copies(histories)[0]):
        tell(f"note: {first} and {second} look like one test published twice; both count", err=True)


def select_laws(laws: Sequence[CreepLaw], histories: list[History], **options: Any) -> Ranking:
    """Identify the laws by likelihood and rank them, showing progress."""
    import creepkit as ck

    with ProgressBar() as progress:
        return ck.select(laws, histories, progress=progress.tick, **options)


def rank_laws(laws: Sequence[CreepLaw], histories: list[History], **options: Any) -> Ranking:
    """Fit each law, showing progress, and rank them."""
    import creepkit as ck
    from creepkit.inverse.rupture_use import common_rupture_times
    from creepkit.inverse.selection import rank

    fits = []
    asked = ck.IdentificationSettings(rupture_times=options.get("rupture_times", "auto"))
    options["rupture_times"] = common_rupture_times(laws, asked).rupture_times
    with ProgressBar() as progress:
        for law in laws:

            def tick(task: str, done: int, total: int, name: str = law.name) -> None:
                progress.tick(f"{name}, {task}", done, total)

            fits.append(ck.identify(law, histories, progress=tick, **options))
    return rank(fits)
