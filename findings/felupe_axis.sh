#!/usr/bin/env bash
# FElupe: a tube meshed with the radius along the first coordinate
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet felupe==11.3.0
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version
from math import pi

import felupe

print(f"felupe {version('felupe')}: volume of a tube of radii 1 and 2 and height 5, {pi * (2**2 - 1**2) * 5:.4f}, by FieldAxisymmetric")
volumes = []
for name, corners in (("radius first", ((1.0, 0.0), (2.0, 5.0))), ("axis first", ((0.0, 1.0), (5.0, 2.0)))):
    region = felupe.RegionQuad(felupe.Rectangle(*corners, n=4))
    field = felupe.FieldAxisymmetric(region, dim=2)
    volumes.append(float((2 * pi * field.radius * region.dV).sum()))
    print(f"nodes as ({name}): {volumes[-1]:.4f}")
print("A good guess: as in axisymmetric elements of Abaqus, CalculiX and Ansys the first coordinate is the radius. Seen: it is the")
print("axis and the second is the radius; a mesh of the other kind is taken without a word as another body, here a disc of")
print("radius 5 and thickness 1, whose hoop stress has nothing of the tube's. The two columns are to be exchanged on the way.")
seen = abs(volumes[0] - 25 * pi) < 1e-9 and abs(volumes[1] - 15 * pi) < 1e-9
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
