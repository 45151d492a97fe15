"""What several commands share: arguments and options, laws by name or file, and subsets of tests."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import creepkit as ck
from creepkit.errors import FitError, LawError, nearest
from creepkit.limits import SEED, Limits
from creepkit.options import Option

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw
    from creepkit.records import History, LawWithValues

PAPER_SPECIMEN = "bulge"
"""What a data set is made of and a camera watches, and what a test is of whose load it takes, where nothing is said."""


Files = Annotated[list[str], typer.Argument(metavar="FILE...", help="Measured files, folders or patterns.")]
Tests = Annotated[list[str] | None, typer.Argument(metavar="[TESTS]...", help="Measured files, folders or patterns.")]
Law = Annotated[
    str, typer.Argument(metavar="LAW|RESULT.json", help="A law or a material, or a file that creepkit wrote.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Reader = Annotated[str | None, Option(help="Reader of the files; by default the one that accepts them.")]
Values = Annotated[dict[str, float] | None, Option(help="A parameter's value.", flag="set", example="n=5.2")]
Seed = Annotated[int, Option(help="Of random draws.", limits=SEED)]
Workers = Annotated[int | None, Option(help="Processes; one for each core by default.", limits=Limits(1, 1024))]
Only = Annotated[
    dict[str, tuple[str, ...]] | None,
    Option(help="Tests with this label alone: name, alloy, temperature (K), stress (MPa).", example="name=test_1"),
]


def is_law_name(word: str) -> bool:
    """Whether a word names a registered law, or a sum of them as norton+strain-hardening, whatever files there are."""
    try:
        ck.law(word)
    except LawError:
        return False
    return True


def is_file_name(word: str) -> bool:
    """Whether a word that may name a law names a file: it has a suffix or a folder, as ./norton, and is no law."""
    return (Path(word).suffix != "" or Path(word).name != word) and not is_law_name(word)


def law_source(text: str) -> CreepLaw | Identification | Ranking | LawWithValues:
    """A law or a material by name, or else what a file holds: an identification, a ranking, or a law with values."""
    from creepkit.records import LawWithValues

    if is_file_name(text):
        source: Identification | Ranking | LawWithValues = ck.load(text)
        if not isinstance(source, LawWithValues) and not hasattr(source, "valued"):
            raise LawError(
                f"{text}: this is a {named(source)}, which has no law with values; give a result of identify or export"
            )
        return source
    try:
        return ck.law(text)
    except LawError as error:
        with suppress(LawError):
            return ck.material(text).valued
        near = nearest(text, ck.available("materials"))
        if "did you mean" in near and "did you mean" not in str(error):
            raise LawError(f"there is no law or material '{text}': {near}") from None
        if Path(text).is_file():
            raise LawError(f"{error}; for the file of that name write ./{text}") from None
        raise


def merged_values(source: Any, given: Mapping[str, float] | None) -> dict[str, float] | None:
    """The values of the source with those given by --set in their place; None for a source's own."""
    if hasattr(source, "terms"):
        return dict(given or {})
    own: Mapping[str, float] = getattr(source, "valued", source).values
    return {**own, **given} if given else None


def show(result: Any, *, as_json: bool, plot: Path | None = None, written: Sequence[Path] = ()) -> None:
    """Draw a result where a picture is asked for, and print it, as text or as JSON.

    written : further files that were.
    """
    from creepkit.reports.terminal import print_json, tell, tell_written

    files = [*written, *([] if plot is None else [plot])]
    if plot is not None:
        result.plot(plot)
    for path in files:
        tell_written(path, err=True)
    if as_json:
        print_json(result, files=files)
    else:
        tell(result)


def read_results(path: Path, histories: Sequence[History] = ()) -> Identification | Ranking:
    """A saved identification or ranking, or that of a folder, with the tests that it was made from where given."""
    import creepkit as ck
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking

    path = _result_in(path) if path.is_dir() else path
    found = ck.load(path)
    if not isinstance(found, Identification | Ranking):
        raise FitError(
            f"{path}: this is a {named(found)}, and neither an identification nor a ranking; give a result of identify"
        )
    kept: Identification | Ranking = with_tests(found, histories)
    return kept


def _result_in(folder: Path) -> Path:
    """The one ranking, or identification, that identify or run wrote into a folder; FitError for none or several."""
    folders = [one for one in (folder, folder / "identified", *folder.glob("*.results/identified")) if one.is_dir()]
    found = [file for one in folders for file in sorted(one.glob("*ranking*.json"))]
    found = found or [file for one in folders if one.name == "identified" for file in sorted(one.glob("*.json"))]
    if len(found) != 1:
        listed = ", ".join(map(str, found[:4])) or "none; run 'creepkit run' or 'creepkit identify' there first"
        raise FitError(f"{folder}: name the identification in it (found: {listed})")
    return found[0]


def with_tests(result: Any, histories: Sequence[History]) -> Any:
    """A saved result with the tests that it was made from, where they are given and it takes them."""
    return result.with_histories(histories) if histories and hasattr(result, "with_histories") else result


def named(result: Any) -> str:
    """What a result is, in words: a rupture assessment."""
    return re.sub(r"(?<!^)([A-Z])", r" \1", type(result).__name__).lower()


def selected(histories: Sequence[History], only: Mapping[str, Sequence[str]] | None) -> list[History]:
    """The tests that --only names; values of one label are alternatives."""
    from creepkit.records.history_selection import select_tests

    return select_tests(histories, **{label: list(values) for label, values in (only or {}).items()})
