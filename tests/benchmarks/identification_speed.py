"""How long an identification of one dimple takes: the speed table of the README.

    python tests/benchmarks/identification_speed.py [--specimens 4]

Planted tests of tests/benchmarks/planted.py (jump of pressure, 48 frames), after one that is not counted. Medians over
specimens of wall and CPU seconds: one law, the four laws of Table 1 with intervals, Eq. (1) with m = 0; through the
surrogate that comes with creepkit, and with finite elements in the loop. Ratios to the first line are of one run.
"""

import argparse
import time

import numpy as np
import planted

import creepkit as ck
from creepkit.cli import set_numba_cache


def timed(function):
    """Wall and CPU seconds of a call."""
    wall, cpu = time.perf_counter(), time.process_time()
    function()
    return time.perf_counter() - wall, time.process_time() - cpu


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--specimens", type=int, default=4)
    given = options.parse_args()
    set_numba_cache()
    dimple, model = ck.specimen("bulge"), ck.surrogate("dimple")
    design = planted.DESIGNS["jump"]
    specimens = [planted.specimen(k, planted.SINGLE, design, dimple) for k in range(given.specimens + 1)]
    drifting = ck.law("drifting-exponent").fix(m=0)
    how = dict(nuisances=design.nuisances, weights="likelihood", frames=60)
    print("| what | using | wall s | CPU s | CPU over the first |\n|-|-|-|-|-|")
    first = None
    for using, name in ((model, "surrogate"), (dimple, "finite elements")):
        for title, run in (
            ("one law, its own", lambda s, u=using: ck.identify(s.law, s.tests, u, **how)),
            ("four laws with intervals",
             lambda s, u=using: ck.select(planted.SINGLE, s.tests, u, nuisances=design.nuisances)),
            ("Eq. (1), m = 0", lambda s, u=using: ck.identify(drifting, s.tests, u, **how)),
        ):  # fmt: skip
            run(specimens[0])
            seconds = np.median([timed(lambda s=s, r=run: r(s)) for s in specimens[1:]], axis=0)
            first = first or seconds[1]
            print(f"| {title} | {name} | {seconds[0]:.2f} | {seconds[1]:.2f} | {seconds[1] / first:.1f} |", flush=True)


if __name__ == "__main__":
    main()
