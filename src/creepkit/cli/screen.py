"""`creepkit screen`: the laws of all alloys of a plate, from a folder of their tests."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

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
from creepkit.cli.interrupts import kept_when_interrupted
from creepkit.cli.options import penalty_named
from creepkit.inverse.settings import IdentificationSettings
from creepkit.reports.terminal import ProgressBar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.language import CreepLaw


CONFIRMATION_CHOICES = {"when-in-doubt": "when in doubt", "always": True, "never": False}


@kept_when_interrupted("alloys that are finished are kept, and the same command goes on with the others")
def command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of history files, their alloys in them.")],
    settings: Annotated[dict[str, Any], IdentificationSettings],
    law: Annotated[
        list[str] | None, typer.Option("--law", metavar="NAME", help="A candidate; the four of Table 1 by default.")
    ] = None,
    compositions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table alloy,Fe,Ni,... below a line '# unit: wt.%'.")
    ] = None,
    to: Annotated[
        Path,
        typer.Option(help="Folder for results; what it holds already is not done again."),
        OutputPath("folder", ("plate.csv", "plate.h5")),
    ] = Path("screened"),
    surrogate: SurrogateOption = None,
    through: Annotated[
        str | None, typer.Option(metavar="NAME", help="Search sums through a surrogate, end with finite elements.")
    ] = None,
    dense: Annotated[
        str, typer.Option(metavar="NAME", help="Law to be had without sparsity, to compare with; or none.")
    ] = "combined",
    penalty: Annotated[
        str | None, typer.Option(metavar="NAME", help="Reduce that law by a penalty: sqrt, group-l2, l2 or subsets.")
    ] = None,
    confirm: Annotated[
        str, typer.Option(help="Simulate the best law by finite elements: when-in-doubt, always or never.")
    ] = "when-in-doubt",
    only: OnlyOption = None,
    fix: FixOption = None,
    bound: BoundOption = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes; one for each core by default."), limits.WORKERS
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Identify the laws of all alloys of a plate.

    Interrupted, it goes on where it was when it is started again in the same way.
    """
    import creepkit as ck
    from creepkit.screening.screen import CANDIDATE_LAWS, resolve_tests

    options = ck.ScreeningOptions(
        settings=ck.IdentificationSettings().changed(settings),
        through=surrogate_named(through),
        dense=None if dense == "none" else dense,
        penalty=penalty_named(penalty),
        confirm=_confirmation_choice(confirm),
    )
    laws: Sequence[CreepLaw | str] = law or CANDIDATE_LAWS
    if fix or bound:
        laws = change_laws([ck.law(name) for name in law or CANDIDATE_LAWS], fix, bound)
    with ProgressBar() as progress:
        plate = ck.screen(
            select_by_label(resolve_tests(folder, compositions), only) if only else folder,
            laws,
            surrogate_named(surrogate),
            compositions=compositions,
            to=to,
            options=options,
            workers=workers,
            progress=progress.tick,
        )
    written = [plate.to_csv(to / "plate.csv"), plate.to_hdf5(to / "plate.h5")]
    if plate.identified:
        written += [to / "fits", *plate.plot(to / "pictures")]
    from creepkit.reports.screening import print_screening

    print_screening(plate, written, as_json)


def _confirmation_choice(text: str) -> bool | Literal["when in doubt"]:
    from creepkit.errors import FitError

    if text not in CONFIRMATION_CHOICES:
        raise FitError(f"--confirm {text} is not known; allowed are {', '.join(CONFIRMATION_CHOICES)}")
    return CONFIRMATION_CHOICES[text]  # type: ignore[return-value]
