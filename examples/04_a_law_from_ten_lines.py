"""A law from ten lines: written, checked, simulated, given damage and temperature, identified, packaged, exported.

Run it in an empty folder:  python examples/04_a_law_from_ten_lines.py
It leaves every stage there: steel.py, tests of bars as CSV files, a picture, the identified law, and a package.
"""

import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import creepkit as ck
from creepkit.readers.history_csv import write_history
from creepkit.registry import default_registry
from creepkit.testing import check_law

HOUR = 3600.0

# 1. Ten lines. A law is one file: its equation, and one line for each parameter.
TEN_LINES = """\
from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress
A, n = parameters("A n")
STEEL = CreepLaw("steel", {"creep": A * stress**n}, {
    A: Param("rate coefficient", bounds=(1e-30, 1e-8), unit="1/s", scale="log"),
    n: Param("stress exponent", bounds=(1, 8)),
}, title="Steady creep of a steel", references=("Norton (1929), The Creep of Steel at High Temperatures",))

@hookimpl
def creepkit_laws():
    return [STEEL]
"""
Path("steel.py").write_text(TEN_LINES)
(steel,) = default_registry().load_file("steel.py").contributions["law"].values()  # creepkit --plugin steel.py ...
print(check_law(steel, samples=16))  # creepkit check steel.py

# 2. It creeps already: here against A s^n t.
times = np.linspace(0, 100 * HOUR, 40)
bar = ck.simulate(steel, "uniaxial", {"A": 1e-16, "n": 4.5}, loading=ck.constant_stress(100, "stress"), times=times)
print("steady creep, off by", np.abs(bar.outputs["strain"] - 1e-16 * 100**4.5 * times).max())

# 3. Bars break. Damage w takes away section, so that stress and its own growth speed up: two lines more for the state,
#    two for its parameters. It follows the largest principal stress, as cavities do.
A, n, C, v, Q = ck.language.parameters("A n C v Q")
(w,) = ck.language.states("w")
s, s_1 = ck.language.stress, ck.language.principal_stress
brittle = ck.CreepLaw(
    name="brittle-steel",
    title="Steel with Kachanov's damage",
    terms={"creep": A * (s / (1 - w)) ** n},
    params={
        **steel.params,
        C: ck.Param("damage coefficient", bounds=(1e-30, 1e-8), unit="1/s", scale="log"),
        v: ck.Param("stress exponent of damage", bounds=(1, 8)),
    },
    states={w: ck.State(0, C * (s_1 / (1 - w)) ** v, limit=0.99)},
    references=("Kachanov (1958), Izv. AN SSSR OTN 8, 26",),
)
print("conforms:", check_law(brittle, samples=16).passed)

# 4. Temperature: an Arrhenius factor on creep and, since damage is a state of its own, one more on damage.
law = brittle.times(ck.arrhenius(T_ref=1073.15)).with_temperature(C=ck.activated(T_ref=1073.15))
print(law)
truth = {"A": 2e-16, "n": 4.5, "C": 3e-14, "v": 4.0, "Q": 3e5, "Q_C": 2.8e5}
truth = {name: truth[name] for name in law.names}

# 5. The same law in other tests: relaxation, and a tube under tension and torsion.
later = np.geomspace(1, 100 * HOUR, 40)
relaxation_run = ck.simulate(
    law, "relaxation", truth, loading=ck.constant_strain(0.001), times=later, temperature=1073.15,
    elastic=ck.Elastic(150e3),
)  # fmt: skip
tube = ck.simulate(
    law, "point", truth, loading=ck.PointLoading(stress={"11": 60, "12": [(0, 0), (10 * HOUR, 35)]}),
    times=times, temperature=1073.15,
)  # fmt: skip
print(relaxation_run)
print(tube)

# 6. Tests as a laboratory would deliver them: five bars to rupture, with the noise of an extensometer.
rng = np.random.default_rng(5)
Path("tests").mkdir(exist_ok=True)
for celsius, level in ((770, 110), (800, 80), (800, 100), (800, 120), (830, 85)):
    plan = np.geomspace(60, 1e7, 2000)
    run = ck.simulate(
        law, "uniaxial", truth, loading=ck.constant_stress(level, "stress"), times=plan, temperature=celsius + 273.15,
        name=f"{celsius} C {level} MPa",
    )  # fmt: skip
    kept = np.unique(
        np.searchsorted(run.times, np.linspace(0, 1, 40) ** 2 * run.times[-1]).clip(max=run.times.size - 1)
    )
    strain = run.outputs["strain"][kept] + rng.normal(0, 2e-5, kept.size)
    write_history(
        run.replace(times=run.times[kept], outputs={"strain": strain}), Path("tests", f"{celsius}_{level}.csv")
    )

# 7. The values come back, with intervals.
tests = ck.read_histories("tests/*.csv")
fit = ck.identify(law, tests, starts=2)
print(fit)
inside = {e.name: e.low <= truth[e.name] <= e.high for e in fit.estimates}
print("true values inside their intervals:", inside)
fit.save("brittle-steel.json")
fit.plot("brittle-steel.png")

# 8. What was never fitted is predicted: how long the tube of step 5 lives, and what is left of a held stress.
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
left.plot(tube.times / HOUR, 100 * tube.outputs["strain_11"], "k-", label="truth, along")
left.plot(tube.times / HOUR, 100 * tube.outputs["strain_12"], "k--", label="truth, shear")
again = ck.simulate(law, "point", fit.values, loading=tube.loading, times=times, temperature=1073.15)
left.plot(again.times / HOUR, 100 * again.outputs["strain_11"], "C1.", label="identified from bars")
left.plot(again.times / HOUR, 100 * again.outputs["strain_12"], "C1.")
left.set(xlabel="time, h", ylabel="creep strain, %", title="60 MPa tension, 35 MPa torsion after 10 h")
relaxed = ck.simulate(
    law,
    "relaxation",
    fit.values,
    loading=relaxation_run.loading,
    times=later,
    temperature=1073.15,
    elastic=relaxation_run.elastic,
)
right.plot(relaxation_run.times / HOUR, relaxation_run.outputs["stress"], "k-", label="truth")
right.plot(relaxed.times / HOUR, relaxed.outputs["stress"], "C1.", label="identified from bars")
right.set(xscale="log", xlabel="time, h", ylabel="stress, MPa", title="a bar held at 0.1 % of strain")
for axes in (left, right):
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25)
figure.savefig("brittle-steel-elsewhere.png", dpi=120)

# 9. A package that colleagues install; it holds the ten lines until yours replace them.
here = [sys.executable, "-c", "from creepkit.cli import main; main()"]
if not Path("new-steel").exists():
    print(subprocess.run([*here, "new-law", "new-steel"], check=True, capture_output=True, text=True).stdout)

# 10. Text for other people's programs; intervals and range of validity stand in the head.
print(ck.export(fit, "python")[:700])
