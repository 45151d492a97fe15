#!/usr/bin/env bash
# py3dic: a map of logarithmic strains of a specimen that necks
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 seaborn==0.13.2 openpyxl==3.1.5 tqdm==4.70.1
# Without its notebooks, and OpenCV without windows.
"$folder/env/bin/pip" install --quiet opencv-python-headless==5.0.0.93
"$folder/env/bin/pip" install --quiet --no-deps py3dic==0.5.0
cd "$folder"
MPLBACKEND=Agg env/bin/python -W ignore - <<'PYTHON'
from contextlib import redirect_stdout
from importlib.metadata import version
from io import StringIO

import numpy as np
import pandas as pd
from py3dic.dic import BatchDICStrainProcessor

x, y = (axis.ravel() for axis in np.mgrid[0:200:21j, 0:200:21j])


def marks(image, x, y):
    """One line of the file in which py3dic writes where the marks of an image are."""
    return image + "\t" + "".join(f"{one},{other}\t" for one, other in zip(x, y)) + "\n"


elongated = 1.02 * x + 0.18 * np.clip(x - 100, 0, 40)  # by 2 %, between 100 and 140 pixels by 20 %
with open("result.dic", "w") as file:
    file.write("0\t200\t21\t20\n0\t200\t21\t20\n" + marks("0h.png", x, y) + marks("500h.png", elongated, 0.99 * y) + "\n")
print(f"py3dic {version('py3dic')}: a specimen pulled by 2 % along x, and by 20 % where x is between 100 and 140, at all y")
places = {"in the neck (120, 20)": (120, 20), "outside (20, 120)": (20, 120), "in the neck (120, 120)": (120, 120), "outside (20, 20)": (20, 20)}
formulas = {"cauchy-eng": lambda strain: strain, "green_lagrange": lambda strain: strain + strain**2 / 2, "log": np.log1p}
found = {}
for kind, formula in formulas.items():
    processor = BatchDICStrainProcessor("result.dic", save_image=False, strain_type=kind, analysis_folder=".")
    with redirect_stdout(StringIO()):
        processor.process_data()
    table = pd.read_csv("result/500h_result.csv", index_col=False).set_index(["pos_x", "pos_y"]).strain_xx
    print(f"  {kind}:")
    for words, place in places.items():
        right = formula(0.2 if "neck" in words else 0.02)
        found[kind, words] = table[place] - right
        print(f"    {words:22} strain_xx in the result file {table[place]:.3f}, formula {right:.3f}")
print("A good guess: the kinds of strain differ by their formula, and each stands at its place. Seen: only for logarithmic strains the field is")
print("transposed before it is differentiated, and never transposed back: a neck across the specimen lies along it in files and maps. Of a square")
print("grid of marks, as here, nothing tells; of another one the result file ends with an error. Means, and strains of a uniform field, are right.")
wrong = np.log(1.2 / 1.02)
seen = all(abs(found[kind, words]) < 1e-5 for kind in ("cauchy-eng", "green_lagrange") for words in places)
swapped = [-wrong, wrong, 0, 0]
seen = seen and np.allclose([found["log", words] for words in places], swapped, atol=1e-5)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
