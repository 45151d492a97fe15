#!/usr/bin/env bash
# frd2vtu: results of CalculiX (Debian 12) that were asked for at the nodes of a gauge length only
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download calculix-ccx=2.20-1 libspooles2.2=2.2-14 libarpack2 libblas3 liblapack3 \
    libgfortran5 libquadmath0 libopenmpi3 libhwloc15 libevent-core-2.1-7 libevent-pthreads-2.1-7 libudev1
for package in *.deb; do dpkg -x "$package" debian; done
libraries=$(find "$folder/debian" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
python3 -m venv env
env/bin/pip install --quiet frd2vtu==0.2.1 pyvista==0.49.1 vtk==9.7.2 pandas==3.1.1 numpy==2.4.6
LD_LIBRARY_PATH=$libraries OMP_NUM_THREADS=1 env/bin/python - <<'PYTHON'
import subprocess
from importlib.metadata import version
from pathlib import Path

import numpy as np
from frd2vtu import frdbin2vtu

LEVELS, HOURS = 5, 10_000


def converted(name: str, where: str) -> dict[int, tuple[float, float]]:
    """Axial displacement and creep strain at each level of a bar that crept, as frd2vtu has them; asked for WHERE."""
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    top = range(4 * LEVELS - 3, 4 * LEVELS + 1)
    lines = ["*NODE", *(f"{4 * z + i},{x},{y},{z}" for z in range(LEVELS) for i, (x, y) in enumerate(corners, 1))]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=BAR"]
    lines += [f"{z + 1}," + ",".join(str(4 * z + i) for i in range(1, 9)) for z in range(LEVELS - 1)]
    lines += ["*NSET, NSET=GAUGE", "5,6,7,8,13,14,15,16"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "170000.,0.3", "*CREEP, LAW=NORTON", "1e-16,5.,0."]
    lines += ["*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL", "*BOUNDARY", "1,1,3", "2,2,3", "3,3", "4,1", "4,3"]
    lines += [line for z in range(1, LEVELS) for line in (f"{4 * z + 1},1,2", f"{4 * z + 2},2", f"{4 * z + 4},1")]
    lines += ["*STEP", "*STATIC", "*CLOAD", *(f"{node},3,25." for node in top)]
    lines += [f"*NODE OUTPUT{where}", "U", f"*ELEMENT OUTPUT{where}", "PEEQ", "*END STEP"]
    lines += ["*STEP, INC=10000", "*VISCO, CETOL=1e-4", f"100.,{HOURS}.", "*END STEP"]
    Path(f"{name}.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["debian/usr/bin/ccx", name], capture_output=True, check=True)
    mesh = frdbin2vtu(f"{name}.frd")
    at_end = f"{HOURS + 1}.000"
    moved, crept = np.asarray(mesh.point_data[f"DISP_{at_end}"])[:, 2], np.ravel(mesh.point_data[f"PE_{at_end}"])
    levels = {z: mesh.points[:, 2] == z for z in range(LEVELS)}
    return {z: (float(moved[at].mean()), float(crept[at].mean())) for z, at in levels.items()}


everywhere, gauge = converted("everywhere", ""), converted("gauge", ", NSET=GAUGE")
print(f"frd2vtu {version('frd2vtu')}, CalculiX 2.20: a bar along z with five levels of nodes that creeps to 1 %, gauge marks at z = 1 and 3")
for z in range(LEVELS):
    (all_moved, all_crept), (moved, crept) = everywhere[z], gauge[z]
    marked = "  (gauge mark)" if z in (1, 3) else ""
    print(f"  z = {z}: all nodes asked for: u = {all_moved:.5f}, creep {all_crept:.4f}; the marks: u = {moved:.5f}, creep {crept:.4f}{marked}")
print("A good guess: the gauge marks have what they had, other nodes nothing. Seen: the values of the set are laid on the first points")
print("of the mesh, whatever their nodes, and zeros on the rest, without a word: the held end moves, the mark at z = 3 has neither")
print("moved nor crept. The file has the numbers of the nodes; they are not used. Without NSET each value is in its place.")
seen = all(np.isclose(everywhere[z][0], z * everywhere[1][0], rtol=1e-4) and 0.0099 < everywhere[z][1] < 0.0101 for z in everywhere)
laid = {0: everywhere[1], 1: everywhere[3]}
seen = seen and all(np.allclose(gauge[z], laid.get(z, (0.0, 0.0)), rtol=1e-5, atol=1e-9) for z in gauge)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
