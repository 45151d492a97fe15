"""Generation of a data set: shards of a design are simulated until enough samples are accepted, then merged.

Shards are taken in order and without gaps, so that the content of the file does not depend on the number of workers.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.dataset import shards, storage
from creepkit.dataset.dataset import Dataset
from creepkit.dataset.shards import GenerationJob, is_complete, merge_shards
from creepkit.errors import DatasetError
from creepkit.jobs.shard_progress import ProgressCallback, ProgressRecord, ProgressReporter
from creepkit.jobs.worker_pools import SHARD_ROWS, ParallelExecution, Workers
from creepkit.jobs.worker_process import TaskResult
from creepkit.language import CreepLaw
from creepkit.records import Specimen
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictor
from creepkit.sampling.domains import SamplingDomain, sampling_design

POLL_INTERVAL = 0.5
"""s between reports of the progress, where no shard ends earlier."""


@checked
def generate(
    source: SamplingDomain | CreepLaw | str,
    using: Specimen | str,
    samples: int | None = None,
    *,
    seed: int,
    to: str | Path,
    draws: int | None = None,
    execution: ParallelExecution | None = None,
    progress: ProgressCallback | None = None,
    **design: Any,
) -> Dataset:
    """Simulate samples until so many are accepted, write them to an HDF5 file, and return them.

    source : a law or its name, or a design. Samples of a law are drawn from a sampling domain,
        domain="conditioned" (the default, where most creep visibly) or "paper"; `design` says this and what else is
        to differ from it: ranges of conditions in MPa, s, mm and K, as in P1=(5, 20), and the s between frames, as in
        every=900.
    samples : accepted ones wanted; whole shards are made, of 256 draws or as many as are wanted where these are fewer,
        so that there may be some more. Or draws : how many are simulated or rejected, whatever becomes of them.
    to : the file; its shards lie in a folder beside it. A call that was interrupted is made again to go on.
    execution : processes or a cluster, and the part of the shards to do; by default one process for each core.
    progress : called as progress(task, done, total, note).
    """
    specimen: Any = resolve_predictor(using)
    design_of_samples = resolve_design(source, specimen, **design)
    path, execution = Path(to), execution or ParallelExecution()
    if not path.name:
        raise DatasetError(f"'{to}' is no name of a file; name the HDF5 file to write, such as combined.h5")
    folder = path.with_name(f"{path.name}.parts")
    rows = execution.shard_rows or shards.rows_of_folder(folder) or _shard_rows(samples or draws)
    job = GenerationJob(design_of_samples, specimen, _whole_number("seed", seed), folder, rows)
    record = ProgressRecord(job, samples, draws, execution.part)
    if execution.part is None and is_complete(job, record, path):
        return storage.read_dataset(path)
    job.open_folder()
    with shards.generating_alone(folder, execution.part):
        record.scan_finished()
        with execution.start(job) as workers:
            run_until_enough(record, workers, progress)
        if execution.part is not None:
            return shards.read_shards(job, sorted(record.done))
        merge_shards(job, record, path, progress)
    return storage.read_dataset(path)


def resolve_design(source: SamplingDomain | CreepLaw | str, specimen: Specimen, **changes: Any) -> SamplingDomain:
    """The design itself, or the one for a law in a sampling domain.

    changes : `domain`, `every`, `grid` and ranges of conditions, as sampling.domains.sampling_design takes them.
    """
    if not isinstance(source, SamplingDomain):
        return sampling_design(resolve_law(source), specimen, **changes)
    if changes:
        argument = next(iter(changes))
        raise DatasetError(f"{argument}= belongs to a law; a design such as {source.name} has its own, change it there")
    return source


def _shard_rows(wanted: object) -> int:
    """Draws of a shard, no more than are wanted; what is no number of them is an error later."""
    return min(SHARD_ROWS, wanted) if isinstance(wanted, int) and wanted > 0 else SHARD_ROWS


def _whole_number(name: str, value: object) -> int:
    """A number from zero on, which must be whole: 1.5 does not become 1."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 0:
        raise DatasetError(f"{name} is {value!r}; allowed are whole numbers from zero on")
    return int(value)


def run_until_enough(record: ProgressRecord, workers: Workers, progress: ProgressCallback | None) -> None:
    """Have shards simulated until there are enough; DatasetError when one cannot be."""
    reporter = ProgressReporter(record, progress)
    running: dict[Future[TaskResult], int] = {}
    while record.leading_run() is None:
        while len(running) < workers.size and (shard := record.next_shard()) is not None:
            record.running.add(shard)
            running[workers.submit(shard)] = shard
        for future in wait(running, POLL_INTERVAL, FIRST_COMPLETED).done:
            number = running.pop(future)
            try:
                result = future.result()
            except DatasetError:
                raise
            except BaseException as error:  # of dask, whose workers died or whose scheduler is gone
                if isinstance(error, KeyboardInterrupt | SystemExit):
                    raise
                text = " ".join(f"{type(error).__name__}: {error}".split())
                raise DatasetError(f"shard {number} could not be simulated: {text}; the same call goes on") from None
            if result.status == "error":
                raise DatasetError(result.text)
            if not record.job.path(number).exists():
                raise DatasetError(
                    f"a worker wrote {record.job.path(number)}, which is not there on this machine; name a file in a "
                    "folder that all machines share"
                )
            record.mark_done(number, result.accepted)
        reporter.report()
