#!/usr/bin/env bash
# materialite: tension of a material that hardens linearly, in few and in many increments
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet materialite==0.1.4 numpy==2.4.6 scipy==1.17.1
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from materialite import Material, Orientation
from materialite.models.small_strain_fft import IsotropicElasticPlastic, LoadSchedule, SmallStrainFFT, linear

MODULUS, YIELD, HARDENING, STRAIN = 200e3, 200.0, 20e3, 0.01


def pulled(**increments):
    """Axial stress, plastic strain and yield stress of one point pulled to STRAIN within the time 1."""
    law = IsotropicElasticPlastic(MODULUS, 77e3, YIELD, linear, {"hardening_rate": HARDENING})
    point = Material(dimensions=[1, 1, 1]).create_uniform_field("orientation", Orientation.identity())
    schedule = LoadSchedule.from_constant_uniaxial_strain_rate(STRAIN, "z")
    solver = SmallStrainFFT(schedule, end_time=1.0, constitutive_model=law, **increments)
    result = solver.run(point, output_variables=["eq_plastic_strains", "yield_stresses"])
    stress = result.extract("stress").components[0][2]
    plastic, strength = (np.ravel(result.extract(name).components)[0] for name in ("eq_plastic_strains", "yield_stresses"))
    return float(stress), float(plastic), float(strength)


plastic = (STRAIN - YIELD / MODULUS) / (1 + HARDENING / MODULUS)
stress = YIELD + HARDENING * plastic
print(f"materialite {version('materialite')}, IsotropicElasticPlastic with linear hardening, pulled to {STRAIN:.0%} strain")
print(f"  exact: stress {stress:.2f} MPa = yield stress, plastic strain {plastic:.5f}")
runs = {"by default": pulled()} | {f"in {n:>3} increments": pulled(initial_time_increment=1 / n) for n in (10, 100)}
for words, (reached, flowed, strength) in runs.items():
    print(f"  {words:17} stress {reached:.2f} MPa, plastic strain {flowed:.5f}, yield stress {strength:.2f} MPa")
print("A good guess: an implicit return to the yield surface, exact here in any number of increments, since the direction of flow does")
print("not change and hardening is linear. Seen: the stress is the yield stress at the start of the increment, the plastic strain that")
print("of perfect plasticity, and the yield stress given back does not agree with the stress. The default is one increment, in which")
print("nothing hardens; with ten the stress is 4.5 % too low, with a hundred 0.45 %, and no error or warning tells of it.")
lagging = runs["by default"]
seen = abs(lagging[0] - YIELD) < 1e-6 * YIELD and abs(lagging[2] - (YIELD + HARDENING * lagging[1])) < 1e-6 * YIELD
errors = [1 - runs[words][0] / stress for words in ("in  10 increments", "in 100 increments")]
seen = seen and 0.03 < errors[0] < 0.06 and 8 < errors[0] / errors[1] < 12 and abs(lagging[1] - (STRAIN - YIELD / MODULUS)) < 1e-6
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
