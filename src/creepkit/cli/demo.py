"""`creepkit demo`: identify laws from the curves that ship with the package, measured ones first, on one screen."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.identify import file_stem, write_ranking
from creepkit.reports.terminal import ProgressBar

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw
    from creepkit.records import History


EXAMPLE_DATA = Path(__file__).parents[1] / "example_data"


MEASURED = EXAMPLE_DATA / "cmsx6"
"""Nine creep curves of CMSX-6, most of them to rupture."""


PLANTED = EXAMPLE_DATA / "planted_creep_curves"
"""Nine simulated creep curves of bars, and the truth behind them."""


PLANTED_BULGE = EXAMPLE_DATA / "planted_bulge_test"
"""A simulated bulge test of one dimple, and the truth behind it."""


MEASURED_LAWS = ("norton", "mpc-omega", "kachanov-rabotnov")
"""Norton's law comes with creepkit, the two with tertiary creep with its plugins."""


UNIAXIAL_LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")


BULGE_LAWS = ("norton", "strain-hardening", "time-hardening")


def command(
    to: Annotated[Path, typer.Option(help="Folder for results; made if needed.")] = Path("demo"),
    uniaxial: Annotated[bool, typer.Option("--uniaxial", help="Simulated creep curves instead of both.")] = False,
) -> None:
    """Identify laws from measured curves, then a bulge test.

    Rupture times are printed beside the measured ones, the true law of the simulated test beside the identified one.
    """
    started = time.perf_counter()
    if uniaxial:
        plots = _planted_creep_curves(to)
    else:
        plots = [*_measured_creep_curves(to / "creep_curves"), *_planted_bulge_test(to / "bulge_test")]
    typer.echo(f"\ntime: {time.perf_counter() - started:.0f} s")
    typer.echo(f"results of every law as JSON, the best one as LaTeX and Python: {to}")
    typer.echo(f"plots: {' '.join(map(str, plots))}")


def _measured_creep_curves(folder: Path) -> list[Path]:
    """Laws of the CMSX-6 curves, and rupture as the best one has it; returns the plots."""
    import creepkit as ck

    tests = ck.read_histories(MEASURED)
    typer.echo(
        f"MEASURED: {len(tests)} creep curves of CMSX-6 at 980 C, thinned; six tests ruptured, three were stopped\n"
        "(Federal Institute for Materials Research and Testing, doi 10.5281/zenodo.13937986, CC BY 4.0)"
    )
    registered = ck.available("laws")
    laws = [ck.law(name) for name in MEASURED_LAWS if name in registered]
    if len(laws) == 1:
        typer.echo("the plugins with tertiary creep are not installed: Norton's law breaks by loss of section alone")
    # Tests under tension cannot determine how damage depends on the largest principal stress.
    laws = [law.fix(alpha=0) if "alpha" in law.names else law for law in laws]
    ranking = _identify("creep curves", laws, tests, starts=2)
    _print_ranking(ranking)
    _print_values(ranking.best)
    _print_rupture_times(ranking.best)
    return _write(ranking, folder)


def _planted_creep_curves(folder: Path) -> list[Path]:
    import creepkit as ck
    from creepkit.inverse.reference_conditions import with_arrhenius

    tests = ck.read_histories(PLANTED)
    typer.echo(f"SIMULATED: {len(tests)} creep curves with noise, 750 to 850 C")
    laws = [with_arrhenius(ck.law(name), tests) for name in UNIAXIAL_LAWS]
    ranking = _identify("creep curves", laws, tests)
    _print_ranking(ranking)
    _print_truth(PLANTED, ranking.best)
    return _write(ranking, folder)


def _planted_bulge_test(folder: Path) -> list[Path]:
    import creepkit as ck
    from creepkit.records import Nuisance

    (test,) = ck.read_histories(PLANTED_BULGE)
    pressures = " then ".join(dict.fromkeys(f"{value:g}" for value in test.loading.program().values if value > 0))
    hours, height = test.times[-1] / 3600, test.outputs["amplitude"][-1]
    typer.echo(
        f"\nSIMULATED: a bulge test with camera noise, {pressures} MPa, {test.times.size} frames to {hours:.0f} h,\n"
        f"top raised by {height:.2f} mm; every law is simulated by finite elements"
    )
    laws = [ck.law(name) for name in BULGE_LAWS]
    ranking = _identify("bulge test", laws, [test], starts=1, nuisances=[Nuisance("offset")])
    _print_ranking(ranking)
    _print_truth(PLANTED_BULGE, ranking.best)
    plots = _write(ranking, folder)
    return [*plots, _plot_section(ranking.best, test, folder)]


