#!/usr/bin/env bash
# kawin: strength of a solid solution that grows with a power of the composition
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pycalphad==0.11.2 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
# Without its dependencies: ESPEI, which it names, serves its fits of mobilities only.
"$folder/env/bin/pip" install --quiet --no-deps kawin==0.5.0
cd "$folder"
env/bin/python -W ignore - <<'PYTHON'
import os

os.environ["MPLBACKEND"] = "Agg"
from importlib.metadata import version

from kawin.precipitation.coupling import SolidSolutionStrength

WEIGHT, COMPOSITION = 600e6, 0.02  # Pa; mole fraction
print(f"kawin {version('kawin')}: SolidSolutionStrength of {COMPOSITION:.0%} Mg, weight {WEIGHT / 1e6:.0f} MPa, to be given in Pa")
ratios = {}
for exponent in (1.0, 2 / 3, 0.5):
    given = {}
    for unit, factor in (("Pa", 1.0), ("MPa", 1e6)):
        model = SolidSolutionStrength(weights={"MG": WEIGHT / factor}, exp={"MG": exponent})
        given[unit] = float(model.compute([COMPOSITION], ["MG"])) * factor / 1e6
    expected = WEIGHT / 1e6 * COMPOSITION**exponent
    ratios[exponent] = expected / given["Pa"]
    print(f"  exponent {exponent:.3f}: weight times a power of the composition {expected:6.2f} MPa; kawin {given['Pa']:7.4f} MPa,", end=" ")
    print(f"with the weight in MPa {given['MPa']:5.2f} MPa")
print("A good guess: weight times composition to the exponent, as Fleischer and Labusch have it with exponents of 1/2 and 2/3, and as kawin")
print("0.3.1 had it; then the weight is a stress, as the documentation says. Seen: the product of both is raised to the exponent, so that the")
print(f"result depends on the unit: with 2/3 the solid solution is {ratios[2 / 3]:.0f} times too weak, with 1/2 {ratios[0.5]:.0f} times, next to nothing beside")
print("precipitates. With the exponent 1, the default, all is well; a weight in Pa raised to one over the exponent gives what is meant.")
seen = abs(ratios[1.0] - 1) < 1e-9
seen = seen and all(abs(ratios[exponent] / WEIGHT ** (1 - exponent) - 1) < 1e-9 for exponent in (2 / 3, 0.5))
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
