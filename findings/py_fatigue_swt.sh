#!/usr/bin/env bash
# py-fatigue: the damage of cycles from zero to tension, corrected for their mean stress
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet py-fatigue==2.1.1 numpy==2.4.6 numba==0.65.1 pandas==3.1.1
cd "$folder"
env/bin/python -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from py_fatigue import CycleCount, SNCurve
from py_fatigue.damage.stress_life import get_pm
from py_fatigue.mean_stress.corrections import swt_mean_stress_correction

CYCLES, PEAK, SLOPE = 1000, 200.0, 5.0
curve = SNCurve(slope=SLOPE, intercept=15.0)  # for ranges of fully reversed stress, as an S-N curve of the package has them
pulses = CycleCount.from_timeseries(np.append(np.tile([0.0, PEAK], CYCLES), 0.0), np.arange(2.0 * CYCLES + 1))


def equivalent_range(mean, amplitude):
    """Range of fully reversed stress after Smith, Watson and Topper: twice the root of peak times amplitude."""
    return 2 * np.sqrt((mean + amplitude) * amplitude)


def damage(cycles):
    return float(np.sum(get_pm(cycles, curve)))


plain = damage(pulses)
exact_range = equivalent_range(PEAK / 2, PEAK / 2)
exact = CYCLES * exact_range**SLOPE / 10**15
print(f"py_fatigue {version('py_fatigue')}: {CYCLES} cycles from 0 to {PEAK:.0f} MPa, S-N curve of slope {SLOPE:.0f} for fully reversed stress")
print(f"  as counted                      range {pulses.stress_range.max():6.1f} MPa, damage {plain:.2e}")
corrections = {
    "goodman, strength without limit": ("goodman", {"r_out": -1, "ult_s": 1e9}),
    "goodman, strength 500 MPa": ("goodman", {"r_out": -1, "ult_s": 500.0}),
    "swt": ("swt", {}),
    "walker, gamma 0.5": ("walker", {"gamma": 0.5}),
}
damages, ranges = {}, {}
for words, (kind, options) in corrections.items():
    corrected = pulses.mean_stress_correction(kind, **options)
    damages[words], ranges[words] = damage(corrected), float(corrected.stress_range.max())
    print(f"  {words:31} range {ranges[words]:6.1f} MPa, damage {damages[words]:.2e}")
print(f"  Smith, Watson and Topper        range {exact_range:6.1f} MPa, damage {exact:.2e}")
reversed_range = float(swt_mean_stress_correction(np.array([0.0]), np.array([100.0]))[0])
print(f"corrected range of a cycle between -100 and 100 MPa, which has no mean stress, by swt: {reversed_range:.0f} MPa")
print("A good guess: tension on average makes the corrected range larger, as with goodman, and a cycle without mean stress keeps its")
print("range of 200 MPa. Seen: swt and walker give the equivalent amplitude, as their formula in the documentation does, where it says")
print(f"range and where goodman puts a range: cycles of tension become harmless, with {exact / damages['swt']:.0f} times too little damage at a slope of")
print(f"{SLOPE:.0f}, {plain / damages['swt']:.1f} times less than without a correction. Twice its ranges are right.")
seen = abs(2 * ranges["swt"] / exact_range - 1) < 1e-9 and abs(ranges["walker, gamma 0.5"] / ranges["swt"] - 1) < 1e-9
seen = seen and abs(reversed_range - 100) < 1e-9 and abs(ranges["goodman, strength 500 MPa"] - 250) < 1e-3
seen = seen and abs(exact / damages["swt"] / 2**SLOPE - 1) < 0.01
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
