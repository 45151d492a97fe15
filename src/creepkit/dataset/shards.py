"""Shards: blocks of rows of a design, each simulated once, kept in its own file, and merged into one data set.

A shard is done when its file exists, belongs to this generation and is complete.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterator, Sequence
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
from creepkit.dataset.dataset import COLUMNS, Dataset, concatenate, first_difference
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
    from creepkit.jobs.shard_progress import ProgressCallback, ProgressRecord
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
        """Simulate a shard; see run_shard() below."""
        return run_shard(self, number)

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

    def accepted_count(self, number: int) -> int | None:
        """How many samples of a shard were accepted; None when it has to be simulated, or again, which is logged."""
        return accepted_count(self, number)

    def open_folder(self) -> None:
        """Make the folder, or check that the one that is there belongs to this job."""
        path = self.folder / GENERATION_NAME
        if self.folder.is_symlink():
            raise DatasetError(
                f"{self.folder}: is a link, and shards are kept in a folder of their own; remove the link"
            )
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


def run_shard(job: GenerationJob, number: int) -> TaskResult:
    """Simulate a shard and write its file, unless it is done."""
    accepted = accepted_count(job, number, quiet=True)
    if accepted is None:
        remove_temporary_files(job.path(number))
        samples = simulate_rows(job.design, job.header, job.seed, number * job.rows, job.rows)
        write_shard(job, number, samples)
        accepted = int((samples.reasons == 0).sum())
    return TaskResult(number, "done", accepted)


def write_shard(job: GenerationJob, number: int, samples: Dataset) -> None:
    """Write the file of a shard."""
    with write_hdf5(job.path(number), DatasetError, storage.WRITE_ADVICE, internal=True) as file:
        storage.write_header(file, samples)
        storage.append_samples(file, samples)
        file.attrs.update({"generation": job.fingerprint, "shard": number, "checksum": sample_checksum(samples)})


def sample_checksum(samples: Dataset) -> str:
    """SHA-256 of all that a data set holds of its samples."""
    digest = hashlib.sha256(repr(sorted(samples.failures.items())).encode())
    for name, column in COLUMNS.items():
        digest.update(np.ascontiguousarray(getattr(samples, name), dtype=column.file_type).tobytes())
    return digest.hexdigest()


def read_shard(job: GenerationJob, number: int) -> Dataset:
    """The samples of a shard; DatasetError when it is not whole, or of another data set."""
    path = job.path(number)
    with open_hdf5(path, storage.DATASET_FILE) as file:
        if file.attrs.get("generation") != job.fingerprint or file.attrs.get("shard") != number:
            raise DatasetError(f"{path}: a shard of another data set")
        samples = storage.read_samples(file, job.header)
        expected = file.attrs["checksum"]
    if sample_checksum(samples) != expected:
        raise DatasetError(f"{path}: damaged, its checksum is not that of what it holds")
    return samples


def accepted_count(job: GenerationJob, number: int, *, quiet: bool = False) -> int | None:
    """How many samples of a shard were accepted; None when it has to be simulated, or again, which is logged."""
    path = job.path(number)
    if not path.exists():
        return None
    try:
        return int((read_shard(job, number).reasons == 0).sum())
    except DatasetError as error:
        if not quiet:
            _log.warning("%s; it is simulated again", error)
        return None


def read_shards(job: GenerationJob, numbers: Sequence[int]) -> Dataset:
    """The samples of several shards."""
    return concatenate([job.header, *(read_shard(job, number) for number in numbers)])


def is_complete(job: GenerationJob, record: ProgressRecord, path: Path) -> bool:
    """Whether the file is there already and holds what is wanted; DatasetError when it is something else."""
    if not path.exists():
        return False
    if path.is_dir():
        raise DatasetError(f"{path}: is a folder; name a file for the data set")
    with open_hdf5(path, storage.DATASET_FILE) as file:
        header = storage.read_header(file, str(path))
        if header.provenance.get("fingerprint") != job.fingerprint:
            difference = first_difference(_identity(header), _identity(job.header), "")
            description = f"there and here {difference}" if difference else "of shards of another size"
            raise DatasetError(f"{path}: holds another data set ({description}); choose another name")
        reasons = file["reasons"][:]
    if record.samples is None:
        return len(reasons) >= (record.draws or 0)
    return int((reasons == 0).sum()) >= record.samples


def merge_shards(job: GenerationJob, record: ProgressRecord, path: Path, progress: ProgressCallback | None) -> None:
    """Write the shortest leading run of shards that is enough."""
    numbers, remaining = record.leading_run() or [], record.draws
    remove_temporary_files(path)
    # a file that is there holds the first samples of the same data set, see is_complete()
    with write_hdf5(path, DatasetError, storage.WRITE_ADVICE, force=True) as file:
        storage.write_header(file, job.header)
        for done, number in enumerate(numbers, start=1):
            samples = read_shard(job, number)
            storage.append_samples(file, samples if remaining is None else samples.rows(slice(0, remaining)))
            remaining = None if remaining is None else remaining - len(samples)
            if progress is not None:
                progress("shards merged", done, len(numbers), "")


def _identity(data: Dataset) -> dict[str, Any]:
    """Everything in the file of a data set that decides its samples."""
    document = {
        "law": law_to_json(data.law),
        "specimen": specimen_to_json(data.specimen),
        "design": data.design_document,
        "seed": data.provenance.get("seed"),
        "creepkit": data.provenance.get("creepkit"),
    }
    return dict(as_read_back(document))
