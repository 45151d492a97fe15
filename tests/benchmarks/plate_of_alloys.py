"""A planted plate of alloys: time of the screening, and how often its laws are found.

    python tests/benchmarks/plate_of_alloys.py [--alloys 47] [--seed 7] [--unknown-thickness] [--no-full-law]
                                               [--how through|surrogate|finite-elements] [--workers 2] [--to FOLDER]
                                               [--write]

Each alloy is one dimple under 8, then 10 MPa for 4 h, a frame a minute, with white noise as measured (1.5 um on D_amp,
0.02 mm on S_d, 0.02 on S_p), its law and values drawn around the three of Fig. 7a of Chen et al. The four laws of
Table 1 are identified with intervals, the best one is corrected by finite elements, and Eq. (2) is fitted without
sparsity. "Set of laws": those that the tests cannot rule out. "Covered": planted values, of alloys whose law was found,
inside their 95 % intervals.
"""

import os
import resource
import sys
import tempfile
import time
from collections import Counter
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.screening.results import mean_relative_squared_error
from creepkit.screening.screen import screen

sys.path.append(str(Path(__file__).parents[2] / "examples"))
from planted_plate import THICKNESS_MEAN_SD, planted_plate

MERGED = {"hyperbolic-sine": "norton"}
"""Laws that differ by a curvature alone, which one dimple hardly shows."""


def screening_options(options):
    """Options of screen()."""
    surrogate = None if options.how == "finite-elements" else ck.surrogate("dimple")
    nuisances = [ck.Nuisance("offset"), ck.Nuisance("rate")]
    if options.unknown_thickness:
        nuisances.append(ck.Nuisance("thickness", mean=THICKNESS_MEAN_SD[0], sd=THICKNESS_MEAN_SD[1]))
    screening = ck.ScreeningOptions()
    return {
        "using": surrogate if options.how == "surrogate" else None,
        "options": ck.ScreeningOptions(
            settings=replace(screening.settings, nuisances=tuple(nuisances)),
            through=surrogate if options.how == "through" else None,
            dense=None if options.no_full_law else "combined",
        ),
        "workers": options.workers,
        "progress": lambda task, done, total, note: progress(f"{task}: {done} of {total} ({note})"),
    }


def cost_table(page, plate, wall, spent, workers):
    """Time of the screening."""
    page.table("alloys", "workers", "wall time, min", "CPU time, min", "CPU time of an alloy, s: median", "largest")
    each = [result.cpu_seconds for result in plate.results]
    times = (f"{wall / 60:.1f}", f"{spent / 60:.1f}", f"{np.median(each):.1f}", f"{np.max(each):.1f}")
    page.row(len(plate.results), workers, *times)


def recovery_tables(page, plate, truth):
    """Shares of alloys whose law was found, and of planted values inside their intervals."""
    pairs = [(truth[result.alloy], result) for result in plate.identified]
    right = [planted.law == result.best.law.name for planted, result in pairs]
    shares = {
        "identified": [result.identified for result in plate.results],
        "law found": right,
        "law found, hyperbolic sine and Norton merged": [
            MERGED.get(planted.law, planted.law) == MERGED.get(result.best.law.name, result.best.law.name)
            for planted, result in pairs
        ],
        "planted law in the set of laws": [planted.law in result.credible_laws for planted, result in pairs],
        "decisive": [result.decisive for _, result in pairs],
        "law found, of the decisive ones": [
            planted.law == result.best.law.name for planted, result in pairs if result.decisive
        ],
        "covered (values)": [
            e.low <= planted.values[e.name] <= e.high
            for (planted, result), found in zip(pairs, right, strict=True)
            if found
            for e in result.best.estimates
        ],
    }
    page.table("quantity", "share [95 % interval]", "of")
    for name, hits in shares.items():
        page.row(name, share_with_interval(hits, "wilson"), len(hits))
    if not pairs:
        return
    page.paragraph(f"Mean size of the set of laws: {np.mean([len(r.credible_laws) for _, r in pairs]):.2f}.")
    page.table("planted law", "found", "alloys")
    for (planted, found), count in sorted(Counter((p.law, r.best.law.name) for p, r in pairs).items()):
        page.row(planted, found, count)


def confirmation_table(page, plate):
    """How far finite elements are from the identified laws, and what a single law loses against Eq. (2)."""
    errors = [r.best.numerical_error for r in plate.identified if r.best.numerical_error is not None]
    losses = [
        mean_relative_squared_error(r.best) / mean_relative_squared_error(r.dense_fit)
        for r in plate.identified
        if r.dense_fit is not None
    ]
    page.table("quantity", "alloys", "median", "largest")
    quantities = {
        "finite elements from the predictor, over the noise": [one.noises for one in errors],
        "loss (Eq. 4) of the best law over that of Eq. (2)": losses,
    }
    for name, values in quantities.items():
        if values:
            page.row(name, len(values), f"{np.median(values):.3g}", f"{np.max(values):.3g}")
    page.paragraph(f"Confirmed by finite elements: {sum(one.confirms for one in errors)} of {len(errors)}.")


def cpu_seconds():
    """CPU time of this process and its children that have ended, s."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def main():
    parser = arguments(__doc__)
    parser.add_argument("--alloys", type=int, default=47)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--how", choices=("through", "surrogate", "finite-elements"), default="through")
    parser.add_argument("--no-full-law", action="store_true", help="without the fit of Eq. (2)")
    parser.add_argument("--unknown-thickness", action="store_true")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--to", help="folder in which results are kept")
    options = parser.parse_args()
    planted = planted_plate(options.alloys, options.seed, thickness_known=not options.unknown_thickness)
    folder = nullcontext(options.to) if options.to else tempfile.TemporaryDirectory()
    with folder as to:
        start, before = time.perf_counter(), cpu_seconds()
        settings = screening_options(options)
        plate = screen(planted.histories, compositions=planted.compositions, to=Path(to), **settings)
        wall, spent = time.perf_counter() - start, cpu_seconds() - before
    variant = "" if options.how == "through" else f"_{options.how.replace('-', '_')}"
    page = Page(f"plate_of_alloys{variant}{'_unknown_thickness' if options.unknown_thickness else ''}", __doc__)
    cost_table(page, plate, wall, spent, options.workers or len(os.sched_getaffinity(0)))
    recovery_tables(page, plate, planted.truth)
    confirmation_table(page, plate)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
