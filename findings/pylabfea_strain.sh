#!/usr/bin/env bash
# pyLabFEA: principal strains of one bar, its axes turned
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pylabfea==4.4.2 numpy==2.4.6 scipy==1.17.1 scikit-learn==1.9.1 matplotlib==3.11.2
cd "$folder"
env/bin/python - <<'PYTHON'
import os

os.environ["MPLBACKEND"] = "Agg"
from importlib.metadata import version

import numpy as np
import pylabfea

MODULUS, POISSON = 200e3, 0.3
steel = pylabfea.Material()
steel.elasticity(E=MODULUS, nu=POISSON)
shear_modulus = MODULUS / (2 * (1 + POISSON))
print(f"pylabfea {version('pylabfea')}: its stiffness of shear is {steel.CV[5, 5] / shear_modulus:.3f} times the shear modulus, so that shear strains")
print("of its vectors of six are changes of angle, twice the component of the tensor")
stretch = np.diag([0.02, -0.01, -0.01])
print("bar that has crept 2 %; principal strains 2, -1 and -1 %, equivalent strain 2 %:")
extremes, equivalent = [], []
for degrees in (0, 15, 45):
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    tensor = turn @ stretch @ turn.T
    strain = pylabfea.Strain([*np.diag(tensor), 2 * tensor[1, 2], 2 * tensor[0, 2], 2 * tensor[0, 1]])
    values = np.sort(np.real(strain.princ))[::-1]
    extremes.append(float(values[0]))
    equivalent.append(float(strain.eeq()))
    print(f"  axes turned by {degrees:2} degrees: principal strains " + ", ".join(f"{value:6.2%}" for value in values) + f", eeq {equivalent[-1]:.2%}")
twisted = pylabfea.Strain([0, 0, 0, 0, 0, 0.01])
print(f"tube twisted by 1 %: principal strains {np.max(twisted.princ):.2%} and {np.min(twisted.princ):.2%}, which are 0.50 and -0.50 %")
print("A good guess: principal strains do not depend on the axes, and eeq and the stiffness, which take a change of angle, tell what a")
print("vector of six holds. Seen: `princ`, `p` and `tens` put the change of angle into the tensor, so that shear counts twice: a bar")
print("seen along 45 degrees is strained by 3.5 % and not 2 %, a twisted tube by twice its principal strains. A vector with half the")
print("changes of angle has the right principal strains, and then a wrong eeq.")
seen = abs(steel.CV[5, 5] / shear_modulus - 1) < 1e-9 and np.allclose(equivalent, 0.02, rtol=1e-9)
seen = seen and np.allclose(extremes[::2], [0.02, 0.035], rtol=1e-9) and abs(np.max(twisted.princ) - 0.01) < 1e-12
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
