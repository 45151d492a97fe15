"""`creepkit identify`: from creep tests to a ranking of laws with intervals, for one alloy or for many."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import creepkit as ck
from creepkit.cli.command_options import OutputPath
from creepkit.cli.identified_folder import check_identified_folder, write_ranking
from creepkit.cli.shared import Files, Json, Only, Reader, Workers, selected, show
from creepkit.errors import FitError
from creepkit.inverse.candidate_laws import LawChanges, SearchOptions
from creepkit.inverse.settings import IdentificationSettings
from creepkit.law_search.search import LawSearchOptions
from creepkit.limits import STRAIN
from creepkit.options import Option, options_of
from creepkit.records import History, Predictor
from creepkit.reports.terminal import ProgressBar, print_json, tell, tell_written
from creepkit.studies.candidates import by_likelihood, ranked_candidates

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.screening.screen import ScreeningOptions

DENSE = "combined"
"""The law that each alloy is identified with without sparsity, where --dense says none."""


def command(
    files: Files,
    law: Annotated[
        list[str] | None,
        typer.Option(
            "--law",
            metavar="NAME",
            help="A law, or a sum, norton+strain-hardening; may be given several times; by default those of Table 1.",
        ),
    ] = None,
    *,
    settings: Annotated[dict[str, Any], IdentificationSettings],
    changes: Annotated[dict[str, Any], LawChanges],
    how: Annotated[dict[str, Any], SearchOptions],
    to: Annotated[
        Path,
        typer.Option(help="Folder for results; made if needed. Of --search also a file LAW.py."),
        OutputPath("folder", ("ranking.json",)),
    ] = Path("identified"),
    reader: Reader = None,
    only: Only = None,
    up_to: Annotated[
        float | None, Option(help="Frames up to this strain alone.", limits=STRAIN, example="0.05")
    ] = None,
    using: Annotated[Predictor | None, Option(help="Identify through a surrogate alone, such as dimple.")] = None,
    through: Annotated[
        Predictor | None, Option(help="Search through a surrogate, and end with the specimen itself.")
    ] = None,
    search_laws: Annotated[
        bool, Option(help="Search laws that nobody wrote down, beside registered ones.", flag="search")
    ] = False,
    budget: Annotated[dict[str, Any], LawSearchOptions],
    further_tests: Annotated[bool, Option(help="Say which tests would distinguish the remaining laws.")] = False,
    each: Annotated[
        Literal["alloy"] | None,
        Option(help="Every alloy by itself: a plate. What the folder holds already is not done again.", flag="by"),
    ] = None,
    compositions: Annotated[
        Path | None, Option(help="Table alloy,Fe,Ni,... of a plate, below a line '# unit: wt.%'.")
    ] = None,
    dense: Annotated[
        str | None, Option(help="Of a plate: the law without sparsity, to compare with; or none.")
    ] = DENSE,
    workers: Workers = None,
    as_json: Json = False,
) -> None:
    """Every law is fitted to all tests at once.

    Several are compared by their likelihood, as by select() in Python, unless --weights or --penalty ask for
    something else; one is identified as by identify(). JSON and plots of each, LaTeX and Python of the best,
    go to a folder.
    """
    from creepkit.reports.ranking import print_ranking
    from creepkit.screening.screen import CANDIDATE_LAWS

    search, chosen = SearchOptions().changed(how), IdentificationSettings().changed(settings)
    if search_laws:
        given = {"--law": law is not None, "--by": each is not None, "--through": through is not None}
        given |= {one.flag: one.name in how for one in options_of(SearchOptions)}
        given |= {one.flag: one.name in changes for one in options_of(LawChanges)}
        advice = "is not for a search of laws: leave it out, or --search"
    elif each is None:
        given = {
            **{one.flag: one.name in budget for one in options_of(LawSearchOptions)},
            "--compositions": compositions is not None,
            "--dense": dense != DENSE,
            "--workers": workers is not None,
        }
        advice = "is for a plate: add --by alloy, or leave it out"
        if budget:
            advice = "is for a search of laws: add --search, or leave it out"
    else:
        given = {one.flag: one.name in how for one in options_of(SearchOptions)}
        given |= {"--temperature": "temperature" in changes, "--further-tests": further_tests}
        advice = "is not for a plate, whose alloys are identified each by itself: leave it out, or --by alloy"
    for flag in (flag for flag, is_given in given.items() if is_given):
        raise FitError(f"{flag} {advice}")
    histories = selected(ck.read_histories(files, reader), only)
    if up_to is not None:
        histories = _truncate_at_strain(histories, up_to)
    if search_laws:
        _search(histories, using, to, chosen, budget, as_json)
        return
    candidates = [ck.law(name) for name in dict.fromkeys(law or CANDIDATE_LAWS)]
    if each is not None:
        options = ck.ScreeningOptions(settings=chosen, through=through, dense=dense)
        laws = LawChanges(temperature="none").changed(changes).applied(candidates, [])
        _screen(histories, laws, using, compositions, to, options, workers, as_json)
        return
    _tell_assumptions(histories)
    candidates = LawChanges().changed(changes).applied(candidates, histories)
    compared = search.sums is not None
    if compared and not by_likelihood(search, chosen):
        raise FitError("--sums compares laws by their likelihood: leave out --weights, --penalty")
    check_identified_folder(to, candidates)
    options_of_fits: dict[str, Any] = {"compared": compared, **({} if through is None else {"through": through})}
    with ProgressBar() as progress:
        ranking = ranked_candidates(
            candidates, histories, using, search, chosen, progress=progress.tick, **options_of_fits
        )
    written = write_ranking(ranking, to)
    if as_json:
        print_json(ranking, files=written)
    else:
        print_ranking(ranking, written, len(histories))
    if further_tests:
        tell(ranking.further_tests(), err=as_json)


def _search(
    histories: list[History],
    using: Predictor | None,
    to: Path,
    settings: IdentificationSettings,
    budget: dict[str, Any],
    as_json: bool,
) -> None:
    """Search laws, and write the ranking and the front."""
    from creepkit.law_search.law_file import write_law_file
    from creepkit.reports.ranking import law_search_text

    _tell_assumptions(histories)
    if to.suffix != ".py":
        check_identified_folder(to, [])
    with ProgressBar() as progress:
        found = ck.search_laws(histories, using, settings=settings, progress=progress.tick, **budget)
    if to.suffix == ".py":
        written = [write_law_file(found.ranking.valued, to)]
    else:
        written = [*write_ranking(found.ranking, to), to / "front.png"]
        found.plot(written[-1])
    if as_json:
        front = [{"law": one.law.name, "complexity": one.complexity, "misfit": one.misfit} for one in found.front]
        print_json(found.ranking, files=written, front=front)
        return
    tell(f"{law_search_text(found)}\n")
    for path in written:
        tell_written(path)


def _screen(
    histories: list[History],
    laws: list[CreepLaw],
    using: Predictor | None,
    compositions: Path | None,
    to: Path,
    options: ScreeningOptions,
    workers: int | None,
    as_json: bool,
) -> None:
    """Identify every alloy by itself, and write the plate."""
    from creepkit.composition.mapping import map_where_known

    with ProgressBar() as progress:
        plate = ck.screen(
            histories, laws, using, compositions=compositions, to=to, options=options, workers=workers,
            progress=progress.tick,
        )  # fmt: skip
    written = [plate.to_csv(to / "plate.csv")]
    if plate.identified:
        plate.plot(to / "plate.png")
        written += [to / "fits", to / "plate.png"]
    maps = map_where_known({one.alloy: one for one in plate.identified}, plate.compositions)
    for mapped in maps.values():
        mapped.plot(to / "compositions.png")
        written.append(to / "compositions.png")
    show(plate, as_json=as_json, written=written)
    if not as_json:
        for mapped in maps.values():
            tell(f"\n{mapped}")


def _truncate_at_strain(histories: list[History], limit: float) -> list[History]:
    """Frames up to a strain; a curve that has fewer than two of them is left out, and said."""
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
    """What readers assumed of the tests, for a fit rests on it, and tests that may be one."""
    from creepkit.quality import without_copies
    from creepkit.quality.repeats import duplicate_tests
    from creepkit.reports.histories import assumptions_text

    for line in assumptions_text(histories).splitlines():
        tell(f"note: {line}", err=True)
    for first, second in duplicate_tests(without_copies(histories)[0]):
        tell(f"note: {first} and {second} look like one test published twice; both count", err=True)
