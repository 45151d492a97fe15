"""Generation of a data set: shards of a design are simulated until enough samples are accepted, then merged.

Shards are taken in order and without gaps, so that the content of the file does not depend on the number of workers.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.dataset import shards, storage
from creepkit.dataset.shards import GenerationJob, is_complete, merge_shards
from creepkit.errors import DatasetError
from creepkit.jobs.shard_progress import ProgressCallback, ProgressRecord, ProgressReporter
from creepkit.jobs.worker_pools import SHARD_ROWS, ParallelExecution, Workers
from creepkit.jobs.worker_process import TaskResult

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.records import Specimen
    from creepkit.sampling.domains import SamplingDesign


POLL_INTERVAL = 0.5
"""s between reports of the progress, where no shard ends earlier."""


def generate(
    design: SamplingDesign,
    specimen: Specimen,
    *,
    samples: int | None = None,
    draws: int | None = None,
    seed: int,
    to: str | Path,
    execution: ParallelExecution | None = None,
    progress: ProgressCallback | None = None,
) -> Dataset:
    """Simulate samples of a design until enough are accepted, write them to a file, and return them.

    samples : accepted ones wanted, in whole shards, so that there may be some more; or draws : samples simulated or
        rejected, whatever becomes of them.
    to : the HDF5 file; its shards are kept in a folder beside it, and a call that was interrupted goes on from them.
    execution : processes or a cluster, and which part of the shards; by default a process for each core does them all.
    progress : called as progress(task, done, total, note).
    """
    path, execution = Path(to), execution or ParallelExecution()
    if not path.name:
        raise DatasetError(f"'{to}' is no name of a file; name the HDF5 file to write, such as combined.h5")
    folder = path.with_name(f"{path.name}.parts")
    rows = execution.shard_rows or shards.rows_of_folder(folder) or _shard_rows(samples or draws)
    job = GenerationJob(design, specimen, _whole_number("seed", seed), folder, rows)
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
