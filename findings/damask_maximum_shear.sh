#!/usr/bin/env bash
# damask: the maximum shear stress of three grains
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet damask==3.1.0 numpy==2.4.6
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from damask import mechanics

# Stresses in MPa with principal values that are known beforehand, each turned by another rotation about two axes.
principal = {"little loaded grain": (12.0, 5.0, 2.0), "grain under tension": (180.0, 10.0, -20.0)}
principal["grain under compression"] = (0.0, -30.0, -160.0)
stresses = []
for angle, values in zip((0.3, 0.7, 1.1), principal.values()):
    cosine, sine = np.cos(angle), np.sin(angle)
    about_z = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    stresses.append(about_z @ about_x @ np.diag(values) @ about_x.T @ about_z.T)
shear = mechanics.maximum_shear(np.array(stresses))
true = np.array([(max(values) - min(values)) / 2 for values in principal.values()])

print(f"damask {version('damask')}: mechanics.maximum_shear, documented as half of the largest less the smallest eigenvalue, in MPa")
for words, one, stated in zip(principal, shear, true):
    print(f"  {words:24} {one:8.2f}, in closed form {stated:7.2f}")
print(f"grain of the highest of them: {list(principal)[int(np.argmax(shear))]}; grains above a limit of 50 MPa: {np.sum(shear > 50)} of 3")
print("A good guess: a maximum shear stress is positive, as the note on the function says. Seen: all are negative, the smallest")
print("eigenvalue less the largest: the highest value of a field is at the point that is least sheared, no point passes a limit after")
print("Tresca, and a creep rate with an odd power of it has the wrong sign. Take the magnitude.")
seen = np.allclose(shear, -true, rtol=1e-12) and int(np.argmax(shear)) == 0
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
