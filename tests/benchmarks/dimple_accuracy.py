"""How accurate and how fast bulge simulations are: two sets of published references, and fresh cases over the bounds.

Run as ``python tests/benchmarks/dimple_accuracy.py [--cases 200] [--seed 1] [--cache FILE] [--tolerance 0.01]``.

Errors are the largest over the history: of the apex and D_amp in % of their largest value, of S_d and S_p in % of the
value itself. Speed: simulations of 12 h with output every 150 s and the Gaussian fit, per CPU second of one core.
Each fresh case has a reference of its own, converged: two meshes and tolerances must agree within .03 %, or finer ones
are taken. References are kept in the cache, one line each, written as soon as it is known; a run that was stopped goes
on from there.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from bulge_cases import FRESH_LAWS, TIMES, TRUE, Case, Known, dimple_references, fillet_references, fresh_cases

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.records import PressureJump, Status

AGREEMENT = 0.03
"""%, within which two discretizations of a reference must agree."""

LEVELS = ((3.0, 2e-3), (4.0, 5e-4), (6.0, 2e-4), (8.0, 5e-5))
"""Refinements and tolerances of references, from coarse to fine."""

REPEATS = 3


@dataclass(frozen=True)
class Reference:
    """What is known of one fresh case: whether it is informative, and its outcome.

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


def errors(found: Floats, expected: Floats) -> Floats:
    """Largest error of apex, D_amp, S_d, S_p over a history, %; NaN for what is not known."""
    whole = np.array([expected[:, 0].max(), expected[:, 1].max(), 1.0, 1.0])
    scale = np.where([True, True, False, False], whole, expected)
    return np.asarray(100 * np.max(np.abs(found - expected) / scale, axis=0))


