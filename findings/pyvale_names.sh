#!/usr/bin/env bash
# pyvale: how many files of results do three images give, whose names hold a time with a decimal point?
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pyvale==2026.10.2 numpy==2.4.6 scipy==1.17.1 pillow==12.0.0
cd "$folder"
OMP_NUM_THREADS=1 env/bin/python - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyvale.dic as dic
from PIL import Image
from scipy.ndimage import gaussian_filter, shift

HEIGHT, WIDTH = 130, 160
speckles = gaussian_filter(np.random.default_rng(1).random((HEIGHT, WIDTH)), 2.0, mode="wrap")
speckles = 255.0 * (speckles - speckles.min()) / np.ptp(speckles)


def image(moved: float, path: Path) -> None:
    pixels = shift(speckles, (0.0, moved), order=3, mode="wrap")
    Image.fromarray(pixels.clip(0.0, 255.0).astype(np.uint8)).save(path)


def files_of(folder: Path, names: list[str]) -> dict[str, float]:
    """{file of results: mean displacement in pixels} of images moved by 0.5, 1.0 and 1.5 pixels."""
    folder.mkdir()
    (folder / "results").mkdir()
    image(0.0, folder / "reference.tiff")
    for number, name in enumerate(names, 1):
        image(0.5 * number, folder / name)
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[20:-20, 20:-20] = True
    dic.calculate_2d(
        reference=folder / "reference.tiff",
        deformed=folder / "creep_*.tiff",
        roi_mask=mask,
        seed=[WIDTH // 2, HEIGHT // 2],
        subset_size=21,
        subset_step=10,
        max_displacement=16,
        num_threads=1,
        output_basepath=folder / "results",
        print_level=0,
    )
    results = sorted((folder / "results").iterdir())
    return {path.name: round(float(np.nanmean(np.loadtxt(path, delimiter=",", skiprows=1)[:, 2])), 2) for path in results}


plain = files_of(Path("plain"), ["creep_05h.tiff", "creep_08h.tiff", "creep_10h.tiff"])
point = files_of(Path("point"), ["creep_0.5h.tiff", "creep_0.8h.tiff", "creep_1.0h.tiff"])
print(f"pyvale {version('pyvale')}, calculate_2d, three images moved by 0.5, 1.0 and 1.5 pixels")
print(f"creep_05h, creep_08h, creep_10h:    {plain}")
print(f"creep_0.5h, creep_0.8h, creep_1.0h: {point}")
print("A good guess: results are 'output_prefix + original filename' with the extension changed, as the documentation says.")
print("Seen: a name ends at its first point, so images of one hour share a file; the last one stays, without a warning.")
seen = list(plain.values()) == [0.5, 1.0, 1.5] and point == {"dic_results_creep_0.csv": 1.0, "dic_results_creep_1.csv": 1.5}
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
