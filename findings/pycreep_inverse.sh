#!/usr/bin/env bash
# pycreep: is the stress for the predicted life of a stress the stress itself?
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 openpyxl==3.1.5 Pint==0.25
# Without its dependencies: the time-temperature parameters need none of PyTorch and Pyro.
"$folder/env/bin/pip" install --quiet --no-deps pycreep==1.2.0
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
from pycreep.ttp import LarsonMillerParameter, UncenteredAnalysis

# Lives without scatter, from a Larson-Miller parameter that is a quadratic in log10 of the stress and falls over all tests.
tests = [
    {"Temp (C)": T, "Stress (MPa)": s, "Heat/Lot ID": "A", "Life (h)": 10 ** (P / (T + 273.15) - 20)}
    for T in (550.0, 600.0, 650.0)
    for s in (60.0, 80.0, 100.0, 120.0, 150.0, 180.0)
    for P in [60000 - 27000 * np.log10(s) + 5000 * np.log10(s) ** 2]
]
analysis = UncenteredAnalysis(LarsonMillerParameter(), 2, pd.DataFrame(tests)).analyze()
stress, temperature = np.array([80.0, 100.0, 150.0]), np.full(3, 873.15)
life = analysis.predict_time(stress, temperature)
back = analysis.predict_stress(life, temperature)
bounded = analysis.predict_stress(life, temperature, root_bounds=(60.0, 180.0))

print(f"pycreep {version('pycreep')}, Larson-Miller, second order, 18 tests from 60 to 180 MPa, R2 = {analysis.R2:.6f}")
print(f"stresses:                          {stress} MPa")
print(f"predict_stress of their lives:     {back.round(0)} MPa")
print(f"the same with root_bounds=(60, 180): {bounded.round(1)} MPa")
print("A good guess: predict_stress undoes predict_time. Seen: where the parameter is convex in log stress, the larger")
print("of two roots is returned, here 10 to 40 times the stress, on the branch where life grows with stress; no warning.")
seen = np.all(back > 1000.0) and np.allclose(bounded, stress, rtol=1e-6)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
