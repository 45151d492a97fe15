"""`creepkit generate`: a data set of simulated tests, made on all cores, on a cluster, or by an array of jobs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.generated_options import parsed_number
from creepkit.cli.interrupts import kept_when_interrupted
from creepkit.cli.options import PAPER_SPECIMEN
from creepkit.reports.terminal import ProgressBar

if TYPE_CHECKING:
    from creepkit.records import Specimen
    from creepkit.sampling.domains import SamplingDesign


@kept_when_interrupted("shards that are finished are kept, and the same command goes on with the others")
def command(
    law: Annotated[str, typer.Argument(metavar="LAW", help="Name of a law.")],
    to: Annotated[
        Path | None, typer.Option(help="HDF5 file to write; its shards lie in FILE.parts."), OutputPath("resumed")
    ] = None,
    samples: Annotated[int | None, typer.Option(help="Accepted samples wanted."), limits.SAMPLES] = None,
    draws: Annotated[int | None, typer.Option(help="Or draws, whatever becomes of them."), limits.SAMPLES] = None,
    specimen: Annotated[str, typer.Option(help="Any specimen that says how its tests are loaded.")] = PAPER_SPECIMEN,
    domain: Annotated[
        str | None, typer.Option(help="conditioned (the default; most samples creep visibly) or paper.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the Sobol sequence."), limits.SEED] = 0,
    interval: Annotated[
        float | None, typer.Option(help="s from frame to frame; 150 by default."), limits.SECONDS
    ] = None,
    end_h: Annotated[float | None, typer.Option(help="End of the tests, h; 12 by default."), limits.HOURS] = None,
    ranges: Annotated[
        list[str] | None,
        typer.Option(
            "--range",
            metavar="NAME=LOW:HIGH",
            help="Of a condition, in its unit (MPa, s, mm, K, N): P1=5:20, force_1=10:50, modulus=150e3, "
            "temperature=1000:1100 ...; once for each.",
        ),
    ] = None,
    unscreened: Annotated[
        bool,
        typer.Option(
            "--unscreened", help="Simulate what bursts far too early by the reduced-order model, too (paper)."
        ),
    ] = False,
    workers: Annotated[
        int | None, typer.Option(help="Processes; one for each core by default."), limits.WORKERS
    ] = None,
    cluster: Annotated[str | None, typer.Option(metavar="URL", help="A dask scheduler, tcp://host:port.")] = None,
    part: Annotated[
        str | None, typer.Option(metavar="K/N", help="Simulate every N-th shard only, from the K-th on; do not merge.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be drawn; simulate nothing.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Simulate a data set for training.

    Interrupted, it goes on where it was when it is started again in the same way.
    """
    import creepkit as ck
    from creepkit.errors import DatasetError

    specimen_record = ck.specimen(specimen)
    design = select_design(
        law, specimen_record, domain, design_changes(ranges or [], end_h, domain, unscreened), interval
    )
    execution = ck.ParallelExecution(workers, cluster, parse_part(part))
    if dry_run:
        from creepkit.reports.sampling import print_acceptance

        print_acceptance(design, seed, to, as_json)
        return
    if to is None:
        raise DatasetError("--to FILE is missing: name the HDF5 file to write, such as --to combined.h5")
    with ProgressBar() as progress:
        data = ck.generate(
            design, specimen_record, samples, draws=draws, seed=seed, to=to, execution=execution, progress=progress.tick
        )
    from creepkit.reports.dataset import print_dataset

    print_dataset(data, to, part, as_json)


def design_changes(ranges: list[str], end_h: float | None, domain: str | None, unscreened: bool) -> dict[str, Any]:
    """Changes of a design that the options state."""
    from creepkit.errors import DatasetError

    changes: dict[str, Any] = dict(parse_range(text) for text in ranges)
    if len(changes) < len(ranges):
        raise DatasetError(f"--range {' '.join(ranges)}: a condition is given twice; keep one of them")
    if end_h is not None:
        if "end_time" in changes:
            raise DatasetError("--end-h and --range end_time both say when tests end; leave one of them out")
        changes["end_time"] = 3600.0 * end_h
    if unscreened:
        if domain != "paper":
            raise DatasetError("--unscreened belongs to --domain paper; nothing else leaves samples out")
        changes["screened"] = False
    return changes


def parse_range(text: str) -> tuple[str, tuple[float, float]]:
    """(condition, (low, high)) from NAME=LOW:HIGH, or from NAME=NUMBER."""
    from creepkit.errors import DatasetError

    name, _, limits = text.partition("=")
    try:
        low, high = (parsed_number(end) for end in (limits if ":" in limits else f"{limits}:{limits}").split(":"))
    except ValueError:
        raise DatasetError(f"--range {text}: write NAME=LOW:HIGH or NAME=NUMBER, such as P1=5:20") from None
    return name.strip(), (low, high)


def select_design(
    law: str, specimen: Specimen, domain: str | None, changes: dict[str, Any], interval: float | None
) -> SamplingDesign:
    """The design that these options name; interval : s between frames."""
    from creepkit.dataset.generation import resolve_design

    given = {name: value for name, value in (("domain", domain), ("every", interval)) if value is not None}
    return resolve_design(law, specimen, **given, **changes)


def parse_part(text: str | None) -> tuple[int, int] | None:
    """K/N as two numbers."""
    from creepkit.errors import DatasetError

    if text is None:
        return None
    k, _, n = text.partition("/")
    if not ((k + n).isascii() and k.isdecimal() and n.isdecimal() and 1 <= int(k) <= int(n)):
        raise DatasetError(f"--part {text} is not K/N with K from 1 to N, such as 3/16")
    return int(k), int(n)
