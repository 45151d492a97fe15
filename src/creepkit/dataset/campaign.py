"""A campaign: shard after shard of a design is simulated until there are samples enough, then all become one file.

Shards are taken from the first on without gaps, so that what the file holds does not depend on how many worked on it.
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

from creepkit.dataset import shards, store
from creepkit.dataset.ledger import Ledger
from creepkit.dataset.merging import AGAIN, is_enough, merge
from creepkit.dataset.pace import Pace, Progress
from creepkit.dataset.shards import Answer, Campaign
from creepkit.dataset.workers import ProcessWorkers, Workers
from creepkit.errors import DatasetError

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.dataset.design import Design
    from creepkit.records import Specimen

_log = logging.getLogger("creepkit.dataset")

PATIENCE = 20
"""Deaths of workers at one shard, after which something else than a sample must be wrong."""


def generate(
    design: Design,
    specimen: Specimen,
    *,
    samples: int | None = None,
    seed: int,
    to: str | Path,
    workers: int | None = None,
    cluster: str | None = None,
    draws: int | None = None,
    part: tuple[int, int] | None = None,
    progress: Progress | None = None,
    rows: int = shards.ROWS,
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
    campaign = Campaign(design, specimen, _whole("seed", seed), path.with_name(f"{path.name}.parts"), rows)
    ledger = Ledger(campaign, samples, draws, part)
    if part is None and is_enough(campaign, ledger, path):
        return store.read(path)
    campaign.open_folder()
    ledger.look()
    with _crew(campaign, workers, cluster) as crew:
        fill(ledger, crew, progress)
    if part is not None:
        return shards.together(campaign, sorted(ledger.done))
    merge(campaign, ledger, path, progress)
    return store.read(path)


def _whole(what: str, number: object) -> int:
    """A number from zero on, which must be whole: 1.5 does not become 1."""
    if not isinstance(number, int | np.integer) or isinstance(number, bool) or number < 0:
        raise DatasetError(f"{what} is {number!r}; allowed are whole numbers from zero on")
    return int(number)


def fill(ledger: Ledger, crew: Workers, progress: Progress | None) -> None:
    """Have shards simulated until there are enough; DatasetError when one cannot be."""
    pace = Pace(ledger, progress)
    taken: dict[int, float] = {}
    deaths: Counter[int] = Counter()
    while ledger.leading() is None:
        for number in [n for n, since in taken.items() if time.monotonic() - since > AGAIN][: crew.free]:
            del taken[number]
            crew.submit(number)
        while crew.free and (following := ledger.following()) is not None:
            ledger.at_work.add(following)
            crew.submit(following)
        for answer in crew.answers(AGAIN):
            _enter(answer, ledger, taken)
            if answer.kind == "died":
                _again(answer, deaths, crew)
        pace.tell()


def _enter(answer: Answer, ledger: Ledger, taken: dict[int, float]) -> None:
    """Enter what became of a shard; DatasetError when it cannot be done."""
    if answer.kind == "done":
        ledger.note(answer.number, answer.accepted)
    elif answer.kind == "taken":
        taken[answer.number] = time.monotonic()
    elif answer.kind == "error":
        raise DatasetError(answer.text)


def _again(answer: Answer, deaths: Counter[int], crew: Workers) -> None:
    """Have a shard done again whose worker died."""
    deaths[answer.number] += 1
    if deaths[answer.number] > PATIENCE:
        raise DatasetError(
            f"shard {answer.number}: its worker process died {PATIENCE} times, the last time by {answer.text}; "
            "is there memory enough for so many workers?"
        )
    _log.warning("a worker process died (%s); its shard %d is simulated again", answer.text, answer.number)
    crew.submit(answer.number)


def _crew(campaign: Campaign, workers: int | None, cluster: str | None) -> AbstractContextManager[Workers]:
    """Who simulates: processes here, or a cluster."""
    if cluster is not None:
        from creepkit.dataset.cluster import ClusterWorkers

        return ClusterWorkers(campaign, cluster, workers)
    if workers is not None and workers < 1:
        raise DatasetError(f"workers is {workers}; allowed are whole numbers above zero, or None for one on each core")
    return ProcessWorkers(campaign, workers or len(os.sched_getaffinity(0)))
