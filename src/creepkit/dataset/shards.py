"""Shards: blocks of rows of a design, each simulated once, kept in its own file, and merged into one data set.

A shard is done when its file exists, belongs to this generation and is complete.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import h5py
import numpy as np

from creepkit import registry
from creepkit.dataset import storage
from creepkit.dataset.dataset import Dataset, first_difference
from creepkit.dataset.simulation import empty_dataset, simulate_rows
from creepkit.dataset.storage import LAYOUT_VERSION
from creepkit.errors import DatasetError
from creepkit.files.hdf5_files import open_hdf5, write_hdf5
from creepkit.files.json_documents import as_read_back, canonical_json, json_text, read_json
from creepkit.files.locking import locked
from creepkit.files.reading import FileKind
from creepkit.files.writing import remove_temporary_files, write_text
from creepkit.jobs.worker_pools import SHARD_ROWS
from creepkit.jobs.worker_process import TaskResult
from creepkit.language.law_codec import law_to_json
from creepkit.registry.specimen_documents import specimen_to_json

if TYPE_CHECKING:
    from creepkit.records import Specimen
    from creepkit.sampling.domains import SamplingDomain


GENERATION_NAME = "generation.json"


GENERATION_FILE = FileKind(
    "the settings of a data set", DatasetError, "it is damaged; remove it if the shards beside it are of this data set"
)


_log = logging.getLogger("creepkit.dataset")


@dataclass(frozen=True)
class GenerationJob:
    """The simulations of a data set, divided into shards that are kept in a folder.

    rows : of a shard. Worker processes are sent this record.
    """

    design: SamplingDomain
    specimen: Specimen
    seed: int
    folder: Path
    rows: int = SHARD_ROWS
    task_name: ClassVar[str] = "shard"

    def on_one_thread(self) -> GenerationJob:
        """The generation with a specimen that simulates on one thread."""
        if getattr(self.specimen, "threads", 1) == 1:
            return self
        return replace(self, specimen=self.specimen.replace(threads=1))  # type: ignore[attr-defined]

    def run(self, number: int) -> TaskResult:
        """Simulate a shard and write its file, unless it is done."""
        accepted = self.accepted_count(number, quiet=True)
        if accepted is None:
            path = self.path(number)
            remove_temporary_files(path)
            samples = simulate_rows(self.design, self.header, self.seed, number * self.rows, self.rows)
            with write_hdf5(path, DatasetError, storage.WRITE_ADVICE, internal=True) as file:
                storage.write_header(file, samples)
                storage.append_samples(file, samples)
                file.attrs.update({"generation": self.fingerprint, "shard": number})
            accepted = int((samples.reasons == 0).sum())
        return TaskResult(number, "done", accepted)

    @cached_property
    def document(self) -> dict[str, Any]:
        """Everything that decides what the shards hold."""
        document = {
            "design": self.design.document(),
            "law": law_to_json(self.design.law),
            "specimen": specimen_to_json(self.specimen),
            "seed": self.seed,
            "rows": self.rows,
            "layout": LAYOUT_VERSION,
            "creepkit": version("creepkit"),
        }
        return dict(as_read_back(document))

    @cached_property
    def fingerprint(self) -> str:
        """Of the document."""
        return hashlib.sha256(canonical_json(self.document)).hexdigest()[:24]

    @cached_property
    def header(self) -> Dataset:
        """The data set, with no samples in it yet."""
        provenance = {
            "creepkit": version("creepkit"),
            "numpy": np.__version__,
            "h5py": h5py.__version__,
            "law": self.design.law.name,
            "law_fingerprint": self.design.law.fingerprint,
            "origin": registry.default_registry().distributions_of(self.design.law),
            "specimen": self.specimen.name,
            "design": self.design.name,
            "seed": self.seed,
            "fingerprint": self.fingerprint,
            "when": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        return empty_dataset(self.design, self.specimen, provenance)

    def path(self, number: int) -> Path:
        """The file of a shard."""
        return self.folder / f"{number:05d}.h5"

    def read(self, number: int) -> Dataset:
        """The samples of a shard; DatasetError when it is not whole, or of another data set."""
        path = self.path(number)
        with open_hdf5(path, storage.DATASET_FILE) as file:
            if file.attrs.get("generation") != self.fingerprint or file.attrs.get("shard") != number:
                raise DatasetError(f"{path}: a shard of another data set")
            return storage.read_samples(file, self.header)

    def accepted_count(self, number: int, *, quiet: bool = False) -> int | None:
        """How many samples of a shard were accepted; None when it has to be simulated, or again, which is logged."""
        if not self.path(number).exists():
            return None
        try:
            return int((self.read(number).reasons == 0).sum())
        except DatasetError as error:
            if not quiet:
                _log.warning("%s; it is simulated again", error)
            return None

    def open_folder(self) -> None:
        """Make the folder, or check that the one that is there belongs to this job."""
        path = self.folder / GENERATION_NAME
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                write_text(json_text(self.document), path, DatasetError, internal=True)
        except OSError as error:
            raise DatasetError(f"{self.folder}: no shards can be written there ({error.strerror})") from None
        existing = read_json(path, GENERATION_FILE)
        if existing != self.document:
            difference = first_difference(existing, self.document, "")
            raise DatasetError(
                f"{self.folder}: holds shards of another data set (there and here {difference}); choose another name, "
                "or remove the folder"
            )


def rows_of_folder(folder: Path) -> int | None:
    """Samples of a shard in a folder that was begun; None where there is none, or none that says so."""
    path = folder / GENERATION_NAME
    document = read_json(path, GENERATION_FILE) if path.is_file() else None
    rows = document.get("rows") if isinstance(document, dict) else None
    return rows if isinstance(rows, int) and rows > 0 else None


@contextmanager
def generating_alone(folder: Path, part: tuple[int, int] | None) -> Iterator[None]:
    """DatasetError where another process of this machine is making the same shards."""
    name = "generating.lock" if part is None else f"generating_{part[0]}_of_{part[1]}.lock"
    with locked(folder / name) as held:
        if not held:
            raise DatasetError(
                f"{folder}: another process is making these shards; wait for it or end it, or divide the work (part)"
            )
        yield
