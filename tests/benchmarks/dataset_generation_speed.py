"""Cost, scaling and size of data sets: bulge simulations of the combined law, 289 frames.

    python tests/benchmarks/dataset_generation_speed.py [--samples 400] [--domains conditioned paper] [--write]

For each sampling domain the same draws are simulated by one and by two workers, in shards of 32, until the wanted
number of samples is accepted. The time of a data set of one draw, mostly imports of its worker, is subtracted. CPU time
is that of all processes. The last three columns scale the cost to the paper's case 2, 155,186 samples. To be run on
idle cores.
"""

from __future__ import annotations

import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from measured import Page, arguments

import creepkit as ck
from creepkit.dataset.dataset import Dataset
from creepkit.dataset.generation import generate
from creepkit.sampling.domains import SamplingDesign, sampling_design

PAPER_SAMPLES = 155_186
"""Samples of the paper's case 2."""
ROWS = 32
DIMPLE = ck.specimen("bulge")


@dataclass(frozen=True)
class Cost:
    """CPU and wall time, s."""

    cpu: float
    wall: float


def cpu_seconds() -> float:
    """CPU time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def timed(design: SamplingDesign, to: Path, workers: int, **wanted: int) -> tuple[Dataset, Cost]:
    """A data set and its cost."""
    cpu, wall = cpu_seconds(), time.perf_counter()
    data = generate(design, DIMPLE, seed=1, to=to, execution=ck.ParallelExecution(workers, shard_rows=ROWS), **wanted)
    return data, Cost(cpu_seconds() - cpu, time.perf_counter() - wall)


def measure(page: Page, domain: str, samples: int, folder: Path) -> None:
    """The rows of one sampling domain."""
    design = sampling_design(ck.law("combined"), DIMPLE, domain)
    timed(design, folder / f"{domain}-compiled.h5", 1, draws=1)
    _, start = timed(design, folder / f"{domain}-start.h5", 1, draws=1)
    data, one = timed(design, folder / f"{domain}-1.h5", 1, samples=samples)
    _, two = timed(design, folder / f"{domain}-2.h5", 2, draws=len(data))
    accepted = int((data.reasons == 0).sum())
    size = (folder / f"{domain}-1.h5").stat().st_size / accepted
    rates = accepted / (one.wall - start.wall), accepted / (two.wall - start.wall)
    costs = one.cpu - start.cpu, two.cpu - 2 * start.cpu
    for workers, cpu, rate in zip((1, 2), costs, rates, strict=True):
        page.row(
            domain,
            f"{accepted} of {len(data)}",
            workers,
            f"{cpu / accepted:.4f}",
            f"{rate:.2f}",
            f"{rate / rates[0]:.2f}",
            f"{size:.0f}",
            f"{cpu / accepted * PAPER_SAMPLES / 3600:.2f}",
            f"{PAPER_SAMPLES / rate / 3600:.2f}",
            f"{size * PAPER_SAMPLES / 1e9:.3f}",
        )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--samples", type=int, default=400, help="accepted samples of each domain (400)")
    parser.add_argument("--domains", nargs="*", default=["conditioned", "paper"], choices=["conditioned", "paper"])
    options = parser.parse_args()
    page = Page("dataset_generation_speed", __doc__)
    page.table(
        "sampling domain",
        "accepted of draws",
        "workers",
        "CPU s a sample",
        "samples a second",
        "over one worker",
        "bytes a sample",
        f"{PAPER_SAMPLES} samples: core-hours",
        "hours",
        "GB",
    )
    with tempfile.TemporaryDirectory() as folder:
        for domain in options.domains:
            measure(page, domain, options.samples, Path(folder))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
