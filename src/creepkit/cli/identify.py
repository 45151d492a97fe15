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
    FramesOption,
    OnlyOption,
    RuptureTimesOption,
    SeedOption,
    StartsOption,
    SurrogateOption,
    SuspectFramesOption,
    WeightsOption,
    change_laws,
    select_by_label,
    setting_changes,
    surrogate_named,
)
from creepkit.cli.options import NUISANCE_SYNTAX, parse_nuisances, penalty_named, search_named
from creepkit.reports.ranking import print_ranking, ranking_to_json
from creepkit.reports.terminal import ProgressBar, print_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw
    from creepkit.records import History


def write_ranking(ranking: Ranking, folder: Path) -> list[Path]:
    """Write JSON and plot of every law, the ranking's plot, and the best law as LaTeX and Python; returns the paths."""
    import creepkit as ck
    from creepkit.inverse.ranking_document import stems_of_laws

    folder.mkdir(parents=True, exist_ok=True)
    ranking_file, names = ranking.save(folder / "ranking.json"), stems_of_laws(ranking)
    written = []
    for name, entry in zip(names, ranking.laws, strict=True):
        entry.fit.plot(folder / f"{name}.png")
        written += [folder / f"{name}.json", folder / f"{name}.png"]
    ranking.plot(ranking_file.with_suffix(".png"))
    written += [ranking_file.with_suffix(".png"), ranking_file]
    for language, suffix in (("latex", ".tex"), ("python", ".py")):
        path = folder / f"{names[0]}{suffix}"
        ck.export(ranking, language, to=path)
        written.append(path)
    return written


def command(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Measured files, folders or patterns.")],
    law: Annotated[
        list[str],
        typer.Option(
            "--law", metavar="NAME", help="A law to fit, or a sum, norton+strain-hardening; may be given several times."
        ),
    ],
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
    starts: StartsOption = None,
    seed: SeedOption = None,
    frames: FramesOption = None,
    suspect_frames: SuspectFramesOption = None,
    rupture_times: RuptureTimesOption = None,
    loss: Annotated[
        str | None,
        typer.Option(help="Of frames: linear, soft_l1, huber, cauchy or arctan; {settings.loss} by default."),
    ] = None,
    test_loss: Annotated[
        str | None,
        typer.Option(
            help="Of whole tests: gaussian; or student, with which one far from its replicates weighs less; "
            "{settings.test_loss} by default."
        ),
    ] = None,
    weights: WeightsOption = None,
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
    nuisance: Annotated[
        list[str] | None,
        typer.Option(
            metavar=NUISANCE_SYNTAX,
            help="What differs between tests, beside offset and rate, such as thickness=0.4935:0.027; rate=none leaves "
            "one out.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Fit laws to creep curves and rank them.

    Every law is fitted to all curves at once. Several are compared by their likelihood, as by select() in Python,
    unless --weights, --search, --penalty or --loss ask for something else; one is identified as by identify(). JSON
    and plots of each, LaTeX and Python of the best, go to a folder.
    """
    import creepkit as ck
    from creepkit.errors import FitError
    from creepkit.files.file_names import LAW_SIGNS, numbered_stems
    from creepkit.files.writing import check_folder_target

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
    _, *stems = numbered_stems(["ranking", *(candidate.name for candidate in candidate_laws)], "law", LAW_SIGNS)
    check_folder_target(
        to, FitError, tuple(f"{s}{suffix}" for s in stems for suffix in (".json", ".png", ".tex", ".py"))
    )
    changes = setting_changes(
        starts=starts,
        seed=seed,
        frames=frames,
        suspect_frames=suspect_frames,
        rupture_times=rupture_times,
        nuisances=parse_nuisances(nuisance),
        weights=weights,
        loss=loss,
        test_loss=test_loss,
    )
    options: dict[str, Any] = {"using": surrogate_named(surrogate), **changes}
    by_likelihood = weights in (None, "likelihood") and loss in (None, "linear") and search == "multi-start"
    by_likelihood = by_likelihood and penalty is None
    if sums is not None and not by_likelihood:
        raise FitError("--sums compares laws by their likelihood: leave out --weights, --search, --penalty and --loss")
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
        typer.echo(str(ranking.further_tests()), err=as_json)


def _truncate_at_strain(histories: list[History], limit: float) -> list[History]:
    """Frames up to a strain; a curve that has fewer than two of them is left out, and said."""
    from creepkit.errors import FitError
    from creepkit.inverse.history_checks import truncated_at_strain

    retained = truncated_at_strain(histories, limit)
    names = {history.name for history in retained}
    for history in histories:
        if history.name not in names:
            typer.echo(f"left out: {history.name} has no two frames below a strain of {limit:g}", err=True)
    if not retained:
        raise FitError(f"no test has two frames below a strain of {limit:g}; raise --up-to")
    return retained


def _tell_assumptions(histories: list[History]) -> None:
    """What readers assumed of the tests, for a fit rests on it."""
    from creepkit.reports.histories import assumptions_text

    for line in assumptions_text(histories).splitlines():
        typer.echo(f"note: {line}", err=True)


def _warn_of_duplicates(histories: list[History]) -> None:
    """Tests that end alike; those with the same readings are left out, and a note of the identification says so."""
    from creepkit.quality import without_copies
    from creepkit.quality.comparison import duplicate_tests

    for first, second in duplicate_tests(without_copies(histories)[0]):
        typer.echo(f"note: {first} and {second} look like one test published twice; both count", err=True)


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
