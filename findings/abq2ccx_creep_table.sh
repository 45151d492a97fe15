#!/usr/bin/env bash
# abq2ccx and CalculiX (Debian 12): an Abaqus deck whose creep table has other temperatures than its moduli
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet abq2ccx==1.6.0
cd "$folder"
apt-get -qq -o APT::Sandbox::User=root download calculix-ccx=2.20-1 libspooles2.2=2.2-14 libarpack2 libblas3 liblapack3 \
    libgfortran5 libquadmath0 libopenmpi3 libhwloc15 libevent-core-2.1-7 libevent-pthreads-2.1-7 libudev1
for package in *.deb; do dpkg -x "$package" debian; done
libraries=$(find "$folder/debian" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
LD_LIBRARY_PATH=$libraries OMP_NUM_THREADS=1 env/bin/python - <<'PYTHON'
import re
import subprocess
from importlib.metadata import version
from pathlib import Path

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
COEFFICIENTS = {550: 1e-18, 575: 6e-18, 600: 3e-17}
MODULI = {20: 210000, 500: 170000, 600: 160000, 700: 145000}
STRESS, HOURS = 100.0, 1000.0


def crept(temperature: int, moduli: dict[int, int]) -> tuple[float, list[str]]:
    """Creep strain of a cube in tension as converted and run, and the converter's lines on creep and temperature."""
    held = [f"{node},{axis + 1}" for node, corner in enumerate(CORNERS, 1) for axis in range(3) if not corner[axis]]
    lines = ["*NODE, NSET=ALL", *(f"{node},{x},{y},{z}" for node, (x, y, z) in enumerate(CORNERS, 1))]
    lines += ["*ELEMENT, TYPE=C3D8I, ELSET=CUBE", "1,1,2,3,4,5,6,7,8", "*SOLID SECTION, ELSET=CUBE, MATERIAL=STEEL"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", *(f"{value},0.3,{at}." for at, value in moduli.items())]
    lines += ["*CREEP, LAW=TIME", *(f"{value},5.,0.,{at}." for at, value in COEFFICIENTS.items())]
    lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", f"ALL,{temperature}.", "*BOUNDARY", *held]
    lines += ["*STEP", "*STATIC", "*CLOAD", *(f"{node},3,{STRESS / 4}" for node in range(5, 9)), "*END STEP"]
    lines += ["*STEP, INC=10000", "*VISCO, CETOL=1e-5", f"{HOURS / 100},{HOURS}", "*EL PRINT, ELSET=CUBE", "CEEQ", "*END STEP"]
    Path("cube.inp").write_text("\n".join(lines) + "\n")
    report = subprocess.run(["env/bin/abq2ccx", "cube.inp"], capture_output=True, text=True, check=True)
    said = [line for line in (report.stdout + report.stderr).splitlines() if line.startswith("[")]
    run = subprocess.run(["debian/usr/bin/ccx", "cube_ccx"], capture_output=True, text=True, check=True)
    said += [line for line in run.stdout.splitlines() if "WARNING" in line]
    strain = re.findall(r"^ +1 +1 +(\S+)$", Path("cube_ccx.dat").read_text(), re.MULTILINE)[-1]
    return float(strain), said


solver = subprocess.run(["debian/usr/bin/ccx", "-v"], capture_output=True, text=True).stdout.split()[-1]
print(f"abq2ccx {version('abq2ccx')}, CalculiX {solver}: *ELASTIC at {', '.join(map(str, MODULI))} C, *CREEP at 550, 575, 600 C")
ratios, said = {}, []
for temperature, coefficient in COEFFICIENTS.items():
    stated = coefficient * STRESS**5 * HOURS
    more = dict(sorted({**MODULI, **{at: 165000 - 100 * (at - 550) for at in COEFFICIENTS}}.items()))
    found, lines = crept(temperature, MODULI)
    full, _ = crept(temperature, more)
    said += lines
    ratios[temperature] = found / stated, full / stated
    print(f"  {temperature} C: creep strain {found:.2e}, stated {stated:.2e}; with moduli at the three temperatures too {full:.2e}")
warned = [line for line in said if line.startswith("[WARNING]") or "temperature" in line.lower()]
print(f"lines of the converter that warn, and lines of either with the word temperature: {len(warned)}")
print("A good guess: the converter carries the table, which both programs interpolate between its rows. Seen: CalculiX reads creep")
print("constants off at the temperatures of *ELASTIC and drops the rest, as one sentence of its manual on *CREEP says; the converter")
print("takes the card over as it is, without a word. At 550 C the A is the mean of those of 550 and 600 C, so that creep is 15 times")
print("what Abaqus is given. Moduli at every temperature of the creep table mend it.")
expected = {550: (1e-18 + 3e-17) / 2e-18, 575: ((1e-18 + 3e-17) / 2 + 0.25 * (3e-17 - 1e-18)) / 6e-18, 600: 1.0}
seen = not warned and all(
    abs(found / expected[temperature] - 1) < 0.01 and abs(full - 1) < 0.01 for temperature, (found, full) in ratios.items()
)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
