"""Generation of a data set: shards of a design are simulated until enough samples are accepted, then merged.

A shard is a block of rows of the design, simulated once and kept in its own file; it is done when that file exists,
belongs to this generation and is complete. Shards are taken in order and without gaps, so that the content of the data
set does not depend on the number of workers.
"""

from __future__ import annotations

import hashlib
import itertools
import logging
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, ClassVar

import h5py
import numpy as np

from creepkit import limits, registry
from creepkit.checked_arguments import checked
from creepkit.dataset import storage
from creepkit.dataset.dataset import Dataset, concatenate, first_difference
from creepkit.dataset.simulation import empty_dataset, simulate_rows
from creepkit.dataset.storage import LAYOUT_VERSION
from creepkit.errors import SAID, DatasetError, restated
from creepkit.files.hdf5_files import open_hdf5, write_hdf5
from creepkit.files.json_documents import as_read_back, canonical_json, json_text, read_json
from creepkit.files.locking import locked
from creepkit.files.reading import FileKind
from creepkit.files.writing import remove_temporary_files, write_text
from creepkit.jobs.progress import ProgressCallback, duration_text
from creepkit.jobs.worker_pools import SHARD_ROWS, ParallelExecution, Workers
from creepkit.jobs.worker_process import TaskResult
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_to_json
from creepkit.records import Specimen
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictor
from creepkit.registry.specimen_documents import specimen_to_json
from creepkit.sampling.domains import SamplingDomain, sampling_design

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
        if self.specimen.threads == 1:
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
        with restated(OSError, DatasetError, f"{self.folder}: no shards can be written there ({SAID})"):
            self.folder.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                write_text(json_text(self.document), path, DatasetError, internal=True)
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


MOST_DRAWS_WITHOUT_ACCEPTED = 16384
"""Draws after which a design is given up of which none was accepted."""


@dataclass
class ProgressRecord:
    """The shards of a job that are done, and how many are wanted.

    samples : accepted ones wanted; or draws : rows wanted, accepted or not. part : (k, n), only shards k-1, k-1+n ...,
        and as many samples as make an n-th of all.
    done : {shard: accepted samples} of this part.
    """

    job: GenerationJob
    samples: int | None
    draws: int | None
    part: tuple[int, int] | None = None
    done: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if (self.samples is None) == (self.draws is None):
            raise DatasetError("say either how many accepted samples are wanted (samples), or how many draws (draws)")
        if self.part is not None and not 1 <= self.part[0] <= self.part[1]:
            raise DatasetError(f"part {self.part[0]}/{self.part[1]} is none; allowed are 1/N to N/N")

    def scan_finished(self) -> None:
        """Find the shards that are done already."""
        for path in sorted(self.job.folder.glob("[0-9]*.h5")):
            if path.stem.isdigit() and (self.part is None or int(path.stem) % self.part[1] == self.part[0] - 1):
                self.mark_done(int(path.stem), self.job.accepted_count(int(path.stem)))

    def mark_done(self, number: int, accepted: int | None) -> None:
        """A shard is done."""
        if accepted is not None:
            self.done[number] = accepted
        drawn = len(self.done) * self.job.rows
        if self.samples is not None and drawn >= MOST_DRAWS_WITHOUT_ACCEPTED and not self.accepted:
            raise DatasetError(
                f"none of the first {drawn} draws was accepted; change the design, or ask for draws instead of samples"
            )

    @property
    def target(self) -> int:
        """Value of `count` at which the job is done: accepted samples, or rows."""
        if self.samples is None:
            return self.job.rows * len(list(self._shard_numbers()))
        return self.samples if self.part is None else -(-self.samples // self.part[1])

    @property
    def count(self) -> int:
        """Accepted samples, or rows, of all shards that are done."""
        return sum(self._contribution(number) for number in self.done)

    @property
    def acceptance_rate(self) -> float:
        """Accepted samples per draw, so far; 1 before the first are known."""
        return self.accepted / (len(self.done) * self.job.rows) if self.done else 1.0

    @property
    def accepted(self) -> int:
        """Accepted samples so far."""
        return sum(self.done.values())

    def leading_run(self) -> list[int] | None:
        """The shortest leading run of done shards that is enough; None while there is none."""
        run = self._needed()
        return run if all(number in self.done for number in run) else None

    def next_shard(self, running: Collection[int]) -> int | None:
        """The next shard to simulate; None when those done and running are expected to be enough."""
        return next((n for n in self._needed(running) if n not in self.done and n not in running), None)

    def _needed(self, running: Collection[int] = ()) -> list[int]:
        """The first shards that are expected to be enough, up to the first that is neither done nor running."""
        needed, expected = list[int](), 0.0
        for number in self._shard_numbers():
            if self.samples is not None and expected >= self.target:
                break
            needed.append(number)
            if number not in self.done and number not in running:
                break
            expected += self._contribution(number) if number in self.done else self.acceptance_rate * self.job.rows
        return needed

    def _shard_numbers(self) -> Iterable[int]:
        """The shards that may be needed, first ones first."""
        first, step = (0, 1) if self.part is None else (self.part[0] - 1, self.part[1])
        if self.draws is None:
            return itertools.count(first, step)
        return range(first, -(-self.draws // self.job.rows), step)

    def _contribution(self, number: int) -> int:
        return self.done[number] if self.draws is None else self.job.rows


def progress_reporter(record: ProgressRecord, progress: ProgressCallback | None) -> Callable[[], None]:
    """What reports the progress of a job when it has changed; rates count the work from now on."""
    start, before, reported = time.monotonic(), record.count, [-1]
    task = "accepted samples" if record.draws is None else "draws"

    def report() -> None:
        done = record.count
        if progress is None or done == reported[0]:
            return
        reported[0], rate = done, (done - before) / max(time.monotonic() - start, 1e-3)
        left = f"{rate:.3g}/s, {duration_text(max(record.target - done, 0) / rate)} left, " if rate > 0 else ""
        accepted = f"{100 * record.acceptance_rate:.0f} % accepted" if record.done else ""
        progress(task, min(done, record.target), record.target, f"{left}{accepted}")

    return report


POLL_INTERVAL = 0.5
"""s between reports of the progress, where no shard ends earlier."""


@checked
def generate(
    source: SamplingDomain | CreepLaw | str,
    using: Specimen | str,
    samples: Annotated[int, limits.SAMPLES] | None = None,
    *,
    seed: Annotated[int, limits.SEED],
    to: str | Path,
    draws: Annotated[int, limits.SAMPLES] | None = None,
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
    rows = execution.shard_rows or rows_of_folder(folder) or _shard_rows(samples or draws)
    job = GenerationJob(design_of_samples, specimen, int(seed), folder, rows)
    record = ProgressRecord(job, samples, draws, execution.part)
    if execution.part is None and is_complete(job, record, path):
        return storage.read_dataset(path)
    job.open_folder()
    with generating_alone(folder, execution.part):
        record.scan_finished()
        with execution.start(job) as workers:
            run_until_enough(record, workers, progress)
        if execution.part is not None:
            return concatenate([job.header, *map(job.read, sorted(record.done))])
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


def run_until_enough(record: ProgressRecord, workers: Workers, progress: ProgressCallback | None) -> None:
    """Have shards simulated until there are enough; DatasetError when one cannot be."""
    report = progress_reporter(record, progress)
    running: dict[Future[TaskResult], int] = {}
    while record.leading_run() is None:
        while len(running) < workers.size and (shard := record.next_shard(running.values())) is not None:
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
        report()


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
            samples = job.read(number)
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
