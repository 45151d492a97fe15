r"""One law from bars, a dimple and tubes
=====================================

Creep curves of two bars, a bulge test of one dimple and two tubes under internal pressure, all of one alloy, identified
alone and together: the thickness of the dimple and of each tube is known to a tolerance only.

Needs the package ``creepkit-specimens``. The tests are simulated by Norton's law and given noise::

    python examples/07_bars_a_dimple_and_tubes.py [--quick] [--to joint]
"""

import argparse
from pathlib import Path

import numpy as np

import creepkit as ck

options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--quick", action="store_true", help="identify from all tests together alone")
options.add_argument("--to", type=Path, default=Path("joint"))
arguments = options.parse_args()

# %%
# The tests, with noise whose standard deviation they state. Each tube and the dimple differ from their drawing.

TRUTH = {"A": 1.2e-16, "n": 4.5}
rng = np.random.default_rng(1)


def measured(name, using, loading, hours, noise, **more):
    """A simulated test with noise: {output: standard deviation}."""
    times = 3600.0 * np.linspace(hours / 24, hours, 24)
    run = ck.simulate("norton", using, TRUTH, loading=loading, times=times, temperature=1073.15, **more)
    outputs = {name: values + noise[name] * rng.standard_normal(24) for name, values in run.outputs.items()}
    sd = {name: np.full(24, noise[name]) for name in outputs}
    return run.replace(name=name, outputs=outputs, standard_deviation=sd, geometry={})


elastic = {"elastic": ck.Elastic(E=150e3)}
dimple, tube = ck.specimen("bulge"), ck.specimen("tube")
bars = [measured(f"bar, {s} MPa", "uniaxial", ck.constant_stress(s), 200, {"strain": 2e-5}) for s in (50.0, 70.0)]
bulges = [
    measured(
        "dimple",
        dimple.replace(apex_thickness=0.507),  # mm; 0.5 on the drawing
        ck.PressureJump(P1=8, P2=10, Tj=6 * 3600.0),
        12,
        {"amplitude": 0.002, "width": 0.02, "shape": 0.02},
        **elastic,
    )
]
tubes = [
    measured(
        f"tube, {p:g} MPa",
        tube.replace(thickness=thickness),  # mm; 2 on the drawing
        ck.constant_load("pressure", p, ramp=60.0),
        200,
        {"diameter_growth": 1e-3},
        **elastic,
    )
    for p, thickness in ((18.0, 2.03), (25.0, 1.98))
]

# %%
# A name alone takes the tolerance of the length that its specimen states as the prior of the nuisance parameter.

groups = {} if arguments.quick else {"bars": bars, "dimple": bulges, "tubes": tubes}
groups["all"] = [*bars, *bulges, *tubes]
for group, tests in groups.items():
    nuisances = [] if group == "bars" else ["thickness"]
    fit = ck.identify("norton", tests, starts=1, nuisances=nuisances, weights="likelihood", through="auto")
    for estimate in fit.estimates:
        print(f"{group:7} {estimate.name} = {estimate.value:.4g} [{estimate.low:.4g}, {estimate.high:.4g}]")

# %%
# Together they find the law, and what the thicknesses are.

print(fit)
arguments.to.mkdir(exist_ok=True)
fit.plot(arguments.to / "tests.png")
print(f"wrote {arguments.to / 'tests.png'}")
