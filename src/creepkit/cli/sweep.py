"""`creepkit sweep`: networks of several sizes on the same data, as a table and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.generated_options import parsed_integer
from creepkit.cli.interrupts import kept_when_interrupted
from creepkit.reports.terminal import ProgressBar, print_json, print_table, tell_written


@kept_when_interrupted("what is trained and the last checkpoint are kept, and the same command goes on from there")
def command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Data set that creepkit generate wrote.")],
    to: Annotated[
        Path,
        typer.Option(help="Folder; a file for each training, those that are there are not redone."),
        OutputPath("folder", ("sweep.png",)),
    ],
    layers: Annotated[str, typer.Option(help="Numbers of layers, such as 1,2,3.")] = "1,2,3",
    hidden: Annotated[str, typer.Option(help="Widths, such as 64,128.")] = "64,128",
    cell: Annotated[str, typer.Option(help="gru, lstm or both: gru,lstm.")] = "gru",
    samples: Annotated[
        str | None, typer.Option(help="Numbers to learn from, such as 1000,2000; all by default.")
    ] = None,
    target: Annotated[str, typer.Option(help="value or log; see creepkit train.")] = "value",
    epochs: Annotated[int, typer.Option(help="Passes over the training rows."), limits.EPOCHS] = 100,
    rate: Annotated[float, typer.Option(help="Rate of Adam at the beginning."), limits.LEARNING_RATE] = 1e-3,
    schedule: Annotated[str, typer.Option(help="Of the rate: plateau, cosine or constant.")] = "plateau",
    seed: Annotated[int, typer.Option(help="Of the split, the first weights and the order of rows."), limits.SEED] = 0,
    device: Annotated[str, typer.Option(help="auto (a GPU where there is one), cpu or cuda.")] = "auto",
    threads: Annotated[
        int | None, typer.Option(help="Of torch; one is quickest on a busy machine."), limits.THREADS
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
) -> None:
    """Train networks of several sizes.

    Interrupted at any moment, the same command goes on where it was.
    """
    import torch

    from creepkit.cli.train import recipe_with
    from creepkit.dataset.storage import read_dataset
    from creepkit.reports.surrogate import size_study_figure, size_study_rows
    from creepkit.surrogates.training import NetworkSizes, size_study

    if threads is not None:
        torch.set_num_threads(threads)
    training_options = {"epochs": epochs, "rate": rate, "schedule": schedule}
    recipe = recipe_with({"target": target}, training_options)
    with ProgressBar() as progress:
        trainings = size_study(
            read_dataset(data, accepted_only=True),
            recipe,
            NetworkSizes(
                layers=parse_whole_numbers(layers, "--layers"),
                hidden=parse_whole_numbers(hidden, "--hidden"),
                cells=tuple(cell.split(",")),  # type: ignore[arg-type]  # words; ParameterGru says which it knows
                samples=parse_whole_numbers(samples, "--samples") if samples else (),
            ),
            to=to,
            seed=seed,
            device=device,
            progress=progress.tick,
        )
    size_study_figure(trainings, to / "sweep.png")
    if as_json:
        print_json({"trainings": [vars(e) for e in trainings], "picture": str(to / "sweep.png")})
        return
    print_table("", *size_study_rows(trainings))
    tell_written(to / "sweep.png")


def parse_whole_numbers(text: str, option: str) -> tuple[int, ...]:
    """Whole numbers above zero, from text such as 1,2,3."""
    from creepkit.errors import SurrogateError, quoted

    try:
        numbers = tuple(parsed_integer(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or any(number not in limits.SAMPLES for number in numbers):
        raise SurrogateError(
            f"{option} {quoted(text)} is not understood; write {limits.SAMPLES}, with commas between them, such as "
            "1,2,3"
        )
    return numbers
