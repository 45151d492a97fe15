#!/usr/bin/env bash
# py3dic: strains of a specimen that is pulled, with rigid motion removed and without
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
from py3dic.dic import BatchDICStrainProcessor

x, y = (axis.ravel() for axis in np.mgrid[0:200:21j, 0:200:21j])


def marks(image, x, y):
    """One line of the file in which py3dic writes where the marks of an image are."""
    return image + "\t" + "".join(f"{one},{other}\t" for one, other in zip(x, y)) + "\n"


with open("result.dic", "w") as file:  # pulled by 20 % along x, narrower by 9 %, and moved by 3 pixels
    file.write("0\t200\t21\t20\n0\t200\t21\t20\n" + marks("0h.png", x, y) + marks("500h.png", 1.2 * x + 3, 0.91 * y) + "\n")
print(f"py3dic {version('py3dic')}: a specimen pulled by 20 % along x, narrower by 9 %, and moved; mean strains of the last image")
formulas = {"cauchy-eng": (0.2, -0.09), "green_lagrange": (0.22, (0.91**2 - 1) / 2), "log": (np.log(1.2), np.log(0.91))}
found = {}
for removed in (True, False):
    for kind, right in formulas.items():
        processor = BatchDICStrainProcessor(
            "result.dic", save_image=False, strain_type=kind, rm_rigid_body_transform=removed, unit_test_mode=True, analysis_folder="."
        )
        with redirect_stdout(StringIO()):
            processor.process_data()
        mean = processor.grids[1].obtain_strains()
        found[removed, kind] = float(mean["e_xx"]), float(mean["e_yy"])
        words = "rigid motion removed, the default" if removed else "rm_rigid_body_transform=False"
        print(f"  {words:34} {kind:15} x {found[removed, kind][0]:+.3f}, y {found[removed, kind][1]:+.3f}; formula x {right[0]:+.3f}, y {right[1]:+.3f}")
print("A good guess: what moves and turns as a whole strains nothing, so that the option changes no strain of this specimen. Seen: without it")
print("displacements run from the strained image to the first one, for the two are handed over in the wrong order: tension is compression, and")
print("no strain but the small one is right even with its sign turned, for squares keep theirs: 18 % in place of 22 %. Displacements too have the")
print("wrong sign. By default, with rigid motion removed, all is right.")
seen = all(np.allclose(found[True, kind], right, atol=1e-5) for kind, right in formulas.items())
wrong = {"cauchy-eng": (-0.2, 0.09), "green_lagrange": ((0.8**2 - 1) / 2, (1.09**2 - 1) / 2), "log": (np.log(0.8), np.log(1.09))}
seen = seen and all(np.allclose(found[False, kind], value, atol=1e-5) for kind, value in wrong.items())
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
