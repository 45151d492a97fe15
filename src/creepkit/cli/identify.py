"""`creepkit identify`: from a folder of creep curves to a named law with intervals and a plot."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.printing import print_json, print_table
from creepkit.cli.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw
    from creepkit.records import History


def command(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Measured files, folders or patterns.")],
    law: Annotated[list[str], typer.Option("--law", metavar="NAME", help="A law to fit; may be given several times.")],
    to: Annotated[Path, typer.Option(help="Folder for results; made if needed.")] = Path("identified"),
    reader: Annotated[str | None, typer.Option(help="Reader to use; by default the one that accepts the file.")] = None,
    temperature: Annotated[
        str, typer.Option(help="auto: an Arrhenius factor when the tests span several temperatures; or none.")
    ] = "auto",
    up_to: Annotated[float | None, typer.Option(help="Use frames up to this strain only, such as 0.05.")] = None,
    starts: Annotated[int, typer.Option(min=1, help="Starts of the search.")] = 8,
    seed: Annotated[int, typer.Option(help="Seed of the search.")] = 0,
    loss: Annotated[str, typer.Option(help="linear, soft_l1, huber, cauchy or arctan.")] = "linear",
    as_json: Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")] = False,
) -> None:
    """Fit laws to creep curves and rank them.

    Every law is fitted to all curves at once; JSON and plots of each, LaTeX and Python of the best, go to a folder.
    """
    from creepkit import study
    from creepkit.errors import FitError

    if temperature not in ("auto", "none"):
        raise FitError(f"--temperature {temperature} is not known; allowed are auto and none")
    if up_to is not None and not up_to > 0:
        raise FitError(f"--up-to {up_to:g} is not a strain above zero; write 0.05 for 5 %")
    _check_folder(to)
    named = [study.law(name) for name in dict.fromkeys(law)]
    histories = study.read_histories(files, reader)
    if up_to is not None:
        histories = _cut(histories, up_to)
    _warn_of_twins(histories)
    if temperature == "auto":
        from creepkit.inverse.warmth import with_arrhenius

        named = [with_arrhenius(one, histories) for one in named]
    ranking = ranked(named, histories, starts, seed, loss)
    written = write(ranking, to)
    if as_json:
        print_json(_answer(ranking, written))
    else:
        tell(ranking, written, histories)


def _check_folder(folder: Path) -> None:
    """Say now, not after all the work, that results cannot be written there."""
    from creepkit.errors import FitError

    existing = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not existing.is_dir():
        raise FitError(f"--to {folder}: {existing} is a file; name a folder for the results")
    if not os.access(existing, os.W_OK):
        raise FitError(f"--to {folder}: {existing} cannot be written to; name another folder for the results")


def _cut(histories: list[History], limit: float) -> list[History]:
    """Frames up to a strain; a curve that has fewer than two of them is left out, and said."""
    cut = [h.up_to("strain", limit) for h in histories]
    kept = [h for h in cut if int((h.used & (h.times > 0)).sum()) >= 2]
    for history in cut:
        if history not in kept:
            typer.echo(f"left out: {history.name} has no two frames below a strain of {limit:g}", err=True)
    return kept


def _warn_of_twins(histories: list[History]) -> None:
    from creepkit.readers.duplicates import duplicates

    for one, other in duplicates(histories):
        typer.echo(f"note: {one} and {other} look like one test published twice; both count", err=True)


def ranked(laws: Sequence[CreepLaw], histories: list[History], starts: int, seed: int, loss: str) -> Ranking:
    """Fit each law, showing progress, and rank them."""
    from creepkit import study
    from creepkit.inverse.selection import rank

    fits = []
    with Progress() as progress:
        for one in laws:

            def tick(task: str, done: int, total: int, name: str = one.name) -> None:
                progress.tick(f"{name}, {task}", done, total)

            fits.append(study.identify(one, histories, starts=starts, seed=seed, loss=loss, progress=tick))
    return rank(fits)


def write(ranking: Ranking, folder: Path) -> list[Path]:
    """Write every law's JSON and plot, and the best law as LaTeX and Python; returns the paths."""
    from creepkit import study

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for entry in ranking.laws:
        name = slug(entry.fit.law.name)
        written.append(entry.fit.save(folder / f"{name}.json"))
        entry.fit.plot(folder / f"{name}.png")
        written.append(folder / f"{name}.png")
    best = ranking.best
    for language, suffix in (("latex", ".tex"), ("python", ".py")):
        path = folder / f"{slug(best.law.name)}{suffix}"
        study.export(best, language, to=path)
        written.append(path)
    return written


def slug(name: str) -> str:
    """A law's name as a file name."""
    return re.sub(r"[^A-Za-z0-9.=-]+", "-", name).strip("-") or "law"


def tell(ranking: Ranking, written: list[Path], histories: list[History]) -> None:
    """Print the table of laws, the verdict, the best law and what was written."""
    rows = [
        (
            entry.fit.law.name,
            str(len(entry.fit.law.params)),
            f"{entry.fit.rms:.3f}",
            f"{100 * entry.fit.scatter.rate:.0f} %",
            f"{100 * entry.fit.scatter.drift:.0f} %",
            f"{entry.excess:.1f}",
            f"{entry.weight:.3f}",
        )
        for entry in ranking.laws
    ]
    columns = ("law", "parameters", "rms ln strain", "test to test", "not followed", "BIC - best", "weight")
    print_table(f"{len(histories)} tests", columns, rows)
    typer.echo(f"{ranking.verdict}\n\n{ranking.best}\n")
    for path in written:
        typer.echo(f"wrote {path}")


def _answer(ranking: Ranking, written: list[Path]) -> dict[str, Any]:
    return {
        "verdict": ranking.verdict,
        "laws": [{**_summary(r.fit), "bic_excess": r.excess, "weight": r.weight} for r in ranking.laws],
        "files": [str(path) for path in written],
    }


def _summary(fit: Identification) -> dict[str, Any]:
    return {
        "law": fit.law.name,
        "rms_ln_strain": fit.rms,
        "parameters": {e.name: {"value": e.value, "low": e.low, "high": e.high, "unit": e.unit, "verdict": e.verdict}
                       for e in fit.estimates},
        "scatter": fit.scatter.to_dict(),
        "notes": list(fit.notes),
    }  # fmt: skip
