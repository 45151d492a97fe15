"""`creepkit train`: a data set becomes a surrogate, with a table of its errors and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.interrupts import kept_when_interrupted
from creepkit.reports.terminal import ProgressBar, print_json, tell, tell_written

if TYPE_CHECKING:
    from creepkit.surrogates.parameter_gru import ParameterGru


@kept_when_interrupted("the last checkpoint is kept, and the same command goes on from there")
def command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Data set that creepkit generate wrote.")],
    to: Annotated[
        Path, typer.Option(help="File of the surrogate; a checkpoint lies beside it meanwhile."), OutputPath("resumed")
    ],
    hidden: Annotated[int | None, typer.Option(help="Width of a layer."), limits.HIDDEN] = None,
    layers: Annotated[int | None, typer.Option(help="Layers."), limits.LAYERS] = None,
    cell: Annotated[str | None, typer.Option(help="gru or lstm.")] = None,
    inputs: Annotated[
        str | None, typer.Option(help="Seen at each frame: load,mean_load,time,step; by default what the grid needs.")
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="value, or log, of the first output, or as its record says.")
    ] = None,
    base: Annotated[str | None, typer.Option(help="none; or correct a model: reduced-order, reference-stress.")] = None,
    epochs: Annotated[int | None, typer.Option(help="Passes over the training rows."), limits.EPOCHS] = None,
    batch: Annotated[int | None, typer.Option(help="Histories in a step."), limits.BATCH] = None,
    rate: Annotated[float | None, typer.Option(help="Rate of Adam at the beginning."), limits.LEARNING_RATE] = None,
    schedule: Annotated[str | None, typer.Option(help="Of the rate: plateau, cosine or constant.")] = None,
    early_stop: Annotated[
        int | None, typer.Option(help="Stop after so many epochs without gain."), limits.EPOCHS
    ] = None,
    clip: Annotated[float | None, typer.Option(help="Largest norm of the gradient."), limits.LARGEST_GRADIENT] = None,
    seed: Annotated[int, typer.Option(help="Of the split, the first weights and the order of rows."), limits.SEED] = 0,
    device: Annotated[str, typer.Option(help="auto (a GPU where there is one), cpu or cuda.")] = "auto",
    threads: Annotated[
        int | None, typer.Option(help="Of torch; one is quickest on a busy machine."), limits.THREADS
    ] = None,
    plots: Annotated[
        Path | None, typer.Option(help="Folder for pictures; by default beside the file."), OutputPath("folder")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the errors as JSON.")] = False,
) -> None:
    """Train the paper's network on a data set.

    Interrupted at any moment, the same command goes on where it was. Curves of the training, predicted against true
    outputs, and the worst samples are drawn.
    """
    import torch

    import creepkit as ck
    from creepkit.dataset.storage import read_dataset
    from creepkit.reports.surrogate import write_surrogate_figures

    if threads is not None:
        torch.set_num_threads(threads)
    network_options = {
        "hidden": hidden,
        "layers": layers,
        "cell": cell,
        "target": target,
        "base": base,
        "inputs": None if inputs is None else tuple(inputs.split(",")),
    }
    training_options = {
        "epochs": epochs,
        "batch": batch,
        "rate": rate,
        "schedule": schedule,
        "early_stop": early_stop,
        "clip": clip,
    }
    selected_recipe, samples = (recipe_with(network_options, training_options), read_dataset(data, accepted_only=True))
    with ProgressBar() as progress:
        model = ck.train(samples, selected_recipe, to=to, seed=seed, device=device, progress=progress.tick)
    plot_files = write_surrogate_figures(model, samples, plots or to.parent, to.stem)
    if as_json:
        print_json({"file": str(to), "metrics": model.metadata.metrics, "pictures": [str(path) for path in plot_files]})
        return
    tell(f"{model}\n")
    for path in (to, *plot_files):
        tell_written(path)


def recipe_with(network_options: dict[str, Any], training_options: dict[str, Any]) -> ParameterGru:
    """The recipe with what was given of its fields; None stands for what was not."""
    from dataclasses import replace

    import creepkit as ck

    recipe = ck.ParameterGru()
    training = {name: value for name, value in training_options.items() if value is not None}
    network = {name: value for name, value in network_options.items() if value is not None}
    return replace(recipe, **network, training=replace(recipe.training, **training))
