#!/usr/bin/env bash
# AL-DIC: strains of a field of displacements that is known, in the three measures that it offers
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --no-compile --no-deps al-dic==1.0.3 numpy==2.4.6 scipy==1.17.1 numba==0.68.1 llvmlite==0.50.0 \
    opencv-python-headless==5.0.0.93 pillow==13.0.0 imageio==2.38.1
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from math import cos, radians, sin

import numpy as np
from al_dic.core.config import dicpara_default
from al_dic.mesh.mesh_setup import mesh_setup
from al_dic.strain.compute_strain import compute_strain
from al_dic.utils.region_analysis import precompute_node_regions

SIDE, MEASURES = 200, ("infinitesimal", "Eulerian-Almansi", "Green-Lagrangian")


def by_hand(stretch):
    """Strain along x of the three measures for a deformation gradient."""
    inverse = np.linalg.inv(stretch)
    return [stretch[0, 0] - 1, (1 - (inverse.T @ inverse)[0, 0]) / 2, ((stretch.T @ stretch)[0, 0] - 1) / 2]


def found(stretch):
    """Strain along x in the middle of an image of SIDE pixels of which every node moves by the same deformation gradient."""
    mask, strains = np.ones((SIDE, SIDE)), []
    for number in range(3):
        parameters = dicpara_default(winstepsize=8, strain_type=number, strain_smoothness=0.0, img_size=(SIDE, SIDE), img_ref_mask=mask)
        grid = np.arange(16.0, SIDE - 15, 8)
        mesh = mesh_setup(grid, grid, parameters)
        moved = mesh.coordinates_fem @ (stretch - np.eye(2)).T
        result = compute_strain(mesh, parameters, moved.ravel(), precompute_node_regions(mesh.coordinates_fem, mask, (SIDE, SIDE)))
        strains.append(float(result.strain_exx[len(moved) // 2]))
    return strains


turn = radians(10.0)
cases = {
    "pulled by 10 %": np.diag([1.1, 1.1**-0.5]),
    "pulled by 30 %": np.diag([1.3, 1.3**-0.5]),
    "pressed by 30 %": np.diag([0.7, 0.7**-0.5]),
    "turned by 10 degrees": np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]]),
}
print(f"AL-DIC {version('al-dic')}, compute_strain: strain along x of a uniform field of displacements")
print(f"  {'':22}" + "".join(f"{name:>28}" for name in MEASURES))
values = {}
for words, stretch in cases.items():
    values[words] = list(zip(found(stretch), by_hand(stretch)))
    print(f"  {words:22}" + "".join(f"{round(one, 4) + 0.0:+12.4f} (right {round(right, 4) + 0.0:+.4f})" for one, right in values[words]))
print("A good guess: strain_type 1 is what the documentation of apply_strain_type.py says, E = (I - F^-T F^-1) / 2: below the elongation in tension, and nothing")
print("in a rotation. Seen: it is 1 / (1 - du/dx) - 1, without the other gradients, of displacements over the reference mesh: above the elongation in")
print("tension, 43 % for 20 % where a creep specimen is 30 % longer, and a rotation strains. That expression is the elongation where du/dx is over the")
print("deformed mesh, which this one is not. The other two measures are right.")
seen = all(abs(one - right) < 1e-6 for row in values.values() for one, right in (row[0], row[2]))
seen = seen and all(abs(values[words][1][0] - (1 / (2 - cases[words][0, 0]) - 1)) < 1e-6 for words in cases)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
