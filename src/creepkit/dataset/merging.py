"""Shards become one file, one after the other, so that a large data set needs no large memory."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.dataset import shards, store
from creepkit.dataset.claims import Claim
from creepkit.dataset.joining import first_difference
from creepkit.dataset.specimen_document import specimen_document
from creepkit.errors import DatasetError
from creepkit.language.tree import law_to_json

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.dataset.ledger import Ledger
    from creepkit.dataset.pace import Progress
    from creepkit.dataset.shards import Campaign


AGAIN = 0.5
"""s, after which what another process is at is looked at again."""


def is_enough(campaign: Campaign, ledger: Ledger, path: Path) -> bool:
    """Whether the file is there already and holds what is wanted; DatasetError when it is something else."""
    if not path.exists():
        return False
    if path.is_dir():
        raise DatasetError(f"{path}: is a folder; name a file for the data set")
    with store.opened(path) as file:
        header = store.read_header(file, str(path))
        if header.provenance.get("fingerprint") != campaign.fingerprint:
            where = first_difference(_told(header), _told(campaign.header), "")
            how = f"there and here {where}" if where else "of shards of another size"
            raise DatasetError(f"{path}: holds another data set ({how}); choose another name")
        reasons = file["reasons"][:]
    if ledger.samples is None:
        return len(reasons) >= (ledger.draws or 0)
    return int((reasons == 0).sum()) >= ledger.samples


def merge(campaign: Campaign, ledger: Ledger, path: Path, progress: Progress | None) -> None:
    """Write the shortest leading run of shards that is enough, unless another process does so meanwhile."""
    while True:
        with Claim(campaign.folder / "merging.claim") as claim:
            if claim.held:
                if not is_enough(campaign, ledger, path):
                    store.remove_left(path)
                    _write(campaign, ledger, path, progress)
                    for number in ledger.done:  # of processes that died between writing a shard and saying so
                        campaign.path(number).with_suffix(".claim").unlink(missing_ok=True)
                return
        time.sleep(AGAIN)


def _write(campaign: Campaign, ledger: Ledger, path: Path, progress: Progress | None) -> None:
    numbers, left = ledger.leading() or [], ledger.draws
    with store.replacing(path) as temporary, store.created(temporary) as file:
        store.write_header(file, campaign.header)
        for done, number in enumerate(numbers, start=1):
            samples = shards.read(campaign, number)
            store.append(file, samples if left is None else samples.rows(slice(0, left)))
            left = None if left is None else left - len(samples)
            if progress is not None:
                progress("shards merged", done, len(numbers), "")


def _told(data: Dataset) -> dict[str, Any]:
    """What decides a data set, as far as its file says it."""
    told = {
        "law": law_to_json(data.law),
        "specimen": specimen_document(data.specimen),
        "design": data.design_document,
        "seed": data.provenance.get("seed"),
        "creepkit": data.provenance.get("creepkit"),
    }
    return dict(json.loads(json.dumps(told)))
