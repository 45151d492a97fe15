"""Shards become one file, one after the other, so that a large data set needs no large memory."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.dataset import shards, store
from creepkit.dataset.claims import ShardLock
from creepkit.dataset.joining import first_difference
from creepkit.dataset.specimen_document import specimen_to_json
from creepkit.errors import DatasetError
from creepkit.language.tree import law_to_json

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.dataset.ledger import ProgressRecord
    from creepkit.dataset.pace import ProgressCallback
    from creepkit.dataset.shards import Campaign


POLL_INTERVAL = 0.5
"""s, after which what another process is at is looked at again."""


def is_complete(campaign: Campaign, record: ProgressRecord, path: Path) -> bool:
    """Whether the file is there already and holds what is wanted; DatasetError when it is something else."""
    if not path.exists():
        return False
    if path.is_dir():
        raise DatasetError(f"{path}: is a folder; name a file for the data set")
    with store.open_hdf5(path) as file:
        header = store.read_header(file, str(path))
        if header.provenance.get("fingerprint") != campaign.fingerprint:
            difference = first_difference(_identity(header), _identity(campaign.header), "")
            description = f"there and here {difference}" if difference else "of shards of another size"
            raise DatasetError(f"{path}: holds another data set ({description}); choose another name")
        reasons = file["reasons"][:]
    if record.samples is None:
        return len(reasons) >= (record.draws or 0)
    return int((reasons == 0).sum()) >= record.samples


def merge_shards(campaign: Campaign, record: ProgressRecord, path: Path, progress: ProgressCallback | None) -> None:
    """Write the shortest leading run of shards that is enough, unless another process does so meanwhile."""
    while True:
        with ShardLock(campaign.folder / "merging.claim") as lock:
            if lock.held:
                if not is_complete(campaign, record, path):
                    store.remove_temporary_files(path)
                    _write_merged(campaign, record, path, progress)
                    for number in record.done:  # of processes that died between writing a shard and saying so
                        campaign.path(number).with_suffix(".claim").unlink(missing_ok=True)
                return
        time.sleep(POLL_INTERVAL)


def _write_merged(campaign: Campaign, record: ProgressRecord, path: Path, progress: ProgressCallback | None) -> None:
    numbers, remaining = record.leading_run() or [], record.draws
    with store.replace_on_success(path) as temporary, store.create_hdf5(temporary) as file:
        store.write_header(file, campaign.header)
        for done, number in enumerate(numbers, start=1):
            samples = shards.read_shard(campaign, number)
            store.append_samples(file, samples if remaining is None else samples.rows(slice(0, remaining)))
            remaining = None if remaining is None else remaining - len(samples)
            if progress is not None:
                progress("shards merged", done, len(numbers), "")


def _identity(data: Dataset) -> dict[str, Any]:
    """What decides a data set, as far as its file says it."""
    document = {
        "law": law_to_json(data.law),
        "specimen": specimen_to_json(data.specimen),
        "design": data.design_document,
        "seed": data.provenance.get("seed"),
        "creepkit": data.provenance.get("creepkit"),
    }
    return dict(json.loads(json.dumps(document)))
