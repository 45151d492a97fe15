r"""From compositions to creep
==========================

Fifteen planted alloys of iron, nickel and chromium, two bars each: their laws, the creep rate as a function of the
composition, what the neighbours of an alloy say of it, and which alloy to make next. ``--quick`` takes ten::

    python examples/08_compositional_space.py [--quick] [--to map.png]
"""

import argparse
from pathlib import Path

import numpy as np

import creepkit as ck

options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--quick", action="store_true")
options.add_argument("--to", type=Path, default=Path("map.png"))
arguments = options.parse_args()

# %%
# The alloys
# ----------
# ln of the rate at 100 MPa is planted, with a scatter of 0.1 between alloys of one composition; so is the exponent.
# Contents are labels of the tests, as the columns of a table of alloys become: without a unit they are in wt.%.

rng = np.random.default_rng(8)
times = np.geomspace(600.0, 4e5, 30)
tests = {}
for k in range(10 if arguments.quick else 15):
    iron, nickel, chromium = x = rng.dirichlet([1.0, 1.0, 0.4])
    log_rate = x @ [-15.0, -17.0, -18.0] - 4.0 * iron * nickel + 0.1 * rng.normal()
    n = 5.0 + nickel
    values = {"A": np.exp(log_rate) / 100.0**n, "n": n}
    labels = {"Fe [at.%]": "bal.", "Ni [at.%]": f"{100 * nickel:.3f}", "Cr [at.%]": f"{100 * chromium:.3f}"}
    tests[f"A{k + 1}"] = []
    for stress in (80, 120):
        loading = ck.constant_stress(stress, "stress")
        run = ck.simulate("norton", "uniaxial", values, loading=loading, times=times, temperature=1073.15)
        strain = run.outputs["strain"] + 2e-5 * rng.normal(size=times.size)
        one = ck.History(f"A{k + 1} {stress} MPa", times, {"strain": strain}, loading, 1073.15, labels=labels)
        tests[f"A{k + 1}"].append(one)

# %%
# Their laws, and the map
# -----------------------

laws = {alloy: ck.identify("norton", own) for alloy, own in tests.items()}
mapped = ck.composition_map(laws)
print(mapped)
mapped.plot(arguments.to)

# %%
# An alloy that was not tested
# ----------------------------

found = mapped.predict({"Fe": 20, "Ni": 60, "Cr": 20})
rate, low, high = found.rate
print(f"Fe20 Ni60 Cr20: {rate:.2e} 1/s [{low:.2e}, {high:.2e}], n = {found.stress_exponent[0]:.2f}")
