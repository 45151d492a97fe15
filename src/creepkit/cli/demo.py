"""`creepkit demo`: identify a planted law from nine noisy curves that ship with the package, and show the truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.identify import ranked, tell, write
from creepkit.cli.printing import print_table

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

PLANTED = Path(__file__).parent / "planted"
LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")


def command(to: Annotated[Path, typer.Option(help="Folder for results; made if needed.")] = Path("demo")) -> None:
    """Identify a planted law from nine noisy creep curves.

    The truth is printed beside the answer.
    """
    from creepkit import study
    from creepkit.inverse.warmth import with_arrhenius

    truth = json.loads((PLANTED / "truth.json").read_text(encoding="utf-8"))
    histories = study.read_histories(sorted(PLANTED.glob("*.csv")))
    typer.echo(f"{len(histories)} creep curves made by this package, with noise, from a law that is now forgotten:")
    for history in histories:
        typer.echo(f"  {history.condition:16} {history.times.size} frames to {history.times[-1] / 3600:.0f} h")
    laws = [with_arrhenius(study.law(name), histories) for name in LAWS]
    ranking = ranked(laws, histories, starts=8, seed=0, loss="linear")
    tell(ranking, write(ranking, to), histories)
    _beside(truth, ranking.best)


def _beside(truth: dict[str, Any], fit: Identification) -> None:
    """The planted values beside the identified ones."""
    right = fit.law.name.startswith(truth["law"])
    rows = []
    for e in fit.estimates if right else ():
        planted = truth["values"][e.name]
        inside = "yes" if e.low <= planted <= e.high else "no"
        rows.append((e.name, f"{planted:.4g}", f"{e.value:.4g}", f"{e.low:.4g} to {e.high:.4g}", inside))
    scatter = f"{100 * truth['rate_scatter']:.0f} %", f"{100 * fit.scatter.rate:.0f} %"
    rows.append(("rate between tests", *scatter, "", ""))
    typer.echo("")
    print_table(f"the truth: {truth['law']}", ("parameter", "planted", "identified", "95 % interval", "inside"), rows)
