"""`creepkit data`: what a data set holds, or what looks wrong in measured tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.reports.terminal import print_json, tell, tell_written

DATA_SET_SUFFIXES = (".h5", ".hdf5")
"""Endings of data sets; everything else is read as measured tests."""


def command(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A data set that 'creepkit generate' wrote, or measured files or a folder."
        ),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    plots: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Draw inputs and a random handful of histories of a data set there."),
        OutputPath("folder"),
    ] = None,
    seed: Annotated[int, typer.Option(help="Which handful."), limits.SEED] = 0,
    reader: Annotated[
        str | None, typer.Option(help="Reader of measured tests; by default the one that accepts them.")
    ] = None,
    activation_energy: Annotated[
        float | None,
        typer.Option(metavar="J/MOL", help="To put a factor on the creep rate as a step of temperature [400e3]."),
        limits.ENERGY,
    ] = None,
) -> None:
    """Describe a data set, or check measured tests."""
    if file.suffix.lower() in DATA_SET_SUFFIXES:
        _describe_data_set(file, as_json, plots, seed)
    elif plots is not None:
        raise typer.BadParameter(f"'{file}' is no data set (.h5); only those are drawn", param_hint="--plots")
    else:
        _check_measured_tests(file, as_json, reader, activation_energy)


def _describe_data_set(file: Path, as_json: bool, plots: Path | None, seed: int) -> None:
    import creepkit as ck
    from creepkit.dataset.dataset import summary

    data = ck.read_dataset(file)
    if as_json:
        print_json(summary(data))
    else:
        tell(data)
    if plots is not None:
        from creepkit.reports.dataset import write_dataset_figures

        for path in write_dataset_figures(data, plots, seed):
            tell_written(path, err=as_json)


def _check_measured_tests(file: Path, as_json: bool, reader: str | None, activation_energy: float | None) -> None:
    import creepkit as ck
    from creepkit.reports.data_quality import data_quality_to_json
    from creepkit.reports.histories import assumptions_text

    histories = ck.read_histories(file, reader=reader)
    quality = ck.check_data_quality(histories, activation_energy=activation_energy)
    assumed = assumptions_text(histories)
    if as_json:
        print_json({**data_quality_to_json(quality), "assumed": assumed.splitlines()})
    else:
        tell("\n".join(filter(None, (str(quality), assumed))))
