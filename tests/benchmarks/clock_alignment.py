"""Lags between the clocks of cameras and instruments, found from the response to pressure: planted lags, and one test.

    python tests/benchmarks/clock_alignment.py [--tests 100] [--write]

Truth is the reduced-order model of the dimple under a programme of pressure (steps with ramps, staircases, slow ramps,
with and without unloading), with a law of creep that the alignment does not know (sinh, Norton, strain hardening, time
hardening; values as in planted_bulge_tests), so that the apex moves elastically and creeps before, during and after the
ramps. The record holds the pressure with noise of 0.02 MPa, the frames the apex with noise of 1 um. The clock of the
instrument is ahead by 0.1 s to 5 min, of either sign, and gains a normal deviate of 1e-4; lags of 15 min to either side
are searched.

Columns: tests; those refused because several lags fit; answers whose 95 % intervals hold the planted lag and the
planted drift (with 95 % binomial bounds); the median error of the lag, the median width of its interval, CPU time of
one alignment. The frames do not tell lags apart that put every ramp between the same frames, so that an interval is
often nearly as wide as that of the frames.

The last section compares with the alignment by hand of the static test of dimple D1 (shared/data/cameras/dabi_static):
its lag is read from the file by finding at which lag the record gives the aligned values; that is repeated for ten
channels of temperature.
"""

from __future__ import annotations

import csv
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from planted_bulge_tests import drawn_values

import creepkit as ck
from creepkit.errors import CreepkitError, HistoryError
from creepkit.instruments.clock_alignment import align_clocks
from creepkit.inverse.sparsity.bootstrap import binomial_interval
from creepkit.records import Channel, InstrumentRecord, Program, RecordedLoading

SEED = 18
DATA = Path(__file__).resolve().parents[2].parent / "shared/data/cameras/dabi_static"
SEARCH = (-900.0, 900.0)
"""s, lags that are searched."""
FRAME_NOISE, PRESSURE_NOISE, DRIFT = 1e-3, 0.02, 1e-4


@dataclass(frozen=True)
class Case:
    """name; interval of frames, duration, ramp: s; levels: of pressure, MPa; row: interval of the record, s."""

    name: str
    interval: float
    duration: float
    ramp: float
    levels: tuple[float, ...]
    row: float


CASES = (
    Case("staircase of 4, ramps 5 s", 1.0, 600.0, 5.0, (2.0, 4.0, 6.0, 8.0, 0.0), 0.1),
    Case("two levels, ramps 20 s", 10.0, 3600.0, 20.0, (6.0, 8.0, 0.0), 0.1),
    Case("one step, slow ramp 300 s", 10.0, 3600.0, 300.0, (8.0,), 1.0),
    Case("staircase of 3, ramps 60 s", 30.0, 7200.0, 60.0, (4.0, 6.0, 8.0, 0.0), 1.0),
    Case("8 then 10 MPa, ramps 5 s", 150.0, 14400.0, 5.0, (8.0, 10.0), 1.0),
    Case("8 then 10 MPa, unloaded, ramps 5 s", 150.0, 14400.0, 5.0, (8.0, 10.0, 0.0), 1.0),
    Case("6, 8, 10, 8 MPa, unloaded, ramps 5 s", 150.0, 43200.0, 5.0, (6.0, 8.0, 10.0, 8.0, 0.0), 1.0),
)


def program_of(case: Case, rng) -> Program:
    """Levels that begin at random moments, each reached by a ramp."""
    lead = 0.1 * case.duration
    share = (case.duration - lead) / len(case.levels)
    times, values = [0.0], [0.0]
    for k, level in enumerate(case.levels):
        start = lead + share * (k + 0.5 * rng.uniform())
        times += [start, start + case.ramp * rng.uniform(0.7, 1.3)]
        values += [values[-1], level]
    return Program(np.array(times), np.array(values))


LAWS = ("hyperbolic-sine", "norton", "strain-hardening", "time-hardening")
LONG = 43200.0
"""s, for which planted_bulge_tests draws rates; those of shorter tests are higher in proportion."""


def apex(program: Program, times, rng):
    """(frames,) mm of the dimple under a law of creep that is drawn."""
    span = float(times[-1])
    while True:
        name = LAWS[rng.integers(len(LAWS))]
        values = drawn_values(name, rng)
        values["A"] *= LONG / span * ((LONG / span) ** values["m"] if name == "time-hardening" else 1.0)
        law = ck.law(name)
        test = ck.History("truth", times, {}, RecordedLoading(program, "pressure"), 1073.15, "bulge", ck.Elastic(150e3))
        try:
            run = ck.surrogate("dimple").predict(law, law.to_internal(law.values(values)), [test])
        except CreepkitError:
            continue
        moved = run.values[0, 0, :, 0]
        if np.isfinite(moved).all() and np.ptp(moved) < 2.0:
            return moved


