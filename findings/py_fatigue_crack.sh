#!/usr/bin/env bash
# py-fatigue: a crack under blocks of equal cycles
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet py-fatigue==2.1.1 numpy==2.4.6 numba==0.65.1 pandas==3.1.1
cd "$folder"
env/bin/python -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
from py_fatigue import ParisCurve
from py_fatigue.damage import crack_growth  # noqa: F401 (gives data frames their accessor `cg`)
from py_fatigue.geometry.generic import InfiniteSurface

DEPTH, RANGE, SLOPE, COEFFICIENT, CYCLES = 1.0, 100.0, 3.0, 1e-11, 300
paris = ParisCurve(slope=SLOPE, intercept=COEFFICIENT, threshold=1.0, critical=1000.0)


def grown(block):
    """Table of the crack under CYCLES equal cycles, given in rows of BLOCK cycles."""
    rows = CYCLES // block
    table = pd.DataFrame({"count_cycle": rows * [float(block)], "mean_stress": rows * [RANGE], "stress_range": rows * [RANGE]})
    return table.cg.calc_growth(paris, InfiniteSurface(initial_depth=DEPTH))


def depth(cycles):
    """Depth of the crack after cycles, the integral of the law of Paris for a slope of 3."""
    return (DEPTH**-0.5 - 0.5 * COEFFICIENT * (RANGE * np.sqrt(np.pi)) ** SLOPE * cycles) ** -2


print(f"py_fatigue {version('py_fatigue')}, cg.calc_growth: a crack of {DEPTH:.0f} mm, {CYCLES} cycles of {RANGE:.0f} MPa; after these it is, in closed form,")
print(f"{depth(CYCLES):.4f} mm deep, with a stress intensity factor of {RANGE * np.sqrt(np.pi * depth(CYCLES)):.1f} MPa sqrt(mm). The last row of its table says:")
last = {}
for block in (1, 10, 100):
    last[block] = grown(block).iloc[-1]
    words = "a row for each cycle" if block == 1 else f"rows of {block} cycles"
    columns = [float(last[block][name]) for name in ("crack_depth", "sif", "geometry_factor", "cumul_cycle")]
    print("  {:22} crack_depth {:8.4f} mm, sif {:9.1f}, geometry_factor {:3.0f}, cumul_cycle {:5.0f}".format(words, *columns))
print("A good guess: the same depth, however the cycles are put in rows; at most that of the start of the row. Seen: a row of n cycles has")
print("the sum over its cycles of depth, stress intensity factor, geometry factor and of the cycles so far, about n times what is meant,")
print("though the crack itself is grown rightly, cycle by cycle. A crack of 1 mm seems 100 mm deep and past any toughness. A row for each")
print("cycle gives the right numbers.")
seen = abs(last[1]["crack_depth"] / depth(CYCLES) - 1) < 1e-3 and last[1]["cumul_cycle"] == CYCLES
for block in (10, 100):
    expected = depth(np.arange(CYCLES - block, CYCLES)).sum()
    seen = seen and abs(last[block]["crack_depth"] / expected - 1) < 1e-3 and last[block]["geometry_factor"] == block
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
