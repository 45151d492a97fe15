"""Accuracy and speed of bulge simulations: published references, and new cases over the bounds of the paper.

    python tests/benchmarks/dimple_accuracy.py [--cases 200] [--seed 1] [--cache FILE] [--tolerance 0.01] [--write]

Errors are the largest over the history: of apex displacement and D_amp in percent of their largest value, of S_d and
S_p in percent of the value itself. Speed: simulations of 12 h with output every 150 s and the Gaussian fit, CPU time of
one core. The references lie in files beside the project. Each new case has a converged reference of its own: two meshes
and tolerances must agree within 0.03 %, or finer ones are taken. "Effective n" is d ln rate / d ln stress at the stress
that stands for the larger pressure, at a strain of 0.01 and 1e4 s. References are kept in the cache, one line each,
written as soon as it is known; a run that was stopped continues from there.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from bulge_cases import DRAWN_LAWS, TIMES, TRUE, Case, PublishedCase, dimple_references, drawn_cases, fillet_references
from measured import Page, arguments, progress
from public_calls import predict

from creepkit.arrays import Floats
from creepkit.records import PressureJump, Status

AGREEMENT = 0.03
"""%, within which two discretizations of a reference must agree."""

LEVELS = ((3.0, 2e-3), (4.0, 5e-4), (6.0, 2e-4), (8.0, 5e-5))
"""Refinements and tolerances of references, from coarse to fine."""

REPEATS = 3


@dataclass(frozen=True)
class Reference:
    """Reference of one new case: whether it is informative, and its outcome.

    agreement : % between the two finest discretizations; outcome : (288, 4), empty when not informative.
    """

    name: str
    reason: str
    agreement: float = np.nan
    outcome: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Row:
    """Errors in % of one case (apex, D_amp, S_d, S_p), the 12 h apex in mm, CPU seconds of one simulation."""

    case: Case
    errors: Floats
    apex: float
    seconds: float


def errors(values: Floats, expected: Floats) -> Floats:
    """Largest error of apex, D_amp, S_d, S_p over a history, %; NaN for what the reference lacks."""
    whole = np.array([expected[:, 0].max(), expected[:, 1].max(), 1.0, 1.0])
    scale = np.where([True, True, False, False], whole, expected)
    return np.asarray(100 * np.max(np.abs(values - expected) / scale, axis=0))


def cpu(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """CPU seconds of a call: the mean over repeats, after a first one that compiles."""
    work()
    start = time.process_time()
    for _ in range(repeats):
        work()
    return (time.process_time() - start) / repeats


def seconds_of(case: Case) -> float:
    """CPU seconds of one simulation of 12 h with output every 150 s and the fit."""
    plan = [case.history(TIMES)]
    return cpu(lambda: predict(case.specimen, case.model, case.values, plan))


def converged(case: Case) -> Reference:
    """The reference of one case."""
    coarse_run, setup = case.simulation(TIMES[-1], tolerance=3e-2)
    apex = coarse_run.at(coarse_run.displacements[:, setup.model.top[0], 1], _screening_times(case))
    reason = _uninformative(coarse_run.status, apex)
    if reason:
        return Reference(case.name, reason)
    outcomes = (case.outcome(TIMES, refinement=r, tolerance=t) for r, t in LEVELS)
    for coarse, fine in pairwise(outcomes):
        gap = float(errors(coarse, fine)[0])
        if gap <= AGREEMENT:
            break
    return Reference(case.name, "", gap, tuple(map(tuple, np.round(fine, 9).tolist())))


def _screening_times(case: Case) -> Floats:
    """Times at which the apex is screened: after the first ramp, before the jump, after it, the end."""
    assert isinstance(case.loading, PressureJump)
    jump = case.loading.Tj
    return np.array([case.loading.ramp, jump, jump + case.loading.ramp, TIMES[-1]])


def _uninformative(status: Status, apex: Floats) -> str:
    """Why a case is not informative about creep, or an empty string."""
    if status is not Status.COMPLETE:
        return "burst"
    if not 0.08 <= apex[3] <= 2.5:
        return "apex outside 0.08 to 2.5 mm"
    if apex[1] - apex[0] + apex[3] - apex[2] < 0.01:
        return "creep below 0.01 mm"
    return ""


def references(count: int, seed: int, cache: Path | None) -> Iterator[tuple[Case, Reference]]:
    """The first `count` informative cases with their references, from the cache as far as it goes."""
    known = _cached(cache)
    for case in drawn_cases(seed):
        key = f"{seed}/{case.name}"
        if key not in known:
            known[key] = converged(case)
            _append(cache, key, known[key])
        if not known[key].reason:
            yield case, known[key]
            count -= 1
            if count == 0:
                return


def _cached(cache: Path | None) -> dict[str, Reference]:
    if cache is None or not cache.exists():
        return {}
    lines = cache.read_text().splitlines(keepends=True)
    entries = (json.loads(line) for line in lines if line.endswith("\n"))  # the last may have been cut off
    return {entry.pop("key"): Reference(**entry) for entry in entries}


def _append(cache: Path | None, key: str, reference: Reference) -> None:
    if cache is not None:
        with cache.open("a") as file:
            file.write(json.dumps({"key": key, **asdict(reference)}) + "\n")


def published_table(page: Page, title: str, cases: list[PublishedCase]) -> None:
    """Errors and speed of published cases."""
    page.heading(title)
    heads = ("CPU time, ms", "simulations per core-second")
    page.table("case", "apex, %", "D_amp, %", "S_d, %", "S_p, %", *heads)
    seconds = []
    for published in cases:
        seconds.append(seconds_of(published.case))
        case_errors = errors(published.case.outcome(published.times), published.outcome)
        numbers = ("" if np.isnan(e) else f"{e:.3f}" for e in case_errors)
        page.row(published.case.name, *numbers, *_speed(seconds[-1]))
    page.row("mean", "", "", "", "", *_speed(float(np.mean(seconds))))


def _speed(seconds: float) -> tuple[str, str]:
    return f"{1e3 * seconds:.1f}", f"{1 / seconds:.1f}"


def new_rows(count: int, seed: int, cache: Path | None, tolerance: float) -> list[Row]:
    """Errors of production runs of new cases."""
    rows, start = [], time.monotonic()
    for n, (case, reference) in enumerate(references(count, seed, cache), start=1):
        expected = np.array(reference.outcome)
        case_errors = errors(case.outcome(TIMES, tolerance=tolerance), expected)
        rows.append(Row(case, case_errors, float(expected[-1, 0]), seconds_of(case)))
        flag = "" if reference.agreement <= AGREEMENT else f"  reference to {reference.agreement:.3f} % only"
        progress(f"{n:4d}/{count} {time.monotonic() - start:6.0f} s  {case.name:24s} {case_errors[0]:7.3f} %{flag}")
    return rows


def new_tables(page: Page, rows: list[Row]) -> None:
    """Errors of the new cases, as a whole and by groups, and their speed."""
    page.heading(f"{len(rows)} new cases")
    page.table("output", *_SUMMARY_HEADS)
    for k, name in enumerate(("apex", "D_amp", "S_d", "S_p")):
        _summary(page, name, np.array([row.errors[k] for row in rows]))
    page.table("apex, by group", *_SUMMARY_HEADS)
    for name, belongs in GROUPS.items():
        _summary(page, name, np.array([row.errors[0] for row in rows if belongs(row)]))
    seconds = np.array([row.seconds for row in rows])
    page.paragraph(
        f"CPU time of a simulation: mean {1e3 * seconds.mean():.1f} ms, median {1e3 * np.median(seconds):.1f} ms; "
        f"{1 / seconds.mean():.1f} simulations per core-second."
    )


_SUMMARY_HEADS = (
    "cases",
    "median, %",
    "95 % quantile, %",
    "largest, %",
    "within 0.2 %, % of cases",
    "within 0.5 %, % of cases",
)


def _summary(page: Page, name: str, group_errors: Floats) -> None:
    if group_errors.size:
        numbers = (np.median(group_errors), np.quantile(group_errors, 0.95), group_errors.max())
        shares = (100 * np.mean(group_errors <= limit) for limit in (0.2, 0.5))
        page.row(name, group_errors.size, *(f"{x:.3f}" for x in numbers), *(f"{x:.1f}" for x in shares))


GROUPS: dict[str, Callable[[Row], bool]] = {
    **{law: partial(lambda row, law: row.case.law == law, law=law) for law in DRAWN_LAWS}
}


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--cases", type=int, default=200, help="new cases; 0 for the published ones alone")
    parser.add_argument("--seed", type=int, default=1, help="of the Sobol sequence")
    parser.add_argument("--cache", type=Path, help="file that keeps references")
    parser.add_argument("--tolerance", type=float, default=TRUE.tolerance, help="of the production runs of new cases")
    options = parser.parse_args()
    page = Page("dimple_accuracy", __doc__)
    published_table(page, "Five published cases: the dimple, pressure by ramps", dimple_references())
    published_table(page, "Four published cases: a plate with a fillet, loaded at once", fillet_references())
    if options.cases:
        new_tables(page, new_rows(options.cases, options.seed, options.cache, options.tolerance))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
