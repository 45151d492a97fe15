"""Generation of a data set: shards of a design are simulated until enough samples are accepted, then merged into one file.

Shards are taken in order and without gaps, so that the content of the file does not depend on the number of workers.
"""

from __future__ import annotations

import logging
import os
import time
from collections import Counter
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.dataset import shards, storage
from creepkit.dataset.shards import POLL_INTERVAL, Campaign, is_complete, merge_shards
from creepkit.errors import DatasetError
from creepkit.jobs.shard_progress import ProgressCallback, ProgressRecord, ProgressReporter
from creepkit.jobs.worker import TaskResult
from creepkit.jobs.workers import ProcessWorkers, Workers

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
    seed: int,
    to: str | Path,
    workers: int | None = None,
    cluster: str | None = None,
    draws: int | None = None,
    part: tuple[int, int] | None = None,
    progress: ProgressCallback | None = None,
    rows: int = shards.SHARD_ROWS,
) -> Dataset:
    """Simulate samples of a design until enough are accepted, write them to a file, and return them.

    samples : accepted ones wanted, in whole shards, so that there may be some more; or draws : samples simulated or
        rejected, whatever becomes of them.
    to : the HDF5 file; its shards are kept in a folder beside it, and a call that was interrupted goes on from them.
    workers : processes, by default one for each core; or cluster : address of a dask scheduler, tcp://host:port.
    part : (k, n) simulates only every n-th shard, from the k-th on, and leaves merging to a call without it.
    progress : called as progress(task, done, total, note). rows : of a shard.
    """
    path = Path(to)
    if not path.name:
        raise DatasetError(f"'{to}' is no name of a file; name the HDF5 file to write, such as combined.h5")
    campaign = Campaign(design, specimen, _whole_number("seed", seed), path.with_name(f"{path.name}.parts"), rows)
    record = ProgressRecord(campaign, samples, draws, part)
    if part is None and is_complete(campaign, record, path):
        return storage.read_dataset(path)
    campaign.open_folder()
    record.scan_finished()
    with _start_workers(campaign, workers, cluster) as pool:
        run_until_enough(record, pool, progress)
    if part is not None:
        return shards.read_shards(campaign, sorted(record.done))
    merge_shards(campaign, record, path, progress)
    return storage.read_dataset(path)


def _whole_number(name: str, value: object) -> int:
    """A number from zero on, which must be whole: 1.5 does not become 1."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 0:
        raise DatasetError(f"{name} is {value!r}; allowed are whole numbers from zero on")
    return int(value)


def run_until_enough(record: ProgressRecord, pool: Workers, progress: ProgressCallback | None) -> None:
    """Have shards simulated until there are enough; DatasetError when one cannot be."""
    reporter = ProgressReporter(record, progress)
    locked_elsewhere: dict[int, float] = {}
    deaths: Counter[int] = Counter()
    while record.leading_run() is None:
        for number in [n for n, since in locked_elsewhere.items() if time.monotonic() - since > POLL_INTERVAL][
            : pool.free_slots
        ]:
            del locked_elsewhere[number]
            pool.submit(number)
        while pool.free_slots and (shard := record.next_shard()) is not None:
            record.running.add(shard)
            pool.submit(shard)
        for result in pool.results(POLL_INTERVAL):
            _record_result(result, record, locked_elsewhere)
            if result.status == "died":
                _resubmit(result, deaths, pool)
        reporter.report()


def _record_result(result: TaskResult, record: ProgressRecord, locked_elsewhere: dict[int, float]) -> None:
    """Enter what became of a shard; DatasetError when it cannot be done."""
    if result.status == "done":
        record.mark_done(result.number, result.accepted)
    elif result.status == "taken":
        locked_elsewhere[result.number] = time.monotonic()
    elif result.status == "error":
        raise DatasetError(result.text)


def _resubmit(result: TaskResult, deaths: Counter[int], pool: Workers) -> None:
    """Have a shard done again whose worker died."""
    deaths[result.number] += 1
    if deaths[result.number] > MOST_WORKER_DEATHS:
        raise DatasetError(
            f"shard {result.number}: its worker process died {MOST_WORKER_DEATHS} times, the last time by {result.text}; "
            "is there memory enough for so many workers?"
        )
    _log.warning("a worker process died (%s); its shard %d is simulated again", result.text, result.number)
    pool.submit(result.number)


def _start_workers(campaign: Campaign, workers: int | None, cluster: str | None) -> AbstractContextManager[Workers]:
    """Who simulates: processes here, or a cluster."""
    if cluster is not None:
        from creepkit.jobs.workers import ClusterWorkers

        return ClusterWorkers(campaign, cluster, workers)
    if workers is not None and workers < 1:
        raise DatasetError(f"workers is {workers}; allowed are whole numbers above zero, or None for one on each core")
    return ProcessWorkers(campaign, workers or len(os.sched_getaffinity(0)))
