"""`creepkit discover`: from measured tests at several temperatures to a law with temperature in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.printing import print_json
from creepkit.cli.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.discovery.trend import TemperatureLaw
    from creepkit.inverse.identification import Identification


def command(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Measured files, folders or patterns; or identifications (.json)."),
    ],
    law: Annotated[str, typer.Option("--law", metavar="NAME", help="The law, without temperature.")] = "norton",
    to: Annotated[Path, typer.Option(help="Folder for results; made if needed.")] = Path("discovered"),
    reader: Annotated[str | None, typer.Option(help="Reader to use; by default the one that accepts the file.")] = None,
    through: Annotated[
        str | None, typer.Option(help="A surrogate in the specimen's place, such as dimple; quicker.")
    ] = None,
    form: Annotated[
        list[str] | None,
        typer.Option(metavar="PARAMETER=FORM,...", help="Forms a parameter may take, such as n=constant,linear."),
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(metavar="PARAMETER:FORM=ODDS", help="Prior odds of a form, such as A:arrhenius=10."),
    ] = None,
    within: Annotated[float, typer.Option(min=0.0, help="K; tests so near are at one temperature.")] = 5.0,
    nuisance: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND[=MEAN[:SD]]", help="What differs between tests, such as thickness=0.4935:0.027."),
    ] = None,
    moduli: Annotated[
        bool, typer.Option("--moduli/--no-moduli", help="First find each test's modulus from its first 15 frames.")
    ] = False,
    starts: Annotated[int, typer.Option(min=1, help="Starts of each search.")] = 8,
    seed: Annotated[int, typer.Option(help="Seed of the searches.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")] = False,
) -> None:
    """Find forms of temperature for the parameters of a law.

    Every temperature is identified alone, closed forms are found through the parameters and refitted to all tests.
    From saved identifications forms are found alone, for want of the tests. JSON, a plot, LaTeX and Python go to a
    folder.
    """
    from creepkit.cli.identify import check_folder

    check_folder(to)
    forms, odds = forms_of(form), prior_of(prior)
    if all(name.endswith(".json") for name in files):
        trend = _from_identifications(files, forms, odds)
    else:
        trend = _from_tests(
            files, reader, law, through, forms, odds, nuisance, within=within, starts=starts, seed=seed, moduli=moduli
        )
    written = write(trend, to)
    if as_json:
        print_json(_answer(trend, written))
        return
    typer.echo(str(trend))
    for path in written:
        typer.echo(f"wrote {path}")


def forms_of(texts: Sequence[str] | None) -> dict[str, list[str]] | None:
    """{parameter: names of forms}, from n=constant,linear."""
    from creepkit.errors import FitError

    found = {}
    for text in texts or ():
        name, _, rest = text.partition("=")
        if not rest:
            raise FitError(f"--form {text} is not known; write n=constant,linear")
        found[name.strip()] = [one.strip() for one in rest.split(",")]
    return found or None


def prior_of(texts: Sequence[str] | None) -> dict[str, dict[str, float]]:
    """{parameter: {form: odds}}, from A:arrhenius=10."""
    from creepkit.errors import FitError

    found: dict[str, dict[str, float]] = {}
    for text in texts or ():
        place, _, odds = text.partition("=")
        name, _, form = place.partition(":")
        try:
            found.setdefault(name.strip(), {})[form.strip()] = float(odds)
        except ValueError:
            raise FitError(f"--prior {text} is not known; write A:arrhenius=10") from None
    return found


def _from_identifications(files: Sequence[str], forms: Any, prior: Any) -> TemperatureLaw:
    from creepkit import study
    from creepkit.discovery.discover import discover

    fits: list[Identification] = [study.load(Path(name)) for name in files]
    with Progress() as progress:
        return discover(fits, forms=forms, prior=prior, progress=progress.tick)


def _from_tests(
    files: Sequence[str], reader: str | None, law: str, through: str | None, forms: Any, prior: Any,
    nuisance: Sequence[str] | None, *, within: float, starts: int, seed: int, moduli: bool,
) -> TemperatureLaw:  # fmt: skip
    from creepkit import study
    from creepkit.cli.identify import nuisances_of
    from creepkit.discovery.temperature_study import temperature_study
    from creepkit.errors import FitError
    from creepkit.inverse.settings import Settings
    from creepkit.study.nouns import specimens_of

    tests = study.read_histories(list(files), reader)
    using = study.surrogate(through) if through else specimens_of(tests)
    if isinstance(using, dict):
        raise FitError(f"the tests are of several specimens, {', '.join(using)}; discover() takes those of one")
    nuisances = nuisances_of(nuisance)
    settings = Settings(starts=starts, seed=seed)
    if nuisances is not None:
        settings = Settings(starts=starts, seed=seed, nuisances=tuple(nuisances))
    with Progress() as progress:
        found = temperature_study(
            study.law(law), tests, using, moduli=moduli, within=within, forms=forms, prior=prior, settings=settings,
            progress=progress.tick,
        )  # fmt: skip
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)
    if found.trend is None:
        raise FitError(found.notes[-1])
    return found.trend


def write(trend: TemperatureLaw, folder: Path) -> list[Path]:
    """Write the answer as JSON, plot, LaTeX and Python; returns the paths."""
    from creepkit import study

    folder.mkdir(parents=True, exist_ok=True)
    written = [trend.save(folder / "temperature.json"), folder / "temperature.png"]
    trend.plot(written[1])
    for language, suffix in (("latex", ".tex"), ("python", ".py")):
        path = folder / f"law{suffix}"
        study.export(trend.valued, language, to=path, force=True)
        written.append(path)
    return written


def _answer(trend: TemperatureLaw, written: Sequence[Path]) -> dict[str, Any]:
    return {
        "law": trend.law.name,
        "judged_by": trend.judged_by,
        "range_K": list(trend.range),
        "T_ref_K": trend.T_ref,
        "forms": trend.forms,
        "sets": {name: [vars(one) for one in own] for name, own in trend.sets.items()},
        "parameters": {e.name: {k: v for k, v in vars(e).items() if k != "name"} for e in trend.estimates},
        "candidates": [{"forms": o.forms, "excess": o.excess, "weight": o.weight} for o in trend.candidates],
        "notes": list(trend.notes),
        "files": [str(path) for path in written],
    }
