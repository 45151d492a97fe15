"""`creepkit discover`: from measured tests at several temperatures to a law with temperature in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.generated_options import parsed_number
from creepkit.cli.identification_options import (
    BoundOption,
    FixOption,
    OnlyOption,
    SurrogateOption,
    change_laws,
    select_by_label,
    surrogate_named,
)
from creepkit.inverse.settings import IdentificationSettings
from creepkit.reports.terminal import ProgressBar, print_json, tell, tell_written

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.discovery.discover import FormOptions, TemperatureStudy
    from creepkit.discovery.temperature_law import TemperatureLaw


def command(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Measured files, folders or patterns; or identifications (.json)."),
    ],
    settings: Annotated[dict[str, Any], IdentificationSettings],
    law: Annotated[str, typer.Option("--law", metavar="NAME", help="The law, without temperature.")] = "norton",
    to: Annotated[
        Path,
        typer.Option(help="Folder for results; made if needed."),
        OutputPath("folder", ("temperature.json", "temperature.png", "law.tex", "law.py")),
    ] = Path("discovered"),
    reader: Annotated[str | None, typer.Option(help="Reader to use; by default the one that accepts the file.")] = None,
    surrogate: SurrogateOption = None,
    only: OnlyOption = None,
    fix: FixOption = None,
    bound: BoundOption = None,
    form: Annotated[
        list[str] | None,
        typer.Option(metavar="PARAMETER=FORM,...", help="Forms a parameter may take, such as n=constant,linear."),
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(metavar="PARAMETER:FORM=ODDS", help="Prior odds of a form, such as A:arrhenius=10."),
    ] = None,
    within: Annotated[
        float, typer.Option(help="K; tests so near are at one temperature."), limits.KELVIN_DIFFERENCE
    ] = 5.0,
    moduli: Annotated[
        bool, typer.Option("--moduli/--no-moduli", help="First find each test's modulus from its first 15 frames.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Find forms of temperature for the parameters of a law.

    Every temperature is identified alone, closed forms are found through the parameters and refitted to all tests.
    From saved identifications forms are found alone, for want of the tests. JSON, a plot, LaTeX and Python go to a
    folder.
    """
    import creepkit as ck
    from creepkit.errors import FitError

    form_options: FormOptions = {"forms": parse_forms(form), "prior": parse_prior_odds(prior)}
    if all(name.endswith(".json") for name in files):
        if only or fix or bound or surrogate:
            raise FitError("--only, --fix, --bound and --surrogate are for measured tests, not for identifications")
        temperature_law = _discover_from_identifications(files, form_options)
    else:
        (changed_law,) = change_laws([ck.law(law)], fix, bound)
        with ProgressBar() as progress:
            study = ck.temperature_study(
                changed_law,
                select_by_label(ck.read_histories(files, reader), only),
                surrogate_named(surrogate),
                moduli=moduli,
                within=within,
                settings=ck.IdentificationSettings().changed(settings),
                progress=progress.tick,
                **form_options,
            )
        temperature_law = _temperature_law_of(study)
    written = write_temperature_law(temperature_law, to)
    if as_json:
        from creepkit.reports.temperature_law import temperature_law_to_json

        print_json(temperature_law_to_json(temperature_law, written))
        return
    tell(temperature_law)
    for path in written:
        tell_written(path)


def parse_forms(texts: Sequence[str] | None) -> dict[str, list[str]] | None:
    """{parameter: names of forms}, from n=constant,linear."""
    from creepkit.errors import FitError

    forms_by_parameter = {}
    for text in texts or ():
        name, _, names = text.partition("=")
        if not names:
            raise FitError(f"--form {text} is not known; write n=constant,linear")
        forms_by_parameter[name.strip()] = [form_name.strip() for form_name in names.split(",")]
    return forms_by_parameter or None


def parse_prior_odds(texts: Sequence[str] | None) -> dict[str, dict[str, float]]:
    """{parameter: {form: odds}}, from A:arrhenius=10."""
    from creepkit.errors import FitError

    odds_by_parameter: dict[str, dict[str, float]] = {}
    for text in texts or ():
        target, _, odds = text.partition("=")
        name, _, form = target.partition(":")
        try:
            number = parsed_number(odds)
        except ValueError:
            raise FitError(f"--prior {text} is not known; write A:arrhenius=10") from None
        if not (name.strip() and form.strip() and 0.0 < number < float("inf")):
            raise FitError(f"--prior {text}: write PARAMETER:FORM=ODDS with finite odds above zero, A:arrhenius=10")
        odds_by_parameter.setdefault(name.strip(), {})[form.strip()] = number
    return odds_by_parameter


def _discover_from_identifications(files: Sequence[str], form_options: FormOptions) -> TemperatureLaw:
    import creepkit as ck

    fits = [ck.load(Path(name)) for name in files]
    with ProgressBar() as progress:
        return ck.discover(fits, progress=progress.tick, **form_options)


def _temperature_law_of(study: TemperatureStudy) -> TemperatureLaw:
    """The temperature law of a study, whose notes are printed; FitError where there is none."""
    from creepkit.errors import FitError

    for note in study.notes:
        tell(f"note: {note}", err=True)
    if study.temperature_law is None:
        raise FitError(study.notes[-1])
    return study.temperature_law


def write_temperature_law(temperature_law: TemperatureLaw, folder: Path) -> list[Path]:
    """Write the law as JSON, plot, LaTeX and Python; returns the paths."""
    import creepkit as ck

    folder.mkdir(parents=True, exist_ok=True)
    written = [temperature_law.save(folder / "temperature.json"), folder / "temperature.png"]
    temperature_law.plot(written[1])
    for language, suffix in (("latex", ".tex"), ("python", ".py")):
        path = folder / f"law{suffix}"
        ck.export(temperature_law.valued, language, to=path)
        written.append(path)
    return written
