"""Generation of a data set: shards of a design are simulated until enough samples are accepted, then merged.

Shards are taken in order and without gaps, so that the content of the file does not depend on the number of workers.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import Any

from creepkit import limits
from creepkit.checked_arguments import checked
from creepkit.dataset import shards, storage
from creepkit.dataset.dataset import Dataset, concatenate, first_difference
from creepkit.dataset.shards import GenerationJob, ProgressRecord, ProgressReporter
from creepkit.errors import DatasetError
from creepkit.files.hdf5_files import open_hdf5, write_hdf5
from creepkit.files.json_documents import as_read_back
from creepkit.files.writing import remove_temporary_files
from creepkit.jobs.progress import ProgressCallback
from creepkit.jobs.worker_pools import SHARD_ROWS, ParallelExecution, Workers
from creepkit.jobs.worker_process import TaskResult
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_to_json
from creepkit.records import Specimen
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictor
from creepkit.registry.specimen_documents import specimen_to_json
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
    limits.check_number("seed", seed, limits.SEED, DatasetError)
    job = GenerationJob(design_of_samples, specimen, int(seed), folder, rows)
    record = ProgressRecord(job, samples, draws, execution.part)
    if execution.part is None and is_complete(job, record, path):
        return storage.read_dataset(path)
    job.open_folder()
    with shards.generating_alone(folder, execution.part):
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
    reporter = ProgressReporter(record, progress)
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
        reporter.report()


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
