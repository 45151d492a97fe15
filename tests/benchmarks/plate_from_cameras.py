"""A plate of 25 alloys from the folder of a laboratory: CPU time by stage, amplitudes and laws as planted.

    python tests/benchmarks/plate_from_cameras.py [--dimples 15,10] [--frames 52] [--spacing 0.64] [--seed 5]
                                                  [--to FOLDER] [--write]

`west/` (DICe, 15 dimples in one view) and `east/` (VIC-3D with decimal commas, 10), times beside each, one logger whose
clock is 23.4 s ahead, three thermocouples. Each dimple is of an alloy of its own, its law and values drawn around the
three of Fig. 7a of Chen et al. at six times their rates, its thickness known to 2 %. `init`, the table of alloys filled
in, `run` with the four laws of Table 1. "Covered": planted values, of alloys whose law was found, inside their 95 %
intervals; amplitudes are compared with the simulated profiles under Eq. (7).
"""

from __future__ import annotations

import csv
import sys
import tempfile
import time
from collections import defaultdict
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.studies.camera_proposal import ALLOYS_FILE
from creepkit.studies.proposal import propose_study

sys.path.append(str(Path(__file__).parents[1]))
sys.path.append(str(Path(__file__).parents[2] / "examples"))
from planted_plate import FIGURE_7A, PARAMETER_SD, RATE_FACTOR_RANGE

from helpers.plates import PlannedDimple, Schedule, simulated, write_lab

FASTER = 6.0
LAG = 23.4


def planned(number: int, random: np.random.Generator) -> PlannedDimple:
    """One alloy of the plate: thickness as measured, but for its 2 %."""
    law = str(random.choice(list(FIGURE_7A)))
    values = {k: v + PARAMETER_SD.get(k, 0.0) * random.normal() for k, v in FIGURE_7A[law].items()}
    mean = FIGURE_7A[law]

    def rate(one: dict[str, float]) -> float:
        if law == "hyperbolic-sine":
            return one["A"] * np.sinh(100.0 / one["B"]) ** one["n"]
        return one["A"] * 100.0 ** one["n"] * 0.01 ** one.get("m", 0.0)

    factor = FASTER * np.exp(random.uniform(*np.log(RATE_FACTOR_RANGE)))
    values["A"] *= factor * rate(mean) / rate(values)
    return PlannedDimple(f"A{number:02d}", law, values, thickness=float(random.uniform(0.46, 0.53)))


