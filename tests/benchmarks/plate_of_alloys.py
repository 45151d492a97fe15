"""A planted plate of alloys on all cores: time, and how often its laws are found.

    python tests/benchmarks/plate.py [--alloys 47] [--seed 7] [--how through|surrogate|finite-elements] [--no-dense]
                                     [--unknown-thickness] [--workers 2] [--to FOLDER]

Each alloy is one dimple, 8 then 10 MPa, 4 h, a frame a minute, with white noise as measured (1.5 um, .02 mm, .02), its
law and values drawn around the three of Fig. 7a of Chen et al. (creepkit.screening.planted). The four laws of Table 1 are
identified with intervals, the best one is confirmed by finite elements, and Eq. (2) is fitted without sparsity unless
--no-dense. --how through searches in the surrogate that comes with creepkit and ends with finite elements; surrogate
has nothing else; finite-elements does without it. Planting is not timed. Started again with the same --to, it goes on,
and its time is not one.

Shares are given with their 95 % intervals (Wilson). "covered" is the share of planted values, of those alloys whose
law was found, that lie in their 95 % intervals.
"""

import argparse
import os
import resource
import tempfile
import time
from collections import Counter
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.screening.planted import THICKNESS_MEAN_SD, planted_plate
from creepkit.screening.screen import screen

MERGED = {"hyperbolic-sine": "norton"}
"""Laws that differ by a curvature alone, which one dimple hardly shows."""


def main():
    set_numba_cache()
    given = options().parse_args()
    planted = planted_plate(given.alloys, given.seed, thickness_known=not given.unknown_thickness)
    folder = nullcontext(given.to) if given.to else tempfile.TemporaryDirectory()
    with folder as to:
        began, before = time.perf_counter(), cpu()
        plate = screen(planted.histories, compositions=planted.compositions, to=Path(to), **how(given))
        wall, spent = time.perf_counter() - began, cpu() - before
    workers = given.workers or len(os.sched_getaffinity(0))
    print(f"{given.alloys} alloys, {given.how}: {wall / 60:.1f} min on {workers} workers, {spent / 60:.1f} CPU-min; "
          f"of an alloy, CPU-s: {quantiles([a.cpu_seconds for a in plate.results])}")  # fmt: skip
    recovered(plate, planted.truth)
    confirmed(plate)
    print(f"\n{plate}")


def how(given):
    """What screen() is told."""
    model = None if given.how == "finite-elements" else ck.surrogate("dimple")
    nuisances = [ck.Nuisance("offset"), ck.Nuisance("rate")]
    if given.unknown_thickness:
        nuisances.append(ck.Nuisance("thickness", mean=THICKNESS_MEAN_SD[0], sd=THICKNESS_MEAN_SD[1]))
    return {
        "using": model if given.how == "surrogate" else None,
        "through": model if given.how == "through" else None,
        "nuisances": nuisances,
        "dense": None if given.no_dense else "combined",
        "confirm": True,
        "workers": given.workers,
        "progress": lambda task, done, total, note: print(f"{task}: {done} of {total} ({note})", flush=True),
    }


def recovered(plate, truth):
    """Shares of alloys whose law was found, and of planted values inside their intervals."""
    told = {a.alloy: (truth[a.alloy], a) for a in plate.identified}
    best = [t.law == a.best.law.name for t, a in told.values()]
    merged = [MERGED.get(t.law, t.law) == MERGED.get(a.best.law.name, a.best.law.name) for t, a in told.values()]
    sure = [t.law == a.best.law.name for t, a in told.values() if a.decisive]
    inside = [
        e.low <= t.values[e.name] <= e.high
        for t, a in told.values() if t.law == a.best.law.name for e in a.best.estimates
    ]  # fmt: skip
    print("\n| quantity | share | 95 % interval | of |\n|-|-|-|-|")
    rows = {
        "identified": [a.identified for a in plate.answers], "law right": best, "right, sinh and power merged": merged,
        "truth in the set": [t.law in a.credible for t, a in told.values()],
        "decisive": [a.decisive for _, a in told.values()], "right where decisive": sure, "covered": inside,
    }  # fmt: skip
    for name, hits in rows.items():
        print(f"| {name} | {share(hits)} | {len(hits)} |")
    print(f"mean size of the set {np.mean([len(a.credible) for _, a in told.values()]):.2f}")
    confusion = Counter((t.law, a.best.law.name) for t, a in told.values())
    for (planted, found), count in sorted(confusion.items()):
        print(f"  {planted} found as {found}: {count}")


def confirmed(plate):
    """How far finite elements are from what was identified, and what sparsity costs."""
    told = [a.confirmation for a in plate.identified if a.confirmation is not None]
    print(f"confirmed {sum(c.holds for c in told)} of {len(told)}; finite elements from the fit, times the noise: "
          f"{quantiles([c.distance for c in told])}")  # fmt: skip
    from creepkit.screening.results import mean_relative_squared_error

    costs = [
        mean_relative_squared_error(a.reduced) / mean_relative_squared_error(a.dense)
        for a in plate.identified
        if a.dense is not None
    ]
    if costs:
        print(f"loss of the reduced law over that without sparsity: {quantiles(costs)}")


def share(hits):
    """A share with its Wilson interval."""
    if not hits:
        return "- | -"
    ends = binomtest(int(sum(hits)), len(hits)).proportion_ci(method="wilson")
    return f"{np.mean(hits):.3f} | {ends.low:.3f} to {ends.high:.3f}"


def quantiles(values):
    """Median and largest."""
    return f"median {np.median(values):.3g}, largest {np.max(values):.3g}" if len(values) else "none"


def cpu():
    """CPU time of this process and its children that have ended, s."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(r.ru_utime + r.ru_stime for r in both)


def options():
    found = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    found.add_argument("--alloys", type=int, default=47)
    found.add_argument("--seed", type=int, default=7)
    found.add_argument("--how", choices=("through", "surrogate", "finite-elements"), default="through")
    found.add_argument("--no-dense", action="store_true")
    found.add_argument("--unknown-thickness", action="store_true")
    found.add_argument("--workers", type=int)
    found.add_argument("--to")
    return found


if __name__ == "__main__":
    main()