def _identify(task: str, laws: Sequence[CreepLaw], tests: list[History], **options: Any) -> Ranking:
    """Identify each law from the tests and rank them, showing progress."""
    import creepkit as ck

    fits = []
    with ProgressBar() as progress:
        for number, law in enumerate(laws, start=1):
            fits.append(ck.identify(law, tests, **options))
            progress.tick(task, number, len(laws), law.name)
    return ck.rank(fits)


def _print_ranking(ranking: Ranking) -> None:
    """Each law with its misfit and weight, then the best one with its values."""
    output = next(iter(ranking.best.errors))
    misfit = "rms ln strain" if output == "strain" else "loss of amplitude"
    rows = []
    for entry in ranking.laws:
        fit = entry.fit
        value = fit.rms if output == "strain" else fit.errors[output].relative_squared_error
        numbers = f"{value:.3g}", f"{entry.excess:.1f}", f"{entry.weight:.3f}"
        rows.append((fit.law.name, str(len(fit.law.params)), *numbers))
    _print_rows(("law", "parameters", misfit, "BIC - best", "weight"), rows)
    typer.echo(ranking.verdict)


def _print_values(fit: Identification) -> None:
    """The identified values with 95 % intervals, three a line."""
    texts = [f"{e.name} = {e.value:.4g} [{e.low:.3g}, {e.high:.3g}] {e.unit}".rstrip() for e in fit.estimates]
    for start in range(0, len(texts), 3):
        typer.echo("  " + ", ".join(texts[start : start + 3]))


def _print_rupture_times(fit: Identification) -> None:
    """Rupture times of each condition, measured and predicted."""
    rupture_by_condition: dict[str, list[Any]] = {}
    for test_fit, test in zip(fit.tests, fit.histories, strict=True):
        if test_fit.rupture is not None:
            rupture_by_condition.setdefault(test.condition, []).append(test_fit.rupture)
    rows = []
    for condition in sorted(rupture_by_condition, reverse=True):
        comparisons = rupture_by_condition[condition]
        measured = ", ".join(f"{'> ' if c.censored else ''}{c.measured / 3600:.4g}" for c in comparisons)
        one = comparisons[0]
        interval = f"{one.low / 3600:.0f} to {one.high / 3600:.0f}"
        rows.append((condition, measured, f"{one.predicted / 3600:.0f}", interval))
    _print_rows(("rupture at", "measured, h", "predicted, h", "95 % interval of one test, h"), rows)


def _print_truth(folder: Path, fit: Identification) -> None:
    """The true values beside the identified ones."""
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    rows = []
    for estimate in fit.estimates if fit.law.name.startswith(truth["law"]) else ():
        true_value = truth["values"][estimate.name]
        inside = "yes" if estimate.low <= true_value <= estimate.high else "no"
        interval = f"{estimate.low:.4g} to {estimate.high:.4g}"
        rows.append((estimate.name, f"{true_value:.4g}", f"{estimate.value:.4g}", interval, inside))
    if "rate_scatter" in truth:
        sds = f"{100 * truth['rate_scatter']:.0f} %", f"{100 * fit.noise_model.rate:.0f} %"
        rows.append(("rate between tests", *sds, "", ""))
    typer.echo(f"the truth: {truth['law']}")
    _print_rows(("parameter", "true", "identified", "95 % interval", "inside"), rows)


def _print_rows(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table without rules: one line a row."""
    widths = [max(len(row[k]) for row in (columns, *rows)) for k in range(len(columns))]
    for row in (columns, *rows):
        typer.echo("  " + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _write(ranking: Ranking, folder: Path) -> list[Path]:
    """Write the results; returns the plot of the best law."""
    write_ranking(ranking, folder)
    return [folder / f"{file_stem(ranking.best.law.name)}.png"]


def _plot_section(fit: Identification, test: History, folder: Path) -> Path:
    """Draw the section of the dimple at the end of the test, as the identified law has it."""
    import creepkit as ck

    run = ck.simulate(
        fit.law,
        "bulge",
        fit.values,
        loading=test.loading,
        times=test.times,
        temperature=test.temperature,
        elastic=test.elastic,
        name=f"{test.name}, {fit.law.name} as identified",
    )
    path = folder / f"{file_stem(fit.law.name)}-section.png"
    run.section(path=path)  # type: ignore[attr-defined]
    return path
