#!/usr/bin/env bash
# pysindy: does a strong ridge penalty shrink the coefficients of a sparse regression?
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pysindy==2.1.0 numpy==2.4.6 scipy==1.17.1 scikit-learn==1.8.0
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pysindy

t = np.linspace(0.0, 10.0, 201)
x = 2.0 * np.exp(-0.5 * t)[:, None] + np.random.default_rng(0).normal(0.0, 0.05, (t.size, 1))


def coefficient(alpha, **more):
    """Of dx/dt = c x by STLSQ without a threshold."""
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=0.0, alpha=alpha, **more),
        feature_library=pysindy.PolynomialLibrary(degree=1, include_bias=False),
    )
    model.fit(x, t=t)
    return float(model.coefficients()[0, 0])


print(f"pysindy {version('pysindy')}, STLSQ, dx/dt = c x, 201 noisy points of c = -0.5")
alphas = (0.0, 0.05, 1e3, 1e9)
default = [coefficient(alpha) for alpha in alphas]
biased = [coefficient(alpha, unbias=False) for alpha in alphas]
for alpha, one, other in zip(alphas, default, biased):
    print(f"alpha = {alpha:8g}: c = {one:+.4f} by default, {other:+.2e} with unbias=False")
print("A good guess: a penalty of 1e9 drives c to zero. Seen: by default the kept terms are fitted again without the")
print("penalty, so that alpha only decides which terms a threshold removes, and c is the same for every alpha.")
seen = np.ptp(default) < 1e-9 and abs(biased[-1]) < 1e-3 < abs(biased[0])
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
