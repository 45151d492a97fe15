#!/usr/bin/env bash
# paramaterial: the smoothed strain rate of a test at a constant rate, and of one whose rate doubles
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --no-compile paramaterial==0.2.0 numpy==2.4.6 pandas==3.1.1 scipy==1.17.1
cd "$folder"
MPLBACKEND=Agg TQDM_DISABLE=1 env/bin/python - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import numpy as np
import paramaterial
import pandas as pd

seconds = np.linspace(0.0, 200.0, 401)
strains = {
    "1e-5 /s throughout": 1e-5 * seconds,
    "2e-5 /s after 100 s": 1e-5 * seconds + 1e-5 * np.maximum(seconds - 100.0, 0.0),
}
Path("data").mkdir()
names = [f"test_{row}" for row in range(len(strains))]
for name, strain in zip(names, strains.values()):
    pd.DataFrame({"Time_s": seconds, "Strain": strain}).to_csv(f"data/{name}.csv", index=False)
pd.DataFrame({"test_id": names}).to_csv("info.csv", index=False)
tests = paramaterial.calculate_strain_rate(paramaterial.DataSet("info.csv", "data"))
print(f"paramaterial {version('paramaterial')}, calculate_strain_rate, readings every 0.5 s, no noise")
print(f"  {'planted':22} {'at':>6}  {'Strain_Rate':>12}  {'Smoothed_Strain_Rate':>20}  ratio")
ratios = []
for words, test in zip(strains, tests):
    for at in (100, 300):
        raw, smooth = test.data["Strain_Rate"].iloc[at], test.data["Smoothed_Strain_Rate"].iloc[at]
        ratios.append(smooth / raw)
        print(f"  {words:22} {seconds[at]:4.0f} s  {raw:9.2e} /s  {smooth:17.2e} /s  {ratios[-1]:.4f}")
print("A good guess: away from the ends and from a jump, the smoothed rate of readings without noise is the rate. Seen: it is a twelfth of it,")
print("in both tests and at both rates. The running sum of five readings is divided by 60, not by 5 (processing.py), under a")
print("name that says nothing but smoothed: a law that is fitted to it has the right exponent and a coefficient that is 12 times too small.")
raise SystemExit(0 if np.allclose(ratios, 1 / 12, rtol=1e-6) else "changed: this is no longer what happens")
PYTHON
