"""Campaigns of the combined law on the paper's dimple, 289 frames: cost of an accepted sample, scaling, size.

Run as ``python tests/benchmarks/campaign_speed.py`` on idle cores; --samples for another number of accepted samples.
For each box the same draws are simulated by one and by two workers, in shards of 32 so that both have work to the end.
What a campaign of one draw takes, mostly imports of its worker, is taken off. CPU time is that of all processes.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.dataset.dataset import Dataset
from creepkit.dataset.generation import generate
from creepkit.sampling.domains import SamplingDesign, sampling_design

PAPER = 155_186
"""Samples of the paper's case 2."""
ROWS = 32
DIMPLE = ck.specimen("bulge")


@dataclass(frozen=True)
class Cost:
    """s of CPU and on the clock."""

    cpu: float
    wall: float


def cpu_seconds() -> float:
    """Of this process, and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def timed(design: SamplingDesign, to: Path, workers: int, **wanted: int) -> tuple[Dataset, Cost]:
    """A campaign and what it cost."""
    cpu, wall = cpu_seconds(), time.perf_counter()
    data = generate(design, DIMPLE, seed=1, to=to, workers=workers, rows=ROWS, **wanted)
    return data, Cost(cpu_seconds() - cpu, time.perf_counter() - wall)


def measure(box: str, samples: int, folder: Path) -> list[str]:
    """The rows of the table for one box."""
    design = sampling_design(ck.law("combined"), DIMPLE, box)
    timed(design, folder / f"{box}-compiled.h5", 1, draws=1)
    _, start = timed(design, folder / f"{box}-start.h5", 1, draws=1)
    data, first = timed(design, folder / f"{box}-1.h5", 1, samples=samples)
    _, both = timed(design, folder / f"{box}-2.h5", 2, draws=len(data))
    accepted = int((data.reasons == 0).sum())
    size = (folder / f"{box}-1.h5").stat().st_size / accepted
    rates = accepted / (first.wall - start.wall), accepted / (both.wall - start.wall)
    costs = first.cpu - start.cpu, both.cpu - 2 * start.cpu
    head = f"{box:12s} {accepted:6d} of {len(data):<6d}"
    return [
        f"{head} {workers:7d} {cpu / accepted:10.4f} {rate:9.2f} {rate / rates[0]:8.2f} {size:9.0f} "
        f"{cpu / accepted * PAPER / 3600:11.2f} {PAPER / rate / 3600:7.2f} {size * PAPER / 1e9:6.3f}"
        for workers, cpu, rate in zip((1, 2), costs, rates, strict=True)
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Cost of campaigns")
    parser.add_argument("--samples", type=int, default=400, help="accepted samples of each box (400)")
    samples = parser.parse_args().samples
    set_numba_cache()
    print(f"{'':32s} {'':7s} {'':10s} {'':9s} {'':8s} {'':9s} {f'all {PAPER} samples':>26s}")
    print(
        f"{'box':12s} {'accepted of draws':19s} {'workers':>7s} {'CPU-s each':>10s} {'each s':>9s} {'scaling':>8s} "
        f"{'bytes':>9s} {'core-hours':>11s} {'hours':>7s} {'GB':>6s}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for box in ("conditioned", "paper"):
            print("\n".join(measure(box, samples, Path(folder))), flush=True)


if __name__ == "__main__":
    main()
