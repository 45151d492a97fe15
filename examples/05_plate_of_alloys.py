"""A planted plate: alloys mixed from four base alloys, each tested as one dimple, screened, held against the truth.

    python examples/05_plate_of_alloys.py [--alloys 47] [--dense] [--unknown-thickness] [--to plate]

Three alloys by default, in a minute; 47 are a whole study, which may be stopped and started again. --dense also fits
Eq. (2) without sparsity to every alloy (Fig. 7b). --unknown-thickness leaves the thickness of each dimple to the fit,
with the mean and spread of 25 measured ones as its prior.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import creepkit as ck
from creepkit.inverse.settings import IdentificationSettings
from creepkit.screening.planted import THICKNESS_MEAN_SD, planted_plate
from creepkit.screening.screen import screen

options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--alloys", type=int, default=3)
options.add_argument("--dense", action="store_true")
options.add_argument("--unknown-thickness", action="store_true")
options.add_argument("--to", type=Path, default=Path("plate"))
arguments = options.parse_args()

# ---- 1. The plate: tests, compositions and the truth, as files -------------------------------------------------------

planted = planted_plate(arguments.alloys, thickness_known=not arguments.unknown_thickness)
tests, compositions = planted.write(arguments.to)
for name, truth in planted.truth.items():
    mixed = ", ".join(f"{100 * share:.0f} % {base}" for base, share in truth.base_fractions.items() if share > 0.01)
    print(f"{name}: {planted.compositions.class_of(name)} ({mixed}), {truth.law}, {truth.thickness:.3f} mm")

# ---- 2. Screened -----------------------------------------------------------------------------------------------------
# Finite elements in the loop; few starts will do for laws of one term. The same from a shell:
#     creepkit screen plate/tests --compositions plate/compositions.csv --confirm always --to plate/screened

began = time.monotonic()
nuisances = [ck.Nuisance("offset"), ck.Nuisance("rate")]
if arguments.unknown_thickness:
    nuisances.append(ck.Nuisance("thickness", mean=THICKNESS_MEAN_SD[0], sd=THICKNESS_MEAN_SD[1]))
plate = screen(
    tests, compositions=compositions, nuisances=nuisances, settings=IdentificationSettings(starts=4, sobol_points=32, frames=60),
    confirm=True, dense="combined" if arguments.dense else None, to=arguments.to / "screened",
    progress=lambda task, done, total, note: print(f"{task}: {done} of {total} ({note})", file=sys.stderr),
)  # fmt: skip
seconds = time.monotonic() - began
print(f"\n{plate}")
plate.to_csv(arguments.to / "plate.csv")
plate.to_hdf5(arguments.to / "plate.h5")
pictures = plate.plot(arguments.to / "pictures")

# ---- 3. Against the truth --------------------------------------------------------------------------------------------

results = {answer.alloy: answer for answer in plate.identified}
confusion_matrix = Counter((planted.truth[name].law, answer.best.law.name) for name, answer in results.items())
laws = sorted({law for pair in confusion_matrix for law in pair})
print("\nplanted (down), identified (across)\n" + " " * 18 + "".join(f"{law:>18}" for law in laws))
for law in laws:
    print(f"{law:18}" + "".join(f"{confusion_matrix[law, found]:18d}" for found in laws))
correct = sum(planted.truth[name].law == answer.best.law.name for name, answer in results.items())
contained = sum(planted.truth[name].law in answer.credible_laws for name, answer in results.items())
decisive_names = [name for name, answer in results.items() if answer.decisive]
wrong = sum(planted.truth[name].law != results[name].best.law.name for name in decisive_names)
print(
    f"best law right {correct} of {len(results)}, truth in the set {contained}; decisive {len(decisive_names)}, of them wrong {wrong}; "
    f"{seconds:.0f} s"
)
print("pictures:", ", ".join(map(str, pictures)))
