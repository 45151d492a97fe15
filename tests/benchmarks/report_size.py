"""Reports as one page of HTML: size and CPU time, of a plate of alloys and of curves with many frames.

    python tests/benchmarks/report_size.py [--alloys 47] [--write]

A planted plate (creepkit.screening.planted: one dimple for each alloy, three outputs, a frame a minute for 4 h) is
screened with the four laws of Table 1 of Chen et al. by the reduced-order model, and reported. Then one planted creep
test of a bar is reported with more and more frames: its figures are thinned to what a screen shows, so that the page
hardly grows. Columns: bytes of the page and of its figures; points of all lines, bands and dots in them; CPU time of
the page, without that of the identification. The goal is 5 MB for a plate of 47 alloys.
"""

import re
import tempfile
import time
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck

LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")


FRAMES = (100, 1_000, 10_000)


def planted_curve(frames):
    """A creep test of a bar under Norton's law with 0.5 % noise, of so many frames."""
    times = np.linspace(100.0, 100 * 3600.0, frames)
    strain = 1e-20 * 120.0**5.2 * times
    noise = 0.005 * strain.max() * np.random.default_rng(3).normal(size=frames)
    return ck.History(
        "planted", times, {"strain": strain + noise}, ck.constant_stress(120.0), 1073.15,
        standard_deviation={"strain": np.full(frames, 0.005 * strain.max())},
    )  # fmt: skip


def measured_page(source):
    """(page as text, CPU seconds) of a report."""
    with tempfile.TemporaryDirectory() as folder:
        started = time.process_time()
        path = ck.report(source, Path(folder) / "report.html")
        return path.read_text(encoding="utf-8"), time.process_time() - started


def row(page, name, tests, source):
    """Write one report and state its size."""
    html, seconds = measured_page(source)
    figures = re.findall("<svg.*?</svg>", html, re.DOTALL)
    points = sum(len(re.findall(r"-?\d*\.?\d+[ -]\d*\.?\d+", d)) for d in re.findall(r' d="([^"]*)"', "".join(figures)))
    page.row(
        name, tests, f"{len(html.encode()) / 1e6:.2f} MB", len(figures), f"{sum(map(len, figures)) / 1e6:.2f} MB",
        points, f"{seconds:.1f} s",
    )  # fmt: skip


def main():
    """Print the table, and write it where asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--alloys", type=int, default=47, help="of the plate")
    options = parser.parse_args()
    page = Page("report_size", __doc__)
    plate = ck.planted_plate(options.alloys)
    progress("screening the plate")
    screened = ck.screen(
        plate.histories, LAWS, using=ck.surrogate("dimple"), compositions=plate.compositions, workers=1,
        options=ck.ScreeningOptions(dense=None, confirm=False),
    )  # fmt: skip
    page.table("report", "tests", "page", "figures", "of them", "points", "CPU time")
    row(page, f"plate of {options.alloys} alloys", options.alloys, screened)
    for frames in FRAMES:
        test = planted_curve(frames)
        row(page, f"one bar, {frames} frames", 1, ck.identify("norton", [test], starts=2))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
