#!/usr/bin/env bash
# sierras: an activation energy of creep rates whose errors are known
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet sierras==0.2.5 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 scikit-learn==1.9.1 matplotlib==3.11.2
cd "$folder"
MPLBACKEND=Agg env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from sierras import ArrheniusRegressor

GAS_CONSTANT, ENERGY = 8.314462618e-3, 300.0  # kJ/(mol K), kJ/mol
kelvin = np.array([800.0, 850.0, 900.0, 950.0, 1000.0])
planted = 1e-9 * np.exp(-ENERGY / GAS_CONSTANT * (1 / kelvin - 1 / 800))


def by_sierras(rates, weights):
    model = ArrheniusRegressor(constant=GAS_CONSTANT).fit(kelvin[:, None], rates, sample_weight=weights)
    return float(model.activation_energy_)


def least_squares(rates, relative_errors):
    """Activation energy of ln(rate) over 1/T, each test weighted by its relative error, which is the error of ln(rate)."""
    columns = np.column_stack([np.ones_like(kelvin), -1 / (GAS_CONSTANT * kelvin)])
    return np.linalg.lstsq(columns / relative_errors[:, None], np.log(rates) / relative_errors, rcond=None)[0][1]


print(f"sierras {version('sierras')}: five creep rates from {planted[0]:.0e} to {planted[-1]:.0e} /s at 800 to 1000 K, {ENERGY:.0f} kJ/mol")
rng = np.random.default_rng(1)
sets = planted * np.exp(0.2 * rng.normal(size=(1000, kelvin.size)))
plain = np.std([by_sierras(rates, None) for rates in sets])
equal = np.std([by_sierras(rates, np.ones_like(rates)) for rates in sets])
inverse = np.std([by_sierras(rates, 1 / (0.2 * rates) ** 2) for rates in sets])
print("1000 sets in which every rate is known to 20 %, standard deviation of the activation energy:")
print(f"  without weights {plain:4.1f} kJ/mol; sample_weight of ones {equal:4.1f}; of 1 / error**2 {inverse:4.1f}")
relative = np.array([0.03, 0.03, 0.03, 0.03, 1.0])
one_off = planted * np.array([1, 1, 1, 1, 2])
right, unweighted = least_squares(one_off, relative), by_sierras(one_off, None)
errors = by_sierras(one_off, relative * one_off)
mended = by_sierras(one_off, one_off / relative**2)
print("One set, rates known to 3 % but the last, which is known to a factor of 2 and is off by that:")
print(f"  least squares {right:.0f} kJ/mol; sierras without weights {unweighted:.0f}; with the errors as sample_weight {errors:.0f}")
print("A good guess: equal weights change nothing, as in every estimator of scikit-learn, and of errors, which plot draws as error bars, the")
print("larger count less. Seen: weights are divided by the rates, as the error of a logarithm is, but then they serve as weights. Equal ones")
print("leave the slowest tests alone to decide: the activation energy scatters three times more. Errors make the worst test count most, worse")
print(f"than no weights. Weights of the rates squared over the errors squared, times the rates, are right: {mended:.0f} kJ/mol.")
seen = equal > 2 * plain and inverse > 2 * plain and abs(right - ENERGY) < 1 and errors > unweighted + 5 > right + 10
seen = seen and abs(mended / right - 1) < 1e-9
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
