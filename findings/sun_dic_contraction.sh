#!/usr/bin/env bash
# SUN-DIC: the lateral strain of a specimen that is pulled, from two images
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet numpy==2.4.6 scipy==1.17.1 natsort==8.4.0 scikit-image==0.26.0 numba==0.65.1 msgpack-numpy==0.4.8
"$folder/env/bin/pip" install --quiet matplotlib==3.11.2 pandas==3.1.1 opencv-contrib-python-headless==5.0.0.93
"$folder/env/bin/pip" install --quiet --no-deps sun-dic==0.0.35  # without its windows and parallel runs
mkdir "$folder/images"
cd "$folder"
MPLBACKEND=Agg env/bin/python -W ignore - <<'PYTHON'
from importlib.metadata import version

import cv2
import numpy as np
from sundic.post_process import CompID, DispComp, StrainComp, getDisplacements, getStrains
from sundic.settings import Settings
from sundic.sundic import planarDICLocal

WIDTH, HEIGHT = 320, 160
random = np.random.default_rng(1)
speckles = random.uniform([-20, -20], [WIDTH + 20, HEIGHT + 20], (5000, 2))
centre = np.array([WIDTH, HEIGHT]) / 2


def photograph(name, axial, lateral):
    """Image of Gaussian speckles whose centres move with a uniform strain along x and y."""
    image = np.zeros((HEIGHT + 80, WIDTH + 80))  # with a margin, for speckles that are cut off
    for x, y in centre + (speckles - centre) * [1 + axial, 1 + lateral] + 40:
        rows, columns = np.ogrid[int(y) - 8 : int(y) + 9, int(x) - 8 : int(x) + 9]
        image[rows, columns] += np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 8)
    cv2.imwrite(f"images/{name}.png", np.clip(115 * image[40:-40, 40:-40], 0, 255).astype(np.uint8))


def strains(axial, lateral):
    """Means over 20 rows of subsets of the strains by SUN-DIC and by lines through its displacements; lateral strain of each row."""
    photograph("0h", 0, 0)
    photograph("500h", axial, lateral)
    settings = Settings()
    settings.ImageFolder, settings.DebugLevel, settings.ROI = "images", 0, [30, 30, 260, 100]
    planarDICLocal(settings, "results.sdic")
    moved, rows, columns = getDisplacements("results.sdic", -1)
    field, _, _ = getStrains("results.sdic", -1)
    lines = [
        np.polyfit(moved[:, place], moved[:, moves], 1)[0]
        for place, moves in ((CompID.XCoordID, DispComp.X_DISP), (CompID.YCoordID, DispComp.Y_DISP))
    ]
    by_row = field[:, StrainComp.Y_STRAIN].reshape(columns, rows).mean(axis=0)
    return np.array([field[:, StrainComp.X_STRAIN].mean(), by_row.mean()]), np.array(lines), by_row


print(f"SUN-DIC {version('sun-dic')} with its defaults: speckles, 52 by 20 subsets")
found = {}
for words, axial, lateral in (("pulled by 2 %, narrower by 0.6 %", 0.02, -0.006), ("pressed by 2 %, wider by 0.6 %", -0.02, 0.006)):
    mean, lines, by_row = found[axial] = strains(axial, lateral)
    print(f"  {words:33} along x: mean strain {mean[0]:+.4f}, line through displacements {lines[0]:+.4f}")
    print(f"  {'':33} along y: mean strain {mean[1]:+.4f}, line through displacements {lines[1]:+.4f}")
mean, lines, by_row = found[0.02]
print("  strain along y of the first rows of the specimen that is pulled: " + ", ".join(f"{value:+.4f}" for value in by_row[:6]))
print(f"  its Poisson's ratio from mean strains {-mean[1] / mean[0]:.2f}, from lines through the displacements {-lines[1] / lines[0]:.2f}")
print("A good guess: in a uniform field the strain at a border is a little more uncertain than inside. Seen: before smoothing the displacements are")
print("continued beyond the border by the size of their differences, so that a field that falls turns round there: where a specimen shortens, its")
print("strain fades to nothing within half a window, and where it lengthens all is right. Of 0.6 % contraction 22 % are lost over 20 rows, of 12 rows")
print("36 %: tension seems to swell a specimen. Displacements as measured, or rows half a window away from borders, are right.")
fade = [0, 1 / 3, 19 / 30, 13 / 15, 1, 1]  # of a line that turns round, by least squares of a parabola in a window of nine
seen = np.allclose(by_row[:6] / -0.006, fade, atol=0.06) and np.allclose(lines, [0.02, -0.006], atol=1e-4) and abs(mean[0] / 0.02 - 1) < 0.01
mean, lines, _ = found[-0.02]
seen = seen and abs(mean[1] / 0.006 - 1) < 0.03 and np.allclose(lines, [-0.02, 0.006], atol=1e-4) and 0.9 < mean[0] / -0.02 < 0.93
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
