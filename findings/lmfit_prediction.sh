#!/usr/bin/env bash
# lmfit: the interval in which the next readings are expected, of a fit with weights
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet lmfit==1.3.4 numpy==2.4.6 scipy==1.17.1
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from lmfit.models import LinearModel
from scipy.stats import t as student

rng = np.random.default_rng(1)
hours = np.linspace(0, 1000, 40)
accuracy = 2e-5
strain = 0.002 + 3e-6 * hours + accuracy * rng.normal(size=hours.size)

# Secondary creep is a straight line, and its intervals are known in closed form; one accuracy for all readings changes none.
columns = np.column_stack([hours, np.ones_like(hours)])
values, squares, *_ = np.linalg.lstsq(columns, strain, rcond=None)
degrees = hours.size - 2
variance = squares[0] / degrees
leverage = np.einsum("ij,jk,ik->i", columns, np.linalg.inv(columns.T @ columns), columns)
line = student.ppf(0.975, degrees) * np.sqrt(variance * leverage)
reading = student.ppf(0.975, degrees) * np.sqrt(variance * (1 + leverage))

print(f"lmfit {version('lmfit')}: half widths in strain at the end of 1000 h, 95 %, of a strain of {strain[-1]:.4f}")
print(f"closed form: line {line[-1]:.2e}, next reading {reading[-1]:.2e}")
ratios = {}
for words, weights in {
    "without weights": None,
    "weights=1/accuracy": np.full_like(strain, 1 / accuracy),
    "weights=1/(accuracy in percent)": np.full_like(strain, 1 / (100 * accuracy)),
}.items():
    result = LinearModel().fit(strain, x=hours, slope=1e-6, intercept=0.001, weights=weights)
    band = result.eval_uncertainty(sigma=0.95)
    ratios[words] = (band / line).mean(), (result.dely_predicted / reading).mean()
    print(f"{words}: line {band[-1]:.2e}, next reading (dely_predicted) {result.dely_predicted[-1]:.2e}")
print("A good guess: weights of one value change nothing, as they change nothing in the parameters, their errors and the band of")
print("the line. Seen: the predicted interval adds the reduced chi-square, a number without a unit that is near 1 where weights")
print("are right, to the square of a strain: plus or minus 2, 200 % of strain, for readings good to 0.002 %. With weights in")
print("percent the same interval is a hundredth of that. Only a fit without weights has an interval of readings.")
right = [abs(ratio - 1) < 0.01 for ratio in (*ratios["without weights"], *(pair[0] for pair in ratios.values()))]
wrong = [ratios["weights=1/accuracy"][1] > 1e4, ratios["weights=1/(accuracy in percent)"][1] > 1e2]
raise SystemExit(0 if all(right + wrong) else "changed: this is no longer what happens")
PYTHON
