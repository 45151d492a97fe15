#!/usr/bin/env bash
# pyLabFEA: from principal stresses to cylindrical ones and back
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

stresses = np.array([[300.0, 0.0, 0.0], [200.0, 100.0, 0.0], [150.0, 150.0, 150.0], [100.0, -50.0, -50.0]])
cylindrical = pylabfea.sig_princ2cyl(stresses)
print(f"pylabfea {version('pylabfea')}: sig_princ2cyl of four stresses, (equivalent stress, angle, pressure), and back by sig_cyl2princ")
print("  given in MPa         pressure   back alone           first three            all four")
alone = np.array([pylabfea.sig_cyl2princ(row) for row in cylindrical])
three = pylabfea.sig_cyl2princ(cylindrical[:3])
four = pylabfea.sig_cyl2princ(cylindrical)


def text(row):
    return "({:4.0f}, {:4.0f}, {:4.0f})".format(*row.round(6) + 0.0)


for index, row in enumerate(stresses):
    of_three = text(three[index]) if index < 3 else ""
    print(f"  {text(row)} {cylindrical[index, 2]:8.0f}   {text(alone[index])}   {of_three:18}   {text(four[index])}")
print("A good guess: the two undo each other, and a stress comes back alike whatever stands beside it. Seen: of four stresses, or of two")
print("or a thousand, the deviators come back and the pressure is left out; of one and of three a third of the pressure is added, since")
print("it asks for the number of rows where the number of columns is meant, and divides by three what sig_princ2cyl has divided before.")
mean = stresses.mean(1, keepdims=True)
seen = np.allclose(four, stresses - mean, atol=1e-9) and np.allclose(alone, stresses - 2 / 3 * mean, atol=1e-9)
seen = seen and not np.allclose(three, stresses[:3] - mean[:3], atol=1.0)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
