"""`creepkit discover`: from measured tests at several temperatures to a law with temperature in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import Json, Only, Reader, selected, show
from creepkit.discovery.discover import DiscoveryOptions
from creepkit.errors import FitError
from creepkit.inverse.candidate_laws import LawChanges
from creepkit.inverse.settings import IdentificationSettings
from creepkit.options import Option
from creepkit.records import Predictor
from creepkit.reports.terminal import ProgressBar, tell

if TYPE_CHECKING:
    from creepkit.discovery.temperature_law import TemperatureLaw

NAMES = ("temperature.json", "temperature.png", "law.tex", "law.py")


def command(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Measured files, folders or patterns; or identifications (.json)."),
    ],
    law: Annotated[str, typer.Option("--law", metavar="NAME", help="The law, without temperature.")] = "norton",
    *,
    settings: Annotated[dict[str, Any], IdentificationSettings],
    changes: Annotated[dict[str, Any], LawChanges, ("fix", "bounds")],
    forms: Annotated[dict[str, Any], DiscoveryOptions],
    to: Annotated[Path, typer.Option(help="Folder for results; made if needed."), OutputPath("folder", NAMES)] = Path(
        "discovered"
    ),
    reader: Reader = None,
    only: Only = None,
    using: Annotated[Predictor | None, Option(help="Identify through a surrogate alone; quicker.")] = None,
    as_json: Json = False,
) -> None:
    """Every temperature is identified alone, closed forms are found through the parameters and refitted to all tests.

    From saved identifications forms are found alone, for want of the tests. JSON, a plot, LaTeX and Python go to a
    folder.
    """
    import creepkit as ck

    with ProgressBar() as progress:
        if all(name.endswith(".json") for name in files):
            if only or changes or using or settings:
                raise FitError("settings, --only, --fix, --bound and --using are for tests, not for saved fits")
            own = {name: value for name, value in forms.items() if name in ("forms", "parameters")}
            found: TemperatureLaw = ck.discover([ck.load(n) for n in files], progress=progress.tick, **own)
        else:
            (changed,) = LawChanges(temperature="none").changed(changes).applied([ck.law(law)], [])
            study = ck.temperature_study(
                changed, selected(ck.read_histories(files, reader), only), using,
                settings=IdentificationSettings().changed(settings), progress=progress.tick, **forms,
            )  # fmt: skip
            for note in study.notes:
                tell(f"note: {note}", err=True)
            if study.temperature_law is None:
                raise FitError(study.notes[-1])
            found = study.temperature_law
    to.mkdir(parents=True, exist_ok=True)
    written = [found.save(to / NAMES[0]), *(to / name for name in NAMES[1:])]
    found.plot(written[1])
    for language, path in zip(("latex", "python"), written[2:], strict=True):
        ck.export(found.valued, language, to=path)
    show(found, as_json=as_json, written=written)
