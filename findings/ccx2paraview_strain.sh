#!/usr/bin/env bash
# ccx2paraview: the equivalent strain that it adds to results of CalculiX (Debian 12), of a bar that creeps to 1 %
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download calculix-ccx=2.20-1 libspooles2.2=2.2-14 libarpack2 libblas3 liblapack3 \
    libgfortran5 libquadmath0 libopenmpi3 libhwloc15 libevent-core-2.1-7 libevent-pthreads-2.1-7 libudev1
for package in *.deb; do dpkg -x "$package" debian; done
libraries=$(find "$folder/debian" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
python3 -m venv env
env/bin/pip install --quiet ccx2paraview==3.2.0 pyvista-frd-reader==0.3.1 pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6
cat > bar.inp <<'DECK'
*NODE
1,0,0,0
2,1,0,0
3,1,1,0
4,0,1,0
5,0,0,1
6,1,0,1
7,1,1,1
8,0,1,1
*ELEMENT, TYPE=C3D8, ELSET=BAR
1,1,2,3,4,5,6,7,8
*MATERIAL, NAME=STEEL
*ELASTIC
170000.,0.3
*CREEP, LAW=NORTON
1e-16,5.,0.
*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL
*BOUNDARY
1,1,3
2,2,3
3,3
4,1
4,3
5,1,2
6,2
8,1
*STEP
*STATIC
*CLOAD
5,3,25.
6,3,25.
7,3,25.
8,3,25.
*END STEP
*STEP, INC=10000
*VISCO, CETOL=1e-4
100.,10000.
*EL FILE, FREQUENCY=10000
S,E,ME,PEEQ
*END STEP
DECK
LD_LIBRARY_PATH=$libraries OMP_NUM_THREADS=1 debian/usr/bin/ccx bar > bar.log
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyvista
import pyvista_frd
from ccx2paraview.common import Converter

Converter("bar.frd", ["vtu"]).run()
written = pyvista.read("bar.vtu")
other = pyvista_frd.read("bar.frd")


def at_top(mesh, name):
    return np.asarray(mesh.point_data[name])[-1]


axial = at_top(written, "E")[2]
creep = float(at_top(written, "PEEQ"))
crept = float(at_top(written, "E_Mises"))
without_temperature = float(at_top(written, "MESTRAIN_Mises"))
stress = float(at_top(written, "S_Mises"))
by_other = float(at_top(other, "TOSTRAIN_Mises"))
print("CalculiX 2.20, a bar of E = 170 GPa at 100 MPa for 10,000 h at 1e-6 1/h, one file of results, at its end:")
print(f"  ccx2paraview {version('ccx2paraview')}: axial strain {axial:.5f}, of it creep (PEEQ) {creep:.5f}; S_Mises {stress:.2f}")
print(f"  E_Mises {crept:.5f}, MESTRAIN_Mises {without_temperature:.5f}")
print(f"  pyvista-frd-reader {version('pyvista-frd-reader')}, of the same file: TOSTRAIN_Mises {by_other:.5f}")
print("A good guess: E_Mises is the equivalent strain after von Mises, in tension that of the bar, and as creep goes on PEEQ, which")
print("stands beside it. Seen: strains are put into the formula of stresses, with 3/2 e:e under the root for 2/3 e:e, so that every")
print("equivalent strain is one and a half times that. A notch that has crept 1 % shows 1.5 %; S_Mises and PEEQ are right.")
seen = abs(crept / by_other - 1.5) < 1e-3 and abs(without_temperature / crept - 1) < 1e-6
seen = seen and abs(by_other / axial - 1) < 0.01 and abs(creep / 0.01 - 1) < 1e-3 and abs(stress / 100 - 1) < 1e-3
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
