#!/usr/bin/env bash
# gplearn: the logarithm of a creep rate in the formulas that it searches
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet gplearn==0.4.3 scikit-learn==1.9.1
cd "$folder"
env/bin/python - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy
from gplearn.genetic import SymbolicRegressor

warnings.simplefilter("ignore")
stress = numpy.linspace(50.0, 250.0, 40)
per_second = 1e-18 * stress**5
print(f"gplearn {version('gplearn')}: rate = 1e-18 stress^5 1/s; asked for log(rate), given the rate, with log as the only function")
errors = {}
for unit, factor in (("1/s", 1.0), ("%/h", 3.6e5), ("1e-6/h", 3.6e9)):
    rate = (per_second * factor)[:, None]
    wanted = numpy.log(rate[:, 0])
    search = SymbolicRegressor(
        population_size=50, generations=3, function_set=("log",), init_depth=(1, 1), const_range=None, random_state=0
    ).fit(rate, wanted)
    predicted = search.predict(rate)
    errors[unit] = abs(predicted - wanted).max(), bool((predicted == 0).all()), str(search._program)
    print(f"{unit:6} log(rate) from {wanted[0]:7.3f} to {wanted[-1]:7.3f}; {search._program} predicts {predicted[0]:7.3f} to {predicted[-1]:7.3f}")
print("A good guess: log is the logarithm of the magnitude, guarded at zero, so the unit of a rate shifts it and nothing else.")
print("Seen: the logarithm of every number below 0.001 is 0, in the search and in what a formula predicts, while the formula")
print("as printed says log(X0). Rates in 1/s, and small ones in %/h, lie below.")
seen = errors["1/s"][1] and errors["%/h"][0] > 1 and errors["1e-6/h"] == (0.0, False, "log(X0)")
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
