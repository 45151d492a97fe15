#!/usr/bin/env bash
# derivative, which pysindy offers as SINDyDerivative: the slope of a straight line that was read at times of equal ratio
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pysindy==2.1.0 derivative==0.6.3 numpy==2.4.6 scipy==1.17.1 scikit-learn==1.8.0
"$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np
from pysindy import FiniteDifference, SINDyDerivative

warnings.simplefilter("ignore")

t = np.geomspace(0.01, 10.0, 60)
line = (3.0 * t)[:, None]
methods = {
    "FiniteDifference of pysindy": FiniteDifference(),
    "kind='finite_difference', k=1": SINDyDerivative(kind="finite_difference", k=1),
    "kind='trend_filtered', order=0": SINDyDerivative(kind="trend_filtered", order=0, alpha=1e-2),
    "kind='savitzky_golay', 0.5 each side, order=1": SINDyDerivative(kind="savitzky_golay", left=0.5, right=0.5, order=1),
    "the same, order=3": SINDyDerivative(kind="savitzky_golay", left=0.5, right=0.5, order=3),
}
print(f"pysindy {version('pysindy')}, derivative {version('derivative')}, x = 3 t without noise, 60 times from 0.01 to 10")
slopes = {}
for name, method in methods.items():
    found = method(line, t)
    slopes[name] = (float(found.min()), float(found.max()))
    print(f"{name:46} slopes from {slopes[name][0]:.3g} to {slopes[name][1]:.4g}")
print("A good guess: times that are handed over are used, and every method gives 3. Seen: 'finite_difference' and")
print("'trend_filtered' take the first step for all steps; 'savitzky_golay' gives 1.5 and 4.5 where its window, a")
print("length of time, holds one point only: the solution of least norm shares the value among the powers, with a RankWarning.")
expected = [(3.0, 3.0), (3.0, 2668.54), (158.049, 158.049), (1.5, 3.0), (3.0, 4.5)]
seen = np.allclose(list(slopes.values()), expected, rtol=1e-4)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
