"""Time of an identification of one dimple, through the reduced-order model and by finite elements.

    python tests/benchmarks/identification_speed.py [--specimens 4] [--write]

Planted tests of planted_bulge_tests.py (one jump of pressure, 48 frames), after one that is not counted. Medians over
the specimens of wall and CPU time: one law, the planted one; the four laws of Table 1 with intervals; Eq. (1) with m =
0. The last column is the ratio of CPU time to the first row of the same run.
"""

import time

import numpy as np
import planted_bulge_tests as planted
from measured import Page, arguments

import creepkit as ck

DESIGN = planted.DESIGNS["jump"]
SETTINGS = dict(nuisances=DESIGN.nuisances, weights="likelihood", frames=60)


def one_law(specimen, using):
    return ck.identify(specimen.law, specimen.tests, using, **SETTINGS)


def four_laws(specimen, using):
    return ck.select(planted.SINGLE, specimen.tests, using, nuisances=DESIGN.nuisances)


def drifting_exponent(specimen, using):
    return ck.identify(ck.law("drifting-exponent").fix(m=0), specimen.tests, using, **SETTINGS)


TASKS = {"one law": one_law, "four laws with intervals": four_laws, "Eq. (1), m = 0": drifting_exponent}


def timed(task, specimen, using):
    """Wall and CPU seconds of a call."""
    wall, cpu = time.perf_counter(), time.process_time()
    task(specimen, using)
    return time.perf_counter() - wall, time.process_time() - cpu


def main():
    parser = arguments(__doc__)
    parser.add_argument("--specimens", type=int, default=4)
    options = parser.parse_args()
    dimple = ck.specimen("bulge")
    specimens = [planted.specimen(k, planted.SINGLE, DESIGN, dimple) for k in range(options.specimens + 1)]
    page = Page("identification_speed", __doc__)
    page.table("identification", "through", "wall time, s", "CPU time, s", "CPU time over the first row")
    first = None
    for using, through in ((ck.surrogate("dimple"), "surrogate"), (dimple, "finite elements")):
        for title, task in TASKS.items():
            task(specimens[0], using)
            wall, cpu = np.median([timed(task, specimen, using) for specimen in specimens[1:]], axis=0)
            first = first or cpu
            page.row(title, through, f"{wall:.2f}", f"{cpu:.2f}", f"{cpu / first:.1f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
