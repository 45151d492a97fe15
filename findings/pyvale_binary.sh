#!/usr/bin/env bash
# pyvale: are displacements that it wrote as .dic2d read back by import_2d as they were?
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


def displacements(height: int, width: int, binary: bool) -> np.ndarray:
    """Displacement in pixels at each subset, written by pyvale and read by it, of speckles moved by half a pixel."""
    folder = Path(f"{height}x{width}_{binary}")
    (folder / "results").mkdir(parents=True)
    speckles = gaussian_filter(np.random.default_rng(1).random((height, width)), 2.0, mode="wrap")
    speckles = 255.0 * (speckles - speckles.min()) / np.ptp(speckles)
    for name, moved in (("reference", 0.0), ("frame_1", 0.5)):
        pixels = shift(speckles, (0.0, moved), order=3, mode="wrap")
        Image.fromarray(pixels.clip(0.0, 255.0).astype(np.uint8)).save(folder / f"{name}.tiff")
    mask = np.zeros((height, width), bool)
    mask[20:-20, 20:-20] = True
    dic.calculate_2d(
        reference=folder / "reference.tiff",
        deformed=folder / "frame_*.tiff",
        roi_mask=mask,
        seed=[width // 2, height // 2],
        subset_size=21,
        subset_step=10,
        max_displacement=16,
        num_threads=1,
        output_basepath=folder / "results",
        output_binary=binary,
        print_level=0,
    )
    (path,) = (folder / "results").iterdir()
    return dic.import_2d(str(path), ",", binary=binary, layout="column", print_level=0).u_px[0]


print(f"pyvale {version('pyvale')}, calculate_2d then import_2d, speckles moved by 0.5 pixels")
equal = {}
for height, width in ((130, 160), (130, 170), (170, 200)):
    text, binary = displacements(height, width, False), displacements(height, width, True)
    equal[len(text)] = len(text) == len(binary) and bool(np.allclose(text, binary, atol=1e-7))
    spread = "equal" if equal[len(text)] else f"{len(binary)} subsets, from {np.nanmin(binary):.0e} to {np.nanmax(binary):.0e}"
    print(f"{len(text)} subsets: text {text.min():.3f} to {text.max():.3f} pixels; binary {spread}")
print("A good guess: what output_binary=True wrote is what binary=True reads. Seen: the length of a row (61 bytes, or 77,")
print("109 or 157 with shape parameters) is guessed from the size of the file, longest first: 61-byte rows of a multiple of 77")
print("subsets (7 columns of 11) are read as 77-byte rows, as noise of hundreds of decades, without an error.")
raise SystemExit(0 if equal == {70: True, 77: False, 154: False} else "changed: this is no longer what happens")
PYTHON
