"""`creepkit surrogate`: data sets of simulated tests, networks that are trained on them, and reduced-order models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import creepkit as ck
from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import PAPER_SPECIMEN, Json, Seed
from creepkit.errors import SolveError
from creepkit.jobs.worker_pools import ParallelExecution
from creepkit.limits import SAMPLES, SECONDS
from creepkit.options import Option
from creepkit.reports.terminal import ProgressBar, print_json, print_table, tell, tell_written
from creepkit.surrogates.parameter_gru import NetworkSizes, ParameterGru, Training

if TYPE_CHECKING:
    from creepkit.records import Predictor

DataSet = Annotated[Path, typer.Argument(metavar="DATA", help="Data set that creepkit surrogate generate wrote.")]
Device = Annotated[str, Option(help="auto (a GPU where there is one), cpu or cuda.")]
Specimen = Annotated[str, Option(help="Any specimen that says how its tests are loaded.")]


def generate(
    law: Annotated[str, typer.Argument(metavar="LAW", help="Name of a law.")],
    *,
    to: Annotated[Path, typer.Option(help="HDF5 file; its shards lie in FILE.parts."), OutputPath("resumed")],
    samples: Annotated[int | None, Option(help="Accepted samples wanted.", limits=SAMPLES)] = None,
    draws: Annotated[int | None, Option(help="Or draws, whatever becomes of them.", limits=SAMPLES)] = None,
    specimen: Specimen = PAPER_SPECIMEN,
    domain: Annotated[
        Literal["conditioned", "paper"], Option(help="Most samples creep visibly, or uniform in the law's bounds.")
    ] = "conditioned",
    seed: Seed = 0,
    interval: Annotated[float | None, Option(help="s from frame to frame; 150 by default.", limits=SECONDS)] = None,
    conditions: Annotated[
        dict[str, tuple[float, float]] | None,
        Option(help="Range of a condition, in MPa, s, mm, K, N.", flag="range", example="P1=5:20"),
    ] = None,
    execution: Annotated[dict[str, Any], ParallelExecution],
    as_json: Json = False,
) -> None:
    """Simulate a data set for training.

    Interrupted, it goes on where it was when it is started again in the same way.
    """
    from creepkit.dataset.generation import resolve_design
    from creepkit.reports.surrogate import print_dataset

    chosen = ParallelExecution(**execution)
    changes: dict[str, Any] = {"domain": domain, **(conditions or {})}
    if interval is not None:
        changes["every"] = interval
    piece = ck.specimen(specimen)
    design = resolve_design(law, piece, **changes)
    with ProgressBar() as progress:
        data = ck.generate(
            design, piece, samples, draws=draws, seed=seed, to=to, execution=chosen, progress=progress.tick
        )
    part = None if chosen.part is None else f"{chosen.part[0]}/{chosen.part[1]}"
    print_dataset(data, to, part, as_json)


def train(
    data: DataSet,
    *,
    to: Annotated[
        Path, typer.Option(help="File of the surrogate; a checkpoint lies beside it meanwhile."), OutputPath("resumed")
    ],
    network: Annotated[dict[str, Any], ParameterGru],
    training: Annotated[dict[str, Any], Training],
    seed: Seed = 0,
    device: Device = "auto",
    plots: Annotated[
        Path | None, typer.Option(help="Folder for pictures; by default beside the file."), OutputPath("folder")
    ] = None,
    as_json: Json = False,
) -> None:
    """Train the paper's network on a data set.

    Interrupted at any moment, the same command goes on where it was. Curves of the training, and predicted against
    true outputs are drawn.
    """
    from creepkit.dataset.storage import read_dataset
    from creepkit.reports.surrogate import write_surrogate_figures

    recipe, samples = _recipe(network, training), read_dataset(data, accepted_only=True)
    with ProgressBar() as progress:
        model = ck.train(samples, recipe, to=to, seed=seed, device=device, progress=progress.tick)
    plot_files = write_surrogate_figures(model, samples, plots or to.parent, to.stem)
    if as_json:
        print_json({"file": str(to), "metrics": model.metadata.metrics, "pictures": [str(path) for path in plot_files]})
        return
    tell(f"{model}\n")
    for path in (to, *plot_files):
        tell_written(path)


def sweep(
    data: DataSet,
    *,
    to: Annotated[
        Path,
        typer.Option(help="Folder; a file for each training, those that are there are not redone."),
        OutputPath("folder"),
    ],
    sizes: Annotated[dict[str, Any], NetworkSizes],
    network: Annotated[dict[str, Any], ParameterGru, ("target",)],
    training: Annotated[
        dict[str, Any], Training, ("epochs", "batch", "rate", "schedule", "patience", "early_stop", "clip")
    ],
    seed: Seed = 0,
    device: Device = "auto",
    as_json: Json = False,
) -> None:
    """Train networks of several sizes, by default 1, 2 and 3 layers of 64 and 128 units, for 100 epochs.

    Interrupted at any moment, the same command goes on where it was.
    """
    from creepkit.dataset.storage import read_dataset
    from creepkit.reports.surrogate import size_study_rows
    from creepkit.surrogates.training import size_study, size_study_to_json

    recipe = _recipe(network, {"epochs": 100, **training})
    asked = NetworkSizes(**{"layers": (1, 2, 3), "hidden": (64, 128), **sizes})
    with ProgressBar() as progress:
        trainings = size_study_to_json(size_study(
            read_dataset(data, accepted_only=True), recipe, asked, to=to, seed=seed, device=device,
            progress=progress.tick,
        ))  # fmt: skip
    if as_json:
        print_json({"trainings": trainings})
    else:
        print_table("", *size_study_rows(trainings))


def reduce(
    *,
    specimen: Annotated[str, Option(help="A specimen in finite elements.")] = PAPER_SPECIMEN,
    geometry: Annotated[
        dict[str, float] | None, Option(help="A length of the test piece, mm.", example="apex_thickness=0.45")
    ] = None,
) -> None:
    """Train the reduced-order model of a test piece, and say how far it errs.

    Searches begin in it. It is kept in the cache folder, so that the first identification of such a test piece finds
    it there; some seconds.
    """
    from creepkit.records import outputs_of

    predictor = _trainable_model(ck.specimen(specimen), geometry or {})
    tell(predictor.train())
    units = {str(output): output.unit for output in outputs_of(predictor)}
    errors = ", ".join(f"{name} {value:.2g} {units.get(name, '')}".rstrip() for name, value in predictor.error.items())
    tell(f"error against its finite elements, one standard deviation over runs it was not trained on: {errors}")


COMMANDS = {"generate": generate, "train": train, "sweep": sweep, "reduce": reduce}


def _recipe(network: dict[str, Any], training: dict[str, Any]) -> ParameterGru:
    """The recipe with what was given of its fields."""
    recipe = ParameterGru()
    return replace(recipe, **network, training=recipe.training.changed(training))


def _trainable_model(specimen: Any, lengths: dict[str, float]) -> Predictor:
    """The reduced-order model of a specimen with other lengths; SolveError where it has none that is trained."""
    from creepkit.records import known_specimens

    predictor: Predictor | None = (specimen.replace(**lengths) if lengths else specimen).reduced_order_model()
    if predictor is None or not predictor.is_trained:
        models = {name: one.reduced_order_model() for name, one in known_specimens().items()}
        others = [name for name, model in models.items() if model is not None and model.is_trained]
        raise SolveError(
            f"--specimen {specimen.name}: it has no reduced-order model that is trained; "
            f"name one of those that have one: {', '.join(others)}"
        )
    return predictor
