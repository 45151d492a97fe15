"""Lags between the clocks of cameras and instruments, found from the response to pressure.

    python tests/benchmarks/clock_alignment.py [--tests 100] [--write]

Planted: the reduced-order model of the dimple under programmes of pressure, with a law of creep that the alignment does
not know; noise of 0.02 MPa and 1 um. The clock of the instrument is ahead by 0.1 s to 5 min, of either sign, and gains
a normal deviate of 1e-4, of which the alignment knows nothing. Columns: tests refused because several lags fit or none
does; answers whose 95 % intervals hold the planted lag in the middle of the test; gross misses, wrong by more than ten
half widths. The frames do not tell lags apart that put every ramp between the same frames. After a slow ramp, during
which creep grows, take the interval for twice as wide, or align on a fast change of the load.

The static test of dimple D1 (shared/data/cameras/dabi_static) was aligned by hand too: plateaus laid upon each other.
"""

from __future__ import annotations

import csv
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from measured import Page, arguments, binomial_interval, progress
from planted_bulge_tests import drawn_values

import creepkit as ck
from creepkit.errors import CreepkitError, HistoryError
from creepkit.instruments.clock_alignment import align_clocks
from creepkit.records import Channel, InstrumentRecord, Program, RecordedLoading

SEED = 20261123
DATA = Path(__file__).resolve().parents[2].parent / "shared/data/cameras/dabi_static"
SEARCHES = {"default search": None}
GROSS = 10.0
"""Half widths of its interval by which a lag must be wrong to be called a gross miss."""
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
    """Record, frame times, displacements, and the lag in the middle of the test, s."""
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
    return record, seen, moved, lag


@dataclass(frozen=True)
class Outcome:
    """Of one alignment; error, half: s of the lag; refused: why, or empty; cost: CPU-s."""

    case: int
    search: str
    test: int
    error: float = float("nan")
    half: float = float("nan")
    held: bool = False
    refused: str = ""
    cost: float = 0.0

    @property
    def gross(self) -> bool:
        """Whether the lag is wrong by more than GROSS half widths."""
        return abs(self.error) > GROSS * self.half


def outcomes(number: int, test: int, seed: int) -> list[Outcome]:
    """One planted test, aligned with each search."""
    case = CASES[number]
    record, seen, moved, truth = planted(case, np.random.default_rng((seed, number, test)))
    found = []
    for search, limits in SEARCHES.items():
        start = time.process_time()
        try:
            answer = align_clocks(record, "P", seen, moved, search=limits)
        except HistoryError as error:
            cost = time.process_time() - start
            why = "ambiguous" if "fit about as well" in str(error) else "no response"
            found.append(Outcome(number, search, test, refused=why, cost=cost))
            continue
        cost = time.process_time() - start
        low, high = answer.lag_interval
        held = low <= truth <= high
        one = Outcome(number, search, test, answer.lag - truth, 0.5 * (high - low), bool(held), cost=cost)
        if not held:
            progress(f"{case.name}, {search}, test {test}: off by {one.error:.4g} s, half width {one.half:.4g} s")
        found.append(one)
    return found


def kept_outcomes(path: Path | None) -> list[Outcome]:
    """Those of a run that was broken off."""
    if path is None or not path.exists():
        return []
    return [Outcome(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def measured_outcomes(cases: list[int], tests: int, seed: int, keep: Path | None) -> list[Outcome]:
    """Every test of every case; the first tests of all cases first, so that what was broken off can be used."""
    found = kept_outcomes(keep)
    done = {(one.case, one.test) for one in found}
    for test in range(tests):
        for number in cases:
            if (number, test) in done:
                continue
            new = outcomes(number, test, seed)
            found += new
            if keep is not None:
                with keep.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(asdict(one)) + "\n" for one in new)
    return [one for one in found if one.case in cases and one.test < tests]


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


def lags_by_hand(record: InstrumentRecord, aligned: dict[str, np.ndarray]) -> list[float]:
    """Of all channels of both files that change."""
    factors = {"PSIG": 6.894757293168361e-3, "Torr": 0.101325 / 760.0}
    return [
        lag_by_hand(
            record,
            aligned,
            name,
            factors.get(channel.written_unit, 1.0),
            273.15 if channel.quantity == "temperature" else 0.0,
        )
        for name, channel in record.channels.items()
        if any(one.startswith(name) for one in aligned) and np.ptp(record.readings(name)[1]) > 0
    ]


def static_test(page: Page) -> None:
    """The alignment of dimple D1, found and by hand."""
    record = ck.read_record(DATA / "D1_record.csv", time_zone="America/Chicago")
    frames = columns_of(DATA / "D1_frame_times.csv")["time"] / 1e3
    apexes = columns_of(DATA / "D1_apex_displacement.csv")["apex_displacement_mm"]
    aligned = columns_of(DATA / "D1_record_aligned_by_hand.csv")
    hand = lags_by_hand(record, aligned)
    page.heading("Dimple D1, static test")
    page.table("alignment", "lag, s", "from, s", "to, s")
    page.row(f"by hand, {len(hand)} channels", f"{np.median(hand):.3f}", f"{min(hand):.3f}", f"{max(hand):.3f}")
    found = align_clocks(record, "D1: Press.", frames, apexes)
    page.row("found", f"{found.lag:.3f}", *(f"{bound:.3f}" for bound in found.lag_interval))
    other = align_clocks(record, "High Acc. Transducer", frames, apexes)
    page.row("found, by the other transducer", f"{other.lag:.3f}", *(f"{bound:.3f}" for bound in other.lag_interval))
    page.paragraph(
        "By hand plateaus were laid upon each other; frames are 0.2 s apart, so that the moment at which a plateau "
        "begins is known to 0.1 s at best. By the other transducer the lag differs by 0.1 s, more "
        "than its interval says; why is not known."
    )


def planted_tables(page: Page, found: list[Outcome]) -> None:
    """A table for each search, a row for each case, and their sum."""
    for search in SEARCHES:
        page.heading(f"Planted lags, {search}")
        page.table(
            "case", "frames every s", "tests", "ambiguous", "lag held", "gross", "median error, s", "median width, s"
        )
        rows = [(case.name, f"{case.interval:g}", k) for k, case in enumerate(CASES)]
        for name, interval, k in [*rows, ("all", "", None)]:
            chosen = [one for one in found if one.search == search and k in (None, one.case)]
            if not chosen:
                continue
            answers = [one for one in chosen if not one.refused]
            page.row(
                name,
                interval,
                len(chosen),
                sum(one.refused == "ambiguous" for one in chosen),
                share(sum(one.held for one in answers), len(answers)),
                sum(one.gross for one in answers),
                f"{np.median([abs(one.error) for one in answers]):.3f}" if answers and k is not None else "-",
                f"{np.median([2 * one.half for one in answers]):.3f}" if answers and k is not None else "-",
            )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--tests", type=int, default=60, help="of each case")
    parser.add_argument("--case", type=int, help="only this one")
    parser.add_argument("--seed", type=int, default=SEED, help="of the planted tests")
    parser.add_argument("--keep", type=Path, help="file of outcomes, so that a run that was broken off goes on")
    options = parser.parse_args()
    page = Page("clock_alignment", __doc__)
    cases = list(range(len(CASES))) if options.case is None else [options.case]
    planted_tables(page, measured_outcomes(cases, options.tests, options.seed, options.keep))
    if DATA.is_dir() and options.case is None:
        static_test(page)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
