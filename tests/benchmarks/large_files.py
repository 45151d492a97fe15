"""Large valid files: CPU time and memory of reading them.

    python tests/benchmarks/large_files.py [--megabytes 200] [--write]

Files of the size asked for are written to a temporary folder, and each is read in a process of its own, whose CPU time
and largest memory are stated, imports included. "frames" or "samples" are what was read, to show that it was all. A
table that holds texts beside its numbers is read up to 40,000,000 cells, and beyond refused in one sentence, before its
rows are taken apart: the environment variable CREEPKIT_LIMITS allows more. The numbers of a data set are noise here, so
that they compress little. It is read twice, first in another process that a damaged file may keep or crash: "of which
in another process" is the CPU time of that one, its imports included.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments

import creepkit as ck
from creepkit.dataset.storage import append_samples, write_header
from creepkit.errors import CreepkitError, DatasetError
from creepkit.files.hdf5_files import write_hdf5

HEAD = "# stress_MPa: 100.5\n# temperature_C: 850.5\n"


def strain(k: int) -> float:
    """%, of primary creep."""
    return float(0.3 * (k / 5e6) ** 0.33)


ROWS: dict[str, tuple[str, Callable[[int], str]]] = {
    "history, points": (f"{HEAD}time_h,strain_pct\n", lambda k: f"{k * 0.25:.2f},{strain(k):.9f}\n"),
    "history, decimal commas": (
        f"{HEAD}time_h;strain_pct\n",
        lambda k: f"{k * 0.25:.2f};{strain(k):.9f}\n".replace(".", ","),
    ),
    "history, texts beside the numbers": (
        f"# ignore: remark\n{HEAD}time_h,strain_pct,remark\n",
        lambda k: f"{k * 0.25:.2f},{strain(k):.9f},ok\n",
    ),
    "record of an instrument": (
        "time_s,pressure_bar,temperature_C\n",
        lambda k: f"{k * 0.1:.1f},{8.25 + k % 17 * 1e-3:.4f},{850 + k % 13 * 0.01:.3f}\n",
    ),
}


DATA_SET = "data set"


def write(name: str, path: Path, size: int) -> None:
    """Write a file until it has so many bytes."""
    if name == DATA_SET:
        write_data_set(path, size)
        return
    head, row = ROWS[name]
    with path.open("w", encoding="ascii") as stream:
        written, k = stream.write(head), 0
        while written < size:
            part = "".join(map(row, range(k, k + 100_000)))
            written, k = written + stream.write(part), k + 100_000


def write_data_set(path: Path, size: int) -> None:
    """Write samples until the file has so many bytes: those of a small data set, their histories times noise."""
    few = ck.generate("norton", "uniaxial", 256, seed=5, to=path.with_name("few.h5"))
    noise, repeated = np.random.default_rng(5), few.rows(np.tile(np.arange(len(few)), 8))
    with write_hdf5(path, DatasetError) as file:
        write_header(file, few)
        while file.id.get_filesize() < size:
            factors = 1.0 + 0.01 * noise.standard_normal(repeated.values.shape).astype(np.float32)
            append_samples(file, replace(repeated, values=repeated.values * factors))


def read(path: str, reader: str) -> None:
    """Read a file and print what it took as JSON; run in a process of its own."""
    try:
        if reader == "data":
            found = f"{len(ck.read_dataset(path))} samples"
        else:
            times = ck.read_record(path).times if reader == "record" else ck.read_histories(path)[0].times
            found = f"{times.size} frames"
    except CreepkitError as error:
        found = f"refused: {error}".replace(path, "FILE")
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps([found, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e9]))


def seconds_of_others() -> float:
    """CPU time of all processes that this one started, and of those that they started; s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    if sys.argv[1:2] == ["--read"]:
        read(*sys.argv[2:])
        return
    parser = arguments(__doc__)
    parser.add_argument("--megabytes", type=int, default=200, help="size of each file")
    options = parser.parse_args()
    page = Page("large_files", __doc__)
    page.table("file", "MB", "CPU, s", "of which in another process", "memory, GB", "result")
    for name in (*ROWS, DATA_SET):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / ("x.h5" if name == DATA_SET else "x.csv")
            write(name, path, options.megabytes * 1_000_000)
            command = [sys.executable, __file__, "--read", str(path), name.partition(" ")[0]]
            before = seconds_of_others()
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            seconds = seconds_of_others() - before
            found, own, memory = json.loads(done.stdout)
            size = f"{path.stat().st_size / 1e6:.0f}"
            elsewhere = f"{seconds - own:.1f}" if name == DATA_SET else ""
            page.row(name, size, f"{seconds:.1f}", elsewhere, f"{memory:.2f}", found)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
