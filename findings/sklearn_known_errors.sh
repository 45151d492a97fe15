#!/usr/bin/env bash
# scikit-learn: the known errors of creep rates in a Gaussian process of normalised values
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet scikit-learn==1.9.1 numpy==2.4.6 scipy==1.17.1
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, RBF

nickel = numpy.linspace(0.0, 1.0, 12)[:, None]
log_rate = -20.0 + 14.0 * nickel[:, 0]  # ln of rates in 1/s over the nickel content: their standard deviation is 4.5
error = numpy.full(12, 0.1)  # of each, known
spread = log_rate.std()


def sd_of_rates(alpha, normalize_y):
    kernel = ConstantKernel(1.0 if normalize_y else spread**2, "fixed") * RBF(0.05, "fixed")
    values = log_rate if normalize_y else log_rate - log_rate.mean()
    process = GaussianProcessRegressor(kernel, alpha=alpha, normalize_y=normalize_y, optimizer=None).fit(nickel, values)
    return process.predict(nickel, return_std=True)[1].mean()


plain, normalised, divided = sd_of_rates(error**2, False), sd_of_rates(error**2, True), sd_of_rates((error / spread) ** 2, True)
print(f"scikit-learn {version('scikit-learn')}: standard deviation that the process gives measured values, each known to {error[0]}")
print(f"values less their mean: {plain:.3f}; normalize_y=True: {normalised:.3f}; and alpha divided by their variance: {divided:.3f}")
print("A good guess: alpha, the variance of additional noise, has the unit of the values that are given, as the predictions have.")
print("Seen: with normalize_y=True it is added after the values were divided by their standard deviation, so that ln of rates")
print("known to 0.1 count as known to 0.44, and intervals are four times too wide (too narrow where values vary by less than 1).")
seen = abs(plain - divided) < 1e-3 and abs(normalised / plain - spread) < 0.2
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
