#!/usr/bin/env bash
# pyoperon: one creep law, found from rates in two units
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pyoperon==0.6.2 numpy==2.4.6 scikit-learn==1.9.1 scipy==1.17.1
cd "$folder"
env/bin/python - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np
from pyoperon.sklearn import SymbolicRegressor

warnings.simplefilter("ignore")
stress = np.random.default_rng(0).uniform(50.0, 250.0, 200)
rate = 1e-12 * (stress / 100) ** 5  # in 1/s, without noise: slower than 1e-10/s, as parts in service creep


def determination(scale, objective, generations=15):
    """Coefficients of determination of three searches: of the rates times a scale, given as it scores the search itself."""
    seen = []
    for seed in (1, 2, 3):
        search = SymbolicRegressor(
            objectives=[objective], allowed_symbols="add,mul,constant,variable", population_size=200, generations=generations,
            max_length=15, optimizer_iterations=10, n_threads=1, random_state=seed,
        )
        search.fit(stress[:, None] / 100, scale * rate)
        predicted = np.asarray(search.predict(stress[:, None] / 100), float) / scale
        seen.append(1 - np.sum((predicted - rate) ** 2) / np.sum((rate - rate.mean()) ** 2))
    print(f"  {objective}, generations {generations:2}: " + ", ".join(f"{value:.6f}" for value in seen))
    return seen


print(f"pyoperon {version('pyoperon')}: rate = 1e-12 (stress / 100 MPa)^5 in 1/s, a product of the stress with itself")
print("coefficient of determination of three searches, rates in 1/s:")
first, slow, slow_squares = determination(1, "r2", 1), determination(1, "r2"), determination(1, "mse")
print("the same rates in per cent in 1000 h:")
fast, fast_squares = determination(3.6e8, "r2"), determination(3.6e8, "mse")
print("A good guess: r2, the default objective, has no unit, so that the law is found in every unit, and mse, a square of the")
print("rates, may not. Seen: it is the other way about. With r2 no formula of rates below 1e-9/s gets a score: what the search")
print("returns after fifteen generations is what it had in the first, here a constant or a parabola. With mse the law is found in")
print("both units. Rates in per cent in 1000 h, which are numbers near 1, let the default find it.")
seen = first == slow and max(slow) < 0.999 and min(slow_squares + fast + fast_squares) > 0.9999
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
