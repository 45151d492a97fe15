"""Generation of a data set: shards of a design are simulated until enough samples are accepted, then merged.

Shards are taken in order and without gaps, so that the content of the file does not depend on the number of workers.
"""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.dataset import shards, storage
from creepkit.dataset.shards import POLL_INTERVAL, GenerationJob, Waiting, is_complete, merge_shards
from creepkit.errors import DatasetError
from creepkit.jobs.shard_progress import ProgressCallback, ProgressRecord, ProgressReporter
from creepkit.jobs.worker_pools import SHARD_ROWS, ParallelExecution, WorkerDeaths, Workers
from creepkit.jobs.worker_process import TaskResult

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.records import Specimen
    from creepkit.sampling.domains import SamplingDesign


_log = logging.getLogger("creepkit.dataset")


MOST_WORKER_DEATHS = 20
"""Deaths of workers at one shard, after which something else than a sample must be wrong."""


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
    locked_elsewhere: dict[int, float] = {}
    deaths, waiting = WorkerDeaths(MOST_WORKER_DEATHS), Waiting()
    while record.leading_run() is None:
        due = [number for number, since in locked_elsewhere.items() if time.monotonic() - since > POLL_INTERVAL]
        for number in due[: workers.free_slots]:
            del locked_elsewhere[number]
            workers.submit(number)
        while workers.free_slots and (shard := record.next_shard()) is not None:
            record.running.add(shard)
            workers.submit(shard)
        for result in workers.results(POLL_INTERVAL):
            if result.status == "taken":
                locked_elsewhere[result.number] = time.monotonic()
            elif result.status == "died":
                _resubmit(result, record, deaths, workers)
            else:
                _record_result(result, record)
        only_waiting = record.running == locked_elsewhere.keys()
        waiting.note([record.job.lock_path(number) for number in locked_elsewhere] if only_waiting else [])
        reporter.report()


def _record_result(result: TaskResult, record: ProgressRecord) -> None:
    """Enter a shard that is done; DatasetError for one that cannot be."""
    if result.status == "error":
        raise DatasetError(result.text)
    record.mark_done(result.number, result.accepted)


def _resubmit(result: TaskResult, record: ProgressRecord, deaths: WorkerDeaths, workers: Workers) -> None:
    """Have a shard done again whose worker died."""
    if not deaths.may_retry(result):
        raise DatasetError(f"shard {result.number}: {deaths.description(result)}")
    record.job.count_death(result.number)
    _log.warning("a worker process died (%s); its shard %d is simulated again", result.text, result.number)
    workers.submit(result.number)
