"""Data sets: simulated by the thousand, read back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.errors import DatasetError
from creepkit.study.nouns import resolve_law, specimen

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.dataset.design import SamplingDesign
    from creepkit.dataset.pace import ProgressCallback
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen


def generate(
    source: SamplingDesign | CreepLaw | str,
    using: Specimen | str,
    samples: int | None = None,
    *,
    seed: int,
    to: str | Path,
    domain: str | None = None,
    draws: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    part: tuple[int, int] | None = None,
    progress: ProgressCallback | None = None,
    **changes: Any,
) -> Dataset:
    """Simulate samples until so many are accepted, write them to an HDF5 file, and return them.

    source : a law or its name, whose samples are drawn from a `box` ("conditioned", where most creep visibly, or
        "paper"; `changes` of it as in P1=(5, 20), every=900), or a design such as rate_family().
    samples : accepted ones wanted; whole shards of 256 draws are made, so that there are some more. Or draws : how many
        are simulated or rejected, whatever becomes of them.
    to : the file; its shards lie in a folder beside it. A call that was interrupted is made again to go on.
    workers : processes, by default one for each core. cluster : address of a dask scheduler, tcp://host:port.
    part : (k, n) simulates every n-th shard only, from the k-th on, for arrays of jobs; a call without it merges.
    progress : called as progress(task, done, total, note).
    """
    from creepkit.dataset.campaign import generate as run

    specimen_record = specimen(using) if isinstance(using, str) else using
    design = resolve_design(source, specimen_record, domain, changes)
    return run(
        design, specimen_record, samples=samples, seed=seed, to=to, workers=workers, cluster=cluster, draws=draws, part=part,
        progress=progress,
    )  # fmt: skip


def resolve_design(
    source: SamplingDesign | CreepLaw | str, specimen: Specimen, domain: str | None = None, changes: dict[str, Any] | None = None
) -> SamplingDesign:
    """The design itself, or the one for a law in a box."""
    from creepkit.dataset.design import SamplingDesign, sampling_design

    if not isinstance(source, SamplingDesign):
        return sampling_design(resolve_law(source), specimen, domain or "conditioned", **changes or {})
    if domain is not None or changes:
        argument = "box" if domain is not None else next(iter(changes or {}))
        raise DatasetError(f"{argument}= belongs to a law; a design such as {source.name} has its own, change it there")
    return source


def rate_family(using: Specimen | str | None = None, **changes: Any) -> SamplingDesign:
    """Return the design of diverse rate functions, not of one law, from which a surrogate learns to serve any law.

    using : the specimen, by default the paper's dimple. changes : ranges of conditions, P1=(5, 20); grid=TimeGrid(...).
    """
    from creepkit.dataset.rate_family import rate_family as run

    return run(specimen(using) if isinstance(using, str) else using, **changes)


def read_dataset(path: str | Path, *, accepted_only: bool = False) -> Dataset:
    """Return the data set of an HDF5 file that `generate` wrote.

    accepted_only : leave rejected and failed samples in the file, which spares their memory.
    """
    from creepkit.dataset.store import read_dataset

    return read_dataset(path, accepted_only=accepted_only)