def planted(case: Case, rng):
    """Record, frame times, displacements, and the lag at a camera time as a function."""
    program = program_of(case, rng)
    lag, gain = rng.choice((-1, 1)) * 10.0 ** rng.uniform(-1, np.log10(300)), DRIFT * rng.standard_normal()
    seen = np.arange(case.interval * rng.uniform(), case.duration, case.interval)
    seen = np.maximum.accumulate(seen + 0.002 * case.interval * rng.uniform(size=seen.size))
    # true time is the camera's; the instrument reads true + lag + gain (true - half)
    half = 0.5 * case.duration
    rows = np.arange(-600.0 if case.duration > 1000 else -60.0, case.duration + 600.0, case.row)
    clean = program.at(np.maximum(rows, 0.0))
    record = InstrumentRecord(
        "planted",
        rows + lag + gain * (rows - half),
        {"P": Channel("P", "pressure", clean + PRESSURE_NOISE * rng.standard_normal(rows.size), "gauge", "MPa")},
    )
    moved = apex(program, np.maximum(seen, 1e-3), rng) + FRAME_NOISE * rng.standard_normal(seen.size)
    return record, seen, moved, lambda t: lag + gain * (t - half), gain


@dataclass
class Tally:
    """Outcomes of one case."""

    errors: list
    widths: list
    held: int = 0
    drift_held: int = 0
    refused: int = 0
    cost: float = 0.0

    @property
    def answers(self) -> int:
        return len(self.errors)


def tally(case: Case, tests: int, seed: int, show: bool = False) -> Tally:
    """Plant tests, align them."""
    result = Tally([], [])
    for k in range(tests):
        rng = np.random.default_rng((seed, k))
        record, seen, moved, lag_at, gain = planted(case, rng)
        start = time.process_time()
        try:
            found = align_clocks(record, "P", seen, moved, search=SEARCH)
        except HistoryError as error:
            result.refused += 1
            progress(f"{case.name} {k}: {error}")
            continue
        finally:
            result.cost += time.process_time() - start
        truth = lag_at(found.middle)
        low, high = found.lag_interval
        result.errors.append(found.lag - truth)
        result.widths.append(high - low)
        result.held += low <= truth <= high
        result.drift_held += found.drift_interval[0] <= gain <= found.drift_interval[1]
        if show and not low <= truth <= high:
            progress(f"  {k}: truth {truth:.4f}, found {found.lag:.4f} in {low:.4f} to {high:.4f}")
    return result


def share(held: int, count: int) -> str:
    """Per cent with binomial bounds."""
    if not count:
        return "-"
    low, high = binomial_interval(held, count)
    return f"{100 * held / count:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """{name: values} of a table of numbers."""
    with path.open(encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array([[float(cell) for cell in row] for row in rows if row]).T, strict=True))


def lag_by_hand(record: InstrumentRecord, aligned: dict[str, np.ndarray], channel: str, factor: float, offset: float):
    """The lag at which a channel of the record, s from its zero, has the values of the aligned table."""
    times, values = record.readings(channel)
    name = next(one for one in aligned if one.startswith(channel))
    wanted = factor * aligned[name] + offset
    lags = np.arange(9.0, 11.0, 0.005)
    frames = aligned["time"] / 1e3 - record.start
    return lags[np.argmin([np.square(np.interp(frames + lag, times, values) - wanted).sum() for lag in lags])]


def static_test(page: Page) -> None:
    """The alignment of dimple D1, found and by hand."""
    record = ck.read_record(DATA / "D1_record.csv", time_zone="America/Chicago")
    frames = columns_of(DATA / "D1_frame_times.csv")["time"] / 1e3
    apexes = columns_of(DATA / "D1_apex_displacement.csv")["apex_displacement_mm"]
    aligned = columns_of(DATA / "D1_record_aligned_by_hand.csv")
    hand = [lag_by_hand(record, aligned, f"{row}{k}: Temp.", 1.0, 273.15) for row in "AD" for k in range(1, 6)]
    page.heading("Dimple D1, static test")
    page.table("alignment", "lag, s", "from, s", "to, s")
    page.row("by hand, ten channels", f"{np.median(hand):.3f}", f"{min(hand):.3f}", f"{max(hand):.3f}")
    found = align_clocks(record, "D1: Press.", frames, apexes)
    page.row("found", f"{found.lag:.3f}", *(f"{bound:.3f}" for bound in found.lag_interval))
    other = align_clocks(record, "High Acc. Transducer", frames, apexes)
    page.row("found, by the other transducer", f"{other.lag:.3f}", *(f"{bound:.3f}" for bound in other.lag_interval))
    page.paragraph(
        "By hand plateaus were laid upon each other; frames are 0.2 s apart, so that the moment at which a plateau "
        "begins is known to 0.1 s at best."
    )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--tests", type=int, default=100, help="of each case")
    parser.add_argument("--case", type=int, help="only this one")
    options = parser.parse_args()
    page = Page("clock_alignment", __doc__)
    page.heading("Planted lags")
    page.table(
        "case",
        "frames every s",
        "tests",
        "refused",
        "lag held",
        "drift held",
        "median error, s",
        "median width, s",
        "CPU-s",
    )
    total = Tally([], [])
    for k, case in enumerate(CASES):
        if options.case is not None and k != options.case:
            continue
        one = tally(case, options.tests, SEED + k, options.case is not None)
        page.row(
            case.name,
            f"{case.interval:g}",
            options.tests,
            one.refused,
            share(one.held, one.answers),
            share(one.drift_held, one.answers),
            f"{np.median(np.abs(one.errors)):.3f}",
            f"{np.median(one.widths):.3f}",
            f"{one.cost / options.tests:.1f}",
        )
        total.errors += one.errors
        total.held += one.held
        total.drift_held += one.drift_held
    page.paragraph(
        f"All cases: the lag held in {share(total.held, total.answers)}, "
        f"the drift in {share(total.drift_held, total.answers)}."
    )
    if DATA.is_dir() and options.case is None:
        static_test(page)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
