"""`creepkit demo`: identify a planted law from what ships with the package, and show the truth beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.cli.identify import file_stem, rank_laws, write_ranking
from creepkit.report.ranking import print_ranking, print_truth

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking
    from creepkit.records import History


EXAMPLE_DATA = Path(__file__).parents[1] / "example_data"


PLANTED = EXAMPLE_DATA / "planted_creep_curves"
"""Nine creep curves of bars, and the truth behind them."""


PLANTED_BULGE = EXAMPLE_DATA / "planted_bulge_test"
"""A bulge test of one dimple, and the truth behind it."""


UNIAXIAL_LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")


BULGE_LAWS = ("norton", "strain-hardening", "time-hardening")


def command(
    to: Annotated[Path, typer.Option(help="Folder for results; made if needed.")] = Path("demo"),
    uniaxial: Annotated[bool, typer.Option("--uniaxial", help="Nine creep curves of bars instead.")] = False,
) -> None:
    """Identify a planted law from a virtual bulge test.

    The truth is printed beside the result.
    """
    import creepkit as ck

    folder = PLANTED if uniaxial else PLANTED_BULGE
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    histories = ck.read_histories(sorted(folder.glob("*.csv")))
    ranking = _rank_uniaxial_laws(histories) if uniaxial else _rank_bulge_laws(histories)
    written_files = write_ranking(ranking, to)
    if not uniaxial:
        written_files.append(_plot_section(ranking.best, histories[0], to))
    print_ranking(ranking, written_files, len(histories))
    print_truth(truth, ranking.best)


def compile_kernels() -> None:
    """Compile what the demo needs and keep it on disk, as part of setting up."""
    import creepkit as ck
    from creepkit.inverse.composite_predictor import reduced_order_model_of

    (test,) = ck.read_histories(sorted(PLANTED_BULGE.glob("*.csv")))
    shortened_test = test.replace(
        times=test.times[:3], outputs={name: values[:3] for name, values in test.outputs.items()}
    )
    law = ck.law(BULGE_LAWS[0])
    theta = law.to_internal(law.center())
    bulge = ck.specimen("bulge")
    bulge.predict(law, theta, [shortened_test], sensitivities=True)
    reduced_model = reduced_order_model_of(bulge)
    assert reduced_model is not None
    reduced_model.predict(law, theta, [shortened_test])  # a fit to a bulge test asks it where to begin


def _rank_uniaxial_laws(histories: list[History]) -> Ranking:
    import creepkit as ck
    from creepkit.inverse.reference_conditions import with_arrhenius

    typer.echo(f"{len(histories)} creep curves made by this package, with noise, from a law that is now forgotten:")
    for history in histories:
        typer.echo(f"  {history.condition:16} {history.times.size} frames to {history.times[-1] / 3600:.0f} h")
    laws = [with_arrhenius(ck.law(name), histories) for name in UNIAXIAL_LAWS]
    return rank_laws(laws, histories, starts=8, seed=0, loss="linear")


def _rank_bulge_laws(histories: list[History]) -> Ranking:
    import creepkit as ck
    from creepkit.records import Nuisance

    (test,) = histories
    pressures = dict.fromkeys(f"{value:g}" for value in test.loading.program().values if value > 0)
    typer.echo(
        "a bulge test made by this package, with the noise of cameras, from a law that is now forgotten:\n"
        f"  {' then '.join(pressures)} MPa, {test.times.size} frames to {test.times[-1] / 3600:.0f} h, top raised by "
        f"{test.outputs['amplitude'][-1]:.2f} mm; every candidate is simulated by finite elements"
    )
    laws = [ck.law(name) for name in BULGE_LAWS]
    return rank_laws(laws, histories, nuisances=[Nuisance("offset")], starts=1, seed=0, loss="linear")


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