def fill_in(path: Path, dimples: dict[str, list[PlannedDimple]], random: np.random.Generator) -> None:
    """Alloys, moduli, and thicknesses as somebody measured them, off by 2 %."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        one = dimples[row["camera"]][int(row["dimple"].removeprefix("D")) - 1]
        row |= {"alloy": one.alloy, "thickness tolerance [%]": "2", "modulus [GPa]": f"{one.modulus / 1e3:g}"}
        row["thickness [mm]"] = f"{one.thickness * (1.0 + 0.02 * random.normal()):.4f}"
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def timed_run(study: Path) -> tuple[ck.StudyResult, dict[str, float]]:
    """The result, and CPU time of each kind of stage, s."""
    spent: dict[str, float] = defaultdict(float)
    last = ["reading", time.process_time()]

    def tick(task: str, done: int, total: int, note: str) -> None:
        now = time.process_time()
        spent[str(last[0])] += now - float(last[1])
        if task.split(" of ")[0] != last[0]:
            progress(f"{task}: {sum(spent.values()):.0f} s of CPU time")
        last[:] = [task.split(" of ")[0], now]

    result = ck.Study.load(study).run(progress=tick)
    spent[str(last[0])] += time.process_time() - float(last[1])
    return result, spent


def judge(page: Page, result: ck.StudyResult, dimples: dict[str, list[PlannedDimple]], schedule: Schedule) -> None:
    """Amplitudes, lags and laws against what was planted."""
    biases, scatter, inside = [], [], []
    truth = {f"{view} D{k}": one for view, ones in dimples.items() for k, one in enumerate(ones, 1)}
    for name, extraction in result.extractions.items():
        exact = simulated(truth[name], schedule).truth()[: extraction.times.size, 0]
        error = (extraction.outputs["amplitude"] - exact)[extraction.used]
        error = error[exact[extraction.used] > 0.02]
        sd = extraction.standard_deviation["amplitude"][extraction.used][-error.size :]
        biases.append(1e3 * error.mean())
        scatter.append(1e3 * error.std())
        inside += list(np.abs(error) < 1.96 * sd)
    page.table("quantity", "value")
    page.row("test pieces", len(truth))
    page.row("extracted", len(result.extractions))
    page.row("mean error of an amplitude, um: largest of a test", f"{np.abs(biases).max():.2f}")
    page.row("scatter of an amplitude, um: largest of a test", f"{max(scatter):.2f}")
    page.row("amplitudes within their 95 %", share_with_interval(inside, "wilson"))
    for view, shift in (("west", 0.0), ("east", 111.0)):
        clock = next((one.alignment for name, one in result.imposed.items() if name.startswith(view)), None)
        if clock is not None:
            low, high = clock.lag_interval
            planted = 600.0 + LAG - shift
            page.row(f"lag of {view}, s (planted {planted:.1f})", f"{clock.lag:.2f} ({low:.2f} to {high:.2f})")
    found = {one.alloy: result.rankings.get(one.alloy) for one in truth.values()}
    page.row("alloys with a law", sum(one is not None for one in found.values()))
    errors = [one.best.numerical_error for one in found.values() if one is not None]
    page.row("confirmed by finite elements", sum(one is not None and one.confirms for one in errors))
    right, covered = [], []
    for one in truth.values():
        ranking = found[one.alloy]
        if ranking is None:
            continue
        right.append(ranking.best.law.name == one.law)
        if right[-1]:
            covered += [e.low <= one.values[e.name] <= e.high for e in ranking.best.estimates if e.name in one.values]
    page.row("law found", share_with_interval(right, "wilson"))
    page.row("covered (values)", share_with_interval(covered, "wilson"))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--dimples", default="15,10")
    parser.add_argument("--frames", type=int, default=52)
    parser.add_argument("--spacing", type=float, default=0.64)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--to", help="folder in which frames and results are kept")
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    west, east = (int(one) for one in options.dimples.split(","))
    schedule = Schedule(frames=options.frames, interval=60.0, rest=10, jump=1290.0)
    dimples = {
        "west": [planned(k, random) for k in range(1, west + 1)],
        "east": [planned(k, random) for k in range(west + 1, west + east + 1)],
    }
    page = Page("plate_from_cameras", __doc__)
    with nullcontext(options.to) if options.to else tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if not (folder / "logger.csv").exists():
            write_lab(
                folder, dimples["west"], dimples["east"], LAG, columns=5, spacing=options.spacing, schedule=schedule
            )
        progress("the folder is written")
        begun = time.process_time()
        proposal = propose_study(folder, folder / "study.toml")
        (folder / ALLOYS_FILE).write_text(proposal.alloys)
        text = proposal.text.replace("subset_mm = 0 ", "subset_mm = 1 ")
        (folder / "study.toml").write_text(text.replace("attach_MB = 3 ", "attach_MB = 0 "))
        of_init = time.process_time() - begun
        fill_in(folder / ALLOYS_FILE, dimples, random)
        result, spent = timed_run(folder / "study.toml")
        page.table("stage", "CPU time, s")
        page.row("init", f"{of_init:.0f}")
        for kind, seconds in spent.items():
            page.row(kind, f"{seconds:.0f}")
        page.row("all", f"{of_init + sum(spent.values()):.0f}")
        judge(page, result, dimples, schedule)
        for one in result.failures:
            page.paragraph(f"Failed: {one.stage}: {one.sentence}")
        if options.write:
            page.write()


if __name__ == "__main__":
    main()