def cpu(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """CPU seconds of a call: the mean over repeats, after a first one that compiles and warms."""
    work()
    start = time.process_time()
    for _ in range(repeats):
        work()
    return (time.process_time() - start) / repeats


def seconds_of(case: Case) -> float:
    """CPU seconds of one simulation of 12 h with output every 150 s and the fit."""
    plan = [case.history(TIMES)]
    return cpu(lambda: case.specimen.predict(case.model, case.model.to_internal(case.values), plan))


def converged(case: Case) -> Reference:
    """The reference of one case."""
    screened, made = case.simulation(TIMES[-1], tolerance=3e-2)
    reason = _uninformative(screened.status, screened.at(screened.displacements[:, made.model.top[0], 1], _marks(case)))
    if reason:
        return Reference(case.name, reason)
    outcomes = (case.outcome(TIMES, refinement=r, tolerance=t) for r, t in LEVELS)
    for coarse, fine in pairwise(outcomes):
        gap = float(errors(coarse, fine)[0])
        if gap <= AGREEMENT:
            break
    return Reference(case.name, "", gap, tuple(map(tuple, np.round(fine, 9).tolist())))


def _marks(case: Case) -> Floats:
    """Times at which a screened apex is looked at: after the first ramp, before the jump, after it, the end."""
    assert isinstance(case.loading, PressureJump)
    jump = case.loading.Tj
    return np.array([case.loading.ramp, jump, jump + case.loading.ramp, TIMES[-1]])


def _uninformative(status: Status, apex: Floats) -> str:
    """Why a case says nothing about creep, or an empty string."""
    if status is not Status.COMPLETE:
        return "burst"
    if not 0.08 <= apex[3] <= 2.5:
        return "apex outside .08 to 2.5 mm"
    if apex[1] - apex[0] + apex[3] - apex[2] < 0.01:
        return "creep below .01 mm"
    return ""


def references(count: int, seed: int, cache: Path | None) -> Iterator[tuple[Case, Reference]]:
    """The first `count` informative cases with their references, from the cache as far as it goes."""
    known = _cached(cache)
    for case in fresh_cases(seed):
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


def known_table(title: str, cases: list[Known]) -> None:
    """Print the errors and the speed of published cases."""
    names = ("apex %", "D_amp %", "S_d %", "S_p %", "CPU ms", "per s")
    print(f"\n{title}\n{'case':8s}" + "".join(f" {name:>8s}" for name in names))
    seconds = []
    for known in cases:
        seconds.append(seconds_of(known.case))
        found = errors(known.case.outcome(known.times), known.outcome)
        print(f"{known.case.name:8s} " + " ".join(f"{e:8.3f}" for e in found) + _speed(seconds[-1]))
    print(f"{'mean':44s}" + _speed(float(np.mean(seconds))))


def _speed(seconds: float) -> str:
    return f" {1e3 * seconds:8.1f} {1 / seconds:8.1f}"


def fresh_rows(count: int, seed: int, cache: Path | None, tolerance: float) -> list[Row]:
    """Errors of production runs of fresh cases."""
    rows, begun = [], time.monotonic()
    for n, (case, reference) in enumerate(references(count, seed, cache), start=1):
        expected = np.array(reference.outcome)
        found = errors(case.outcome(TIMES, tolerance=tolerance), expected)
        rows.append(Row(case, found, float(expected[-1, 0]), seconds_of(case)))
        flag = "" if reference.agreement <= AGREEMENT else f"  reference to {reference.agreement:.3f} % only"
        print(f"{n:4d}/{count} {time.monotonic() - begun:6.0f} s  {case.name:24s} {found[0]:7.3f} %{flag}", flush=True)
    return rows


def fresh_table(rows: list[Row]) -> None:
    """Print what the fresh cases say, as a whole and where their tail is."""
    print(f"\n{len(rows)} fresh cases, error of the history, %")
    print(f"{'':32s} {'cases':>5s} {'median':>8s} {'95 %':>8s} {'largest':>8s} {'<= .2 %':>8s} {'<= .5 %':>8s}")
    for k, name in enumerate(("apex", "D_amp", "S_d", "S_p")):
        _summary(name, np.array([row.errors[k] for row in rows]))
    print("the apex alone, by")
    for name, belongs in GROUPS.items():
        _summary(name, np.array([row.errors[0] for row in rows if belongs(row)]))
    print("the ten worst")
    for row in sorted(rows, key=lambda row: -row.errors[0])[:10]:
        values = ", ".join(f"{name} {value:.3g}" for name, value in row.case.values.items())
        size = f"{row.errors[0]:.3f} % of {row.apex:.3f} mm"
        print(f"  {size}  {row.case.name}: {values}, effective n {steepness(row.case):.1f}")
    seconds = np.array([row.seconds for row in rows])
    print(f"CPU ms of a simulation: mean {1e3 * seconds.mean():.1f}, median {1e3 * np.median(seconds):.1f}; "
          f"{1 / seconds.mean():.1f} per core-second")  # fmt: skip


def _summary(name: str, found: Floats) -> None:
    if found.size:
        shares = [100 * np.mean(found <= limit) for limit in (0.2, 0.5)]
        print(f"{name:32s} {found.size:5d} {np.median(found):8.3f} {np.quantile(found, 0.95):8.3f} {found.max():8.3f} "
              f"{shares[0]:8.1f} {shares[1]:8.1f}")  # fmt: skip


def steepness(case: Case) -> float:
    """d ln rate / d ln stress at the stress that stands for the larger pressure, strain .01 and 1e4 s: effective n."""
    stress = case.specimen.reference_stress(case.history(TIMES))[-1] * np.array([0.99, 1.01])
    rate = kernels.lower(case.model, "numpy").log_rate(case.values, stress=stress, strain=0.01, time=1e4)
    return float(np.diff(rate)[0] / np.diff(np.log(stress))[0])


GROUPS: dict[str, Callable[[Row], bool]] = {
    **{law: partial(lambda row, law: row.case.law == law, law=law) for law in FRESH_LAWS},
    "effective n below 4": lambda row: steepness(row.case) < 4,
    "effective n 4 to 6.5": lambda row: 4 <= steepness(row.case) < 6.5,
    "effective n above 6.5": lambda row: steepness(row.case) >= 6.5,
    "strain hardening, m below -.5": lambda row: row.case.law == "strain-hardening" and row.case.values["m"] < -0.5,
    "apex at 12 h below .3 mm": lambda row: row.apex < 0.3,
    "apex at 12 h .3 to 1 mm": lambda row: 0.3 <= row.apex < 1,
    "apex at 12 h above 1 mm": lambda row: row.apex >= 1,
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200, help="fresh cases; 0 for the published ones alone")
    parser.add_argument("--seed", type=int, default=1, help="of the Sobol sequence")
    parser.add_argument("--cache", type=Path, help="file that keeps references")
    parser.add_argument("--tolerance", type=float, default=TRUE.tolerance, help="of the fresh production runs")
    chosen = parser.parse_args()
    known_table("dimple_reference.json: the true dimple, pressure by ramps", dimple_references())
    known_table("fe_reference.json: a plate with a fillet, loaded at once", fillet_references())
    if chosen.cases:
        fresh_table(fresh_rows(chosen.cases, chosen.seed, chosen.cache, chosen.tolerance))


if __name__ == "__main__":
    main()
