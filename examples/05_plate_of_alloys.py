r"""Screen a plate of alloys
========================

A simulated plate: alloys mixed from four base alloys, each tested as one dimple, screened, and compared with the truth.

Three alloys by default, in a minute; 47 are a whole study, which may be stopped and started again. ``--dense`` also
fits Eq. (2) without sparsity to every alloy (Fig. 7b). ``--unknown-thickness`` leaves the thickness of each dimple to
the fit, with the mean and standard deviation of 25 measured ones as its prior. ``--quick`` takes two alloys::

    python examples/05_plate_of_alloys.py [--alloys 47] [--dense] [--unknown-thickness] [--quick] [--to plate]
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from planted_plate import planted_plate

import creepkit as ck

MEAN_THICKNESS, SD_THICKNESS = 0.4935, 0.027  # mm, of 25 measured dimples

options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--alloys", type=int, default=3)
options.add_argument("--dense", action="store_true")
options.add_argument("--unknown-thickness", action="store_true")
options.add_argument("--quick", action="store_true")
options.add_argument("--to", type=Path, default=Path("plate"))
arguments = options.parse_args()
alloys = 2 if arguments.quick else arguments.alloys

# %%
# The plate: tests, compositions and the truth, as files
# ------------------------------------------------------

planted = planted_plate(alloys, thickness_known=not arguments.unknown_thickness)
tests, compositions = planted.write(arguments.to)
for name, truth in planted.truth.items():
    mixed = ", ".join(f"{100 * share:.0f} % {base}" for base, share in truth.base_fractions.items() if share > 0.01)
    print(f"{name}: {planted.compositions.class_of(name)} ({mixed}), {truth.law}, {truth.thickness:.3f} mm")

# %%
# Screened
# --------
# Finite elements in the loop; few starts will do for laws of one term. The same from a shell:
#     creepkit identify plate/tests --by alloy --compositions plate/compositions.csv --to plate/screened

began = time.monotonic()
nuisances = [ck.Nuisance("offset"), ck.Nuisance("rate")]
if arguments.unknown_thickness:
    nuisances.append(ck.Nuisance("thickness", mean=MEAN_THICKNESS, sd=SD_THICKNESS))
settings = ck.IdentificationSettings(
    starts=2 if arguments.quick else 4, sobol_points=32, frames=60, nuisances=tuple(nuisances)
)
plate = ck.screen(
    tests,
    compositions=compositions,
    options=ck.ScreeningOptions(settings=settings, dense="combined" if arguments.dense else None),
    to=arguments.to / "screened",
    progress=lambda task, done, total, note: print(f"{task}: {done} of {total} ({note})", file=sys.stderr),
)
seconds = time.monotonic() - began
print(f"\n{plate}")
plate.to_csv(arguments.to / "plate.csv")
plate.plot(arguments.to / "plate.png")

# %%
# Against the truth
# -----------------

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
    f"best law right {correct} of {len(results)}, truth in the set {contained}; "
    f"decisive {len(decisive_names)}, of them wrong {wrong}; {seconds:.0f} s"
)
print("picture:", arguments.to / "plate.png")
