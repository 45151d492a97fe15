#!/usr/bin/env bash
# scikit-bio: the balance coordinates of alloys that lack an element
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet scikit-bio==0.7.4
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy
from skbio.stats.composition import clr, multi_replace

alloys = numpy.array([[60.0, 20.0, 20.0, 0.0], [55.0, 20.0, 20.0, 5.0]])
replaced = 100 * multi_replace(alloys)
coordinates = clr(replaced)[:, 3]
print(f"scikit-bio {version('scikit-bio')}: at.% of Fe, Ni, Co, Cr, zeros replaced so that logarithms of ratios exist")
for before, after, coordinate in zip(alloys, replaced, coordinates):
    print(f"{before} -> {after}; centred logarithm of Cr {coordinate:.3f}")
print("A good guess: an absent element is replaced by a trace, below all amounts that were measured. Seen: by 1 over the square")
print("of the number of components (reads of thousands of taxa are what it was made for): with four elements 6.25 at.%, more")
print("than the 5 at.% of the alloy that has the element; the order along that coordinate is turned over. delta= states a trace.")
seen = abs(replaced[0, 3] - 6.25) < 1e-9 and abs(replaced[1, 3] - 5.0) < 1e-9 and coordinates[0] > coordinates[1]
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
