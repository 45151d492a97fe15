#!/usr/bin/env bash
# pysindy: an equation of creep as it is printed
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pysindy==2.1.0
cd "$folder"
env/bin/python - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy
import pysindy

warnings.simplefilter("ignore")
time = numpy.linspace(0.0, 3.6e6, 200)
strain = 0.03 * (1 - numpy.exp(-1e-6 * time))
model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0, alpha=0), feature_library=pysindy.PolynomialLibrary(1))
model.fit(strain[:, None], t=time)
coefficients = model.coefficients()[0]
print(f"pysindy {version('pysindy')}: strain over seconds by rate = 3e-8 - 1e-6 strain")
print("coefficients     ", coefficients)
print("equations()      ", model.equations())
print("equations(precision=10)", model.equations(precision=10))
print("A good guess: the equation that is printed is the model. Seen: coefficients are rounded to three decimals, not digits,")
print("and what is zero then is left out: the right model, with both terms within 0.1 %, is printed as rate = 0.000, as if")
print("sparse regression had removed every term. precision counts decimals, so a rate in 1/s needs ten of them or more.")
seen = model.equations()[0].strip() == "0.000" and numpy.allclose(coefficients, [3e-8, -1e-6], rtol=1e-3)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
