"""Reading of frames of cameras: CPU time and memory, against np.loadtxt.

    python tests/benchmarks/camera_reading.py [--frames 40] [--write]

Frames of 10,424 points in 14 columns, of which seven are read: as DICe writes them (five digits), as tables of Python
(17 digits), as VIC-3D with semicolons and decimal commas, and as packed rows of pyvale (25 columns). CPU time is that
of the process, the least of three runs, for a sequence of one file a frame: for finding and ordering the files, and for
each frame, which is read, checked and turned into points, displacements and marks of validity. np.loadtxt reads the
same seven columns to an array, and is given the delimiter and the first row. Memory is the largest that Python had
allocated while it went through all frames.
"""

from __future__ import annotations

import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from measured import Page, arguments

import creepkit as ck

sys.path.insert(0, str(Path(__file__).parents[1]))

POINTS = 10_424
"""Of the released pipeline's frames."""

COLUMNS = 14
GOAL = 10.0
"""CPU-s for 474 frames, reading and extraction together."""

FRAMES_OF_THE_TEST = 474


def _lengths(points: int) -> np.ndarray:
    generator = np.random.default_rng(0)
    side = np.linspace(-30.0, 30.0, points)
    columns = [side, side[::-1], 0.01 * side, *(0.01 * generator.normal(size=(3, points)))]
    return np.stack([*columns, 0.01 + 0.001 * generator.random(points)], axis=1)


def _table(heads: list[str], delimiter: str, form: str, values: np.ndarray) -> str:
    others = np.random.default_rng(1).normal(size=(len(values), COLUMNS - 7))
    rows = np.concatenate([others, values], axis=1)
    names = [f"other_{k}" for k in range(COLUMNS - 7)] + heads
    return "\n".join([delimiter.join(names), *(delimiter.join(form % v for v in row) for row in rows)]) + "\n"


DICE = [f"MODEL_{kind}_{axis}" for kind in ("COORDINATES", "DISPLACEMENT") for axis in "XYZ"] + ["SIGMA"]
VIC = [f"{name} [mm]" for name in "XYZUVW"] + ["sigma [pixel]"]


def dice(values: np.ndarray) -> bytes:
    return _table(DICE, ",", "%.4E", values).encode()


def long_numbers(values: np.ndarray) -> bytes:
    return _table(DICE, ",", "%.16e", values).encode()


def vic_commas(values: np.ndarray) -> bytes:
    return _table(VIC, ";", "%.6f", values).replace(".", ",").encode()


def packed_rows(values: np.ndarray) -> bytes:
    from helpers.camera_samples import Dome, pyvale_binary

    return pyvale_binary(Dome(values[:, :3], values[:, 3:6], values[:, 6]))


CASES: dict[str, tuple[Callable[[np.ndarray], bytes], str, str]] = {
    "DICe, 5 digits, commas": (dice, "DICe_solution_{:04d}.txt", ","),
    "17 digits, commas": (long_numbers, "DICe_solution_{:04d}.txt", ","),
    "VIC-3D, semicolons, decimal commas": (vic_commas, "plate_{:04d}_0.csv", ""),
    "pyvale, packed rows": (packed_rows, "dic_results_{:04d}.dic3d", ""),
}


def cpu_seconds(function: Callable[[], object]) -> float:
    start = time.process_time()
    function()
    return time.process_time() - start


def go_through(frames: ck.Frames) -> float:
    return float(sum(frame.displacements[0, 2] for frame in frames))


def loadtxt_seconds(path: Path, delimiter: str) -> float:
    columns = range(COLUMNS - 7, COLUMNS)
    return min(
        cpu_seconds(lambda: np.loadtxt(path, delimiter=delimiter, skiprows=1, usecols=columns)) for _ in range(3)
    )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--frames", type=int, default=40)
    options = parser.parse_args()
    page = Page("camera_reading", __doc__)
    page.table(
        "files",
        "MB a frame",
        "finding, CPU-ms a file",
        "reading, CPU-ms a frame",
        "np.loadtxt, CPU-ms",
        f"{FRAMES_OF_THE_TEST} frames, CPU-s (goal with extraction: {GOAL:g})",
        "largest memory, MB",
    )
    for label, (write, name, delimiter) in CASES.items():
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            content = write(_lengths(POINTS))
            for k in range(options.frames):
                (folder / name.format(k)).write_bytes(content)
            go_through(ck.read_frames(folder))
            finding = min(cpu_seconds(partial(ck.read_frames, folder)) for _ in range(3)) / options.frames
            frames = ck.read_frames(folder)
            reading = min(cpu_seconds(partial(go_through, frames)) for _ in range(3)) / options.frames
            loaded = loadtxt_seconds(folder / name.format(0), delimiter) if delimiter else np.nan
            tracemalloc.start()
            go_through(frames)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        page.row(
            label,
            f"{len(content) / 1e6:.2f}",
            f"{1e3 * finding:.2f}",
            f"{1e3 * reading:.1f}",
            f"{1e3 * loaded:.1f}" if delimiter else "does not read it",
            f"{FRAMES_OF_THE_TEST * (finding + reading):.1f}",
            f"{peak / 1e6:.1f}",
        )
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
