#!/usr/bin/env bash
# paramaterial: the rate that is compensated for temperature, after Zener and Hollomon, of tests at two temperatures
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --no-compile paramaterial==0.2.0 numpy==2.4.6 pandas==3.1.1 scipy==1.17.1
MPLBACKEND=Agg "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from math import exp

import paramaterial
import pandas as pd

GAS_CONSTANT = 8.314462618  # J/(mol K)
print(f"paramaterial {version('paramaterial')}, calculate_ZH_parameter with the defaults: Z = rate exp(Q / (R T))")
print(f"  {'Q':>11} {'T':>7} {'rate':>11}  {'Z, planned':>10}  {'Z, paramaterial':>15}  too large by")
factors = {}
for activation, planned in ((150e3, 1e5), (400e3, 1e16)):
    for kelvin in (1000.0, 1200.0):
        rate = planned * exp(-activation / (GAS_CONSTANT * kelvin))
        info = pd.Series({"temperature_K": kelvin, "rate_s-1": rate, "Q_activation": activation})
        item = paramaterial.DataItem("test", pd.DataFrame(), info)
        found = paramaterial.calculate_ZH_parameter(item).info["ZH_parameter"]
        factors[activation, kelvin] = found / planned
        print(f"  {activation / 1e3:4.0f} kJ/mol {kelvin:5.0f} K {rate:8.1e} /s  {planned:10.2e}  {found:15.2e}  {found / planned:.2f}")
print("A good guess: with Q in J/mol and T in K, tests that were planned for one Z get that Z. Seen: the gas constant by default is 8.1345, two")
print("digits of 8.3145 exchanged (models.py), so that Q acts as if it were 2.2 % larger: at 400 kJ/mol Z is too large by a factor of 2.4 to 2.9 and")
print("differs by 19 % between two tests of one Z. plot_ZH_regression passes no other constant on; only a call with gas_constant=8.314462618 is right.")
seen = all(abs(factor - exp(activation / kelvin * (1 / 8.1345 - 1 / GAS_CONSTANT))) < 1e-6 for (activation, kelvin), factor in factors.items())
seen = seen and factors[400e3, 1000.0] > 2.8 and factors[400e3, 1000.0] / factors[400e3, 1200.0] > 1.15
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
