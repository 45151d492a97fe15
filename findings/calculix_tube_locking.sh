#!/usr/bin/env bash
# CalculiX (Debian 12): a tube under internal pressure that creeps by a Norton law, in two kinds of axisymmetric elements
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download calculix-ccx=2.20-1 libspooles2.2=2.2-14 libarpack2 libblas3 liblapack3 \
    libgfortran5 libquadmath0 libopenmpi3 libhwloc15 libevent-core-2.1-7 libevent-pthreads-2.1-7 libudev1
for package in *.deb; do dpkg -x "$package" debian; done
libraries=$(find "$folder/debian" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
LD_LIBRARY_PATH=$libraries OMP_NUM_THREADS=1 python3 - <<'PYTHON'
import re
import subprocess
from math import sqrt
from pathlib import Path

INNER, OUTER, PRESSURE, COEFFICIENT, EXPONENT = 10.0, 20.0, 60.0, 1e-16, 5
TIMES = (1e4, 3e4, 1e5, 3e5)


def growth(element: str, through_wall: int) -> list[float]:
    """Rate of the outer radius at TIMES, in mm/h, of a slice in plane strain meshed in one layer."""
    order = 2 if element.startswith("CAX8") else 1
    row, step = order * through_wall + 1, (OUTER - INNER) / (order * through_wall)
    nodes = [
        f"{1 + i + j * row},{INNER + i * step},{j * step}"
        for j in range(order + 1) for i in range(row) if not (order == 2 and i % 2 and j % 2)
    ]
    elements = []
    for i in range(1, row, order):
        above = i + order * row
        corners = [i, i + order, above + order, above]
        middles = [i + 1, i + 2 + row, above + 1, i + row] if order == 2 else []
        elements.append(",".join(map(str, [len(elements) + 1, *corners, *middles])))
    lines = ["*NODE, NSET=ALL", *nodes, f"*ELEMENT, TYPE={element}, ELSET=TUBE", *elements, "*NSET, NSET=OUTER", f"{row}"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "150000.,0.3", "*CREEP, LAW=NORTON", f"{COEFFICIENT},{EXPONENT},0."]
    lines += ["*SOLID SECTION, ELSET=TUBE, MATERIAL=STEEL", "*BOUNDARY", "ALL,2"]
    lines += ["*STEP", "*STATIC", "*DLOAD", f"1,P4,{PRESSURE}", "*END STEP"]
    lines += ["*STEP, INC=100000", "*VISCO, CETOL=1e-4", f"1000.,{TIMES[-1]},,5000."]
    lines += ["*NODE PRINT, NSET=OUTER", "U", "*END STEP"]
    Path("tube.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["debian/usr/bin/ccx", "tube"], capture_output=True, check=True)
    found = re.findall(r"time +(\S+)\n\n +\d+ +(\S+)", Path("tube.dat").read_text())
    readings = [(float(time), float(moved)) for time, moved in found]
    rates = []
    for time in TIMES:
        last = next((k for k, (at, _) in enumerate(readings) if at >= time), len(readings) - 1)
        (t0, u0), (t1, u1) = readings[last - 1], readings[last]
        rates.append((u1 - u0) / (t1 - t0))
    return rates


# Steady state of a long tube: the equivalent stress falls as r**(-2/n), the radius grows by a rate of 1/r.
scale = PRESSURE * sqrt(3) / (EXPONENT * (INNER ** (-2 / EXPONENT) - OUTER ** (-2 / EXPONENT)))
exact = sqrt(3) / 2 * COEFFICIENT * scale**EXPONENT / OUTER
said = subprocess.run(["debian/usr/bin/ccx", "-v"], capture_output=True, text=True).stdout.split()[-1]
print(f"CalculiX {said}: rate of the outer radius over that of the closed form; the law is rate = A q^5, without primary creep")
print(f"{'hours':22}" + "".join(f"{time:10.0e}" for time in TIMES))
print(f"{'hoop strain, bore':22}" + "".join(f"{100 * exact * OUTER / INNER**2 * time:9.2f}%" for time in TIMES))
ratios = {}
for element, through_wall in (("CAX8R", 4), ("CAX4", 4), ("CAX4", 8), ("CAX4", 16)):
    ratios[element, through_wall] = [rate / exact for rate in growth(element, through_wall)]
    print(f"{element + ', ' + str(through_wall) + ' elements':22}" + "".join(f"{one:10.3f}" for one in ratios[element, through_wall]))
print("A good guess: elements of first order are some per cent too stiff, by a factor that refinement lowers and time leaves alone,")
print("and a rate that falls under constant load is primary creep. Seen: CAX4 locks the more the further creep, which keeps the")
print("volume, outgrows elastic strain: its rate falls without end. At 4 % strain of the bore four elements give a third of the rate,")
print("and a stress exponent or a primary stage that is fitted to it is the mesh's. CAX8R is right. Abaqus' CAX4 has the volume")
print("change reduced, so that a mesh that was right there is not right here.")
four, right = ratios["CAX4", 4], ratios["CAX8R", 4]
seen = four[0] > four[1] > four[2] > four[3] and four[2] < 0.4 and four[3] < 0.2 and all(abs(one - 1) < 0.01 for one in right[1:])
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
