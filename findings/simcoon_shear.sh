#!/usr/bin/env bash
# simcoon: creep damage after Kachanov under tension, torsion and a tension along other axes
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet simcoon==2.2.0 numpy==2.4.6
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import simcoon

equivalent, resistance, exponent, damage = 100.0, 400.0, 6.0, 0.3


def vector(tensor, shear=1):
    """Components 11, 22, 33, 12, 13, 23 of a symmetric tensor."""
    return np.array([*np.diag(tensor), shear * tensor[0, 1], shear * tensor[0, 2], shear * tensor[1, 2]])


def turned(degrees, tensor):
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rotation = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])
    return rotation @ tensor @ rotation.T


pull, stretch = np.diag([equivalent, 0, 0]), np.diag([0.1, -0.05, -0.05])
twist = np.zeros((3, 3))
twist[0, 1] = twist[1, 0] = equivalent / np.sqrt(3)
states = {
    "bar along axis 1": (pull, 0 * stretch),
    "the same bar, axes turned by 45 degrees": (turned(45, pull), 0 * stretch),
    "tube in torsion": (twist, 0 * stretch),
    "bar along axis 1, strained by 10 %": (pull, stretch),
    "that bar, axes turned by 45 degrees": (turned(45, pull), turned(45, stretch)),
}
stated = (equivalent / (resistance * (1 - damage))) ** exponent
print(f"simcoon {version('simcoon')}: damage_kachanov, criterion vonmises, A0 {resistance:.0f}, r {exponent:.0f}, damage {damage}; all")
print(f"have one equivalent stress, says Mises_stress of simcoon; documented is (crit / (A0 (1 - D)))^r = {stated:.4e}")
ratios = []
for words, (stress, strain) in states.items():
    rate = simcoon.damage_kachanov(vector(stress), vector(strain, 2), damage, resistance, exponent, "vonmises")
    ratios.append(rate / stated)
    print(f"  {words:40} Mises_stress {simcoon.Mises_stress(vector(stress)):.2f}, rate / documented {ratios[-1]:.6f}")
print("A good guess: one rate, that of the equivalent stress, for all five; the strain is an argument for criteria of strain. Seen:")
print("normal components of stress are multiplied by 1 + their strain, shear components by their shear strain, so that a shear stress")
print("counts only as far as there is shear strain: a tube in torsion has no creep damage, and a bar along 45 degrees has a 64th. Only")
print("a stress in its principal axes with a strain of zeros gives what is documented.")
components = vector(turned(45, pull)) * (np.array([1, 1, 1, 0, 0, 0]) + vector(turned(45, stretch), 2))
shares = np.array([1.0, 0.5, 0.0, 1.1, simcoon.Mises_stress(components) / equivalent])
seen = np.allclose(ratios, shares**exponent, rtol=1e-9, atol=1e-12)
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
